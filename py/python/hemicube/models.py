"""Meshes: from arrays, from files, and from the objects of other libraries."""

from __future__ import annotations

import os
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays
from ._errors import InputError
from ._hemicube import Scene as _Scene

UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254, "ft": 0.3048}


class Mesh:
    """The triangles of a model file, in metres, with the names that the file has for them."""

    def __init__(self, scene: _Scene) -> None:
        self._scene = scene

    @property
    def name(self) -> str:
        """The stem of the file."""
        return self._scene.name

    @cached_property
    def vertices(self) -> NDArray[np.float64]:
        """Positions (n, 3) in metres."""
        return self._scene.vertices()

    @cached_property
    def faces(self) -> NDArray[np.uint32]:
        """Corners (m, 3) of the triangles, counter-clockwise seen from the front."""
        return self._scene.faces()

    @cached_property
    def surface(self) -> NDArray[np.str_]:
        """Name (m,) of each face's surface: an OBJ group, a glTF node, an STL solid."""
        return self._names("surface")

    @cached_property
    def material(self) -> NDArray[np.str_]:
        """Name (m,) of each face's material."""
        return self._names("material")

    @cached_property
    def object(self) -> NDArray[np.str_]:
        """Name (m,) of each face's object."""
        return self._names("object")

    def to_trimesh(self) -> Any:
        """The same as a `trimesh.Trimesh`, face by face."""
        import trimesh

        return trimesh.Trimesh(self.vertices, self.faces, process=False)

    def to_pyvista(self) -> Any:
        """The same as a `pyvista.PolyData`, face by face."""
        import pyvista

        return pyvista.PolyData.from_regular_faces(self.vertices, self.faces.astype(np.int64))

    def _names(self, by: str) -> NDArray[np.str_]:
        names, of = self._scene.grouping(by)
        return np.array(names, dtype=np.str_)[of]

    def __repr__(self) -> str:
        return f"<hemicube.Mesh {self.name!r}: {len(self.faces)} faces>"


def read(
    path: str | os.PathLike[str],
    *,
    unit: str | float = "m",
    flip: bool = False,
) -> Mesh:
    """Reads the triangles of a model: .obj, .stl, .ply, .gltf, .glb or .vs3.

    `unit` is that of the file's coordinates: m, mm, cm, in, ft, or metres as a number. `flip` turns
    every face round. Raises `FileError` if it cannot be read.
    """
    scene = _Scene.load(os.fspath(path), metres(unit), None, "file", 0.9, False)
    return Mesh(scene.changed("file", True) if flip else scene)


def metres(unit: str | float) -> float:
    """What `unit=` is in metres."""
    if isinstance(unit, str):
        if unit not in UNITS:
            raise InputError(f"unit={unit!r}: give one of {', '.join(UNITS)}, or metres")
        return UNITS[unit]
    return _arrays.above("unit", unit)


def mesh_arrays(mesh: Any) -> tuple[ArrayLike, ArrayLike]:
    """Vertices and faces of a mesh of trimesh, pyvista or meshio; of a Mesh of ours as well."""
    kind = type(mesh).__name__
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        return mesh.vertices, mesh.faces
    if hasattr(mesh, "points") and hasattr(mesh, "cells_dict") and hasattr(mesh, "cells"):
        if not hasattr(mesh, "n_cells"):
            return mesh.points, _of_blocks(mesh.cells)
    if hasattr(mesh, "points") and hasattr(mesh, "is_all_triangles"):
        if not mesh.is_all_triangles:
            raise InputError(f"mesh: not all faces of the {kind} are triangles; triangulate() it")
        return mesh.points, np.asarray(mesh.faces).reshape(-1, 4)[:, 1:]
    raise InputError(
        f"mesh: a {kind} has no triangles that are known here; give vertices and faces, or a "
        "trimesh.Trimesh, pyvista.PolyData or meshio.Mesh"
    )


def _of_blocks(blocks: Any) -> NDArray[Any]:
    """The triangles of meshio's blocks of cells; points and lines are left out."""
    without_area = {"vertex", "line", "line3"}
    kinds = {block.type for block in blocks} - without_area
    if kinds != {"triangle"}:
        other = ", ".join(sorted(kinds - {"triangle"})) or "no faces at all"
        raise InputError(f"mesh: the cells of the meshio mesh are {other}; give triangles")
    return np.concatenate([block.data for block in blocks if block.type == "triangle"])
