"""Claims of the thesis abstract on sliding and friction in a gear mesh."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.claims_freedoms import THESIS
from mechlab.catalog.delta6.claims_velocity import shows
from mechlab.catalog.delta6.probes import SOURCE
from mechlab.catalog.delta6.tooth_statics import sliding
from mechlab.experiment.entry import Claim, ClaimResult, Verdict

PRINTED_CONTACT, PRINTED_SLIDING, PRINTED_RADIUS = (0.024, 0.065), (0.1296, -0.0472), 0.3
FRICTION = 0.16


def sliding_digits() -> ClaimResult:
    """The printed contact point, and those of standard gears of the printed radius with the contact at a tip."""
    from_point = closed.sliding_velocity(PRINTED_CONTACT, PRINTED_RADIUS, PRINTED_RADIUS).velocity
    fits = [z for z in range(12, 80) if shows(sliding(z, 2.0 * PRINTED_RADIUS / z), PRINTED_SLIDING, 4)]
    computed: dict[str, object] = {
        "analytic: from the printed point [m/s]": from_point.tolist(),
        "statics: tooth numbers that give every digit": fits,
    }
    for z in fits:
        contact = closed.contact_point(closed.tip_distance(z, 2.0 * PRINTED_RADIUS / z))
        computed[f"analytic: contact at the tip, {z} teeth [m]"] = contact.round(6).tolist()
    if shows(from_point, PRINTED_SLIDING, 4):
        return ClaimResult(computed, Verdict.HOLDS)
    if fits:
        because = (
            f"the contact point is carried with more digits than printed, as the tip of a gear of {fits[0]} teeth; "
            f"the printed one gives {from_point[0]:.4f}, {from_point[1]:.4f}"
        )
        return ClaimResult(computed, Verdict.HOLDS_ONLY_IF, because)
    return ClaimResult(computed, Verdict.MISPRINT, str(from_point.round(4).tolist()))


def example_size() -> ClaimResult:
    """Gears of the printed radius beside the mechanism of the velocity example."""
    between, room = (
        2.0 * PRINTED_RADIUS,
        2.0 * SOURCE.rod_length * math.sin(float(closed.cardan_bend(SOURCE.geometry, np.zeros(3))[0])),
    )
    computed = {
        "distance of the gear axes [m]": between,
        "analytic: twice the way from guide to platform [m]": room,
        "module of 20 teeth [mm]": 1e3 * between / 20,
    }
    if between < room:
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(
        computed,
        Verdict.CANNOT,
        f"the gears would be larger than the mechanism (module {1e3 * between / 20:.0f} mm); a tenth of the size would fit",
    )


def across_the_line() -> ClaimResult:
    """Angle between the printed sliding velocity and the line of action."""
    v, n = np.array(PRINTED_SLIDING), np.array([math.sin(closed.PRESSURE_ANGLE), math.cos(closed.PRESSURE_ANGLE)])
    cosine = float(v @ n / np.linalg.norm(v))
    computed = {
        "printed velocity against the line of action [deg]": math.degrees(math.acos(cosine)),
        "statics [deg]": math.degrees(math.acos(float(sliding(20, 0.03) @ n / np.linalg.norm(sliding(20, 0.03))))),
    }
    if abs(cosine) < 1e-3:  # four digits of the velocity
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(computed, Verdict.FAILS, "the velocity is not at right angles to the line of action")


def friction_angle() -> ClaimResult:
    """Angle of a tooth force with Coulomb friction to the friction force and to the normal."""
    normal, tangent = np.array([0.0, 1.0]), np.array([1.0, 0.0])
    reaction = normal + FRICTION * tangent
    angle = {
        name: math.degrees(math.acos(float(reaction @ axis) / float(np.linalg.norm(reaction))))
        for name, axis in (("friction force", tangent), ("normal", normal))
    }
    printed = math.degrees(math.atan(FRICTION))
    computed = {f"vectors: reaction against the {k} [deg]": v for k, v in angle.items()} | {"arctan f [deg]": printed}
    if abs(angle["friction force"] - printed) < 1e-9:
        return ClaimResult(computed, Verdict.HOLDS)
    if abs(angle["normal"] - printed) < 1e-9:
        return ClaimResult(
            computed,
            Verdict.MISPRINT,
            f"arctan f = {printed:.2f} deg from the normal (the line of action); from the friction force it is "
            f"{angle['friction force']:.2f} deg",
        )
    return ClaimResult(computed, Verdict.FAILS, "the reaction leans by another angle")


CLAIMS = (
    Claim("C38", "chapter 5, sliding velocity",
          "Contact at (0.024, 0.065) m, gears of 0.3 m: the teeth slide with (0.1296, -0.0472) m/s.",
          [0.1296, -0.0472], sliding_digits, THESIS),
    Claim("C39", "chapter 5, sliding velocity",
          "The gears of the example have pitch radii of 0.3 m.", 0.3, example_size, THESIS),
    Claim("C40", "chapter 5, friction",
          "The friction force is at right angles to the line of action, against the sliding velocity.", "90 deg", across_the_line, THESIS),
    Claim("C41", "chapter 5, friction",
          "The reaction deviates from the friction force by the angle arctan f.",
          "arctan f from the friction force", friction_angle, THESIS),
)  # fmt: skip
