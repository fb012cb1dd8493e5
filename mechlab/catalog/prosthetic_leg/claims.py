"""Claims of the leg article: equations (37) to (40) and its conclusion, computed anew."""

from __future__ import annotations

import numpy as np

from mechlab.analytic import transition_matrices as tm
from mechlab.catalog.bibliography import PROSTHESIS
from mechlab.catalog.prosthetic_leg.build import LEG, SWING_TIME, Parameters, build
from mechlab.catalog.prosthetic_leg.questions import answers, engine_terms, own_terms, tree
from mechlab.kit.claims import Evidence, Ledger, above, below, evidence, factor, fails, holds, near, only_if
from mechlab.mechanism.geometry import Array

LEDGER = Ledger(PROSTHESIS)
STEP = 1e-6


def _difference(placement: Array, q: float) -> Array:
    """dA/dq of A = B exp(q Om) by central differences."""
    om = tm.prismatic((1.0, 0.0))
    return np.asarray(placement @ (tm.joint_motion(om, q + STEP) - tm.joint_motion(om, q - STEP)) / (2.0 * STEP))


@LEDGER.claim(
    "T1", "after (37)", "The inverse of the transition matrix of a slide has -q in place of q.", "-q",
    holds(when=below(1e-15, "|A^-1 A - E|")), fails(),
    formerly="G1",
)  # fmt: skip
def inverse() -> Evidence:
    """The printed inverse times the matrix of a slide at q = 0.3 m."""
    q, om = 0.3, tm.prismatic((1.0, 0.0))
    printed = np.array([[1.0, 0.0, -q], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    return evidence({"|A^-1 A - E|": float(np.max(np.abs(printed @ tm.joint_motion(om, q) - np.eye(3))))})


@LEDGER.claim(
    "T2", "(38), (39)", "dA/dq = Omega A, Omega = [[0,0,1],[0,0,0],[0,0,0]].", "Omega A",
    holds(when=below(1e-9, "slide turned by -90 deg")),
    only_if("the slide lies along x of the parent link. With a constant turned placement B it is "
            "dA/dq = (B Omega B^-1) A = A Omega", when=below(1e-9, "slide along x of the parent")),
    fails(),
    formerly="G2",
)  # fmt: skip
def derivative() -> Evidence:
    """dA/dq = Omega A for a slide along x of the parent and for a turned one, against central differences."""
    om, q = tm.prismatic((1.0, 0.0)), 0.3
    gaps = {}
    for name, angle in (("slide along x of the parent", 0.0), ("slide turned by -90 deg", -0.5 * np.pi)):
        b = tm.placement((0.1, 0.2), angle)
        gaps[name] = float(np.max(np.abs(om @ b @ tm.joint_motion(om, q) - _difference(b, q))))
    return evidence(gaps)


@LEDGER.claim(
    "T3", "after (39)", "The formulas for revolute links then hold for prismatic links too.", "same formulas",
    holds(when=below(1e-12, "M: own - pinocchio", "h: own - pinocchio")), fails(),
    formerly="G3",
)  # fmt: skip
def same_formulas() -> Evidence:
    """With (38) and (39) the formulas of revolute links hold for slides: the whole leg against Pinocchio."""
    p = Parameters()
    q, v = np.full(6, 0.2), np.linspace(-1.0, 2.0, 6)
    mass, h, _ = own_terms(tree(p), q, v)
    other_mass, other_h, _ = engine_terms("pinocchio", build(p, "parts"), q, v)
    return evidence({
        "M: own - pinocchio": float(np.max(np.abs(mass - other_mass))),
        "h: own - pinocchio": float(np.max(np.abs(h - other_h)) / np.max(np.abs(h))),
    })  # fmt: skip


@LEDGER.claim(
    "T4", "(40)", "The generalized force of a slide is -C q + sum of m G^T U r: no rest length.", "-C q",
    holds(when=near("equilibrium by (40), m", 1e-2, of="drawn length, m")),
    only_if("q is measured from the unstretched spring; with q the drawn length the force is -C (q - q0), and the leg needs "
            "a damper too: undamped slides ring for ever"),
    formerly="G4",
)  # fmt: skip
def rest_length() -> Evidence:
    """(40): Q = -C q + weight. A slide whose coordinate is a length s, as drawn, then shrinks to nothing."""
    p, drawn = Parameters(), 0.2
    sag = float(tm.gravity_force(tree(p), np.zeros(len(LEG)))[2]) / p.C_thigh
    return evidence({"equilibrium by (40), m": sag, "with rest length 0.2 m": drawn + sag, "drawn length, m": drawn})


@LEDGER.claim(
    "T5", "(40)", "The elastic term has the sign -C q.", "-",
    holds(when=factor("printed form, N", 1.0, 1e-4, of="-dV/dq, N")), fails(),
    formerly="G5",
)  # fmt: skip
def sign() -> Evidence:
    """The sign of the elastic term: the virtual work of the spring, -dV/dq by differences."""
    p = Parameters()
    t = tree(p, ("thigh",))
    q = np.array([0.004])
    push = [float(tm.energy(t, q + s, np.zeros(1))[1]) for s in (STEP, -STEP)]
    printed = float(-p.C_thigh * q[0] + tm.gravity_force(t, q)[0])
    return evidence({"printed form, N": printed, "-dV/dq, N": -(push[0] - push[1]) / (2.0 * STEP)})


@LEDGER.claim(
    "T6", "conclusion", "The model is corrected by elastic slides in thigh and shin, and one at the hip for its lift.", "3 slides",
    only_if("more than a swing is asked for: in a swing the slide at the hip matters (without it the ankle is {hitch:.1f} mm off), those "
            "of thigh and shin hardly ({slides:.1f} mm); they are for the stance",
            when=below(5e-3, "lock_thigh_shin_error") & above(5e-3, "lock_hitch_error")),
    holds("no slide changes the swing by 5 mm", when=above(5e-3, "lock_thigh_shin_error")),
    fails("no slide changes the swing by 5 mm"),
    formerly="G6",
)  # fmt: skip
def which_slides() -> Evidence:
    """The conclusion adds slides in thigh and shin and a hitch at the hip: what each does to the ankle in a swing."""
    found = answers(Parameters(), "pinocchio", SWING_TIME)
    return evidence(found, hitch=1e3 * found["lock_hitch_error"], slides=1e3 * found["lock_thigh_shin_error"])


CLAIMS = LEDGER.claims
