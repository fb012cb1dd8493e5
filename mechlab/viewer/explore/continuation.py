"""Following the closed poses of a mechanism along their arc, on which folds are regular points.

Pseudo-arclength continuation (Keller 1977): instead of the drive, the distance along the curve is the parameter. The
tangent of the curve replaces the row of the moving drive, so that the equations stay regular where the drive
reaches a limit position. Many curves, and many points of one, are followed at once: `Closing` holds the equations of
a mechanism with its drives held, at many poses.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import MechlabError
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics, structure
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_poses import ManyPoses, displacement, moved, rotation_vectors
from mechlab.mechanism.structure import generic, independent_rows, rank

CLOSED = 1e-11
"""Residual [m, rad] below which a pose counts as closed after Newton's method."""


class Closing:
    """Square equations of a mechanism with its drives held: independent closure rows, then the rows of `drives`, then
    `held` rows that keep at home what these leave free; as many as there are rates.

    With N (nv, k) the motions left free and d(q) (nv,) the displacement from home, the held rows are N^T d = 0.
    Raises MechlabError where the drives are not independent of the constraints.
    """

    def __init__(self, mechanism: Mechanism, drives: tuple[str, ...], size: float) -> None:
        self.mechanism, self.drives = mechanism, drives
        self.many = ManyPoses(mechanism)
        self.home = mechanism.reference()
        constraints = ConstraintSet(mechanism)
        self.keep = independent_rows(mechanism, constraints)
        self.drive_rows = np.array([mechanism.row(n) for n in drives]).reshape(len(drives), mechanism.nv)
        self.home_values = np.array([mechanism.value(n, self.home) for n in drives])
        self.held = self._left_free(constraints)
        self.first_drive = len(self.keep)
        if len(self.keep) + len(drives) + len(self.held) != mechanism.nv:
            raise MechlabError(
                f"{mechanism.name}: the drives {', '.join(drives)} hold each other; none can be moved while the others rest."
            )
        self.scale = np.ones(mechanism.nv)
        """Length of a unit of each coordinate: 1 for turns, 1 / size for slides."""
        for joint in mechanism.joints:
            if joint.kind == "prismatic":
                self.scale[mechanism.v_slice[joint.name]] = 1.0 / size

    def _left_free(self, constraints: ConstraintSet) -> Array:
        m = self.mechanism
        matrix = np.vstack([constraints.jacobian(TreeKinematics(m)), self.drive_rows])
        with_drives = rank(np.vstack([generic(m)[1], self.drive_rows]))
        free = m.nv - max(structure(m).rank, with_drives)
        return np.asarray(np.linalg.svd(matrix)[2][m.nv - free :])

    def values(self, q: Array) -> Array:
        """(n, drives) values at q (n, nq)."""
        return np.column_stack([self.mechanism.value(n, q) for n in self.drives])

    def equations(self, q: Array) -> tuple[Array, Array, Array]:
        """Residuals (n, nv), those of the drives from their home values; Jacobian (n, nv, nv); largest residual (n,) of
        all closure rows, redundant ones included."""
        m, n = self.mechanism, len(q)
        residual, jacobian = self.many.set(q).residual_and_jacobian()
        worst = np.abs(residual).max(axis=1, initial=0.0)
        held, held_jacobian = self._held(q)
        drives = np.broadcast_to(self.drive_rows, (n, *self.drive_rows.shape))
        out = np.concatenate([residual[:, self.keep], self.values(q) - self.home_values, held], axis=1)
        return (
            out,
            np.concatenate([jacobian[:, self.keep], drives, held_jacobian], axis=1).reshape(n, m.nv, m.nv),
            worst,
        )

    def _held(self, q: Array) -> tuple[Array, Array]:
        m, n = self.mechanism, len(q)
        offset = displacement(m, np.broadcast_to(self.home, q.shape), q)
        jacobian = np.tile(self.held, (n, 1, 1))
        if len(self.held):
            for joint in m.joints:
                if joint.kind == "spherical":
                    s = m.v_slice[joint.name]
                    jacobian[:, :, s] = self.held[:, s] @ right_jacobian_inverses(
                        rotation_vectors(q[:, m.q_slice[joint.name]])
                    )
        return offset @ self.held.T, jacobian

    def distances(self, q: Array) -> Array:
        """(n,) smallest singular value of the rows, each divided by its largest size over q: 0 where modes meet."""
        jacobian = self.equations(q)[1]
        return smallest_values(jacobian, row_sizes(jacobian))


def row_sizes(jacobians: Array) -> Array:
    """(k,) largest length of each row of matrices (n, k, k): a row that vanishes somewhere is not hidden by scaling."""
    return np.asarray(np.maximum(np.linalg.norm(jacobians, axis=2).max(axis=0), 1e-12))


