"""Input checks shared by the delta6 closed forms."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError, NoSolution

FloatArray: TypeAlias = NDArray[np.float64]
BoolArray: TypeAlias = NDArray[np.bool_]


def vectors(name: str, value: ArrayLike, length: int = 3) -> FloatArray:
    """Finite float array of shape (..., length)."""
    array = finite(name, value)
    if array.ndim == 0 or array.shape[-1] != length:
        raise MechlabError(f"{name} has shape {array.shape}; expected (..., {length})")
    return array


def finite(name: str, value: ArrayLike) -> FloatArray:
    """Float array without NaN or infinity."""
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise MechlabError(f"{name} is not an array of numbers: {error}") from error
    if not np.all(np.isfinite(array)):
        raise MechlabError(
            f"{name} holds {np.count_nonzero(~np.isfinite(array))} values that are not finite; "
            "expected finite numbers. Mask them out first"
        )
    return array


def number(name: str, value: float, *, above: float = -math.inf) -> float:
    """Finite scalar greater than `above`."""
    try:
        result = float(value)
    except (TypeError, ValueError) as error:
        raise MechlabError(f"{name} = {value!r} is not a number") from error
    if not math.isfinite(result) or not result > above:
        wanted = "a finite number" if above == -math.inf else f"a finite number greater than {above:g}"
        raise MechlabError(f"{name} = {value!r}; expected {wanted}")
    return result


def demand(good: BoolArray, sentence: str, advice: str) -> None:
    """Raise NoSolution unless every element is good; name how many are not and the first of them."""
    if np.all(good):
        return
    bad = np.argwhere(~good)
    where = f" (first at index {tuple(int(i) for i in bad[0])})" if good.ndim else ""
    raise NoSolution(f"{len(bad)} of {good.size} poses{where}: {sentence}. {advice}")


def apply(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    """Matrix times vector over leading axes: (..., m, n), (..., n) -> (..., m)."""
    return np.asarray((matrix @ vector[..., None])[..., 0])


def freeze(rows: ArrayLike) -> FloatArray:
    """Read-only float array, for constants that are handed out."""
    array = np.array(rows, dtype=np.float64)
    array.flags.writeable = False
    return array
