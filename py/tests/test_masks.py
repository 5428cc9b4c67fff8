"""Faces that a mask of a texture cuts are one row each."""

import base64
import json
import struct
import zlib

import numpy as np
import pytest
import shapes

import hemicube as hc

HOLE = 20 / 64


def png(pixels):
    """A PNG of red, green, blue and alpha (h, w, 4)."""
    height, width = pixels.shape[:2]

    def chunk(name, data):
        body = name + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    head = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    parts = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + parts


def uri(kind, data):
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"


@pytest.fixture
def path(tmp_path):
    """Two squares that face each other; the lower one has a round hole by its texture."""
    vertices, faces = shapes.facing()
    texture = np.full((64, 64, 4), 255, np.uint8)
    y, x = np.mgrid[:64, :64] + 0.5
    texture[(y - 32) ** 2 + (x - 32) ** 2 < (64 * HOLE) ** 2, 3] = 0
    arrays = [
        (vertices.astype(np.float32), "VEC3"),
        (np.tile(shapes.square()[:, :2], (2, 1)).astype(np.float32), "VEC2"),
        (faces[:2].astype(np.uint16).ravel(), "SCALAR"),
        (faces[2:].astype(np.uint16).ravel(), "SCALAR"),
    ]
    views, accessors, data = [], [], b""
    for number, (array, kind) in enumerate(arrays):
        size = array.nbytes
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": size})
        component = 5126 if array.dtype == np.float32 else 5123
        accessor = {"bufferView": number, "componentType": component}
        accessors.append({**accessor, "count": len(array), "type": kind})
        data += array.tobytes()
    accessors[0].update(min=[0, 0, 0], max=[1, 1, 1])
    attributes = {"POSITION": 0, "TEXCOORD_0": 1}
    masked = {"baseColorTexture": {"index": 0}}
    primitives = [{"attributes": attributes, "indices": 2 + k, "material": k} for k in range(2)]
    model = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(data), "uri": uri("application/octet-stream", data)}],
        "bufferViews": views,
        "accessors": accessors,
        "images": [{"uri": uri("image/png", png(texture))}],
        "textures": [{"source": 0}],
        "materials": [
            {"name": "leaf", "alphaMode": "MASK", "pbrMetallicRoughness": masked},
            {"name": "plain"},
        ],
        "meshes": [{"primitives": primitives}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    path = tmp_path / "mask.gltf"
    path.write_text(json.dumps(model))
    return path


def test_a_cut_face_has_one_row(path):
    mesh = hc.read(path)
    F = hc.view_factors(mesh)
    assert len(mesh.faces) == 4 and F.shape == (4, 4) and list(F.face) == [0, 1, 2, 3]
    assert F.area[:2].sum() == pytest.approx(1 - np.pi * HOLE**2, rel=0.02)
    assert F.area[2:] == pytest.approx([0.5, 0.5])
    # Pieces are drawn as they are.
    assert len(F._cells()[1]) > 4
    S = F.lump(mesh.material)
    assert list(S.labels) == ["leaf", "plain"]
    fine = hc.view_factors(mesh, patch_size=0.1)
    again = fine.lump(mesh.material[fine.face])
    assert S.matrix.toarray() == pytest.approx(again.matrix.toarray(), abs=1e-3)


def test_some_rows_of_cut_faces(path):
    mesh = hc.read(path)
    whole, some = hc.view_factors(mesh), hc.view_factors(mesh, rows=[3, 0])
    assert some.matrix.toarray() == pytest.approx(whole.matrix.toarray()[[3, 0]], rel=1e-9)
    two = hc.view_factors(mesh, sides="two")
    assert two.shape == (8, 8) and list(two.front) == [0, 1, 2, 3] * 2
