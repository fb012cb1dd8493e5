"""A branch of closed poses of a mechanism with one freedom, along one of its joints.

Continuation reaches the branch once; after that its poses are closed exactly at many places together.
"""

from __future__ import annotations

from bisect import bisect_left

import numpy as np

from mechlab.errors import NoSolution
from mechlab.experiment.prices import price_of_poses
from mechlab.integrate import count_work
from mechlab.mechanism import Mechanism
from mechlab.mechanism.batch_sparse import SparseClosing
from mechlab.mechanism.batch_tree import BatchRows, BatchTree
from mechlab.mechanism.geometry import Array

STRIDE = 0.3
"""Farthest that any coordinate moves between two poses of the continuation [rad or m]."""
SHORTEST = 5e-2
"""A step of the continuation is given up when it is smaller than this share of its first size."""
CLOSED_TO, NEARLY_CLOSED, EXPLORED_TO = 1e-12, 1e-6, 1e-3
"""Last correction of Newton's method [rad or m]. What it leaves in the pose is its square, in the tangent its first power. For
the continuation alone EXPLORED_TO is enough; the end of a full turn is closed to NEARLY_CLOSED."""
NEAREST = 4
"""Poses of the continuation from which another one is guessed."""
SLOPE_LIMIT = 15.0
"""A limit position of the joint is near where another coordinate moves this many times as fast, per motion of the joint, as at
the start."""
TURN = 2.0 * np.pi
NORMAL_EQUATIONS_LIMIT = 1e-6
"""Largest share of a solution that its step of refinement may change; beyond it the matrix is factored (QR) instead."""


