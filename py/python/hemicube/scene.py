"""Scenes: models with materials and lamps, and their light."""

from __future__ import annotations

import json
import os
import warnings
from functools import cached_property
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays, _hemicube
from ._errors import InputError, ModelWarning
from ._progress import Progress, hearer
from .models import Mesh, metres

Floats = NDArray[np.float64]

Path = str | os.PathLike[str]

PLACES = {1: "inside solids", 3: "outside the model"}


def load(
    path: Path,
    *,
    unit: str | float = "m",
    up: ArrayLike | None = None,
    sides: str = "file",
    max_reflectance: float = 0.9,
    flip: bool = False,
) -> Scene:
    """Reads a model with its materials and lamps: .gltf, .glb, .obj, .stl, .ply or .vs3; or the
    built-in scene of that name, if there is no such file.

    unit             of the file's coordinates: m, mm, cm, in, ft, or metres as a number
    up               (3,) what points upwards; as the format says unless given
    sides            which sides of faces reflect: "file", "one" (fronts) or "two"
    max_reflectance  brighter materials are clamped to it
    flip             turns every face round

    Raises `FileError` if it cannot be read.
    """
    name = os.fspath(path)
    if os.path.splitext(name)[1] == "" and not os.path.exists(name):
        # It is made as it is: in metres, upright, with reflectances of its own.
        for argument, given in (("unit", unit != "m"), ("up", up is not None)):
            if given:
                raise InputError(f"{argument}=: is for files; {name!r} is a built-in scene")
        if max_reflectance != 0.9:
            raise InputError(f"max_reflectance=: is for files; {name!r} is a built-in scene")
        scene = _hemicube.Scene.builtin(name).changed(sides, False)
    else:
        axis = None if up is None else _arrays.direction("up", up)
        most = _arrays.real(max_reflectance)
        scene = _hemicube.Scene.load(name, metres(unit), axis, sides, most, True)
    return Scene(scene.changed("file", True) if flip else scene)


class Scene:
    """A model with its materials and lamps. What is changed counts for light that is made after."""

    def __init__(self, scene: _hemicube.Scene) -> None:
        self._scene = scene

    @property
    def name(self) -> str:
        """The stem of the file."""
        return self._scene.name

    @property
    def mesh(self) -> Mesh:
        """Its triangles, with the names of surfaces and materials."""
        return Mesh(self._scene)

    @property
    def sky(self) -> tuple[float, float, float]:
        """Radiance of the surroundings, alike from everywhere: W/(m² sr), or cd/m²."""
        return tuple(self._scene.sky)  # type: ignore[return-value]

    @sky.setter
    def sky(self, radiance: ArrayLike) -> None:
        self._scene = self._scene.with_sky(_channels("sky", radiance))

    def add_lamp(self, position: ArrayLike, flux: ArrayLike, *, name: str = "lamp") -> None:
        """Adds a lamp at `position` (3,), m, that sends out `flux`, lm or W, in all directions."""
        place = _arrays.triple("position", position)
        self._scene = self._scene.with_lamp(name, place, _channels("flux", flux))

    def add_sun(self, toward: ArrayLike, irradiance: ArrayLike) -> None:
        """Adds the sun, where `toward` (3,) points. What faces it receives `irradiance`, lx or
        W/m²."""
        direction = _arrays.direction("toward", toward)
        self._scene = self._scene.with_sun(direction, _channels("irradiance", irradiance))

    def set_emission(self, material: str, radiance: ArrayLike) -> None:
        """Lets a material emit: cd/m² or W/(m² sr), one number or (3,)."""
        channels = _channels("radiance", radiance)
        self._changed(material, self._scene.with_emission(material, channels))

    def set_reflectance(self, material: str, reflectance: ArrayLike) -> None:
        """Gives a material another diffuse reflectance, 0 to below 1, one number or (3,)."""
        shares = _channels("reflectance", reflectance)
        if max(shares) >= 1.0:
            raise InputError(f"reflectance: {max(shares)} is not below 1")
        self._changed(material, self._scene.with_reflectance(material, shares))

    def _changed(self, material: str, scene: _hemicube.Scene | None) -> None:
        if scene is None:
            names = ", ".join(sorted(set(self.mesh.material)))
            text = f"material {material!r}: there is none of that name; there are {names}"
            raise InputError(text)
        self._scene = scene

    def light(
        self,
        *,
        error: float | None = None,
        samples: int | None = None,
        patch_size: float | None = None,
        seed: int = 0,
        memory: int | None = None,
        progress: Progress = None,
    ) -> Light:
        """Solves for the light of the scene.

        error       share that irradiance is to be known to on four fifths of what is lit: .01 is
                    1 %. Rays and patches are then chosen for it
        samples     rays of each patch, 32 to 65536; not with `error`
        patch_size  largest area of a patch, m²
        seed        another one gives other rays
        memory      bytes that the work may take; what is free unless given
        progress    True shows a bar on stderr; or a function that is called with (done, total)
        """
        if error is not None and samples is not None:
            raise InputError("samples=: are chosen for error=; leave one of them out")
        if error is not None and not 0.0 < _arrays.real(error) < 1.0:
            raise InputError(f"error={error!r}: is a share, above 0 and below 1; .01 is 1 %")
        asked = SimpleNamespace(
            error=error,
            samples=None if samples is None else _arrays.integer("samples", samples, 32, 1 << 16),
            patch_size=None if patch_size is None else _arrays.above("patch_size", patch_size),
            seed=_arrays.seed_of(seed),
            memory=_arrays.memory_of(memory),
        )
        light = Light(_hemicube.light(self._scene, asked, hearer(progress)))
        reached = light.error
        if error is not None and reached is not None and reached > error:
            warnings.warn(
                f"error={error:g} is not reached, the best is {reached:.2g}: allow a larger one, "
                "or more memory=",
                ModelWarning,
                stacklevel=2,
            )
        return light

    def __repr__(self) -> str:
        return f"<hemicube.Scene {self.name!r}: {len(self.mesh.faces)} faces>"