def smallest_values(jacobians: Array, sizes: Array) -> Array:
    """(n,) smallest singular values of matrices (n, k, k) whose rows are divided by `sizes` (k,)."""
    return np.asarray(np.linalg.svd(jacobians / sizes[:, None], compute_uv=False)[:, -1])


def right_jacobian_inverses(vectors: Array) -> Array:
    """(n, 3, 3): rates of rotation vectors (n, 3) from angular velocities in the body (Chirikjian 2012, 10.86)."""
    hat = np.zeros((len(vectors), 3, 3))
    hat[:, 2, 1], hat[:, 0, 2], hat[:, 1, 0] = vectors.T
    hat -= np.swapaxes(hat, 1, 2)
    angle = np.linalg.norm(vectors, axis=1)
    safe = np.maximum(angle, 1e-4)
    factor = 1.0 / safe**2 - (1.0 + np.cos(safe)) / (2.0 * safe * np.sin(safe))
    return np.asarray(np.eye(3) + 0.5 * hat + np.where(angle < 1e-4, 1.0 / 12.0, factor)[:, None, None] * (hat @ hat))


LONGEST, SHORTEST = 1.0, 1e-6  # steps along a curve, in rad or sizes of the mechanism
BEND = 0.25
"""Largest turn of the tangent in one step [rad]."""
MOST_STEPS = 4000

# How a lane ends: its drive is at `last`, its drive turns back, assembly modes meet.
END, FOLD, MEET = "end", "fold", "meet"


@dataclass
class Lane:
    """One drive moved in one sense, `way` = +1 or -1, until it has the value `last` [rad or m].

    q, tangent: poses and tangents of the curve so far; step: length of the next step; turning: change of the tangent
    per length; ended: END, FOLD or MEET, "" while it goes on.
    """

    drive: int
    way: float
    last: float
    q: list[Array]
    tangent: list[Array]
    step: float = 0.05
    turning: Array = field(default_factory=lambda: np.zeros(0))
    ended: str = ""


def norms(closing: Closing, dv: Array) -> Array:
    """(n,) lengths of displacements (n, nv), slides measured in sizes of the mechanism."""
    return np.asarray(np.linalg.norm(dv * closing.scale, axis=-1))