class PoseBranch:
    """Closed poses q(phi) through q0 (nv,), phi being the coordinate of joint number `coordinate`.

    Continuation predicts by the last three poses and tangents and corrects by Newton's method. The prediction carries it through
    poses where assembly modes meet, since the branch itself is smooth there. `turn` (nv,): what a full turn adds to q, once it is
    known; `patience`: how many steps may fail before the joint is given up; `corrected` [rad or m]: the last correction of the poses that
    were closed last, of which the tangents are those before it.
    Raises NoSolution where the joint reaches a limit position.
    """

    def __init__(self, mechanism: Mechanism, q0: Array, coordinate: int, tree: BatchTree, rows: BatchRows) -> None:
        self.mechanism, self.coordinate, self.tree, self.rows = mechanism, coordinate, tree, rows
        self.others = np.array([k for k in range(mechanism.nv) if k != coordinate], dtype=int)
        self.start = float(q0[coordinate])
        self.columns = np.array([*self.others, mechanism.nv, coordinate], dtype=int)
        try:
            self.sparse: SparseClosing | None = SparseClosing(rows, coordinate)
        except ValueError:  # dense equations are cheaper
            self.sparse = None
        self.turn: Array | None = None
        self.patience = 10**9
        self.limit, self.corrected = np.inf, 0.0
        if mechanism.nv == 1:
            self.phi, self.q, self.u = [self.start], [q0], [np.ones(1)]
            return
        q, u = self.close(np.array([self.start]), q0[None])
        self.limit = SLOPE_LIMIT * max(1.0, float(np.max(np.abs(u))))
        self.phi, self.q, self.u = [self.start], [q[0]], [u[0]]

    def seed(self, other: PoseBranch) -> None:
        """Take over the poses of `other`, a branch through the same start along another joint."""
        k = self.coordinate
        q, u = np.array(other.q), np.array(other.u)
        # closing the first pose along the other joint may have moved this one in its last digits
        q[other.first, k] = self.start
        order = np.argsort(q[:, k])
        self.phi = q[order, k].tolist()
        self.q, self.u = list(q[order]), list((u / u[:, k : k + 1])[order])

    @property
    def first(self) -> int:
        """Index of the start among the poses."""
        return bisect_left(self.phi, self.start)

    def close(self, phi: Array, guess: Array, closed: float = CLOSED_TO, near: float = 10.0) -> tuple[Array, Array]:
        """Closed poses q (P, nv) at phi (P,) near `guess`, and tangents u = dq/dphi. Raises NoSolution where they do not
        close, or a correction is larger than `near`."""
        q = np.array(guess, dtype=float)
        q[:, self.coordinate] = phi
        u = np.zeros_like(q)
        u[:, self.coordinate] = 1.0
        if not self.rows.count or not len(self.others):
            return q, u
        for _ in range(8):
            try:
                solved = self._step(q)
            except np.linalg.LinAlgError:
                raise NoSolution(f"{self.mechanism.name}: singular pose on the path") from None
            correction = solved[:, :, 0]
            q[:, self.others] -= correction
            size = max(correction.max(), -correction.min())
            if size < closed:
                self.corrected = float(size)
                u[:, self.others] = -solved[:, :, 1]
                if not max(u.max(), -u.min()) < self.limit:
                    break
                return q, u
            if not size < near:
                break
        raise NoSolution(f"{self.mechanism.name}: the path of {self.name} cannot be followed here")

    def _step(self, q: Array) -> Array:
        """(P, nv - 1, 2) what to subtract from the other coordinates to close the poses, and minus their tangents."""
        if self.sparse is not None:
            count_work(price_of_poses(len(q), self.mechanism.nv, sparse=self.sparse.equations.work))
            found, change = self.sparse.solve(q)
            if _settled(found, change):
                return found
        count_work(price_of_poses(len(q), self.mechanism.nv, solved=True))
        count, system = len(self.others), self.rows.system(q)[:, :, self.columns]
        return _least_squares(system[:, :, :count], system[:, :, count:])

    @property
    def name(self) -> str:
        """Name of the joint along which the branch is followed."""
        return self.mechanism.joints[self.coordinate].name

    def extend(self, sign: int) -> float:
        """Add one pose at the end of the branch in the direction of `sign` and return its phi. Raises NoSolution at a limit."""
        last = range(len(self.phi) - 1, max(-1, len(self.phi) - 4), -1) if sign > 0 else range(min(3, len(self.phi)))
        known = [(self.phi[k], self.q[k], self.u[k]) for k in last]
        phi0, q0, u0 = known[0]
        size = STRIDE / max(1.0, float(np.max(np.abs(u0))))
        first = size
        while size > SHORTEST * first and self.patience > 0:
            phi = phi0 + sign * size
            inside = abs(phi0 - self.start) < TURN - 1e-9
            if self.tree.revolute[self.coordinate] and inside and abs(phi - self.start) > TURN:
                phi = self.start + sign * TURN
            guess = _hermite(known, phi)
            try:
                ends = abs(phi - self.start) > TURN - 1e-9
                # a pose this far from its guess would be refused below
                near = 0.2 * float(np.max(np.abs(guess - q0)))
                q, u = self.close(np.array([phi]), guess[None], NEARLY_CLOSED if ends else EXPLORED_TO, near)
            except NoSolution:
                size *= 0.25
                self.patience -= 1
                continue
            moved, gone, bent, fast = (max(x.max(), -x.min()) for x in (q[0] - guess, q[0] - q0, u[0] - u0, u0))
            if moved <= 0.1 * gone and bent <= 0.5 * fast + 0.5:
                at = len(self.phi) if sign > 0 else 0
                self.phi.insert(at, phi)
                self.q.insert(at, q[0])
                self.u.insert(at, u[0])
                return phi
            size *= 0.25
            self.patience -= 1
        raise NoSolution(f"{self.mechanism.name}: {self.name} cannot be moved beyond {phi0:.9g}: a limit position")

    def sharpen(self) -> None:
        """Close all poses once more, together: the tangents, which are those before the last correction, become as exact as the poses."""
        if self.rows.count and len(self.others):
            q, u = self.close(np.array(self.phi), np.array(self.q), EXPLORED_TO)
            self.q, self.u = list(q), list(u)

    def close_turn(self, sign: int) -> bool:
        """Whether the branch, extended by a full turn, is back in its first pose; then `turn` is known."""
        k = len(self.phi) - 1 if sign > 0 else 0
        if abs(abs(self.phi[k] - self.start) - TURN) > 1e-12:
            return False
        moved = (self.q[k] - self.q[self.first]) * sign
        turns = np.where(self.tree.revolute, np.round(moved / TURN) * TURN, 0.0)
        if np.max(np.abs(moved - turns)) > 1e-8:
            return False
        self.turn = turns
        return True

    def at(self, phi: Array, closed: float = CLOSED_TO) -> tuple[Array, Array]:
        """Closed poses q (P, nv) and tangents u (P, nv) at phi (P,) within the branch, or anywhere once it turns fully."""
        if not self.rows.count and not len(self.others):
            return phi[:, None].copy(), np.ones((len(phi), 1))
        turns = np.zeros(len(phi))
        low, high = self.phi[0], self.phi[-1]
        if self.turn is not None:
            turns = np.where((phi < low) | (phi > high), np.floor((phi - low) / TURN), 0.0)
        inside = phi - turns * TURN
        count = len(self.phi)
        if count == 1:
            guess = self.q[0] + (inside - self.phi[0])[:, None] * self.u[0]
        else:
            guess = _interpolated(np.array(self.phi), np.array(self.q), np.array(self.u), inside)
        q, u = self.close(inside, guess, closed)
        if self.turn is not None:
            q = q + turns[:, None] * self.turn
        return q, u


