"""From drives to output and back: Jacobians through the constraints, conditioning, rates and accelerations of
everything."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.pinocchio.constraints import PinConstraints
from mechlab.engines.pinocchio.kinematics import PinKinematics
from mechlab.engines.pinocchio.quantities import Quantities
from mechlab.errors import MechlabError, NoSolution
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.structure import null_space, singularity


@dataclass(frozen=True)
class OutputJacobian:
    """The linear map between drive rates and the twist of a frame (linear at its origin, angular; world axes).

    matrix (6, drives): twist = matrix @ drive rates. inverse (drives, 6): drive rates from a twist, by all motions
    that the constraints allow, not from `matrix`; a twist that is not allowed is replaced by the nearest. rates (nv,
    drives): all rates. values: singular values of `matrix`. singularities: see `mechlab.mechanism.singularity`. free:
    number of motions left over with the drives held (local freedoms, a parallel singularity).
    """

    frame: str
    drives: tuple[str, ...]
    matrix: Array
    inverse: Array
    rates: Array
    values: Array
    singularities: tuple[str, ...]
    free: int

    @property
    def condition(self) -> float:
        """Largest over smallest singular value of `matrix`, in metres and radians; infinite when singular."""
        if not len(self.values) or self.values[-1] <= 1e-12 * self.values[0]:
            return float("inf")
        return float(self.values[0] / self.values[-1])


def output_jacobian(
    mechanism: Mechanism, q: ArrayLike, frame: str, drives: Sequence[str] | None = None
) -> OutputJacobian:
    """Jacobian from the rates of `drives` (joints or shafts; default: those of the Drives) to the twist of `frame`.

    Solves [J; B] X = [0; 1], rows scaled, smallest X where local freedoms leave a choice; then matrix = J_frame X.
    Raises MechlabError for an unknown name, or no drives.
    """
    names = tuple(drives if drives is not None else [d.on for d in mechanism.drives])
    if not names:
        raise MechlabError(f"{mechanism.name}: it has no drives; name the joints or shafts whose rates are given.")
    kin = PinKinematics(mechanism, q)
    place = mechanism.frame(frame)
    rotation, origin = kin.pose(place.body)
    twist = kin.jacobian(place.body, origin + rotation @ place.placement.translation)
    closure = PinConstraints(kin).jacobian()
    actuation = np.array([mechanism.row(n) for n in names])
    rates, rank = _solve(closure, actuation)
    matrix = twist @ rates
    basis = null_space(closure)
    return OutputJacobian(
        frame=frame,
        drives=names,
        matrix=matrix,
        inverse=actuation @ basis @ np.linalg.pinv(twist @ basis, rcond=1e-10),
        rates=rates,
        values=np.asarray(np.linalg.svd(matrix, compute_uv=False), dtype=float),
        singularities=singularity(mechanism, np.asarray(q, dtype=float), twist),
        free=mechanism.nv - rank,
    )


def _solve(closure: Array, rows: Array) -> tuple[Array, int]:
    """(nv, k) X of least norm with closure @ X = 0, rows @ X = 1 (least squares), and the rank of both together."""
    matrix = np.concatenate([closure, rows])
    norms = np.sqrt(np.einsum("ij,ij->i", matrix, matrix))
    scale = np.where(norms > 1e-14, norms, 1.0)
    right = np.concatenate([np.zeros((len(closure), len(rows))), np.eye(len(rows))])
    x, _, rank, _ = np.linalg.lstsq(matrix / scale[:, None], right / scale[:, None], rcond=1e-10)
    return np.asarray(x, dtype=float), int(rank)


def rates(mechanism: Mechanism, q: ArrayLike, given: Mapping[str, float]) -> Array:
    """(nv,) rates that meet the constraints and give the quantities in `given` (joints, shafts, FRAME_x, FRAME_wx, ...)
    their rates; the smallest where a freedom is left.

    Raises NoSolution when the given rates contradict the constraints (also at a singular position).
    """
    kin = PinKinematics(mechanism, q)
    items = Quantities(kin, list(given))
    closure = PinConstraints(kin).jacobian()
    wanted = _flat(items, given)
    right = np.concatenate([np.zeros(len(closure)), wanted])
    return _meet(mechanism, np.concatenate([closure, items.jacobian()]), right, list(given), "rates")


def accelerations_of(mechanism: Mechanism, q: ArrayLike, v: ArrayLike, given: Mapping[str, float]) -> Array:
    """(nv,) accelerations that meet the constraints at rates v and give the quantities in `given` their accelerations;
    the smallest where a freedom is left. Raises NoSolution when they contradict the constraints."""
    kin = PinKinematics(mechanism, q, v)
    items = Quantities(kin, list(given))
    constraints = PinConstraints(kin)
    right = np.concatenate([-constraints.bias(), _flat(items, given) - items.bias()])
    matrix = np.concatenate([constraints.jacobian(), items.jacobian()])
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


def _flat(items: Quantities, given: Mapping[str, float]) -> Array:
    if any(i.rows != 1 for i in items.items):
        raise MechlabError("a rotation has no scalar rate; give FRAME_wx, FRAME_wy, FRAME_wz instead.")
    values = np.array([float(given[i.name]) for i in items.items])
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
