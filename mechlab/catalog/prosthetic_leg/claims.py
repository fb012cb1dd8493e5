"""Claims of the leg article: equations (37) to (40) and its conclusion, computed anew."""

from __future__ import annotations

import numpy as np

from mechlab.analytic import transition_matrices as tm
from mechlab.catalog.prosthetic_leg.build import LEG, Parameters, mechanism, tree
from mechlab.catalog.prosthetic_leg.questions import answers
from mechlab.catalog.prosthetic_leg.scenes import SWING_TIME
from mechlab.engines.pinocchio import PinPlant
from mechlab.experiment.entry import Claim, ClaimResult, Verdict
from mechlab.mechanism.geometry import Array

SOURCE = "Transition matrices of prismatic links of an above-knee prosthesis (2009)"
STEP = 1e-6


def _difference(placement: Array, q: float) -> Array:
    """dA/dq of A = B exp(q Om) by central differences."""
    om = tm.prismatic((1.0, 0.0))
    return np.asarray(placement @ (tm.joint_motion(om, q + STEP) - tm.joint_motion(om, q - STEP)) / (2.0 * STEP))


def _inverse() -> ClaimResult:
    q, om = 0.3, tm.prismatic((1.0, 0.0))
    printed = np.array([[1.0, 0.0, -q], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    gap = float(np.max(np.abs(printed @ tm.joint_motion(om, q) - np.eye(3))))
    return ClaimResult({"|A^-1 A - E|": gap}, Verdict.HOLDS if gap < 1e-15 else Verdict.FAILS)


def _derivative() -> ClaimResult:
    """dA/dq = Omega A with Omega = [[0,0,1],[0,0,0],[0,0,0]], for a slide along x of the parent and for a turned one."""
    om, q = tm.prismatic((1.0, 0.0)), 0.3
    gaps = {}
    for name, angle in (("slide along x of the parent", 0.0), ("slide turned by -90 deg", -0.5 * np.pi)):
        b = tm.placement((0.1, 0.2), angle)
        gaps[name] = float(np.max(np.abs(om @ b @ tm.joint_motion(om, q) - _difference(b, q))))
    first, turned = gaps.values()
    if first < 1e-9 < turned:
        return ClaimResult(
            gaps,
            Verdict.HOLDS_ONLY_IF,
            "the slide lies along x of the parent link. With a constant turned placement B it is "
            "dA/dq = (B Omega B^-1) A = A Omega",
        )
    return ClaimResult(gaps, Verdict.HOLDS if turned < 1e-9 else Verdict.FAILS)


def _same_formulas() -> ClaimResult:
    """With (38) and (39) the formulas of revolute links hold for slides: the whole leg against Pinocchio."""
    p = Parameters()
    q, v = np.full(6, 0.2), np.linspace(-1.0, 2.0, 6)
    h = tm.bias_force(tree(p), q, v) - tm.gravity_force(tree(p), q) - tm.elastic_force(tree(p), q, v)
    plant = PinPlant(mechanism(p, LEG), q, v)
    gaps = {
        "M: own - pinocchio": float(np.max(np.abs(tm.mass_matrix(tree(p), q) - plant.mass_matrix()))),
        "h: own - pinocchio": float(np.max(np.abs(h - plant.bias())) / np.max(np.abs(h))),
    }
    return ClaimResult(gaps, Verdict.HOLDS if max(gaps.values()) < 1e-12 else Verdict.FAILS)


def _rest_length() -> ClaimResult:
    """(40): Q = -C q + weight. A slide whose coordinate is a length s, as drawn, then shrinks to nothing."""
    p = Parameters()
    t = tree(p)
    weight = float(tm.gravity_force(t, np.zeros(len(LEG)))[2])
    drawn = 0.2
    printed = weight / p.C_thigh
    with_rest = drawn + weight / p.C_thigh
    computed = {"equilibrium by (40), m": printed, "with rest length 0.2 m": with_rest, "drawn length, m": drawn}
    if abs(printed - drawn) < 1e-2:
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(
        computed,
        Verdict.HOLDS_ONLY_IF,
        "q is measured from the unstretched spring; with q the drawn length the force is -C (q - q0), and the leg needs "
        "a damper too: undamped slides ring for ever",
    )


def _sign() -> ClaimResult:
    """The sign of the elastic term: the virtual work of the spring, -dV/dq by differences."""
    p = Parameters()
    t = tree(p, ("thigh",))
    q = np.array([0.004])
    push = [float(tm.energy(t, q + s, np.zeros(1))[1]) for s in (STEP, -STEP)]
    by_energy = -(push[0] - push[1]) / (2.0 * STEP)
    printed = float(-p.C_thigh * q[0] + tm.gravity_force(t, q)[0])
    same = abs(printed - by_energy) < 1e-4 * abs(by_energy)
    return ClaimResult({"printed form, N": printed, "-dV/dq, N": by_energy}, Verdict.HOLDS if same else Verdict.FAILS)


def _which_slides() -> ClaimResult:
    """The conclusion adds slides in thigh and shin and a hitch at the hip: what each does to the ankle in a swing."""
    said = answers(Parameters(), "pinocchio", SWING_TIME)
    small, large = said["lock_thigh_shin_error"], said["lock_hitch_error"]
    if small < 5e-3 < large:
        return ClaimResult(
            said,
            Verdict.HOLDS_ONLY_IF,
            f"the hitch is meant: without it the ankle is {1e3 * large:.1f} mm off; without the slides of thigh and shin "
            f"{1e3 * small:.1f} mm, so a swing needs four freedoms; the slides are for the stance",
        )
    return ClaimResult(said, Verdict.HOLDS if small > 5e-3 else Verdict.FAILS, "no slide changes the swing by 5 mm")


CLAIMS = (
    Claim("G1", "after (37)", "The inverse of the transition matrix of a slide has -q in place of q.", "-q", _inverse, SOURCE),
    Claim("G2", "(38), (39)", "dA/dq = Omega A, Omega = [[0,0,1],[0,0,0],[0,0,0]].", "Omega A", _derivative, SOURCE),
    Claim("G3", "after (39)", "The formulas for revolute links then hold for prismatic links too.", "same formulas",
          _same_formulas, SOURCE),
    Claim("G4", "(40)", "The generalised force of a slide is -C q + sum of m G^T U r: no rest length.", "-C q",
          _rest_length, SOURCE),
    Claim("G5", "(40)", "The elastic term has the sign -C q.", "-", _sign, SOURCE),
    Claim("G6", "conclusion", "Thigh and shin are split by elastic slides, a hitch is added at the hip.", "3 slides",
          _which_slides, SOURCE),
)  # fmt: skip
