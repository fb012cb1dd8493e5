"""Claims C38 to C48 of the thesis abstract: sliding and friction in a gear mesh, and table 1 of torques with friction."""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.bibliography import THESIS
from mechlab.catalog.delta6.elements import tooth_loss, tooth_sliding
from mechlab.catalog.delta6.parameters import SOURCE
from mechlab.kit.claims import (
    Evidence,
    Ledger,
    below,
    cannot,
    evidence,
    fails,
    holds,
    misprint,
    near,
    only_if,
    same_digits,
    shows,
    true,
)  # fmt: skip
from mechlab.mechanism.geometry import Array

LEDGER = Ledger(THESIS)

PRINTED_CONTACT, PRINTED_SLIDING, PRINTED_RADIUS = (0.024, 0.065), (0.1296, -0.0472), 0.3
"""Contact point [m], sliding velocity [m/s] for 1 rad/s, pitch radius of both gears [m]."""
FRICTION = 0.16


@LEDGER.claim(
    "C38", "chapter 5, sliding velocity",
    "Contact at (0.024, 0.065) m, gears of 0.3 m: the teeth slide with (0.1296, -0.0472) m/s.", [0.1296, -0.0472],
    holds(when=shows("analytic: from the printed point [m/s]", 4, of="printed")),
    only_if("the contact point is carried with more digits than printed, as the tip of a gear of {teeth} teeth; "
            "the printed one gives {x:.4f}, {y:.4f}", when=true("fits") & below(1e-9, "analytic against statics [m/s]")),
    fails("the two ways to compute the sliding disagree", when=~below(1e-9, "analytic against statics [m/s]")),
    misprint("{correct}"),
)  # fmt: skip
def sliding_digits() -> Evidence:
    """The printed contact point, and those of standard gears of the printed radius with the contact at a tip."""
    from_point = closed.sliding_velocity(PRINTED_CONTACT, PRINTED_RADIUS, PRINTED_RADIUS).velocity
    fits = [z for z in range(12, 80) if same_digits(tooth_sliding(z, 2.0 * PRINTED_RADIUS / z), PRINTED_SLIDING, 4)]
    computed: dict[str, Any] = {
        "analytic: from the printed point [m/s]": from_point.tolist(),
        "statics: tooth numbers that give every digit": fits,
    }
    for z in fits:
        contact = closed.contact_point(closed.tip_distance(z, 2.0 * PRINTED_RADIUS / z))
        computed[f"analytic: contact at the tip, {z} teeth [m]"] = contact.round(6).tolist()
    at_tip = closed.contact_point(closed.tip_distance(20, 0.03))
    apart = closed.sliding_velocity(at_tip, 0.3, 0.3).velocity - tooth_sliding(20, 0.03)
    computed["analytic against statics [m/s]"] = float(np.abs(apart).max())
    return evidence(
        computed, printed=PRINTED_SLIDING, fits=bool(fits), teeth=fits[0] if fits else 0, x=from_point[0],
        y=from_point[1], correct=from_point.round(4).tolist(),
    )  # fmt: skip


@LEDGER.claim(
    "C39", "chapter 5, sliding velocity", "The gears of the example have pitch radii of 0.3 m.", 0.3,
    holds(when=below(1.0, "share")),
    cannot("the gears would be larger than the mechanism (module {module:.0f} mm); a tenth of the size would fit"),
)  # fmt: skip
def example_size() -> Evidence:
    """Gears of the printed radius beside the mechanism of the velocity example."""
    between = 2.0 * PRINTED_RADIUS
    across, module = 2.0 * SOURCE.rod_length * math.sin(SOURCE.home_bend), 1e3 * between / 20
    computed = {
        "distance of the gear axes [m]": between,
        "analytic: twice the way from guide to platform [m]": across,
        "module of 20 teeth [mm]": module,
    }
    return evidence(computed, share=between / across, module=module)


@LEDGER.claim(
    "C40", "chapter 5, friction",
    "The friction force is at right angles to the line of action, against the sliding velocity.", "90 deg",
    holds(when=near("cosine", 1e-3, of=0.0)),  # four digits of the velocity
    fails("the velocity is not at right angles to the line of action"),
)  # fmt: skip
def across_the_line() -> Evidence:
    """Angle between the printed sliding velocity and the line of action."""
    n = np.array([math.sin(closed.PRESSURE_ANGLE), math.cos(closed.PRESSURE_ANGLE)])
    printed, statics = (float(v @ n / np.linalg.norm(v)) for v in (np.array(PRINTED_SLIDING), tooth_sliding(20, 0.03)))
    computed = {
        "printed velocity against the line of action [deg]": math.degrees(math.acos(printed)),
        "statics [deg]": math.degrees(math.acos(statics)),
    }
    return evidence(computed, cosine=printed)


