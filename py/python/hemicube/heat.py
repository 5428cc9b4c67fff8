"""Heat by radiation between grey diffuse surfaces."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays, _hemicube
from ._errors import InputError, ModelWarning
from ._progress import Progress, hearer

if TYPE_CHECKING:
    from .factors import ViewFactors

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class HeatBalance:
    """What settles, one number a surface (m,). As an array it is the net flux."""

    flux: Floats
    """Net heat that leaves by radiation, W/m²: what is supplied to each. Negative if it gains."""

    temperature: Floats
    """K; nan where nothing says which."""

    area: Floats
    """m²."""

    radiosity: Floats
    """Infrared that leaves, emitted and reflected, W/m²."""

    irradiance: Floats
    """Infrared that arrives, W/m²."""

    sunlight: Floats
    """Sunlight absorbed, W/m²."""

    flux_error: Floats
    """Half the width of the 95 % interval of `flux`, W/m², as view factors err."""

    temperature_error: Floats
    """The same of `temperature`, K."""

    supplied: float
    """Heat that is supplied, W: the sum of what is positive."""

    removed: float
    """Heat that is taken away, W, as a positive number."""

    to_environment: float
    """Net infrared that leaves to the environment, W."""

    imbalance: float
    """What all this leaves unaccounted for, over what is exchanged."""

    @property
    def power(self) -> Floats:
        """Net heat that leaves, W: `flux` times `area`."""
        return self.flux * self.area

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.flux, dtype=dtype) if copy else np.asarray(self.flux, dtype=dtype)

    def __len__(self) -> int:
        return len(self.flux)

    def __getitem__(self, key: Any) -> Any:
        return self.flux[key]

    def __repr__(self) -> str:
        return (
            f"<hemicube.HeatBalance of {len(self)} surfaces: {self.supplied:.6g} W supplied, "
            f"{self.removed:.6g} W removed, {self.to_environment:.6g} W to the environment>"
        )


def balance(
    factors: ViewFactors,
    temperature: ArrayLike,
    *,
    emissivity: ArrayLike,
    flux: ArrayLike,
    environment: float | None,
    absorptance: ArrayLike | None,
    sunlight: ArrayLike | None,
    diffuse_sunlight: float,
    memory: int | None,
    progress: Progress,
) -> HeatBalance:
    """See `ViewFactors.heat`."""
    given = factors.each("temperature", temperature)
    _range("temperature", given, 0.0, "K; 20 °C are 293.15")
    own = _shares("emissivity", factors.each("emissivity", emissivity))
    absorbs = own if absorptance is None else factors.each("absorptance", absorptance)
    around = None if environment is None else _arrays.real(environment)
    if around is not None and not (np.isfinite(around) and around >= 0):
        raise InputError(f"environment={environment!r}: is no temperature in K; 20 °C are 293.15")
    diffuse = _arrays.real(diffuse_sunlight)
    if not (np.isfinite(diffuse) and diffuse >= 0):
        raise InputError(f"diffuse_sunlight={diffuse_sunlight!r}: is no irradiance in W/m²")
    _, node_of = np.unique(factors.front, return_inverse=True)
    node_of = node_of.reshape(-1)
    nodes = int(node_of.max()) + 1 if len(node_of) else 0
    of_nodes = np.full(nodes, np.nan)
    known = ~np.isnan(given)
    of_nodes[node_of[known]] = given[known]
    twice = known & (given != of_nodes[node_of])
    if twice.any():
        row = int(np.argmax(twice))
        raise InputError(f"temperature[{row}]: {given[row]} K; its other side has another one")
    supplied = _supplied(factors, flux, node_of, nodes)
    both = ~np.isnan(of_nodes) & ~np.isnan(supplied)
    if both.any():
        row = int(np.argmax(both[node_of]))
        raise InputError(f"flux: surface {row} has a temperature and a flux; give nan for one")
    arriving = np.zeros(len(given)) if sunlight is None else factors.each("sunlight", sunlight)
    _range("sunlight", arriving, 0.0, "W/m²")
    sunny = sunlight is not None or diffuse > 0
    inputs = SimpleNamespace(
        emissivity=own,
        node_of=node_of.astype(np.uint32),
        temperature=of_nodes,
        supplied=np.nan_to_num(supplied, nan=0.0),
        environment=around,
        absorptance=_shares("absorptance", absorbs),
        sunlight=arriving if sunny else None,
        diffuse=diffuse,
        error=factors.error,
        memory=_arrays.memory_of(memory),
    )
    found = _hemicube.heat(factors._arrays(), inputs, hearer(progress))
    left_out, rows = found.pop("left_out")
    if rows:
        warnings.warn(
            f"{left_out:.3g} W that are supplied to {rows} surfaces are left out: these exchange "
            "with nothing",
            ModelWarning,
            stacklevel=3,
        )
    return HeatBalance(area=factors.area, **found)


def _supplied(
    factors: ViewFactors, flux: ArrayLike, node_of: NDArray[np.intp], nodes: int
) -> Floats:
    """Heat that is supplied to each node, W; nan where no flux is given."""
    of_rows = factors.each("flux", flux)
    if np.isinf(of_rows).any():
        raise InputError(f"flux[{int(np.argmax(np.isinf(of_rows)))}]: is not finite")
    given = ~np.isnan(of_rows)
    if np.shape(flux) != of_rows.shape:
        # One number a face, or for all: both sides of it together.
        given &= factors.front == np.arange(len(of_rows))
    weights = np.where(given, of_rows, 0.0) * factors.area
    sums = _arrays.sums(node_of, weights, nodes)
    return np.where(np.bincount(node_of[given], minlength=nodes) > 0, sums, np.nan)


def _shares(name: str, values: Floats) -> Floats:
    wrong = ~((values >= 0.0) & (values <= 1.0))
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(f"{name}[{row}]: {values[row]} is not from 0 to 1")
    return values


def _range(name: str, values: Floats, least: float, unit: str) -> None:
    wrong = (values < least) | np.isinf(values)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(f"{name}[{row}]: {values[row]} is not {least:g} or more, in {unit}")
