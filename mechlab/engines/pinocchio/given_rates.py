"""Rates and accelerations that meet the constraints and have given values, on Pinocchio: one pose, and a kept state for many."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.motions import KeptMotions
from mechlab.engines.pinocchio.constraints import PinConstraints
from mechlab.engines.pinocchio.kinematics import PinKinematics, frame_state
from mechlab.engines.pinocchio.quantities import Quantities
from mechlab.errors import MechlabError, NoSolution
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kept import LastKept
from mechlab.mechanism.model import Mechanism


class PinState:
    """A mechanism on Pinocchio at one state; keeps its workspace. Implements `mechlab.engines.motions.KeptState`."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.kin = PinKinematics(mechanism)
        self.constraints = PinConstraints(self.kin)
        self._items: dict[tuple[str, ...], Quantities] = {}

    def start(self, q: Array) -> Array:
        """q (nq,) itself."""
        return q

    def place(self, x: Array) -> None:
        """Move to coordinates at rest."""
        self.kin.set(x)

    def move(self, x: Array, u: Array) -> None:
        """Move to coordinates and rates."""
        self.kin.set(x, u)

    def items(self, names: Sequence[str]) -> Quantities:
        """Values, rows and biases of the names."""
        key = tuple(names)
        if key not in self._items:
            self._items[key] = Quantities(self.kin, list(key))
            if any(i.rows != 1 for i in self._items[key].items):
                raise MechlabError("a rotation has no scalar rate; give FRAME_wx, FRAME_wy, FRAME_wz instead.")
        return self._items[key]

    def rate_rows(self, names: Sequence[str]) -> Array:
        """(m, nv) rows of loops and relations, then of the names."""
        return np.concatenate([self.constraints.evaluate()[1], self.items(names).jacobian()])

    def accel_rows(self, names: Sequence[str]) -> tuple[Array, Array]:
        """(m, nv) rows and (m,) dJ/dt v."""
        return self.rate_rows(names), np.concatenate([self.constraints.bias(), self.items(names).bias()])

    def frame(self, name: str) -> tuple[Array, Array, Array, Array]:
        """Pose, velocity, Jacobian and dJ/dt v of a Frame."""
        return frame_state(self.kin, name)

    def rates(self, u: Array) -> Array:
        """(..., nv) themselves."""
        return u


_KEPT, _MOTIONS = LastKept(), LastKept()


def kept_state(mechanism: Mechanism) -> PinState:
    """A PinState; the last few of each thread are kept, by identity of the mechanism."""
    return _KEPT.get(PinState, mechanism)


def kept_motions(mechanism: Mechanism) -> KeptMotions:
    """Motions at many poses; the last few of each thread are kept."""
    return _MOTIONS.get(lambda m: KeptMotions(kept_state(m)), mechanism)


def rates(mechanism: Mechanism, q: ArrayLike, given: Mapping[str, float]) -> Array:
    """(nv,) rates that meet the constraints and give the quantities in `given` (joints, shafts, FRAME_x, FRAME_wx, ...)
    their rates; the smallest where a freedom is left.

    Raises NoSolution when the given rates contradict the constraints (also at a singular position).
    """
    state = kept_state(mechanism)
    state.place(np.asarray(q, dtype=float))
    matrix = state.rate_rows(tuple(given))
    wanted = _flat(given)
    right = np.concatenate([np.zeros(len(matrix) - len(wanted)), wanted])
    return _meet(mechanism, matrix, right, list(given), "rates")


def accelerations_of(mechanism: Mechanism, q: ArrayLike, v: ArrayLike, given: Mapping[str, float]) -> Array:
    """(nv,) accelerations that meet the constraints at rates v and give the quantities in `given` their accelerations;
    the smallest where a freedom is left. Raises NoSolution when they contradict the constraints."""
    state = kept_state(mechanism)
    state.kin.set(q, v)
    matrix, bias = state.accel_rows(tuple(given))
    wanted = _flat(given)
    right = np.concatenate([np.zeros(len(matrix) - len(wanted)), wanted]) - bias
    return _meet(mechanism, matrix, right, list(given), "accelerations")


def quantity_rates(
    mechanism: Mechanism, q: ArrayLike, v: ArrayLike, a: ArrayLike, names: Sequence[str]
) -> tuple[dict[str, float], dict[str, float]]:
    """Rates and accelerations of quantities by name from v (nv,) and a (nv,)."""
    kin = PinKinematics(mechanism, q, v)
    items = Quantities(kin, list(names))
    rows = items.jacobian()
    first, second = rows @ np.asarray(v, dtype=float), rows @ np.asarray(a, dtype=float) + items.bias()
    return dict(zip(names, first.tolist(), strict=True)), dict(zip(names, second.tolist(), strict=True))


def _flat(given: Mapping[str, float]) -> Array:
    values = np.array([float(x) for x in given.values()])
    if not np.all(np.isfinite(values)):
        raise MechlabError(f"expected finite numbers, got {dict(given)!r}.")
    return values


def _meet(mechanism: Mechanism, matrix: Array, right: Array, names: list[str], what: str) -> Array:
    norms = np.sqrt(np.einsum("ij,ij->i", matrix, matrix))
    scale = np.where(norms > 1e-14, norms, 1.0)
    x = np.linalg.lstsq(matrix / scale[:, None], right / scale, rcond=1e-11)[0]
    gap = float(np.max(np.abs(matrix @ x - right), initial=0.0))
    if not gap <= 1e-8 * max(1.0, float(np.max(np.abs(right), initial=0.0))):
        raise NoSolution(
            f"{mechanism.name}: no {what} of the mechanism agree with {', '.join(names)} here (missed by {gap:.3g}): "
            "the position is singular, or more is given than there are degrees of freedom."
        )
    return np.asarray(x)
