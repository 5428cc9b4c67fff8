"""Arrays as the library takes them, or an error that names the array, its shape and the row."""

from __future__ import annotations

import html
import os
from collections.abc import Mapping
from operator import index
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import InputError


def numbers(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Any array of real numbers, in double precision."""
    array = plain(name, values)
    if array.dtype.kind not in "fiu":
        raise InputError(f"{name}: has dtype {array.dtype}; give real numbers")
    return np.require(array, np.float64, ["C", "A"])


def plain(name: str, values: ArrayLike) -> NDArray[Any]:
    """What is an array, and has all of its values."""
    if isinstance(values, np.ma.MaskedArray):
        raise InputError(f"{name}: is a masked array; give one with all values: .filled(...)")
    try:
        return np.asarray(values)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: is no array ({error})") from None


def points(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Positions (n, 3), all finite."""
    array = numbers(name, values)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{name}: has shape {array.shape}; it should be (n, 3)")
    finite = np.isfinite(array).all(axis=1)
    if not finite.all():
        row = int(np.argmin(finite))
        raise InputError(f"{name}[{row}]: {array[row].tolist()} is not finite")
    return array


def triangles(name: str, values: ArrayLike, count: int, of: str) -> NDArray[np.uint32]:
    """Corners (m, 3), each one of `count` vertices, which are called `of`."""
    array = plain(name, values)
    if array.ndim != 2 or array.shape[1] != 3:
        hint = "; split polygons into triangles" if array.ndim == 2 else ""
        raise InputError(f"{name}: has shape {array.shape}; it should be (m, 3){hint}")
    if array.dtype.kind not in "iu":
        raise InputError(f"{name}: has dtype {array.dtype}; give integers")
    wrong = ((array < 0) | (array >= count)).any(axis=1)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(
            f"{name}[{row}]: {array[row].tolist()} is no triangle of {of}, which has {count} rows, "
            "counted from 0"
        )
    return np.require(array, np.uint32, ["C", "A"])


def triple(name: str, values: ArrayLike) -> list[float]:
    """Three finite numbers."""
    array = numbers(name, values)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise InputError(f"{name}: {np.asarray(values).tolist()} is no vector; give three numbers")
    return [float(x) for x in array]


def above(name: str, value: float, least: float = 0.0) -> float:
    """A finite number above `least`."""
    number = real(value)
    if not (np.isfinite(number) and number > least):
        raise InputError(f"{name}={value!r}: is not above {least:g}; give a number")
    return number


def real(value: object) -> float:
    """A number; nan of what is none."""
    if isinstance(value, (str, bytes, bool)):
        return np.nan
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return np.nan


def integer(name: str, value: int, least: int, most: int) -> int:
    """An integer from `least` to `most`."""
    number = index(value) if hasattr(value, "__index__") else None
    if number is None or not least <= number <= most:
        raise InputError(f"{name}={value!r}: is no integer from {least} to {most}")
    return number


def direction(name: str, values: ArrayLike) -> list[float]:
    """A vector of length 1, of three numbers that are not all zero."""
    three = np.array([triple(name, values)])
    if not three.any():
        raise InputError(f"{name}: has no direction: it is zero")
    return [float(x) for x in unit_rows(name, three)[0]]


def unit_rows(name: str, rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows (n, 3) at length 1, however long or short they are."""
    most = np.abs(rows).max(axis=1, keepdims=True, initial=0.0)
    none = np.flatnonzero(most == 0.0)
    if len(none):
        raise InputError(f"{name}[{none[0]}]: has no direction: it is zero")
    scaled = rows / most
    unit: NDArray[np.float64] = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    return unit


def seed_of(seed: int) -> int:
    """A seed that the library takes."""
    return integer("seed", seed, 0, (1 << 32) - 1)


def memory_of(memory: int | None) -> int:
    """Bytes that work may take: as given, or what is free."""
    if memory is None:
        return available_memory()
    number = real(memory)
    if not 0 <= number < 1 << 63:
        raise InputError(f"memory={memory!r}: is no number of bytes")
    return int(number)


def sums(of: NDArray[Any], weights: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Sums of `weights` (n,) by the group `of` (n,) each, of `count` groups."""
    return np.asarray(np.bincount(of, weights=weights, minlength=count), dtype=np.float64)


def over(values: NDArray[np.float64], areas: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quotients; 0 where there is no area."""
    return np.divide(values, areas, out=np.zeros(len(areas)), where=areas > 0)


def available_memory() -> int:
    """Bytes that are free for use; a cautious guess where the system does not tell."""
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            for line in file:
                if line.startswith("MemAvailable:"):
                    return int(line.split()[1]) << 10
    except OSError:
        pass
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
    except (AttributeError, ValueError, OSError):
        return 4 << 30


def table(title: str, facts: Mapping[str, object]) -> str:
    """What notebooks show of a result."""
    rows = (f"<tr><th>{k}</th><td>{html.escape(str(v))}</td></tr>" for k, v in facts.items())
    return f"<table><caption>{title}</caption>{''.join(rows)}</table>"
