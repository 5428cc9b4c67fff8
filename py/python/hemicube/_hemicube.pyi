"""What the package is built on, in Rust."""

import os
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Hearer = Callable[[str, int, int], None] | None
Mesh = tuple[NDArray[np.float64], NDArray[np.uint32]]

__version__: str

class Scene:
    @staticmethod
    def from_arrays(
        vertices: NDArray[np.float64], faces: NDArray[np.uint32], obstacles: Mesh | None = None
    ) -> Scene: ...
    @staticmethod
    def load(
        path: str | os.PathLike[str],
        unit: float,
        up: list[float] | None,
        sides: str,
        max_reflectance: float,
    ) -> Scene: ...
    @staticmethod
    def builtin(name: str) -> Scene: ...
    def changed(self, sides: str, flip: bool, obstacles: Mesh | None = None) -> Scene: ...
    @property
    def name(self) -> str: ...
    def vertices(self) -> NDArray[np.float64]: ...
    def faces(self) -> NDArray[np.uint32]: ...
    def grouping(self, by: str) -> tuple[list[str], NDArray[np.uint32]]: ...

class Pieces:
    def corners(self) -> tuple[NDArray[np.float64], NDArray[np.uint32]]: ...
    def sunlight(
        self, toward: list[float], irradiance: float, progress: Hearer
    ) -> NDArray[np.float64]: ...

def view_factors(
    scene: Scene, options: SimpleNamespace, progress: Hearer = None
) -> dict[str, Any]: ...
def heat(
    matrix: SimpleNamespace, given: SimpleNamespace, progress: Hearer = None
) -> dict[str, Any]: ...
def gebhart(
    matrix: SimpleNamespace,
    emissivity: NDArray[np.float64],
    environment: bool,
    memory: int,
    progress: Hearer = None,
) -> NDArray[np.float64]: ...
def lump(
    matrix: SimpleNamespace, group_of: NDArray[np.int64], groups: int
) -> dict[str, Any]: ...
