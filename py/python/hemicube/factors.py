"""The matrix of view factors (form factors) of a mesh."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterable
from functools import cached_property
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays, _hemicube
from ._errors import InputError, ModelWarning
from ._progress import Progress, hearer
from .heat import HeatBalance, balance
from .models import Mesh, mesh_arrays
from .scene import Scene

if TYPE_CHECKING:
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import LinearOperator

Floats = NDArray[np.float64]


def view_factors(
    vertices: Any,
    faces: ArrayLike | None = None,
    *,
    error: float = 1e-3,
    obstacles: Any = None,
    patch_size: float | None = None,
    sides: str = "one",
    enclosure: bool = False,
    threshold: float = 0.0,
    rows: Iterable[int] | None = None,
    seed: int = 0,
    memory: int | None = None,
    progress: Progress = None,
) -> ViewFactors:
    """View factors between the faces of a mesh, occlusion included.

    `vertices` (n, 3) are in metres, `faces` (m, 3) indices of them, counter-clockwise seen from the
    front; or `vertices` is a whole mesh, of `hemicube.read`, trimesh, pyvista or meshio. Row i is
    face i.

    error       root-mean-square error aimed at, as a share of the factors' root mean square
    obstacles   (vertices, faces) or a mesh: what only blocks and has no rows
    patch_size  largest area of a patch, m²: larger faces are cut, and have a row for each part
    sides       "one": fronts have rows, and backs absorb; "two": rows m to 2m are the backs
    enclosure   the model is closed: rows are made to sum to 1, reciprocity kept
    threshold   smaller factors are left out, and sums of rows restored
    rows        only these rows
    seed        another one gives other rays, where rays decide
    memory      bytes that all of it may take; what is free unless given
    progress    True shows a bar on stderr; or a function that is called with (done, total)

    Raises `InputError` for what makes no sense and `OutOfMemory`. Ctrl-C stops the work.
    """
    scene = _scene_of(vertices, faces, _pair("obstacles", obstacles), sides)
    wanted = None if rows is None else _rows(rows)
    if wanted is not None and enclosure:
        raise InputError("rows=: closing a matrix takes all of its rows; leave enclosure= out")
    if not 0.0 <= _arrays.real(threshold) < 1.0:
        raise InputError(f"threshold={threshold!r}: is no number from 0 to below 1")
    options = SimpleNamespace(
        error=_share("error", error),
        patch_size=None if patch_size is None else _arrays.above("patch_size", patch_size),
        enclosure=bool(enclosure),
        threshold=float(threshold),
        rows=None if wanted is None else wanted.tolist(),
        seed=_arrays.seed_of(seed),
        memory=_arrays.memory_of(memory),
    )
    made = _hemicube.view_factors(scene, options, hearer(progress))
    made["report"] = json.loads(made["report"])
    found = ViewFactors(rows=wanted, **made)
    for text in _doubts(found, options.error, obstacles is not None):
        warnings.warn(text, ModelWarning, stacklevel=2)
    return found


class ViewFactors:
    """View factors between m surfaces: `F.matrix[i, j]` is the share of what surface i sends out
    diffusely that arrives at surface j.

    The sum of a row, `escape` and `back` make 1, but for errors.
    """

    area: Floats
    """Areas (m,), m²."""

    escape: Floats
    """Share (n,) of each row that escapes to the environment."""

    back: Floats
    """Share (n,) of each row that ends on what has no row: backs of faces, and obstacles."""

    face: NDArray[np.int64]
    """The face (m,) of the mesh that each surface is, or is a part of; the first of several."""

    front: NDArray[np.int64]
    """Of each surface (m,) that which is its front; itself, but for backs."""

    rows: NDArray[np.int64] | None
    """The rows (n,) that `matrix` has, of all m; None for all."""

    labels: NDArray[Any] | None
    """What surfaces (m,) were lumped by; None of faces."""

    error: float
    """Root-mean-square error of all factors over their own, as estimated."""

    report: dict[str, Any]
    """What happened: the engine, its pairs and rays, what rows lose, the time of each stage."""

    def __init__(
        self,
        *,
        starts: NDArray[np.int64],
        columns: NDArray[np.int32],
        values: NDArray[Any],
        area: Floats,
        escape: Floats,
        back: Floats,
        face: NDArray[np.int64],
        front: NDArray[np.int64],
        error: float,
        report: dict[str, Any],
        rows: NDArray[np.int64] | None = None,
        labels: NDArray[Any] | None = None,
        pieces: _hemicube.Pieces | None = None,
        row_of: NDArray[np.int64] | None = None,
    ) -> None:
        self._starts, self._columns, self._values = starts, columns, values
        self.area, self.escape, self.back = area, escape, back
        self.face, self.front, self.rows, self.labels = face, front, rows, labels
        self.error, self.report = error, report
        # The pieces of surface that rows are of, and the row of each.
        self._pieces, self._row_of = pieces, row_of

    def __len__(self) -> int:
        return len(self._starts) - 1

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self), len(self.area)

    @cached_property
    def matrix(self) -> csr_array:
        """The factors, (m, m), or (n, m) with `rows=`. Single precision as they are made; double
        where they were scaled (`enclosure`, `threshold`) or lumped. To be read: what is edited in
        place is a `.copy()`."""
        from scipy.sparse import csr_array

        # To change them in place would change the factors of all that is asked later.
        self._values.setflags(write=False)
        self._columns.setflags(write=False)
        # Columns and starts of one width are taken over as they are.
        fits = len(self._values) <= np.iinfo(np.int32).max
        starts = self._starts.astype(np.int32) if fits else self._starts
        parts = (self._values, self._columns, starts)
        matrix = csr_array(parts, shape=self.shape, copy=False)
        matrix.has_canonical_format = True
        return matrix

    def as_linear_operator(self) -> LinearOperator:
        """F as a linear operator in double precision: `F @ radiosity` is irradiance."""
        from scipy.sparse.linalg import LinearOperator

        matrix = self.matrix
        return LinearOperator(
            self.shape,
            matvec=lambda x: matrix @ x,
            rmatvec=lambda x: matrix.T @ x,
            matmat=lambda x: matrix @ x,
            dtype=np.float64,
        )

    def lump(self, labels: ArrayLike) -> ViewFactors:
        """View factors between groups of surfaces: F_IJ = sum_i A_i sum_j F_ij / A_I.

        `labels` (m,) are integers or strings, of surfaces, or of the mesh's faces; groups come in
        the order of their first surface. With `sides="two"`, labels of faces are strings, and backs
        are groups of their own, `NAME (back)`.
        """
        self._all_rows("lump")
        of_rows = self._labels(labels)
        names, first, of = np.unique(of_rows, return_index=True, return_inverse=True)
        order = np.argsort(first)
        rank = np.empty_like(order)
        rank[order] = np.arange(len(order))
        of = rank[of.reshape(-1)]
        groups = len(names)
        area = _arrays.sums(of, self.area, groups)

        def mean(shares: Floats) -> Floats:
            return _arrays.over(_arrays.sums(of, self.area * shares, groups), area)

        front = np.arange(groups)
        front[of] = of[self.front]
        made = _hemicube.lump(self._arrays(), of, groups)
        return ViewFactors(
            area=area,
            escape=mean(self.escape),
            back=mean(self.back),
            face=self.face[first[order]],
            front=front,
            labels=names[order],
            error=self.error,
            report=self.report,
            pieces=self._pieces,
            row_of=None if self._row_of is None else of[self._row_of],
            **made,
        )

    def heat(
        self,
        temperature: ArrayLike = np.nan,
        *,
        emissivity: ArrayLike,
        flux: ArrayLike = np.nan,
        environment: float | None = None,
        absorptance: ArrayLike | None = None,
        sunlight: ArrayLike | None = None,
        diffuse_sunlight: float = 0.0,
        memory: int | None = None,
        progress: Progress = None,
    ) -> HeatBalance:
        """Net heat fluxes and temperatures of grey diffuse surfaces that exchange radiation.

        Arrays have one number for all, one a surface (m,), or one a face of the mesh.

        temperature       K; nan where it is to be found
        flux              heat that is supplied where there is no temperature, W/m²; nan is 0
                          (adiabatic). Of faces with two sides: to both, per area of one
        emissivity        0 to 1
        environment       temperature of what surrounds the model, K; None if it is closed
        absorptance       share of sunlight that is absorbed; `emissivity` unless given
        sunlight          irradiance straight from the sun, W/m²; see `F.sunlight`
        diffuse_sunlight  what comes in from all around, W/m²

        Both sides of a face have one temperature.
        """
        self._all_rows("heat")
        return balance(
            self,
            temperature,
            emissivity=emissivity,
            flux=flux,
            environment=environment,
            absorptance=absorptance,
            sunlight=sunlight,
            diffuse_sunlight=diffuse_sunlight,
            memory=memory,
            progress=progress,
        )

    def gebhart(
        self, emissivity: ArrayLike, *, memory: int | None = None, progress: Progress = None
    ) -> Floats:
        """Gebhart factors (m, m): B[i, j] is the share of what surface i emits that surface j
        absorbs, by reflections too. What leaves an open model makes a row sum to less than 1."""
        self._all_rows("gebhart")
        return _hemicube.gebhart(
            self._arrays(),
            self.each("emissivity", emissivity),
            self.is_open,
            _arrays.memory_of(memory),
            hearer(progress),
        )

    def sunlight(
        self, toward: ArrayLike, irradiance: float = 1361.0, *, progress: Progress = None
    ) -> Floats:
        """Irradiance (m,) of each surface straight from the sun, in its shadows, W/m².

        `toward` (3,) points to the sun; `irradiance` is that of a surface that faces it, W/m².
        """
        pieces, row_of = self._surfaces()
        direction = _arrays.direction("toward", toward)
        strength = _arrays.real(irradiance)
        if not (np.isfinite(strength) and strength >= 0):
            raise InputError(f"irradiance={irradiance!r}: is no irradiance in W/m²")
        found = pieces.sunlight(direction, strength, hearer(progress))
        sums = _arrays.sums(row_of, found * pieces.areas(), len(self.area))
        return _arrays.over(sums, self.area)

    def to_pyvista(self, **values: ArrayLike) -> Any:
        """The surfaces as a `pyvista.PolyData`, with `values` (m,) as arrays of its cells: those of
        fronts by their names, those of backs as `NAME_back`."""
        import pyvista

        points, triangles, rows = self._cells()
        mesh = pyvista.PolyData.from_regular_faces(points, triangles)
        backs = np.flatnonzero(self.front != np.arange(len(self.area)))
        back_of = np.arange(len(self.area))
        back_of[self.front[backs]] = backs
        for name, given in values.items():
            of_rows = self.each(name, given)
            mesh.cell_data[name] = of_rows[rows]
            if len(backs):
                mesh.cell_data[f"{name}_back"] = of_rows[back_of[rows]]
        return mesh

    def to_trimesh(self) -> Any:
        """The fronts of the surfaces as a `trimesh.Trimesh`, whose `face_attributes["row"]` is the
        row of each."""
        import trimesh

        points, triangles, rows = self._cells()
        attributes = {"row": rows}
        return trimesh.Trimesh(points, triangles, face_attributes=attributes, process=False)

    def _cells(self) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
        """Points (n, 3), triangles of them (k, 3), and the row (k,) of each: of fronts."""
        pieces, row_of = self._surfaces()
        fronts = ~pieces.backs()
        corners = pieces.corners()[fronts].reshape(-1, 3)
        points, index = np.unique(corners, axis=0, return_inverse=True)
        return points, index.reshape(-1, 3), row_of[fronts]

    def _surfaces(self) -> tuple[_hemicube.Pieces, NDArray[np.int64]]:
        if self._pieces is None or self._row_of is None:
            raise InputError("where the surfaces are is not kept in a copy; use the first factors")
        return self._pieces, self._row_of

    @property
    def is_open(self) -> bool:
        """Whether more than a thousandth of what all surfaces send out escapes."""
        shown = self.area if self.rows is None else self.area[self.rows]
        return bool((shown * self.escape).sum() > 1e-3 * shown.sum())

    def each(self, name: str, values: ArrayLike) -> Floats:
        """One number a surface (m,), of one for all, one a surface, or one a face."""
        array = _arrays.numbers(name, values)
        m, faces = len(self.area), self._faces
        if array.ndim == 0:
            return np.full(m, float(array))
        if array.shape == (m,):
            return array
        if array.shape == (faces,) and self.labels is None:
            return np.ascontiguousarray(array[self.face])
        of_faces = f", or ({faces},) of the faces" if self.labels is None and faces != m else ""
        raise InputError(f"{name}: has shape {array.shape}; it should be ({m},){of_faces}")

    @property
    def _faces(self) -> int:
        return int(self.face.max()) + 1 if len(self.face) else 0

    def _labels(self, labels: ArrayLike) -> NDArray[Any]:
        array = _arrays.plain("labels", labels)
        if array.dtype.kind == "O" and all(isinstance(label, str) for label in array.flat):
            array = array.astype(str)
        if array.dtype.kind not in "iubU" or _is_mixed(labels):
            raise InputError(f"labels: have dtype {array.dtype}; give integers or strings")
        m, faces = len(self.area), self._faces
        if array.shape == (m,):
            return array
        if array.shape != (faces,) or self.labels is not None:
            raise InputError(f"labels: has shape {array.shape}; it should be ({m},)")
        array = array[self.face]
        is_back = self.front != np.arange(m)
        if not is_back.any():
            return array
        if array.dtype.kind != "U":
            raise InputError(f"labels: give strings, or one for each of the {m} sides")
        return np.where(is_back, np.char.add(array, " (back)"), array)

    def _all_rows(self, what: str) -> None:
        if self.rows is not None:
            n, m = self.shape
            raise InputError(f"{what}: takes all rows, and these are {n} of {m}")

    def _arrays(self) -> SimpleNamespace:
        return SimpleNamespace(
            starts=self._starts,
            columns=self._columns,
            values=self._values,
            area=self.area,
            escape=self.escape,
            back=self.back,
        )

    def __getstate__(self) -> dict[str, Any]:
        state = self.__dict__.copy()
        state.pop("matrix", None)
        return state | {"_pieces": None}

    def __repr__(self) -> str:
        n, m = self.shape
        count, error = len(self._values), self.error
        return f"<hemicube.ViewFactors {n} x {m}, {count} factors, error {error:.1e}>"

    def _repr_html_(self) -> str:
        n, m = self.shape
        shown = self.area if self.rows is None else self.area[self.rows]
        mean = float((shown * self.escape).sum() / max(shown.sum(), 1e-300))
        facts = {
            "rows, columns": f"{n}, {m}",
            "factors": f"{len(self._values)} ({100 * len(self._values) / max(n * m, 1):.1f} %)",
            "error": f"{100 * self.error:.2g} %",
            "area": f"{self.area.sum():.6g} m²",
            "escapes": f"{100 * mean:.3g} %",
        }
        if self.labels is not None:
            facts["surfaces"] = ", ".join(str(label) for label in self.labels[:8])
        return _arrays.table("view factors", facts)


def _is_mixed(labels: Any) -> bool:
    """Whether a list has strings and what is none, which an array would turn into strings."""
    if not isinstance(labels, (list, tuple)):
        return False
    return len({isinstance(label, str) for label in labels}) > 1


def _pair(name: str, mesh: Any) -> tuple[Floats, NDArray[np.uint32]] | None:
    """Arrays of a mesh, or of a pair of vertices and faces."""
    if mesh is None:
        return None
    if isinstance(mesh, (tuple, list)):
        if len(mesh) != 2:
            raise InputError(f"{name}=: has {len(mesh)} parts; give (vertices, faces), or a mesh")
        vertices, faces = mesh
    else:
        vertices, faces = mesh_arrays(mesh)
    points = _arrays.points(f"{name}: vertices", vertices)
    return points, _arrays.triangles(f"{name}: faces", faces, len(points), "vertices")


def _scene_of(
    vertices: Any,
    faces: ArrayLike | None,
    obstacles: tuple[Floats, NDArray[np.uint32]] | None,
    sides: str,
) -> _hemicube.Scene:
    if sides not in ("file", "one", "two"):
        raise InputError(f"sides={sides!r}: give 'one', 'two' or 'file'")
    if isinstance(vertices, (Mesh, Scene)):
        return vertices._scene.changed(sides, False, obstacles)
    if faces is None:
        vertices, faces = mesh_arrays(vertices)
    points = _arrays.points("vertices", vertices)
    corners = _arrays.triangles("faces", faces, len(points), "vertices")
    return _hemicube.Scene.from_arrays(points, corners, obstacles).changed(sides, False)


def _rows(rows: Iterable[int]) -> NDArray[np.int64]:
    if not isinstance(rows, Iterable):
        raise InputError(f"rows={rows!r}: give integers, one or more, like [{rows!r}]")
    array = _arrays.plain("rows", rows if isinstance(rows, (np.ndarray, range)) else list(rows))
    if array.ndim != 1 or array.dtype.kind not in "iu" or len(array) == 0:
        raise InputError("rows=: give integers, one or more")
    if (array < 0).any():
        raise InputError(f"rows=: there is no row {int(array.min())}; rows count from 0")
    return array.astype(np.int64)


def _share(name: str, value: float) -> float:
    share = _arrays.real(value)
    if not 0.0 < share <= 1.0:
        raise InputError(f"{name}={value!r}: is a share, above 0 and at most 1; .001 is 0.1 %")
    return share


def _doubts(found: ViewFactors, asked: float, obstructed: bool) -> list[str]:
    """What is doubtful about a matrix."""
    doubts = []
    if found.report["faces_outwards"]:
        doubts.append(
            "most faces see nothing while their backs see surfaces: these are bodies seen from "
            "outside; if it should be a room, turn its faces round (faces[:, ::-1]), or use "
            "sides='two'"
        )
    losses = found.report["losses"]
    if losses and losses["to_backs"] and not obstructed:
        doubts.append(
            f"{losses['to_backs']} rows lose more than 1 % to backs of faces: no harm where "
            "something stands on a face; else turn the faces round that are seen from behind, or "
            "use sides='two'; F.report['losses'] names the worst"
        )
    if losses and losses["numerically"]:
        doubts.append(
            f"{losses['numerically']} rows lose more than 1 % numerically; ask for less error=, or "
            "a smaller patch_size=; F.report['losses'] names the worst"
        )
    if not found.error <= asked:
        doubts.append(
            f"the error of the factors is {found.error:.2e}, more than the {asked:.2e} asked for; "
            "use a smaller patch_size=, or allow a larger error="
        )
    return doubts
