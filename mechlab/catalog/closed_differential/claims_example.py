"""Claims of the source's numeric example: speeds, moments, radii, misprints; with both tooth sets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic import differential as closed
from mechlab.catalog.closed_differential.build import build
from mechlab.catalog.closed_differential.looks import planet_name
from mechlab.catalog.closed_differential.parameters import SOURCE, STATED_TEETH, USED_TEETH
from mechlab.catalog.closed_differential.probes import EXAMPLE, answers, rounded
from mechlab.experiment.entry import Claim, ClaimResult, Verdict
from mechlab.kit.witness import room

PRINTED_SPEEDS = (50.0, 33.33, 200.0)
PRINTED_MOMENTS = (40.0, 60.0, 20.0, 180.0)
MILLI = 1e-3


def _example(keys: Sequence[str], printed: Sequence[float], tolerance: float) -> ClaimResult:
    """A printed row of the example against all witnesses, for both tooth sets."""
    computed: dict[str, Any] = {}
    fits: dict[str, list[bool]] = {name: [] for name in EXAMPLE}
    for name, p in EXAMPLE.items():
        for who, values in answers(p, w_H1=100.0).items():
            row = [float(values[k]) for k in keys]
            computed[f"{who}, {name}"] = rounded(row)
            fits[name].append(bool(np.allclose(row, printed, rtol=0, atol=tolerance)))
    if all(fits["stated teeth"]):
        return ClaimResult(computed, Verdict.HOLDS)
    if all(fits["used teeth"]):
        other = computed["analytic, stated teeth"]
        because = (
            f"the train has the teeth {', '.join(map(str, USED_TEETH))}, which are the radii of the computation over the "
            f"module; the stated teeth {', '.join(map(str, STATED_TEETH))} give {', '.join(f'{x:g}' for x in other)}"
        )
        return ClaimResult(computed, Verdict.HOLDS_ONLY_IF, because)
    return ClaimResult(computed, Verdict.FAILS, "no tooth set of the source gives these numbers")


def example_speeds() -> ClaimResult:
    """w_H2, w3, w1."""
    return _example(("w_H2", "w3", "w1"), PRINTED_SPEEDS, 5e-3)


def example_moments() -> ClaimResult:
    """M21, M23, M54, M56."""
    return _example(("M21", "M23", "M54", "M56"), PRINTED_MOMENTS, 1e-9)


def carrier_radii() -> ClaimResult:
    """Radii of the planet axes for module 4 mm and the stated teeth, from the poses of the models."""
    p = replace(EXAMPLE["stated teeth"], module=4 * MILLI)
    m = build(p, "parts")
    names = [f"{planet_name(stage)}_1" for stage in (1, 2)]
    pose = room("pinocchio").PinKinematics(m)
    model, data = room("mujoco").to_mujoco(m)
    view = room("mujoco").MujocoMap(m, model)
    computed = {
        "analytic: m (z1 + z2)/2, m (z4 + z5)/2 [mm]": rounded(np.array(p.radii) / MILLI),
        "pinocchio: distance of the axes [mm]": rounded([np.hypot(*pose.pose(n)[1][:2]) / MILLI for n in names]),
        "mujoco: distance of the axes [mm]": rounded([np.hypot(*data.xpos[view.body(n)][:2]) / MILLI for n in names]),
    }
    found = list(computed.values())
    if all(np.allclose(x, [240.0, 400.0]) for x in found):
        return ClaimResult(computed, Verdict.HOLDS)
    right = found[0]
    if all(np.allclose(x, right, atol=1e-9) for x in found):
        because = f"{right[0]:g} and {right[1]:g} mm: diameters were taken for radii; harmless, only ratios enter"
        return ClaimResult(computed, Verdict.MISPRINT, because)
    return ClaimResult(computed, Verdict.FAILS, "the witnesses disagree")


def bracket() -> ClaimResult:
    """The bracket (1+15) in the formula for w3, read as printed and as 1 + 1.5."""
    train = EXAMPLE["used teeth"].train
    read = {
        text: (50.0 * (1 - train.u46) - 100.0 * (1 + x)) / (train.u13 - train.u46)
        for text, x in (("15", 15.0), ("1.5", 1.5))
    }
    engines = {who: float(v["w3"]) for who, v in answers(EXAMPLE["used teeth"], w_H1=100.0).items()}
    computed = {f"analytic: w3 with 1 + {k}": rounded(v) for k, v in read.items()} | {
        f"{k}: w3": v for k, v in engines.items()
    }
    good = {k: all(abs(v - x) < 1e-9 for x in engines.values()) for k, v in read.items()}
    if good["15"]:
        return ClaimResult(computed, Verdict.HOLDS)
    if good["1.5"]:
        return ClaimResult(computed, Verdict.MISPRINT, "1 + 1.5, as u13 = -1.5; the printed result 33.33 used it")
    return ClaimResult(computed, Verdict.FAILS, "neither reading gives the printed result")


def step_label() -> ClaimResult:
    """The step 'from (17)': -1.5 (33.33 - 100) + 100."""
    p = EXAMPLE["used teeth"]
    train, v = p.train, closed.speeds(p.train, w_H1=100.0, w_H2=50.0)
    by_16, by_17 = train.u13 * (v.w3 - v.w_H1) + v.w_H1, train.u46 * (v.w3 - v.w_H2) + v.w_H2
    computed = {"analytic: factor of (16)": train.u13, "analytic: factor of (17)": train.u46,
                "analytic: w1 by (16)": rounded(by_16), "analytic: w1 by (17)": rounded(by_17)}  # fmt: skip
    computed |= {f"{who}: w1": rounded(x["w1"]) for who, x in answers(p, w_H1=100.0).items() if who != "analytic"}
    if abs(train.u46 + 1.5) < 1e-9:
        return ClaimResult(computed, Verdict.HOLDS)
    if abs(train.u13 + 1.5) < 1e-9 and abs(by_16 - by_17) < 1e-9:
        return ClaimResult(computed, Verdict.MISPRINT, "(16): the factor -1.5 is u13. Both formulas give the same w1")
    return ClaimResult(computed, Verdict.FAILS, "neither formula has this factor")


CLAIMS = (
    Claim("E1", "example, steps 1 to 3", "w_H1 = 100 rad/s, M_H1 = 100 N m, M_H2 = 200 N m give w_H2, w3, w1.",
          list(PRINTED_SPEEDS), example_speeds, SOURCE),
    Claim("E2", "example, moments on the wheels", "M21, M23, M54, M56 [N m].", list(PRINTED_MOMENTS), example_moments, SOURCE),
    Claim("E3", "example, data", "Radii of the carriers for module 4 mm and the stated teeth.", "240, 400 mm", carrier_radii, SOURCE),
    Claim("E4", "example, formula for w3", "The bracket is (1+15).", "1+15", bracket, SOURCE),
    Claim("E5", "example, formula for w1", "w1 is computed from (17) with the factor -1.5.", "(17)", step_label, SOURCE),
)  # fmt: skip
