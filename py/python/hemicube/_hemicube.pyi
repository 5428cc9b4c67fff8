"""What the package is built on, in Rust."""

import os
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

_Hearer = Callable[[str, int, int], None] | None
_Mesh = tuple[NDArray[np.float64], NDArray[np.uint32]]

__version__: str

@final
class Scene:
    @staticmethod
    def from_arrays(
        vertices: NDArray[np.float64], faces: NDArray[np.uint32], obstacles: _Mesh | None = None
    ) -> Scene: ...
    @staticmethod
    def load(
        path: str | os.PathLike[str],
        unit: float,
        up: list[float] | None,
        sides: str,
        max_reflectance: float,
        lit: bool,
    ) -> Scene: ...
    @staticmethod
    def builtin(name: str) -> Scene: ...
    def changed(self, sides: str, flip: bool, obstacles: _Mesh | None = None) -> Scene: ...
    @property
    def name(self) -> str: ...
    def vertices(self) -> NDArray[np.float64]: ...
    def faces(self) -> NDArray[np.uint32]: ...
    @property
    def sky(self) -> list[float]: ...
    def with_sky(self, radiance: list[float]) -> Scene: ...
    def with_lamp(self, name: str, position: list[float], flux: list[float]) -> Scene: ...
    def with_sun(self, toward: list[float], irradiance: list[float]) -> Scene: ...
    def with_emission(self, name: str, radiance: list[float]) -> Scene | None: ...
    def with_reflectance(self, name: str, reflectance: list[float]) -> Scene | None: ...
    def grouping(self, by: str) -> tuple[list[str], NDArray[np.uint32]]: ...

@final
class Pieces:
    def corners(self) -> NDArray[np.float64]: ...
    def areas(self) -> NDArray[np.float64]: ...
    def backs(self) -> NDArray[np.bool_]: ...
    def sunlight(
        self, toward: list[float], irradiance: float, progress: _Hearer = None
    ) -> NDArray[np.float64]: ...

@final
class Light:
    @property
    def report(self) -> str: ...
    def probe(
        self,
        points: NDArray[np.float64],
        normals: NDArray[np.float64],
        samples: int | None,
        progress: _Hearer = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.uint8]]: ...
    def render(self, looked: SimpleNamespace, progress: _Hearer = None) -> NDArray[np.float32]: ...
    def bake(
        self,
        path: str,
        mode: str,
        texel: float | None,
        exposure: float | None,
        progress: _Hearer = None,
    ) -> list[os.PathLike[str]]: ...
    def save(self, path: str, progress: _Hearer = None) -> None: ...

def light(scene: Scene, asked: SimpleNamespace, progress: _Hearer = None) -> Light: ...
def solve_shared(
    scene: Scene,
    asked: SimpleNamespace,
    output: str,
    communicator: object,
    progress: _Hearer = None,
) -> str: ...
def view_factors(
    scene: Scene, options: SimpleNamespace, progress: _Hearer = None
) -> dict[str, Any]: ...
def heat(
    matrix: SimpleNamespace, given: SimpleNamespace, progress: _Hearer = None
) -> dict[str, Any]: ...
def gebhart(
    matrix: SimpleNamespace,
    emissivity: NDArray[np.float64],
    environment: bool,
    memory: int,
    progress: _Hearer = None,
) -> NDArray[np.float64]: ...
def lump(
    matrix: SimpleNamespace, group_of: NDArray[np.int64], groups: int
) -> dict[str, Any]: ...
