"""The path of a mechanism with one freedom: closed poses and their first two derivatives along one coordinate."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.motions import TreeMotions
from mechlab.errors import MechlabError, NoSolution
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics, integrate
from mechlab.mechanism.closing import close_many
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_rows import ManyRows
from mechlab.mechanism.structure import structure
from mechlab.mechanism.tree import no_joints

STRIDE = 0.1
"""No coordinate moves farther in one step [rad or m]."""

SHORTEST = 1e-9
CLOSED = 1e-13
TOGETHER = 8
"""Places from which on it pays to close them together."""
A_TURN = 25
"""Places of a turn that are closed together before it is followed."""
SLOPE_LIMIT = 1e5
"""A joint that moves so much faster than the coordinate marks a limit position."""


@dataclass(frozen=True)
class PathPoint:
    """A closed pose: coordinate phi, q (nq,), u = dv/dphi' (nv,) and du = du/dphi (nv,): v = u phi', a = u phi'' +
    du phi'^2."""

    phi: float
    q: Array
    u: Array
    du: Array


class ClosedPath:
    """The path through a closed pose (default: the reference), along the joint or shaft `coordinate`.

    Poses far from known ones are reached in small steps that keep the assembly mode: a predictor of second order, then
    Newton; a step whose correction is not small is halved. Raises MechlabError when the mechanism has not exactly one
    freedom, NoSolution where the coordinate reaches a limit position.
    """

    def __init__(self, mechanism: Mechanism, coordinate: str, q: ArrayLike | None = None) -> None:
        freedoms = structure(mechanism).freedoms
        if freedoms != 1:
            raise MechlabError(
                f"{mechanism.name}: it has {freedoms} degrees of freedom; one_freedom and cycle need exactly 1. "
                "Several joints are led at once by `mechlab track`, or by given values in `mechlab sweep`."
            )
        self.mechanism, self.coordinate = mechanism, coordinate
        self.row = mechanism.row(coordinate)
        self.tree, self.constraints = TreeKinematics(mechanism), ConstraintSet(mechanism)
        start = mechanism.reference() if q is None else np.array(q, dtype=float)
        first = self._point(float(mechanism.value(coordinate, start)), start)
        if first is None:
            raise NoSolution(
                f"{mechanism.name}: in this pose {coordinate} does not set the motion: a limit position. Try another joint."
            )
        self.start = first
        self._phis, self._points = [first.phi], [first]

    def at(self, phi: float) -> PathPoint:
        """The path at phi [rad or m]."""
        here = self._nearest(phi)
        while here.phi != phi:
            here = self._step(here, phi)
            k = bisect_left(self._phis, here.phi)
            self._phis.insert(k, here.phi)
            self._points.insert(k, here)
        return here

    def at_all(self, phis: ArrayLike) -> list[PathPoint]:
        """The path at many places (n,): those that are regular are closed together, the others one after the other."""
        wanted = np.asarray(phis, dtype=float)
        known = set(self._phis)
        new = np.array([phi for phi in dict.fromkeys(wanted.tolist()) if phi not in known])
        if len(new) >= TOGETHER:
            self._prepare(new)
        return [self.at(float(phi)) for phi in wanted]

    def _prepare(self, phis: Array) -> None:
        """Add the points of the path at phis (n,) that close and are regular, as `_point` asks for."""
        m = self.mechanism
        led = close_many(ManyRows(m, [self.coordinate]), self.start.q, [phis])
        phis, q = phis[led.closed], led.q[led.closed]
        if not len(phis):
            return
        found = TreeMotions(m).at(q, {self.coordinate: 1.0}, {self.coordinate: 0.0})
        fine = found.solved & (np.max(np.abs(found.v), axis=1) <= SLOPE_LIMIT)
        # as between the steps of `at`: rates do not jump from one place to the next
        order = np.argsort(phis)
        apart = np.max(np.abs(np.diff(found.v[order], axis=0)), axis=1, initial=0.0)
        sizes = np.max(np.abs(found.v[order]), axis=1)
        jumps = apart > 0.5 * np.minimum(sizes[:-1], sizes[1:]) + 0.5
        if np.any(jumps):
            return
        for k in np.flatnonzero(fine).tolist():
            place = bisect_left(self._phis, float(phis[k]))
            self._phis.insert(place, float(phis[k]))
            self._points.insert(place, PathPoint(float(phis[k]), q[k], found.v[k], found.a[k]))

    def _nearest(self, phi: float) -> PathPoint:
        k = bisect_left(self._phis, phi)
        around = self._points[max(0, k - 1) : k + 1]
        return min(around, key=lambda p: abs(p.phi - phi))

    def _step(self, here: PathPoint, phi: float) -> PathPoint:
        """One accepted step towards phi."""
        size = STRIDE / max(1.0, float(np.max(np.abs(here.u))))
        while size > SHORTEST:
            d = float(np.clip(phi - here.phi, -size, size))
            goal = phi if d == phi - here.phi else here.phi + d
            moved = here.u * d + 0.5 * here.du * d * d
            q = self._close(goal, integrate(self.mechanism, here.q, moved), 0.2 * float(np.max(np.abs(moved))))
            found = None if q is None else self._point(goal, q)
            if found is not None and np.max(np.abs(found.u - here.u)) <= 0.5 * np.max(np.abs(here.u)) + 0.5:
                return found
            size = 0.25 * min(size, abs(d))
        raise NoSolution(
            f"{self.mechanism.name}: {self.coordinate} cannot be moved beyond {here.phi:.9g}: a limit position, or a place "
            "where assembly modes meet."
        )

    def _close(self, phi: float, q: Array, room: float) -> Array | None:
        """Newton onto the constraints at phi; None when it needs more correction than `room`."""
        m, total, size = self.mechanism, 0.0, np.inf
        for _ in range(12):
            self.tree.set(q)
            off = float(m.value(self.coordinate, q)) - phi
            residual = np.append(self.constraints.residual(self.tree), off)
            before, size = size, float(np.max(np.abs(residual)))
            if size < CLOSED or (size < 1e-11 and size >= before):
                return q
            matrix = np.vstack([self.constraints.jacobian(self.tree), self.row])
            dv = np.asarray(-np.linalg.lstsq(matrix, residual, rcond=1e-12)[0])
            total += float(np.max(np.abs(dv)))
            if not total <= room + 1e-9:
                return None
            q = integrate(m, q, dv)
        return None

    def _point(self, phi: float, q: Array) -> PathPoint | None:
        """Derivatives of the path at a closed pose; None where the coordinate does not set the motion."""
        self.tree.set(q)
        matrix = np.vstack([self.constraints.jacobian(self.tree), self.row])
        right = np.zeros(len(matrix))
        right[-1] = 1.0
        inverse = np.linalg.pinv(matrix, rcond=1e-12)
        u = inverse @ right
        if np.max(np.abs(matrix @ u - right)) > 1e-8 or np.max(np.abs(u)) > SLOPE_LIMIT:
            return None
        self.tree.set(q, u)
        right = np.append(-self.constraints.bias(self.tree), 0.0)
        return PathPoint(phi, q, u, inverse @ right)

    def full_turn(self) -> Array | None:
        """(nq,) what a full turn of the coordinate adds to q, when the mechanism is back in its pose after it; else None.

        None too for a slide, and where a limit position comes before.
        """
        m = self.mechanism
        if self.coordinate not in m.v_slice or m.joint(self.coordinate).kind != "revolute":
            return None
        phis = np.linspace(self.start.phi, self.start.phi + 2.0 * np.pi, A_TURN)[1:]
        if phis[-1] not in self._phis:
            self._prepare(phis)
        try:
            last = self.at(float(phis[-1]))
        except NoSolution:
            return None
        moved = last.q - self.start.q
        for joint in m.joints:
            s = m.q_slice[joint.name]
            turns = np.round(moved[s] / (2.0 * np.pi)) * 2.0 * np.pi if joint.kind == "revolute" else 0.0
            if np.max(np.abs(moved[s] - turns)) > 1e-8:
                return None
            moved[s] = turns
        return np.asarray(moved)

    def limits(self, reach: float = 2.0 * np.pi) -> tuple[float, float]:
        """How far the coordinate can go from the start, down and up, at most `reach` either way [rad or m]."""
        ends = []
        for sign in (-1.0, 1.0):
            far = self.start.phi + sign * reach
            try:
                self.at(far)
            except NoSolution:
                far = self._phis[0] if sign < 0 else self._phis[-1]
            ends.append(far)
        return ends[0], ends[1]


def choose_path(
    mechanism: Mechanism, q: ArrayLike | None = None, prefer: Sequence[str] = ()
) -> tuple[ClosedPath, Array | None]:
    """The path along the first coordinate that turns fully (with what a turn adds to q), else along the first that sets
    the motion; in the order: `prefer`, the drives, all joints. Raises as `ClosedPath`, naming what was tried."""
    names = list(
        dict.fromkeys([*prefer, *(d.on for d in mechanism.drives), *(j.name for j in mechanism.joints if j.nv == 1)])
    )
    first: ClosedPath | None = None
    for name in names:
        try:
            path = ClosedPath(mechanism, name, q)
        except NoSolution:
            continue
        turn = path.full_turn()
        if turn is not None:
            return path, turn
        first = first or path
    if first is None:
        if not mechanism.nv:
            raise no_joints(mechanism.name)
        raise NoSolution(f"{mechanism.name}: none of {', '.join(names)} sets the motion in this pose: it is singular.")
    return first, None
