"""Two elements of the transmission by themselves, to hold closed forms against: a double cardan joint as a mechanism, and
one tooth contact by statics of vectors.

Double cardan joint: shaft, cross, rod, cross, shaft. Does it pass rotation on at a constant ratio? The upper shaft turns in
a slider, which is free to follow, the lower one in the ground. In the delta both shafts are parallel and the two forks of
the rod are in phase; here either can be wrong by an angle.

Tooth contact: rigid gears, a normal force along the line of action, Coulomb friction. The driver stands at A = (-r1, 0) and
turns with +1 rad/s, the driven gear at C = (r2, 0); the pitch point is the origin. The driver pushes along
n = (sin 20 deg, cos 20 deg).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.protocol import StatePlant
from mechlab.errors import MechlabError, NoSolution, unknown
from mechlab.mechanism import Builder, Inertia, Mechanism, newton, prismatic, revolute
from mechlab.mechanism.geometry import Array, Vector, axis_rotation, vector

# -- double cardan joint -------------------------------------------------------------------------------------------------

PART = Inertia.box(0.05, 0.02, 0.02, 0.02)
STEP = math.radians(15.0)
"""Largest turn of the input between two poses of a sweep: Newton then stays in its assembly mode."""


@lru_cache(maxsize=16)
def cardan_chain(length: float, bend: float, misphase: float = 0.0, tilt: float = 0.0) -> Mechanism:
    """The chain with a rod of `length` [m] bent by `bend` against the upper shaft in the reference pose, its lower fork
    turned about the rod by `misphase` and the lower shaft leaning by `tilt` in the plane of rod and upper shaft [rad].

    Joints: follow (slider), turn_in, fork_a, fork_b, ankle_b, ankle_a, turn_out; turn_out of a perfect chain is turn_in.
    Raises MechlabError for a bend outside (0, 90 deg).
    """
    if not 0.0 < bend < 0.5 * math.pi:
        raise MechlabError(f"cardan_chain: bend = {bend:g} rad; expected a value between 0 and pi / 2.")
    z = np.array([0.0, 0.0, 1.0])
    along = np.array([math.sin(bend), 0.0, -math.cos(bend)])
    upper_b = np.array([0.0, 1.0, 0.0])
    upper_a = np.cross(upper_b, z)
    lower_b = axis_rotation(along, misphase) @ upper_b
    lower_z = axis_rotation(upper_b, tilt) @ z
    lower_a = np.cross(lower_b, lower_z)
    lower_a /= np.linalg.norm(lower_a)
    span = _vec(length * along)
    b = Builder("cardan_chain", summary="one double cardan: shaft, cross, rod, cross, shaft")
    b.body("slider", prismatic("follow", "z"), inertia=PART)
    b.body("shaft_in", revolute("turn_in", "z"), parent="slider", inertia=PART)
    b.body("cross_in", revolute("fork_a", _vec(upper_a)), parent="shaft_in", inertia=PART)
    rod = Inertia.rod(0.1, (0.0, 0.0, 0.0), span, 0.004)
    b.body("rod", revolute("fork_b", _vec(upper_b)), parent="cross_in", inertia=rod)
    b.body("cross_out", revolute("ankle_b", _vec(lower_b)), parent="rod", at=span, inertia=PART)
    b.body("shaft_out", revolute("turn_out", _vec(lower_z)), at=span, inertia=PART)
    b.body("half_out", revolute("ankle_a", _vec(lower_a)), parent="shaft_out", inertia=PART)
    b.loop("cardan", "cross_out", "half_out", kind="fixed")
    b.drive("turn_in")
    return b.build()


def output_turns(witness: StatePlant, inputs: ArrayLike) -> Array:
    """(n,) angle of the lower shaft for angles of the upper one, in this order, by Newton on the witness's own rows.

    Raises NoSolution when the chain does not close.
    """
    m = witness.mechanism
    row = m.row("turn_in")

    def evaluate(q: Array, target: float) -> tuple[Array, Array]:
        residual, jacobian, _ = witness.set(q).closing()
        return np.append(residual, row @ q - target), np.vstack([jacobian, row])

    q, now, out = m.reference(), 0.0, []
    for angle in np.asarray(inputs, dtype=float).tolist():
        for target in np.linspace(now, angle, 1 + max(1, math.ceil(abs(angle - now) / STEP)))[1:]:
            found = newton(lambda x, s=float(target): evaluate(x, s), lambda x, dv: x + dv, q)  # type: ignore[misc]
            if not found.closed:
                raise NoSolution(
                    f"cardan_chain: does not close at an input of {target:.6g} rad: open by {found.residual:.3g}"
                )
            q = found.q
        now = angle
        out.append(float(m.row("turn_out") @ q))
    return np.array(out)


def _vec(v: Array) -> Vector:
    return vector(v.tolist(), "cardan_chain: axis")


# -- tooth contact ---------------------------------------------------------------------------------------------------------

PRESSURE = math.radians(20.0)


def _cross(a: Array, b: Array) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def _contact(teeth: tuple[float, float], module: float, phase: str) -> tuple[Array, Array, Array, Array]:
    """Contact point, centres A and C, normal n; the contact lies where a tip circle cuts the line of action."""
    r1, r2 = (0.5 * module * z for z in teeth)
    n = np.array([math.sin(PRESSURE), math.cos(PRESSURE)])
    a, c = np.array([-r1, 0.0]), np.array([r2, 0.0])
    if phase == "approach":  # tip of the driven gear, before the pitch point
        centre, radius, pick = c, r2 + module, min
    elif phase == "recess":
        centre, radius, pick = a, r1 + module, max
    else:
        raise unknown("phase of a mesh", phase, ("approach", "recess"))
    roots = np.roots([1.0, -2.0 * float(n @ centre), float(centre @ centre) - radius**2]).real
    return float(pick(roots)) * n, a, c, n


def _slide(contact: Array, a: Array, c: Array) -> Array:
    """Velocity of the driver's tooth minus that of the driven one."""
    rate = -float(np.linalg.norm(a) / np.linalg.norm(c))
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    return np.asarray(turn @ (contact - a) - rate * (turn @ (contact - c)))


def tooth_sliding(teeth: float, module: float) -> Array:
    """(2,) sliding velocity of two equal gears at the tip of the driver [m/s], with the sign of the source: the velocity
    of the driven tooth against the driver's."""
    contact, a, c, _ = _contact((teeth, teeth), module, "recess")
    return -_slide(contact, a, c)


def tooth_loss(driver: float, driven: float, friction: float, phase: str) -> float:
    """Torque of the driver over what it would be without friction, for a given torque of the driven gear."""
    contact, a, c, n = _contact((driver, driven), 1.0, phase)
    slide = _slide(contact, a, c)
    force = n + friction * slide / np.linalg.norm(slide)  # on the driven tooth, dragged along by the driver's
    return _cross(contact - a, force) / -_cross(contact - c, force) * driven / driver