def next_joint(failed: PoseBranch, left: list[int]) -> int | None:
    """Of the joints left, the one that moves most steadily along the poses that were reached; None when all stop."""
    u = np.array(failed.u)
    steadiness = {k: float(np.min(u[:, k] * np.sign(u[0, k]) / np.max(np.abs(u), axis=1))) for k in left}
    best = max(left, key=lambda k: steadiness[k], default=None)
    return best if best is not None and steadiness[best] > 1.0 / SLOPE_LIMIT else None


def _hermite(known: list[tuple[float, Array, Array]], phi: float) -> Array:
    """The polynomial through up to three poses with their tangents, at phi."""
    out = np.zeros_like(known[0][1])
    for i, (x, q, u) in enumerate(known):
        basis, slope = 1.0, 0.0
        for j, (y, _, _) in enumerate(known):
            if j != i:
                basis *= ((phi - y) / (x - y)) ** 2
                slope += 2.0 / (x - y)
        out += (basis * (1.0 - slope * (phi - x))) * q + (basis * (phi - x)) * u
    return out


def _interpolated(x: Array, q: Array, u: Array, phi: Array) -> Array:
    """(P, nv) at phi (P,) the polynomials through the nearest poses q (n, nv) at x (n,), rising, with their tangents u, up to NEAREST."""
    near = min(NEAREST, len(x))
    first = np.minimum(np.maximum(np.searchsorted(x, phi) - near // 2, 0), len(x) - near)
    which = first[:, None] + np.arange(near)
    places = x[which]
    apart = places[:, :, None] - places[:, None, :] + np.eye(near)
    ways = phi[:, None] - places
    factors = np.where(np.eye(near, dtype=bool), 1.0, ways[:, None, :] / apart)
    basis = factors.prod(axis=2) ** 2
    slopes = 2.0 * ((1.0 / apart).sum(axis=2) - 1.0)
    weights = np.concatenate([basis * (1.0 - slopes * ways), basis * ways], axis=1)
    return np.asarray((weights[:, None] @ np.concatenate([q[which], u[which]], axis=1))[:, 0])


def _least_squares(matrices: Array, sides: Array) -> Array:
    """(P, n, k) least-squares solutions of matrices (P, m, n) with m >= n; raises LinAlgError for a singular one."""
    across = np.swapaxes(matrices, 1, 2)
    try:
        inverse = np.linalg.inv(across @ matrices)
    except np.linalg.LinAlgError:
        return _by_factors(matrices, sides)
    found = inverse @ (across @ sides)
    change = inverse @ (across @ (sides - matrices @ found))
    found += change
    if not _settled(found, max(change.max(), -change.min())):
        return _by_factors(matrices, sides)
    return np.asarray(found)


def _settled(found: Array, change: float) -> bool:
    """Whether the step of refinement restored the digits lost to the squared condition number; its size says how many."""
    return bool(change < NORMAL_EQUATIONS_LIMIT * max(found.max(), -found.min(), 1e-6))


def _by_factors(matrices: Array, sides: Array) -> Array:
    orthogonal, upper = np.linalg.qr(matrices)
    return np.asarray(np.linalg.solve(upper, np.swapaxes(orthogonal, 1, 2) @ sides))


def candidate_joints(mechanism: Mechanism, q0: Array, rows: BatchRows) -> list[int]:
    """Joints along which a branch may be followed, best first: the drives, then those that move fastest. Raises NoSolution where the
    pose has not exactly one freedom."""
    nv = mechanism.nv
    if nv == 1:
        return [0]
    _, jacobian = rows.evaluate(q0[None])
    _, sizes, vectors = np.linalg.svd(jacobian[0])
    free = nv - int(np.sum(sizes > 1e-9 * max(1.0, sizes[0] if len(sizes) else 1.0)))
    if free != 1:
        raise NoSolution(f"{mechanism.name}: the start has {free} freedoms: a place where modes meet")
    direction = np.abs(vectors[-1])
    driven = {d.on for d in mechanism.drives}
    order = sorted(range(nv), key=lambda k: (mechanism.joints[k].name not in driven, -direction[k]))
    return [k for k in order if direction[k] > 0.05 * np.max(direction)]
