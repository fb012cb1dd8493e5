"""How fast a mechanism may move by itself: the largest eigenvalue of M a + C v + K q = 0 on the motions that the constraints allow.

It bounds the steps of an explicit method: `fastest_rate` of springs, dampers and the laws that act like them, at the start of a
scene, `drive_step` of the drives that hold, in the reference pose. `command_rate` is the fastest that laws change by themselves.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.acting import held_drives
from mechlab.experiment.held_rates import HeldRates, ViscousBetween
from mechlab.experiment.laws import ComputedTorque, Law, Motor, Servo, Viscous
from mechlab.experiment.motion import Hold, PrescribedMotion, Ramp, Sine
from mechlab.experiment.scene import Scene, initial_state
from mechlab.mechanism import ConstraintSet, Joint, Mechanism, Shaft, Spring, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.statics import spring_stretch
from mechlab.mechanism.structure import null_space

RESOLVED = 0.5
"""Timestep times the fastest eigenvalue of the drives that hold, at most: RK4 is unstable above 2.78, and leaves an error of
a hundredth of a transient at 1."""
STABLE = 2.5
"""Timestep times the fastest eigenvalue of springs and dampers of the mechanism up to which the timestep is left; beyond, 1 is taken."""
MOST_RATES = 24
"""Mechanisms with more rates are not linearized, which would cost more than it saves."""


def largest_eigenvalue(mass: Array, stiffness: Array, damping: Array) -> float:
    """Largest |eigenvalue| [1/s] of M a + C v + K q = 0, all matrices (n, n); a motion without mass counts as resting."""
    n = len(mass)
    lower = -np.linalg.lstsq(mass, np.hstack([stiffness, damping]), rcond=1e-12)[0]
    system = np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), lower])
    return float(np.max(np.abs(np.linalg.eigvals(system)), initial=0.0))


def fastest_rate(mechanism: Mechanism, scene: Scene) -> float:
    """Largest |eigenvalue| [1/s] of the motion at the start of a scene, linearized on the constraints: M a = -C v - K q with
    C, K the sums of c g g^T and k g g^T over all springs, dampers, servos and the like, g the gradient of what they stretch by.
    What their tension adds, and weight and other laws, are slow; computed torque has the rates of its gains, held rates that of
    their capture. 0 when unknown."""
    m, acting = mechanism, _acting(mechanism)
    driven = [x for law in scene.laws for x in _like_springs(m, law)]
    gained = max(
        (_fastest_root(*g) for law in scene.laws if isinstance(law, ComputedTorque) for g in law.gains), default=0.0
    )
    gained = max([gained, *(1.0 / law.time for law in scene.laws if isinstance(law, HeldRates) and law.holds)])
    if m.nv > MOST_RATES or not (acting or driven) or any(j.nv != 1 for j in m.joints):
        return gained
    try:
        q, v = initial_state(m, scene)
    except MechlabError:
        return gained
    tree = TreeKinematics(m, q)
    return max(gained, _rate(tree, [(_gradient(tree, x), x.stiffness, x.damping) for x in acting] + driven))


def _acting(m: Mechanism) -> list[Joint | Shaft | Spring]:
    """What has stiffness or damping of its own."""
    every: list[Joint | Shaft | Spring] = [*m.joints, *m.shafts, *m.springs]
    return [x for x in every if x.stiffness or x.damping]


def _rate(tree: TreeKinematics, acting: Sequence[tuple[Array, float, float]]) -> float:
    """`largest_eigenvalue` on the motions that the constraints allow; acting: row (nv,), stiffness and damping of each."""
    free = null_space(ConstraintSet(tree.mechanism).jacobian(tree))
    stretch = np.array([row for row, _, _ in acting]) @ free
    k, c = ((stretch.T * [x[i] for x in acting]) @ stretch for i in (1, 2))
    return largest_eigenvalue(free.T @ tree.mass_matrix() @ free, k, c)


def _like_springs(m: Mechanism, law: Law) -> list[tuple[Array, float, float]]:
    """Row, stiffness and damping of a law that acts like a spring or damper on a joint or shaft."""
    if isinstance(law, Servo):
        return [(m.row(law.on), law.stiffness, law.damping)]
    if isinstance(law, Viscous):
        return [(m.row(law.on), 0.0, law.coefficient)]
    if isinstance(law, ViscousBetween):
        return [(m.row(law.a) - m.row(law.b), 0.0, law.coefficient)]
    if isinstance(law, Motor):
        return [(m.row(law.on), 0.0, abs(law.stall / law.no_load_rate) if law.no_load_rate else 0.0)]
    return []


def _fastest_root(stiffness: float, damping: float) -> float:
    """Largest |root| of s^2 + damping s + stiffness."""
    return float(np.max(np.abs(np.roots([1.0, damping, stiffness]))))


SMOOTH_LAWS = ("constant", "servo", "harmonic", "viscous", "viscous_between", "motor", "computed_torque")
STANDING = (Hold, Ramp)


def command_rate(scene: Scene) -> float:
    """The largest rate [rad/s] at which the laws of a scene change in time by themselves; infinite where that cannot be read from
    them (functions, tables, laws with kinks)."""
    fastest = 0.0
    for law in scene.laws:
        if law.kind not in SMOOTH_LAWS or math.isfinite(getattr(law, "limit", math.inf)):
            return math.inf
        fastest = max(fastest, abs(getattr(law, "frequency", 0.0)))
        motions = [x for _, x in law.commands] if isinstance(law, ComputedTorque) else [getattr(law, "motion", Hold())]
        fastest = max([fastest, *(_motion_rate(x) for x in motions)])
    return fastest


def _motion_rate(motion: PrescribedMotion) -> float:
    if isinstance(motion, Sine):
        return abs(motion.frequency)
    return 0.0 if isinstance(motion, STANDING) else math.inf


def _gradient(tree: TreeKinematics, x: Joint | Shaft | Spring) -> Array:
    """(nv,) gradient of the stretch of a spring: at a joint or shaft, or between two points."""
    if not isinstance(x, Spring):
        return tree.mechanism.row(x.name)
    a, b, length, _ = spring_stretch(tree, x)
    if length == 0.0:
        return np.zeros(tree.mechanism.nv)
    return np.asarray((b - a) / length @ (tree.jacobian(x.body_b, b)[:3] - tree.jacobian(x.body_a, a)[:3]))


def drive_step(mechanism: Mechanism, scene: Scene) -> float:
    """The largest timestep [s] that resolves the drives that hold, RESOLVED / |eigenvalue| rounded down to 1, 2 or 5 of a
    decimal place; infinite without such drives.

    The eigenvalue is the largest of M a + C v + K q = 0 at the reference pose, on the motions that the constraints allow, with the
    stiffness K and damping C of those drives alone.
    """
    servos = [law for law in held_drives(scene.laws) if isinstance(law, Servo)]
    if not servos:
        return math.inf
    fastest = _rate(TreeKinematics(mechanism), [(mechanism.row(x.on), x.stiffness, x.damping) for x in servos])
    return _rounded_down(RESOLVED / fastest) if fastest else math.inf


def rk4_step(mechanism: Mechanism, scene: Scene, timestep: float) -> float:
    """The timestep [s] for RK4, or a smaller one: `drive_step`, and where springs and dampers of the mechanism, in its reference pose, are
    faster than STABLE, one that resolves them."""
    m, acting, step = mechanism, _acting(mechanism), min(timestep, drive_step(mechanism, scene))
    if m.nv > MOST_RATES or not acting or any(j.nv != 1 for j in m.joints):
        return step
    tree = TreeKinematics(m)
    fastest = _rate(tree, [(_gradient(tree, x), x.stiffness, x.damping) for x in acting])
    return min(step, _rounded_down(1.0 / fastest)) if fastest * step > STABLE else step


def _rounded_down(step: float) -> float:
    """A timestep to 1, 2 or 5 of a decimal place."""
    power = 10.0 ** math.floor(math.log10(step))
    return max(m for m in (1.0, 2.0, 5.0) if m * power <= step * (1.0 + 1e-9)) * power