def correct(
    closing: Closing, q: Array, drives: Array, border: Array, target: Array | None = None
) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Closed coordinates near q (n, nq): at right angles to the rows `border` (n, nv), or drives at `target` (n,).

    drives: (n,) which drive moves. Returns q, its Jacobian (n, nv, nv) with the border in place, how far each moved (n,)
    and whether it closed (n,).
    """
    start, row, each = q, closing.first_drive + drives, np.arange(len(q))
    moves = np.zeros(len(q))
    for _ in range(9):
        residual, jacobian, _ = closing.equations(q)
        jacobian[each, row] = border
        offset = residual[each, row] + closing.home_values[drives] - (0.0 if target is None else target)
        residual[each, row] = 0.0 if target is None else offset
        dv = -solve(jacobian, residual)
        q = moved(closing.mechanism, q, dv)
        moves = norms(closing, dv)
        if float(moves.max(initial=0.0)) < 1e-12:
            break
    _, jacobian, worst = closing.equations(q)
    jacobian[each, row] = border
    closed = np.isfinite(worst) & (worst < CLOSED) & (moves < 1e-8)
    return q, jacobian, norms(closing, displacement(closing.mechanism, start, q)), closed


def solve(matrices: Array, right: Array) -> Array:
    """(n, k) solutions; for a singular matrix the one of least norm."""
    try:
        return np.asarray(np.linalg.solve(matrices, right[..., None])[..., 0])
    except np.linalg.LinAlgError:
        return np.asarray((np.linalg.pinv(matrices, rcond=1e-13) @ right[..., None])[..., 0])


def tangents(closing: Closing, jacobian: Array, drives: Array) -> Array:
    """(n, nv) directions of unit length, along the border rows that stand in the Jacobian."""
    right = np.zeros(jacobian.shape[:2])
    right[np.arange(len(drives)), closing.first_drive + drives] = 1.0
    found = solve(jacobian, right)
    return found / np.maximum(norms(closing, found), 1e-300)[:, None]


def follow_lanes(closing: Closing, lanes: list[Lane]) -> None:
    """Follows every lane until its drive is at `last`, at a fold, or where assembly modes meet; fills q, tangent, ended."""
    drives = np.array([x.drive for x in lanes])
    jacobian = closing.equations(np.array([x.q[-1] for x in lanes]))[1]
    first = tangents(closing, jacobian, drives)
    for lane, t in zip(lanes, first, strict=True):
        lane.tangent, lane.turning = [t * lane.way], np.zeros(len(t))
        if not np.all(np.isfinite(t)) or closing.drive_rows[lane.drive] @ t <= 1e-9:
            lane.ended = MEET
    signs = {id(x): _sign(closing, x.q[-1], x.drive, x.tangent[-1]) for x in lanes}
    for _ in range(MOST_STEPS):
        going = [x for x in lanes if not x.ended]
        if not going:
            return
        _step(closing, going, signs)
    for lane in lanes:
        lane.ended = lane.ended or MEET


def _sign(closing: Closing, q: Array, drive: int, tangent: Array) -> float:
    """Sign of the determinant with the tangent as border: it changes only where two curves cross."""
    jacobian = closing.equations(q[None])[1][0]
    jacobian[closing.first_drive + drive] = tangent * closing.scale**2
    return float(np.linalg.slogdet(jacobian)[0])


def _ahead(closing: Closing, lane: Lane, step: float) -> Array:
    return step * (lane.tangent[-1] + 0.5 * step * lane.turning)


def _step(closing: Closing, going: list[Lane], signs: dict[int, float]) -> None:
    m = closing.mechanism
    drives = np.array([x.drive for x in going])
    here, before = np.array([x.q[-1] for x in going]), np.array([x.tangent[-1] for x in going])
    ahead = np.array([_ahead(closing, x, x.step) for x in going])
    q, jacobian, off, closed = correct(closing, moved(m, here, ahead), drives, before * closing.scale**2)
    after = tangents(closing, jacobian, drives)
    cosine = np.einsum("ni,ni->n", after * closing.scale, before * closing.scale)
    sign = np.linalg.slogdet(jacobian)[0]
    for i, lane in enumerate(going):
        if not (closed[i] and off[i] <= 0.1 * lane.step + 1e-9 and cosine[i] > np.cos(BEND)):
            lane.step *= 0.5
            if lane.step < SHORTEST:
                lane.ended = MEET
            continue
        row = closing.drive_rows[lane.drive]
        value = float(closing.values(q[i : i + 1])[0, lane.drive])
        if (value - lane.last) * lane.way >= 0.0:
            _finish(closing, lane, q[i], after[i])
        elif row @ after[i] * lane.way <= 0.0:
            _fold(closing, lane)
        elif sign[i] != signs[id(lane)]:
            if lane.step < 1e-3:
                lane.ended = MEET
            lane.step *= 0.5
        else:
            lane.turning = (after[i] - before[i]) / lane.step
            lane.q.append(q[i])
            lane.tangent.append(after[i])
            lane.step = min(LONGEST, lane.step * (1.6 if off[i] < 0.02 * lane.step and cosine[i] > 0.995 else 1.0))


def _finish(closing: Closing, lane: Lane, q: Array, tangent: Array) -> None:
    """End the lane at the point between its latest point and q where the drive has the value `last`."""
    start, drive = lane.q[-1], np.array([lane.drive])
    values = closing.values(np.array([start, q]))[:, lane.drive]
    share = (lane.last - values[0]) / (values[1] - values[0])
    guess = moved(closing.mechanism, start[None], share * displacement(closing.mechanism, start[None], q[None]))
    row = closing.drive_rows[lane.drive][None]
    found, jacobian, _, closed = correct(closing, guess, drive, row, np.array([lane.last]))
    if not closed[0]:
        lane.step *= 0.5
        lane.ended = MEET if lane.step < SHORTEST else ""
        return
    lane.q.append(found[0])
    lane.tangent.append(tangents(closing, jacobian, drive)[0] * lane.way)
    lane.ended = END


def _fold(closing: Closing, lane: Lane) -> None:
    """End the lane at the fold, where the drive is stationary along the curve (Illinois rule of false position)."""
    drive, border = np.array([lane.drive]), (lane.tangent[-1] * closing.scale**2)[None]
    row = closing.drive_rows[lane.drive] * lane.way

    def at(step: float) -> tuple[float, Array, Array]:
        guess = moved(closing.mechanism, lane.q[-1][None], _ahead(closing, lane, step)[None])
        q, jacobian, _, _ = correct(closing, guess, drive, border)
        t = tangents(closing, jacobian, drive)[0]
        return float(row @ t), q[0], t

    (low, high), f_low, f_high = (0.0, lane.step), float(row @ lane.tangent[-1]), at(lane.step)[0]
    q, t = lane.q[-1], lane.tangent[-1]
    for _ in range(60):
        middle = (low * f_high - high * f_low) / (f_high - f_low)
        f, q, t = at(middle)
        if abs(f) < 1e-13 or high - low < 1e-14:
            break
        if f > 0:
            low, f_low, f_high = middle, f, 0.5 * f_high
        else:
            high, f_high, f_low = middle, f, 0.5 * f_low
    if middle > 1e-9:
        lane.q.append(q)
        lane.tangent.append(t)
    lane.ended = FOLD
