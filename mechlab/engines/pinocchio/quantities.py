"""Quantities by name: joints, shafts, and coordinates of frames, with their rows and biases over the rates; and the Jacobian of a frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.pinocchio.constraints import PinConstraints
from mechlab.engines.pinocchio.kinematics import PinKinematics
from mechlab.errors import MechlabError, unknown
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array, quaternion_exp, quaternion_to_matrix, rotation_log
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Frame
from mechlab.mechanism.singularity import singularity
from mechlab.mechanism.structure import null_space

LINEAR, ANGULAR, ROTATION = "xyz", ("wx", "wy", "wz"), "rotation"


@dataclass(frozen=True)
class PoseQuantity:
    """A name resolved: a joint or shaft (`frame` None), or a coordinate of a frame. `part`: "x", "y", "z" (position),
    "wx", "wy", "wz" (rate of turning only), "rotation" (a (3, 3) matrix, frame axes to world)."""

    name: str
    frame: Frame | None = None
    part: str = ""

    @property
    def rows(self) -> int:
        """Number of scalar conditions it makes."""
        return 3 if self.part == ROTATION else 1


def resolve(mechanism: Mechanism, name: str) -> PoseQuantity:
    """The quantity of that name: JOINT, SHAFT, FRAME_x _y _z, FRAME_wx _wy _wz or FRAME_rotation. Joints and shafts go
    first. Raises MechlabError that lists what exists."""
    if name in mechanism.scalar_names:
        return PoseQuantity(name)
    for frame in mechanism.frames:
        part = name.removeprefix(f"{frame.name}_")
        if part != name and (part in (*LINEAR, *ANGULAR, ROTATION)) and part:
            return PoseQuantity(name, frame, part)
    frames = [f"{f.name}_{p}" for f in mechanism.frames for p in (*LINEAR, *ANGULAR, ROTATION)]
    raise unknown(f"{mechanism.name}: quantity", name, [*mechanism.scalar_names, *frames])


class Quantities:
    """Values, rows (J of the quantity) and biases (dJ/dt v) of quantities at the state of a PinKinematics."""

    def __init__(self, kin: PinKinematics, names: list[str]) -> None:
        self.kin = kin
        self.items = [resolve(kin.mechanism, n) for n in names]
        m = kin.mechanism
        self._columns = m.q_columns
        self._zero = {i.name: m.zero(i.name) for i in self.items if i.frame is None}
        self._zeros = np.array([self._zero[i.name] for i in self.items if i.frame is None])
        self._plain = all(i.frame is None for i in self.items)
        self._rows = np.array([m.row(i.name) for i in self.items if i.frame is None]).reshape(-1, m.nv)

    def frame_pose(self, frame: Frame) -> tuple[Array, Array]:
        """Rotation (3, 3) and position (3,) of a frame in the world."""
        rotation, origin = self.kin.pose(frame.body)
        return rotation @ frame.placement.rotation, origin + rotation @ frame.placement.translation

    def value(self, item: PoseQuantity) -> Array | float:
        """Physical value: zero + coordinate, a position [m], or a rotation matrix."""
        if item.frame is None:
            row = self.kin.mechanism.row(item.name)
            return self._zero[item.name] + float(row @ self.kin.q[self._columns])
        rotation, position = self.frame_pose(item.frame)
        if item.part == ROTATION:
            return rotation
        if item.part in ANGULAR:
            raise MechlabError(f"{item.name} is a rate of turning and has no value; give {item.frame.name}_rotation.")
        return float(position[LINEAR.index(item.part)])

    def difference(self, item: PoseQuantity, target: ArrayLike) -> Array:
        """(rows,) value - target; for a rotation the rotation vector in world axes of R R_target^T [rad]."""
        value = self.value(item)
        if item.part == ROTATION:
            return rotation_log(np.asarray(value) @ np.asarray(target, dtype=float).T)
        return np.array([float(value) - float(target)])  # type: ignore[arg-type]

    def differences(self, targets: Sequence[Any]) -> Array:
        """(total rows,) `difference` of all quantities, in order."""
        if self._plain:
            return np.asarray(self._rows @ self.kin.q[self._columns] + np.subtract(self._zeros, targets))
        return np.concatenate([self.difference(i, x) for i, x in zip(self.items, targets, strict=True)])

    def jacobian(self) -> Array:
        """(total rows, nv) of all quantities, in order."""
        if self._plain:
            return self._rows
        full: dict[str, Array] = {}
        out = []
        for item in self.items:
            if item.frame is None:
                out.append(self.kin.mechanism.row(item.name)[None, :])
                continue
            name = item.frame.name
            if name not in full:
                full[name] = self.kin.jacobian(item.frame.body, self.frame_pose(item.frame)[1])
            out.append(full[name][_part_rows(item.part)])
        return np.concatenate(out) if out else np.zeros((0, self.kin.mechanism.nv))

    def bias(self) -> Array:
        """(total rows,) dJ/dt v of all quantities, in order."""
        out = []
        for item in self.items:
            if item.frame is None:
                out.append(np.zeros(1))
            else:
                out.append(self.kin.bias(item.frame.body, self.frame_pose(item.frame)[1])[_part_rows(item.part)])
        return np.concatenate(out) if out else np.zeros(0)


def _part_rows(part: str) -> slice:
    if part == ROTATION:
        return slice(3, 6)
    k = LINEAR.index(part) if part in LINEAR else 3 + ANGULAR.index(part)
    return slice(k, k + 1)


def interpolate(item: PoseQuantity, start: Array | float, end: ArrayLike, s: float) -> ArrayLike:
    """The target on the way from `start` (s = 0) to `end` (s = 1): a straight line, or a turn about one axis."""
    if item.part != ROTATION:
        return float(start) + s * (float(end) - float(start))  # type: ignore[arg-type]

    first = np.asarray(start)
    turn = rotation_log(np.asarray(end, dtype=float) @ first.T)
    return np.asarray(quaternion_to_matrix(quaternion_exp(s * turn)) @ first)


def check_target(item: PoseQuantity, target: ArrayLike) -> None:
    """Raises MechlabError for a target that is not finite, not a number, or not a rotation matrix where one is
    needed."""
    try:
        array = np.asarray(target, dtype=float)
    except (TypeError, ValueError):
        raise MechlabError(f"{item.name}: expected a number, got {target!r}.") from None
    if not np.all(np.isfinite(array)):
        raise MechlabError(f"{item.name}: expected a finite number, got {target!r}.")
    if item.part == ROTATION:
        if array.shape != (3, 3) or np.abs(array @ array.T - np.eye(3)).max() > 1e-9 or np.linalg.det(array) < 0:
            raise MechlabError(f"{item.name}: expected a (3, 3) rotation matrix, frame axes to world.")
    elif array.shape != ():
        raise MechlabError(f"{item.name}: expected one number, got {target!r}.")
    if item.part in ANGULAR:
        raise MechlabError(f"{item.name} is a rate of turning and cannot be assembled; give FRAME_rotation.")


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