@LEDGER.claim(
    "C41", "chapter 5, friction",
    "The reaction deviates from the friction force by the angle arctan f.", "arctan f from the friction force",
    holds(when=near("friction_force", 1e-9, of="arctan f [deg]")),
    misprint("arctan f = {printed:.2f} deg from the normal (the line of action), as the sentence before says; from the friction force it "
             "is {friction_force:.2f} deg",
             when=near("normal", 1e-9, of="arctan f [deg]")),
    fails("the reaction leans by another angle"),
)  # fmt: skip
def friction_angle() -> Evidence:
    """Angle of a tooth force with Coulomb friction to the friction force and to the normal."""
    normal, tangent = np.array([0.0, 1.0]), np.array([1.0, 0.0])
    reaction = normal + FRICTION * tangent
    to_tangent, to_normal = (
        math.degrees(math.acos(float(reaction @ axis) / float(np.linalg.norm(reaction)))) for axis in (tangent, normal)
    )
    printed = math.degrees(math.atan(FRICTION))
    computed = {
        "vectors: reaction against the friction force [deg]": to_tangent,
        "vectors: reaction against the normal [deg]": to_normal,
        "arctan f [deg]": printed,
    }
    return evidence(computed, friction_force=to_tangent, normal=to_normal, printed=printed)


FREE, ROUGH = closed.SOURCE_TABLE_FRICTIONLESS, closed.SOURCE_TABLE_FRICTION
"""Torques of table 1 without friction and with f = 0.16 [N m]: output link, meshes 1 to 3, drive."""
CENTI = 0.005
"""Half a unit of the last digit of table 1 [N m]."""


@LEDGER.claim(
    "C42", "chapter 5, table 1, f = 0", "Torques without friction: 50, 32.35, 32.35, 33.43, 40.12 N m.", FREE.tolist(),
    only_if("the ratios of the stages are 11/17, 1, 31/30 and 6/5: they give every digit, but are ours; the source prints no teeth",
            when=shows("torques", 2, of="printed [N m]")),
    cannot("no ratios of tooth numbers tried give the torques"),
)  # fmt: skip
def stage_ratios() -> Evidence:
    """Torques without friction as products of ratios of small tooth numbers."""
    torques = closed.torque_chain(50.0).frictionless
    computed = {
        "analytic: torques from 11/17, 1, 31/30, 6/5 [N m]": torques.round(4).tolist(),
        "printed [N m]": FREE.tolist(),
    }
    return evidence(computed, torques=torques)


@LEDGER.claim(
    "C43", "chapter 5, table 1",
    "50 N m at the output link need 40.12 N m at the drives, ratio 0.8024.", 40.12,
    only_if("the load acts through {nearest} of the ratios of chapter 4", when=below(1.0, "off_in_last_digits")),
    cannot("the text says neither about which axis the 50 N m act nor which teeth the table has; it does not say that they are the "
           "ratios of chapter 4, 0.783 and 1.4, and no simple product of these gives {total:.4f} (nearest {value:.4f})"),
)  # fmt: skip
def same_mechanism() -> Evidence:
    """Output over drive torque against simple products of the coefficients 0.783 and 1.4."""
    total = float(FREE[-1] / FREE[0])
    found = {
        f"{c:g} x 0.783^{i} x 1.4^{j}": c * 0.783**i * 1.4**j
        for c, i, j in product((0.5, 1.0, 2.0), (-1, 0, 1), (-1, 0, 1))
        if (i, j) != (0, 0)
    }
    nearest = min(found, key=lambda k: abs(found[k] / total - 1.0))
    off = abs(found[nearest] / total - 1.0)
    computed = {
        "printed: drive / output torque": total,
        f"nearest: {nearest}": found[nearest],
        "relative difference": off,
        "drive torque for 50 N m about alpha, two drives [N m]": 50.0 / (2 * 0.783),
    }
    return evidence(
        computed, off_in_last_digits=off / (2.0 * CENTI / float(FREE[-1])), total=total, value=found[nearest],
        nearest=nearest,
    )


@LEDGER.claim(
    "C44", "chapter 5, table 1, percentages", "The difference due to friction is 5, 15, 23, 23 % at the meshes.",
    [5, 15, 23, 23],
    holds(when=shows("each", 0)),
    only_if("the percentages are read as cumulative", when=shows("total", 0)),
    misprint("{correct}"),
)  # fmt: skip
def percentages() -> Evidence:
    """Percentages of the table, read stage by stage and cumulatively."""
    total = 100.0 * (ROUGH[1:] / FREE[1:] - 1.0)
    each = 100.0 * (ROUGH[1:] / ROUGH[:-1] / (FREE[1:] / FREE[:-1]) - 1.0)
    computed = {"cumulative [%]": total.round(3).tolist(), "stage by stage [%]": each.round(3).tolist()}
    return evidence(computed, each=each, total=total, correct=total.round(1).tolist())


