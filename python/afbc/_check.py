"""Checks of arguments. Their errors name the argument and the value that is needed."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from math import isfinite
from operator import index
from os import fspath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._afbc import AfbcError

#: Largest seed that the compiled part accepts.
SEED_MAX = 2**63 - 1


def _kind(value: object) -> str:
    return type(value).__name__


def _shown(value: object) -> str:
    """Returns a value as text that fits in a line."""
    try:
        text = repr(value).replace("\n", " ")
    except ValueError:
        return "too long a number"
    return text if len(text) <= 40 else text[:40] + "..."


def whole(name: str, value: Any, least: int, most: int) -> int:
    """Returns a whole number within these limits."""
    try:
        number = index(value)
    except TypeError:
        raise TypeError(f"{name}: a whole number is needed, not {_kind(value)}") from None
    if not least <= number <= most:
        raise AfbcError(f"{name}: {_shown(number)} given; a whole number from {least} to {most} is needed")
    return number


def number(name: str, value: Any, least: float, most: float) -> float:
    """Returns a finite number within these limits."""
    if isinstance(value, (str, bytes)):
        raise TypeError(f"{name}: a number is needed, not {_kind(value)}")
    try:
        given = float(value)
    except TypeError:
        raise TypeError(f"{name}: a number is needed, not {_kind(value)}") from None
    except OverflowError:
        given = float("inf")
    if not (isfinite(given) and least <= given <= most):
        raise AfbcError(f"{name}: {_shown(value)} given; a number from {least:g} to {most:g} is needed")
    return given


def finite(name: str, values: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Returns a copy of finite numbers of this shape."""
    try:
        array = np.asarray(values)
    except ValueError:
        raise AfbcError(f"{name}: {_shown(values)} given; numbers of shape {shape} are needed") from None
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: numbers are needed, not {_kind(values)} of dtype {array.dtype}")
    if array.shape != shape:
        raise AfbcError(f"{name}: shape {array.shape} given; {shape} is needed")
    if not np.all(np.isfinite(array)):
        raise AfbcError(f"{name}: NaN or infinity given; finite numbers are needed")
    return array.astype(np.float64)


def path(name: str, value: Any) -> str:
    """Returns a path as text."""
    try:
        given = fspath(value)
    except TypeError:
        raise TypeError(f"{name}: a name or a path is needed, not {_kind(value)}") from None
    if not isinstance(given, str):
        raise TypeError(f"{name}: a name or a path as text is needed, not {_kind(given)}")
    if not given or "\0" in given:
        raise AfbcError(f"{name}: {_shown(given)} given; a name or a path is needed")
    return given


def several(name: str, values: Any, needed: str) -> list[Any]:
    """Returns the items of a list or another collection. A text or a mapping is refused."""
    if not isinstance(values, Collection) or isinstance(values, (str, bytes, Mapping)):
        raise TypeError(f"{name}: {needed} needed, not {_kind(values)}")
    if isinstance(values, np.ndarray) and values.ndim == 0:
        raise TypeError(f"{name}: {needed} needed, not an array of no dimension")
    return list(values)


def mapping(name: str, values: Any, needed: str) -> Mapping[Any, Any]:
    """Returns the value if it is a mapping."""
    if not isinstance(values, Mapping):
        raise TypeError(f"{name}: {needed} needed, not {_kind(values)}")
    return values


def key(name: str, values: Mapping[str, Any], wanted: str) -> Any:
    """Returns the value of a key."""
    try:
        return values[wanted]
    except KeyError:
        raise AfbcError(f"{name}: no key {wanted!r}") from None