class Light:
    """The light of a scene, solved: to be measured, looked at, baked and stored."""

    def __init__(self, light: _hemicube.Light) -> None:
        self._light = light

    @cached_property
    def report(self) -> dict[str, Any]:
        """What happened: patches, rays, energy, the time of each stage."""
        found: dict[str, Any] = json.loads(self._light.report)
        return found

    @property
    def error(self) -> float | None:
        """The error reached, as a share, if one was asked for."""
        error = self.report["error"]
        return None if error is None else float(error["total"])

    def probe(
        self,
        points: ArrayLike,
        normals: ArrayLike,
        *,
        samples: int | None = None,
        progress: Progress = None,
    ) -> tuple[Floats, Floats]:
        """Irradiance (n, 3), lx or W/m², at `points` (n, 3), m, on planes with these `normals`
        (n, 3), or (3,) for all; and half-widths of its 95 % intervals.

        Channels are red, green and blue; illuminance is `hemicube.luminance(E)`. Points inside
        solids and outside the model are nan. `samples` are rays a point, 4096 unless given.
        """
        places = _arrays.points("points", points)
        given = _arrays.plain("normals", normals)
        planes = np.broadcast_to(given, places.shape) if given.shape == (3,) else given
        planes = _arrays.points("normals", planes)
        if planes.shape != places.shape:
            raise InputError(f"normals: has shape {planes.shape}, and points {places.shape}")
        planes = _arrays.unit_rows("normals", planes)
        if samples is not None:
            samples = _arrays.integer("samples", samples, 256, 1 << 20)
        found, half, place = self._light.probe(places, planes, samples, hearer(progress))
        for code, name in PLACES.items():
            left_out = place == code
            if left_out.any():
                found[left_out] = half[left_out] = np.nan
                text = f"{int(left_out.sum())} of {len(place)} points are {name}: they are nan"
                warnings.warn(text, ModelWarning, stacklevel=2)
        return found, half

    def render(
        self,
        *,
        eye: ArrayLike | None = None,
        target: ArrayLike | None = None,
        up: ArrayLike | None = None,
        vfov: float | None = None,
        size: tuple[int, int] | None = None,
        samples: int = 8,
        progress: Progress = None,
    ) -> NDArray[np.float32]:
        """Radiance (height, width, 3) that a camera sees, cd/m² or W/(m² sr), linear.

        eye, target  (3,) where from and at what, m; the scene's own camera unless given
        up           (3,) what is upwards in the picture
        vfov         vertical angle of view, degrees; 40 unless given
        size         (width, height) in pixels
        samples      along each side of a pixel, 1 to 15
        """
        if (eye is None) != (target is None):
            raise InputError("eye=, target=: give both, or none")
        if vfov is not None and not 0.0 < _arrays.real(vfov) < 180.0:
            raise InputError(f"vfov={vfov!r}: is not from 0 to 180 degrees")
        if not 1 <= samples <= 15:
            raise InputError(f"samples={samples!r}: is not from 1 to 15")
        if size is not None and (len(size) != 2 or min(size) < 1):
            raise InputError(f"size={size!r}: give (width, height) in pixels")
        looked = SimpleNamespace(
            eye=None if eye is None else _arrays.triple("eye", eye),
            target=None if target is None else _arrays.triple("target", target),
            up=None if up is None else _arrays.direction("up", up),
            vfov=None if vfov is None else float(np.radians(vfov)),
            size=None if size is None else [int(size[0]), int(size[1])],
            samples=int(samples),
        )
        return self._light.render(looked, hearer(progress))

    def bake(
        self,
        path: Path,
        *,
        mode: str = "unlit",
        texel: float | None = None,
        exposure: float | None = None,
        progress: Progress = None,
    ) -> list[str]:
        """Writes the model with its light as .glb, and returns the files that were written.

        mode      "unlit": what is seen, in a texture; "vertex": radiance at vertices; "lightmap":
                  irradiance in a second set of texture coordinates, beside it as .exr and .json
        texel     width of a texel, m; chosen unless given
        exposure  of "unlit", in stops; chosen unless given
        """
        name = os.fspath(path)
        if mode not in ("unlit", "vertex", "lightmap"):
            raise InputError(f"mode={mode!r}: give 'unlit', 'vertex' or 'lightmap'")
        if not name.lower().endswith(".glb"):
            raise InputError(f"{name}: baked models are written as .glb")
        width = None if texel is None else _arrays.above("texel", texel)
        if exposure is not None and not np.isfinite(_arrays.real(exposure)):
            raise InputError(f"exposure={exposure!r}: is no number of stops")
        written = self._light.bake(name, mode, width, exposure, hearer(progress))
        return [os.fspath(file) for file in written]

    def save(self, path: Path, *, progress: Progress = None) -> None:
        """Writes a solution for each source of light as .hemi, for the viewer and new lamps.

        The scene is solved anew for it, source by source, with the patches and rays of this light.
        """
        name = os.fspath(path)
        if not name.lower().endswith(".hemi"):
            raise InputError(f"{name}: solutions are written as .hemi")
        self._light.save(name, hearer(progress))

    def __repr__(self) -> str:
        scene, patches = self.report["scene"], self.report["patches"]
        error = "" if self.error is None else f", error {100 * self.error:.2g} %"
        return f"<hemicube.Light of {scene!r}: {patches} patches{error}>"

    def _repr_html_(self) -> str:
        facts = {"scene": self.report["scene"], "patches": self.report["patches"]}
        if self.error is not None:
            facts["error"] = f"{100 * self.error:.2g} %"
        return _arrays.table("light", facts)


def luminance(channels: ArrayLike) -> Floats:
    """.2126 R + .7152 G + .0722 B of an array (..., 3): illuminance of irradiance, lx."""
    array = _arrays.numbers("channels", channels)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise InputError(f"channels: has shape {array.shape}; it should be (..., 3)")
    weighed: Floats = array @ np.array([0.2126, 0.7152, 0.0722])
    return weighed


def _channels(name: str, values: ArrayLike) -> list[float]:
    """Red, green and blue, of three numbers or one for all."""
    array = _arrays.numbers(name, values)
    three = _arrays.triple(name, np.broadcast_to(array, (3,)) if array.ndim == 0 else array)
    if min(three) < 0.0:
        raise InputError(f"{name}: {min(three)} is negative")
    return three