@LEDGER.claim(
    "C45", "chapter 5, below table 1", "In the worst case friction costs 23 %.", 23,
    holds(when=shows("growth", 0)),
    misprint("{growth:.1f} %"),
)  # fmt: skip
def worst_case() -> Evidence:
    """Drive torque with and without friction."""
    growth = 100.0 * float(ROUGH[-1] / FREE[-1] - 1.0)
    computed = {"growth of the drive torque [%]": growth, "efficiency": float(FREE[-1] / ROUGH[-1])}
    return evidence(computed, growth=growth)


def _losses() -> tuple[Array, Array]:
    """Loss factor of each stage of the table, and by how much its rounded digits can be off."""
    factor = ROUGH[1:] / ROUGH[:-1] / closed.SOURCE_STAGE_RATIOS
    rounding = [0.0, *(CENTI / ROUGH[1:])]
    return factor, factor * (np.array(rounding[:-1]) + np.array(rounding[1:]))


@LEDGER.claim(
    "C46", "chapter 5, table 1, mesh 3 and drives",
    "Friction costs 23 % at mesh 3 and at the drives alike: 41.19 and 49.49 N m.", [41.19, 49.49],
    holds("the loss between them is that of a mesh", when=~below(0.0, "excess")),
    only_if("what lies between mesh 3 and the drives has no friction: the factor there is {factor:.4f}. The torque changes by 6/5 there, "
            "and a pair of teeth of this ratio would lose at least {least:.1f} %", when=below(0.5, "lost")),
    fails("the loss between them is {lost:.1f} %, less than that of a mesh"),
)  # fmt: skip
def last_mesh() -> Evidence:
    """The loss of the last stage against what any standard pair of its ratio loses at least."""
    factor, margin = _losses()
    pairs = [(6 * k, 5 * k) for k in range(3, 25)] + [(5 * k, 6 * k) for k in range(3, 25)]
    least = min(f(a, b, FRICTION) for a, b in pairs for f in (closed.approach_loss, closed.recess_loss))
    computed = {
        "loss factor of the last stage": float(factor[3]),
        "rounding": float(margin[3]),
        "analytic: least loss factor of a pair 6:5": least,
        "41.19 x 6/5 [N m]": 41.19 * 1.2,
    }
    return evidence(computed, excess=factor[3] + margin[3] - least, factor=factor[3], least=100 * (least - 1),
                    lost=100 * (factor[3] - 1))  # fmt: skip


def _fitting(stage: int, pairs: list[tuple[int, int]]) -> tuple[list[str], str, float]:
    """Pairs and phases that give the loss of a stage within its rounding, and the nearest one."""
    factor, margin = _losses()
    found = {
        f"{a}:{b} {phase}": tooth_loss(a, b, FRICTION, phase) for a, b in pairs for phase in ("approach", "recess")
    }
    nearest = min(found, key=lambda k: abs(found[k] - factor[stage]))
    return [k for k, v in found.items() if abs(v - factor[stage]) <= margin[stage]], nearest, found[nearest]


@LEDGER.claim(
    "C47", "chapter 5, table 1, mesh 2, f = 0.16", "Mesh 2 raises the torque from 33.97 to 37.05 N m.", [33.97, 37.05],
    only_if("the pair is {pairs}; one fit in a search over many pairs, no proof", when=true("fits")),
    cannot("tooth numbers are not given, and no pair of equal gears fits (nearest {nearest}: {value:.4f})"),
)  # fmt: skip
def second_mesh() -> Evidence:
    """Equal gears with the loss of the second stage."""
    factor, margin = _losses()
    fits, nearest, value = _fitting(1, [(z, z) for z in range(12, 131)])
    computed = {
        "loss factor of stage 2": float(factor[1]),
        "rounding": float(margin[1]),
        "statics: pairs that fit": fits,
        f"statics: {nearest}": value,
    }
    return evidence(computed, fits=bool(fits), pairs=" or ".join(fits), nearest=nearest, value=value)


@LEDGER.claim(
    "C48", "chapter 5, table 1, meshes 1 and 3, f = 0.16",
    "Meshes 1 and 3 raise the torques to 33.97 and 41.19 N m.", [33.97, 41.19],
    only_if("the pairs are those that fit", when=true("fits")),
    cannot("tooth numbers are not given, and no standard spur pair of these ratios up to 130 teeth has these losses"),
)  # fmt: skip
def other_meshes() -> Evidence:
    """Pairs of the ratio of stages 1 and 3."""
    factor, _ = _losses()
    computed: dict[str, Any] = {}
    found = []
    for stage, (a, b) in ((0, (11, 17)), (2, (31, 30))):
        pairs = [(a * k, b * k) for k in range(1, 13) if 12 <= min(a * k, b * k) and max(a * k, b * k) <= 130]
        fits, nearest, value = _fitting(stage, pairs)
        computed |= {
            f"loss factor of stage {stage + 1}": float(factor[stage]),
            f"statics: pairs that fit stage {stage + 1}": fits,
            f"statics: {nearest}": value,
        }
        found.append(bool(fits))
    return evidence(computed, fits=found)
