"""Two elements of the transmission by themselves, and the checks A5 and A10 and the claim C09 of the thesis abstract on them: a
double cardan joint as a mechanism, and one tooth contact by statics of vectors.

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

from mechlab.analytic import delta6 as closed
from mechlab.catalog.bibliography import THESIS
from mechlab.catalog.delta6.parameters import SOURCE, Delta6Parameters
from mechlab.catalog.delta6.poses import plants
from mechlab.engines.protocol import StatePlant
from mechlab.errors import MechlabError, NoSolution, unknown
from mechlab.experiment.entry import Check, CheckResult
from mechlab.kit.checked_quantities import CheckedQuantity, check_quantities
from mechlab.kit.claims import Evidence, Ledger, above, below, evidence, fails, holds, labelled, only_if
from mechlab.mechanism import Builder, Inertia, Mechanism, newton, prismatic, revolute
from mechlab.mechanism.geometry import Array, Vector, axis_rotation, vector

LEDGER = Ledger(THESIS)
PART = Inertia.box(0.05, 0.02, 0.02, 0.02)
STEP = math.radians(15.0)
"""Largest turn of the input between two poses of a sweep: Newton then stays in its assembly mode."""
TURN = np.radians(np.arange(0.0, 361.0, 30.0))
"""Angles of the upper shaft over one turn [rad]."""
PRESSURE = math.radians(20.0)
"""Pressure angle of the teeth [rad]."""


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


def errors_over_a_turn(length: float, bend: float, misphase: float = 0.0, tilt: float = 0.0) -> dict[str, float]:
    """Witness -> largest |output - input| of the chain over a turn of the input [deg]."""
    chain = cardan_chain(length, bend, misphase, tilt)
    return {name: math.degrees(_largest_error(w)) for name, w in plants(chain).items()}


def _largest_error(w: StatePlant) -> float:
    """Largest |output - input| [rad]: its maximum around the worst of the angles TURN, by a polynomial through 13 Chebyshev
    nodes. They are 60 deg apart at most; the polynomial is then exact to 1e-8 for a bend below 45 deg."""
    coarse = np.abs(output_turns(w, TURN) - TURN)
    if coarse.max() < 1e-9:  # rounding has no maximum to look for
        return float(coarse.max())
    worst = float(TURN[int(np.argmax(coarse))])
    half = float(TURN[1] - TURN[0])
    nodes = np.polynomial.chebyshev.chebpts1(13)
    inputs = np.maximum(worst + half * nodes, 0.0)
    fit = np.polynomial.Chebyshev.fit(inputs, output_turns(w, inputs) - inputs, 12)
    return float(np.abs(fit(np.linspace(inputs.min(), inputs.max(), 20_001))).max())


def a5(p: Delta6Parameters) -> CheckResult:
    """A double cardan turned once: forks in phase, 45 and 90 deg out of phase, at the bend of the home pose."""
    bend = p.home_bend
    half, right = (plants(cardan_chain(p.rod_length, bend, misphase)) for misphase in (0.25 * math.pi, 0.5 * math.pi))
    out_of_phase = {"analytic": _misphased(bend, 0.25 * math.pi)} | {k: output_turns(w, TURN) for k, w in half.items()}
    swings = {"analytic": math.degrees(float(closed.misphase_amplitude(bend, 0.5 * math.pi)))}
    swings |= {name: _swing(w, bend) for name, w in right.items()}
    k = math.cos(bend) ** 2
    expected = math.degrees(math.asin((1.0 - k) / (1.0 + k)))
    source = math.degrees(float(closed.misphase_amplitude(SOURCE.home_bend, 0.5 * math.pi)))
    pins, step = TURN[:-1] + 0.1, 1e-5
    hooke = (_hooke(pins + step, bend) - _hooke(pins - step, bend)) / (2.0 * step)
    ratio = {"analytic": closed.rod_speed_ratio(bend, pins), "differences": hooke}
    # Newton closes the chains to 1e-13.
    return check_quantities(
        CheckedQuantity("forks in phase: output - input [deg]", 1e-8, errors_over_a_turn(p.rod_length, bend), 0.0),
        CheckedQuantity("45 deg out of phase: output [rad]", 1e-10, out_of_phase),
        CheckedQuantity("90 deg out of phase: half the swing [deg]", 1e-8, swings, expected),
        # central differences: 1e-10 of a third derivative, rounding 1e-16 / 1e-5
        CheckedQuantity("speed of the rod over that of its shaft", 1e-8, ratio),
        CheckedQuantity("the same at the bend of the source, 38.045 deg [deg]", 1e-3, {"analytic": source}, 13.557),
        note=f"bend {math.degrees(bend):.4g} deg",
    )


def _swing(w: StatePlant, bend: float) -> float:
    """Half the swing of output - input [deg] with the forks 90 deg out of phase, from the two inputs where it is extreme.

    From the normal to rod and shaft, output - input is atan(cos^2(bend) tan(psi)) - psi, extreme at tan(psi) = +-1/cos(bend).
    """
    extreme = 0.5 * math.pi - math.atan(1.0 / math.cos(bend))
    inputs = np.array([-extreme, extreme])
    error = output_turns(w, inputs) - inputs
    return math.degrees(abs(error[1] - error[0])) / 2.0


def _hooke(pin: Array, bend: float) -> Array:
    """Turn of the rod behind a Hooke joint; the driving pin stands `pin` from the normal to shaft and rod."""
    return np.asarray(np.unwrap(np.arctan2(np.cos(bend) * np.sin(pin), np.cos(pin))))


def _misphased(bend: float, misphase: float) -> Array:
    """Closed form of the output over a turn; the fork pin of the reference pose stands at 90 deg to the normal of rod and
    shaft."""
    start = 0.5 * math.pi
    turn = closed.misphase_output(TURN + start, bend, -misphase) - closed.misphase_output(start, bend, -misphase)
    return np.asarray(turn)


@LEDGER.claim(
    "C09", "chapter 2, constant ratio", "The ratio between rotary drives and output link is constant.", "constant",
    fails("even in phase the output is off by {in_phase:.3g} deg", when=above(1e-8, "in_phase")),
    holds(when=below(1e-8, "out_of_phase")),
    only_if("the two forks of every cardan rod are in phase and its shafts are parallel"),
)  # fmt: skip
def constant_ratio() -> Evidence:
    """The cardan shafts by themselves: as built, with forks out of phase, with shafts that are not parallel."""
    length, bend = SOURCE.rod_length, SOURCE.home_bend
    cases = {
        "in phase, parallel": errors_over_a_turn(length, bend),
        "forks 90 deg out of phase": errors_over_a_turn(length, bend, misphase=0.5 * math.pi),
        "shafts 10 deg apart": errors_over_a_turn(length, bend, tilt=math.radians(10.0)),
    }
    computed: dict[str, float] = {}
    for case, errors in cases.items():
        computed |= labelled(errors, f"{case}, output - input [deg]")
    good, *bad = cases.values()
    return evidence(computed, in_phase=max(good.values()), out_of_phase=max(min(x.values()) for x in bad))


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


def a10(p: Delta6Parameters) -> CheckResult:
    """Sliding and friction in one mesh, against statics of the tooth contact."""
    velocity = closed.sliding_velocity(closed.contact_point(closed.tip_distance(20, 0.03)), 0.3, 0.3).velocity
    losses = [closed.approach_loss(19, 19, 0.16), closed.approach_loss(20, 20, 0.16), closed.recess_loss(20, 20, 0.16)]
    cases = ((19, "approach"), (20, "approach"), (20, "recess"))
    loss = {"analytic": losses, "statics": [tooth_loss(z, z, 0.16, phase) for z, phase in cases]}
    slide = {"analytic": velocity, "statics": tooth_sliding(20, 0.03)}
    unequal = closed.sliding_velocity([0.01, 0.02], 0.3, 0.2)
    rates = {"analytic": [unequal.contact_rate, unequal.driven_rate]}
    return check_quantities(
        # four printed decimals
        CheckedQuantity("sliding velocity of 20 teeth at the tip [m/s]", 5e-5, slide, [0.1296, -0.0472]),
        CheckedQuantity("loss factors at f = 0.16", 1e-5, loss, [1.09066, 1.08670, 1.07679]),
        CheckedQuantity("sliding, closed form against statics [m/s]", 1e-12, slide),
        # both pitch circles run at 0.3 m/s: the driven one, of 0.2 m, turns by -1.5 rad/s, and against the driver by -2.5
        CheckedQuantity("rates, radii 0.3 and 0.2 m [rad/s]", 1e-12, rates, [-2.5, 1.5]),
        CheckedQuantity("losses, closed form against statics", 1e-12, loss),
    )


CHECKS = (
    Check("A5", "the cardan shafts pass rotation on at a constant ratio, with their forks in phase only", a5,
          "specification, section 4"),
    Check("A10", "sliding velocity and friction loss of a gear mesh", a10,
          "thesis abstract, chapter 5, equations and table 1"),
)  # fmt: skip
