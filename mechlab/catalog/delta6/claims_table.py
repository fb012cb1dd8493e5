"""Claims of the thesis abstract on table 1, the torques with and without friction."""

from __future__ import annotations

from itertools import product

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.claims_freedoms import THESIS
from mechlab.catalog.delta6.claims_velocity import shows
from mechlab.catalog.delta6.tooth_statics import loss
from mechlab.experiment.entry import Claim, ClaimResult, Verdict
from mechlab.mechanism.geometry import Array

FREE, ROUGH, FRICTION = closed.SOURCE_TABLE_FRICTIONLESS, closed.SOURCE_TABLE_FRICTION, 0.16
CENTI = 0.005
"""Half a unit of the last digit of table 1 [N m]."""


def stage_ratios() -> ClaimResult:
    """Torques without friction as products of ratios of small tooth numbers."""
    chain = closed.torque_chain(50.0)
    computed = {
        "analytic: torques from 11/17, 1, 31/30, 6/5 [N m]": chain.frictionless.round(4).tolist(),
        "printed [N m]": FREE.tolist(),
    }
    if shows(chain.frictionless, FREE, 2):
        return ClaimResult(computed, Verdict.HOLDS, "as ratios 11/17, 1, 31/30 and 6/5")
    return ClaimResult(computed, Verdict.CANNOT, "no ratios of tooth numbers tried give the torques")


def same_mechanism() -> ClaimResult:
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
    if off < 2.0 * CENTI / float(FREE[-1]):
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(
        computed,
        Verdict.FAILS,
        f"no simple product of 0.783 and 1.4 gives the total ratio {total:.4f} (nearest {found[nearest]:.4f})",
    )


def percentages() -> ClaimResult:
    """Percentages of the table, read stage by stage and cumulatively."""
    printed = [5.0, 15.0, 23.0, 23.0]
    total = 100.0 * (ROUGH[1:] / FREE[1:] - 1.0)
    each = 100.0 * (ROUGH[1:] / ROUGH[:-1] / (FREE[1:] / FREE[:-1]) - 1.0)
    computed = {"cumulative [%]": total.round(3).tolist(), "stage by stage [%]": each.round(3).tolist()}
    if shows(each, printed, 0):
        return ClaimResult(computed, Verdict.HOLDS)
    if shows(total, printed, 0):
        return ClaimResult(computed, Verdict.HOLDS_ONLY_IF, "the percentages are read as cumulative")
    return ClaimResult(computed, Verdict.MISPRINT, str(total.round(1).tolist()))


def worst_case() -> ClaimResult:
    """Drive torque with and without friction."""
    growth = 100.0 * float(ROUGH[-1] / FREE[-1] - 1.0)
    computed = {"growth of the drive torque [%]": growth, "efficiency": float(FREE[-1] / ROUGH[-1])}
    if shows([growth], [23.0], 0):
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(computed, Verdict.MISPRINT, f"{growth:.1f} %")


def _losses() -> tuple[Array, Array]:
    """Loss factor of each stage of the table, and by how much its rounded digits can be off."""
    factor = ROUGH[1:] / ROUGH[:-1] / closed.SOURCE_STAGE_RATIOS
    rounding = [0.0, *(CENTI / ROUGH[1:])]
    return factor, factor * (np.array(rounding[:-1]) + np.array(rounding[1:]))


def last_mesh() -> ClaimResult:
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
    if factor[3] + margin[3] >= least:
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(
        computed,
        Verdict.FAILS,
        f"the last stage has no friction loss in it: factor {factor[3]:.4f}, while a pair of this ratio loses "
        f"at least {100 * (least - 1):.1f} %",
    )


def _fitting(stage: int, pairs: list[tuple[int, int]]) -> tuple[list[str], str, float]:
    """Pairs and phases that give the loss of a stage within its rounding, and the nearest one."""
    factor, margin = _losses()
    found = {f"{a}:{b} {phase}": loss(a, b, FRICTION, phase) for a, b in pairs for phase in ("approach", "recess")}
    nearest = min(found, key=lambda k: abs(found[k] - factor[stage]))
    return [k for k, v in found.items() if abs(v - factor[stage]) <= margin[stage]], nearest, found[nearest]


def second_mesh() -> ClaimResult:
    """Equal gears with the loss of the second stage."""
    factor, margin = _losses()
    fits, nearest, value = _fitting(1, [(z, z) for z in range(12, 131)])
    computed = {
        "loss factor of stage 2": float(factor[1]),
        "rounding": float(margin[1]),
        "statics: pairs that fit": fits,
        f"statics: {nearest}": value,
    }
    if fits:
        return ClaimResult(
            computed,
            Verdict.HOLDS_ONLY_IF,
            f"the pair is {' or '.join(fits)}; one fit in a search over many pairs, no proof",
        )
    return ClaimResult(
        computed,
        Verdict.CANNOT,
        f"tooth numbers are not given, and no pair of equal gears fits (nearest {nearest}: {value:.4f})",
    )


def other_meshes() -> ClaimResult:
    """Pairs of the ratio of stages 1 and 3."""
    factor, _ = _losses()
    computed: dict[str, object] = {}
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
    if all(found):
        return ClaimResult(computed, Verdict.HOLDS_ONLY_IF, "the pairs are those that fit")
    return ClaimResult(
        computed,
        Verdict.CANNOT,
        "tooth numbers are not given, and no standard spur pair of these ratios up to 130 teeth has these losses",
    )


CLAIMS = (
    Claim("C42", "chapter 5, table 1, f = 0",
          "Torques without friction: 50, 32.35, 32.35, 33.43, 40.12 N m.", FREE.tolist(), stage_ratios, THESIS),
    Claim("C43", "chapter 5, table 1 against chapter 4",
          "The table is that of the mechanism of the velocity example (ratios 0.783 and 1.4).", "same mechanism", same_mechanism, THESIS),
    Claim("C44", "chapter 5, table 1, percentages",
          "The difference due to friction is 5, 15, 23, 23 % at the meshes.", [5, 15, 23, 23], percentages, THESIS),
    Claim("C45", "chapter 5, below table 1", "In the worst case friction costs 23 %.", 23, worst_case, THESIS),
    Claim("C46", "chapter 5, table 1, drives",
          "The torque of the drives, 49.49 N m, includes the friction of the last mesh.", 49.49, last_mesh, THESIS),
    Claim("C47", "chapter 5, table 1, mesh 2, f = 0.16",
          "Mesh 2 raises the torque from 33.97 to 37.05 N m.", [33.97, 37.05], second_mesh, THESIS),
    Claim("C48", "chapter 5, table 1, meshes 1 and 3, f = 0.16",
          "Meshes 1 and 3 raise the torques to 33.97 and 41.19 N m.", [33.97, 41.19], other_meshes, THESIS),
)  # fmt: skip
