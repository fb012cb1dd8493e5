"""The one rule set of error control, as data. Nothing here knows a mechanism.

Residual and Jacobian of all loops and relations at many poses at once.

The fastest rate of a mechanism as it stands: what bounds the steps of an explicit method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.scene import Scene, initial_state
from mechlab.lab.accuracy.batch import BatchTree, across, crossed
from mechlab.lab.accuracy.conservative import scalars
from mechlab.mechanism import ConstraintSet, Joint, Mechanism, Shaft, Spring, TreeKinematics
from mechlab.mechanism.constraints import _LOOP_TABLE, AXES
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.statics import spring_stretch


@dataclass(frozen=True)
class Rules:
    """What all problems are held to.

    safety: an estimate counts this many times; work [s]: counted, of all probing together; nodes: of a cell of the method "energy",
    first and last; rungs: of a ladder, at least, before the order that it shows is believed; failures: of a ladder
    at its coarse end, before it is given up; floor [m or rad]: below it the error of "energy" is rounding, which steps do not
    cure; tolerances: of a ladder that is controlled by them; sharpest: of a
    ladder that starts near its target; rounding: units in the last place by which the energy is shifted
    to see what double precision allows; check_share: of the work done so far that the check method may add; check_steps: its
    steps in an output interval, fewest and most; check_tolerances: of a check method that has no steps;
    check_own: share of the size of the motion up to which its own error lets
    it say anything; contradiction: how many times the errors stated by both methods their difference may be.
    """

    safety: float = 2.0
    work: float = 4.5
    nodes: tuple[int, int] = (6, 192)
    rungs: int = 3
    failures: int = 6
    floor: float = 1e-8
    tolerances: tuple[float, ...] = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
    sharpest: float = 1e-13
    rounding: float = 4.0
    check_share: float = 0.1
    check_steps: tuple[int, int] = (4, 4000)
    check_tolerances: tuple[float, float] = (1e-5, 1e-7)
    check_own: float = 1e-3
    contradiction: float = 10.0


RULES = Rules()


@dataclass(frozen=True)
class LadderRule:
    """A method as error control may use it. engine, integrator, constraints as of `mechlab.lab.methods.Method`; order:
    of its error in the step; control: "step" or "tolerance"; stable: largest step times the fastest rate of the mechanism
    (0: no limit); extrapolated: whether the steps of the ladder are combined (Richardson); leaves: (c, p) of the error
    c x tolerance^p that a run leaves as a rule, so that the ladder starts near its target (c = 0: it starts at the
    coarsest); evaluations: expected in an output interval under a tolerance, until a run has told."""

    name: str
    engine: str
    integrator: str
    constraints: str
    control: str
    order: float
    stable: float = 0.0
    extrapolated: bool = False
    leaves: tuple[float, float] = (0.0, 1.0)
    evaluations: float = 1.0


LSODA_LEAVES = (12.0, 0.89)
"""Measured on a stiff governor over 10 s: 3 x tolerance^0.89 from 1e-5 to 1e-12; a run is believed at half of its target, and
as much again is left for other problems."""

LADDERS: tuple[LadderRule, ...] = (
    LadderRule("MuJoCo RK4", "mujoco", "RK4", "hard", "step", 4.0, 2.2),
    LadderRule("MuJoCo discrete, extrapolated", "mujoco", "discrete", "hard", "step", 1.0, 0.0, True),
    LadderRule("Pinocchio RK4", "pinocchio", "RK4", "soft", "step", 4.0, 2.2),
    LadderRule(
        "LSODA on MuJoCo's tree", "mujoco", "LSODA", "exact", "tolerance", 5.0, leaves=LSODA_LEAVES, evaluations=25.0
    ),
    LadderRule(
        "LSODA on Pinocchio's tree",
        "pinocchio",
        "LSODA",
        "exact",
        "tolerance",
        5.0,
        leaves=LSODA_LEAVES,
        evaluations=25.0,
    ),
    LadderRule("one freedom DOP853", "one_freedom", "DOP853", "exact", "tolerance", 8.0, evaluations=8.0),
    LadderRule("hybrid DOP853", "hybrid", "DOP853", "exact", "tolerance", 8.0, evaluations=7.0),
)
"""The methods; what each is expected to cost a problem is known from its price. "energy" comes before all of them where it
applies."""

LOOPS_ORDER = 2.0
"""Of MuJoCo with loops or gears: their softness goes with the square of the step."""
EXTRAPOLATED = 3.0
"""Largest order that the errors of extrapolated runs are believed to fall with: it rises from rung to rung."""


class BatchRows:
    """Residual and Jacobian of all loops and relations at many poses; rows as in `mechlab.mechanism.ConstraintSet`, in
    another order."""

    def __init__(self, tree: BatchTree) -> None:
        self.tree = tree
        m = tree.mechanism
        loops = [x for x in m.loops if x.kind != "distance"]
        rods = [x for x in m.loops if x.kind == "distance"]
        self.a = tree.points([(x.body_a, x.placement_a.translation) for x in loops])
        self.b = tree.points([(x.body_b, x.placement_b.translation) for x in loops])
        self.turn_a = np.array([tree.place[x.body_a][1] @ x.placement_a.rotation for x in loops]).reshape(-1, 1, 3, 3)
        self.turn_b = np.array([tree.place[x.body_b][1] @ x.placement_b.rotation for x in loops]).reshape(-1, 1, 3, 3)
        offsets = [(i, AXES.index(u)) for i, x in enumerate(loops) for u in _LOOP_TABLE[x.kind][0]]
        angles = [(i, AXES.index(u), AXES.index(w)) for i, x in enumerate(loops) for u, w in _LOOP_TABLE[x.kind][1]]
        self.offsets = np.array(offsets, dtype=int).reshape(-1, 2).T
        self.angles = np.array(angles, dtype=int).reshape(-1, 3).T
        self.full = len(offsets) == 3 * len(loops)
        on = tree.on
        self.between = (on[self.b[0]] - on[self.a[0]])[:, None, None, :]
        self.rod_a = tree.points([(x.body_a, x.placement_a.translation) for x in rods])
        self.rod_b = tree.points([(x.body_b, x.placement_b.translation) for x in rods])
        self.rod_between = (on[self.rod_b[0]] - on[self.rod_a[0]])[:, None, None, :]
        self.lengths = np.array([x.length for x in rods])
        self.relations = np.array([m.coefficient_row(x.coefficients) for x in m.relations]).reshape(-1, m.nv)
        self.count = self.offsets.shape[1] + self.angles.shape[1] + len(rods) + len(m.relations)

    def system(self, q: Array) -> Array:
        """(P, rows, nv + 1) Jacobian and, in the last column, residual at q (P, nv)."""
        tree = self.tree
        poses = tree.at(q)
        count, n = q.shape
        parts = []
        if len(self.a[0]) or len(self.lengths):
            linear, angular = (s.transpose(1, 2, 0) for s in tree.screws(poses))
        if len(self.a[0]):
            ra = poses.frames[self.a[0]]
            pa, pb = (ra @ self.a[1])[:, :, :3, 0], tree.positions(poses, self.b)
            back = np.swapaxes(ra[:, :, :3, :3] @ self.turn_a, 2, 3)
            own = np.empty((len(pa), count, 3, n + 1))
            # of the point of A that is where B's is: with it the turning of A counts
            np.multiply(linear - across(pb) @ angular, self.between, out=own[..., :n])
            own[..., n] = pb - pa
            own = back @ own
            if self.full:
                parts.append(own.transpose(1, 0, 2, 3).reshape(count, -1, n + 1))
            else:
                i, k = self.offsets
                parts.append(own[i, :, k].transpose(1, 0, 2))
            if self.angles.shape[1]:
                i, j, k = self.angles
                rb = poses.frames[self.b[0]][:, :, :3, :3] @ self.turn_b
                u, w = back[i, :, j], rb[i, :, :, k]
                turned = np.empty((len(i), count, n + 1))
                turned[..., :n] = (crossed(w, u)[:, :, None, :] @ angular * self.between[i])[:, :, 0]
                turned[..., n] = np.sum(u * w, axis=-1)
                parts.append(turned.transpose(1, 0, 2))
        if len(self.lengths):
            pa, pb = tree.positions(poses, self.rod_a), tree.positions(poses, self.rod_b)
            d = pb - pa
            both = np.empty((len(d), count, n + 1))
            # both ends lie on the line of the rod, so that its direction at B takes the turning of both sides
            both[..., :n] = (d[:, :, None, :] @ (linear - across(pb) @ angular) * self.rod_between)[:, :, 0]
            both[..., n] = 0.5 * (np.sum(d * d, axis=-1) - self.lengths[:, None] ** 2)
            parts.append((both / self.lengths[:, None, None]).transpose(1, 0, 2))
        if len(self.relations):
            linked = np.empty((count, len(self.relations), n + 1))
            linked[..., :n], linked[..., n] = self.relations, q @ self.relations.T
            parts.append(linked)
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)

    def evaluate(self, q: Array) -> tuple[Array, Array]:
        """Residual (P, rows) and Jacobian (P, rows, nv) at q (P, nv)."""
        if not self.count:
            return np.zeros((len(q), 0)), np.zeros((len(q), 0, self.tree.ground))
        found = self.system(q)
        return found[..., -1], found[..., :-1]


LARGEST = 24
"""Mechanisms with more rates are not linearised: it would cost more than it saves."""


def fastest_rate(mechanism: Mechanism, scene: Scene) -> float:
    """Largest |eigenvalue| [1/s] of the motion at the start of a scene, linearised on the constraints: M a = -C v - K q with
    C, K the sums of c g g^T and k g g^T over all springs and dampers, g the gradient of what they stretch by. What their
    tension adds, and weight and laws, are slow. 0 when unknown."""
    m = mechanism
    acting: list[Joint | Shaft | Spring] = [x for x in (*scalars(m), *m.springs) if x.stiffness or x.damping]
    if m.nv > LARGEST or not acting or any(j.nv != 1 for j in m.joints):
        return 0.0
    try:
        q, v = initial_state(m, scene)
    except MechlabError:
        return 0.0
    tree = TreeKinematics(m, q)
    free = _null(ConstraintSet(m).jacobian(tree), m.nv)
    stretch = np.array([_gradient(tree, x) for x in acting]) @ free
    mass = free.T @ tree.mass_matrix() @ free
    n = free.shape[1]
    system = np.zeros((2 * n, 2 * n))
    system[:n, n:] = np.eye(n)
    for columns, sizes in (
        (slice(0, n), [x.stiffness for x in acting]),
        (slice(n, None), [x.damping for x in acting]),
    ):
        system[n:, columns] = -np.linalg.lstsq(mass, (stretch.T * sizes) @ stretch, rcond=1e-12)[0]
    return float(np.max(np.abs(np.linalg.eigvals(system)), initial=0.0))


def _gradient(tree: TreeKinematics, x: Joint | Shaft | Spring) -> Array:
    """(nv,) of the stretch of a spring: of a joint or shaft, or of the distance between two points."""
    if not isinstance(x, Spring):
        return tree.mechanism.row(x.name)
    a, b, length, _ = spring_stretch(tree, x)
    if length == 0.0:
        return np.zeros(tree.mechanism.nv)
    return np.asarray((b - a) / length @ (tree.jacobian(x.body_b, b)[:3] - tree.jacobian(x.body_a, a)[:3]))


def _null(rows: Array, nv: int) -> Array:
    """(nv, k) basis of what the rows leave free."""
    if not len(rows):
        return np.eye(nv)
    _, sizes, vectors = np.linalg.svd(rows)
    return np.asarray(vectors[int(np.sum(sizes > 1e-9 * sizes[0])) :].T)
