"""Arrays that a Story may keep: of the right shape, finite, rigid where they must be, and read-only."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError

Array = NDArray[np.float64]

RIGID_TOLERANCE = 1e-6


def frozen(values: ArrayLike, what: str, shape: tuple[int | None, ...], finite: bool = True) -> Array:
    """`values` as a read-only float64 array of `shape` (None: any length); raises MechlabError that names
    `what`."""
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise MechlabError(f"{what}: expected numbers of shape {shape}, got {type(values).__name__}.") from None
    matches = array.ndim == len(shape) and all(
        want in (None, got) for want, got in zip(shape, array.shape, strict=True)
    )
    if not matches:
        expected = str(tuple("any" if n is None else n for n in shape)).replace("'", "")
        raise MechlabError(f"{what}: expected shape {expected}, got {array.shape}.")
    if finite and not np.all(np.isfinite(array)):
        first = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise MechlabError(f"{what}: every number must be finite, but {what}{list(first)} is {array[first]}.")
    array.flags.writeable = False
    return array


def check_rigid(matrices: Array, what: str) -> None:
    """Raises MechlabError unless every (4, 4) matrix is a rotation and a translation."""
    rotation = matrices[..., :3, :3]
    error = np.abs(rotation @ np.swapaxes(rotation, -1, -2) - np.eye(3)).max(axis=(-1, -2))
    error = np.maximum(error, np.abs(np.linalg.det(rotation) - 1.0))
    error = np.maximum(error, np.abs(matrices[..., 3, :] - [0.0, 0.0, 0.0, 1.0]).max(axis=-1))
    if error.size and error.max() > RIGID_TOLERANCE:
        where = [int(i) for i in np.unravel_index(int(error.argmax()), error.shape)]
        raise MechlabError(
            f"{what}{where}: not a rigid placement (error {error.max():.1e}, limit {RIGID_TOLERANCE:.0e}); "
            "expected [[R, p], [0, 0, 0, 1]] with a proper rotation R."
        )
