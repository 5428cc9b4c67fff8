"""Meshes with known view factors."""

import numpy as np

SQUARE = np.array([[0, 1, 2], [0, 2, 3]])


def square(z=0.0, size=1.0):
    """A square (4, 3) at height z, whose front is up."""
    return np.array([[0, 0, z], [size, 0, z], [size, size, z], [0, size, z]], dtype=float)


def facing(distance=1.0):
    """Two unit squares that face each other: vertices, faces."""
    vertices = np.vstack([square(), square(distance)])
    return vertices, np.vstack([SQUARE, SQUARE[:, ::-1] + 4])


def parallel(width, distance):
    """The view factor between two equal squares opposite each other (Hottel 1931)."""
    x = width / distance
    root = np.sqrt(1 + x**2)
    terms = np.log(np.sqrt((1 + x**2) ** 2 / (1 + 2 * x**2)))
    terms += 2 * x * root * np.arctan(x / root) - 2 * x * np.arctan(x)
    return 2 / (np.pi * x**2) * terms


def room(size=(1.0, 1.0, 1.0)):
    """A closed box seen from inside: vertices (8, 3), faces (12, 3), two a side."""
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
    quads = [
        [0, 1, 3, 2],  # floor
        [4, 6, 7, 5],  # ceiling
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 5, 7, 3],
    ]
    faces = [[q[0], q[i], q[i + 1]] for q in quads for i in (1, 2)]
    return corners * size, np.array(faces)


def sphere(radius=1.0, steps=12, inwards=False):
    """A sphere of triangles between circles of latitude."""
    polar = np.linspace(0, np.pi, steps + 1)
    around = np.linspace(0, 2 * np.pi, 2 * steps, endpoint=False)
    ring = [
        [np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)]
        for t in polar[1:-1]
        for p in around
    ]
    vertices = radius * np.array([[0, 0, 1], [0, 0, -1], *ring])
    n, faces = len(around), []
    for k in range(n):
        j = (k + 1) % n
        faces.append([0, 2 + k, 2 + j])
        last = 2 + (steps - 2) * n
        faces.append([1, last + j, last + k])
        for row in range(steps - 2):
            a, b = 2 + row * n, 2 + (row + 1) * n
            faces += [[a + k, b + k, b + j], [a + k, b + j, a + j]]
    faces = np.array(faces)
    return vertices, faces[:, ::-1] if inwards else faces


def joined(*meshes):
    """Several meshes as one, and the number of each face's mesh."""
    vertices, faces, which, base = [], [], [], 0
    for number, (points, triangles) in enumerate(meshes):
        vertices.append(points)
        faces.append(np.asarray(triangles) + base)
        which += [number] * len(triangles)
        base += len(points)
    return np.vstack(vertices), np.vstack(faces), np.array(which)
