"""Loads that rigid bodies leave undetermined are named: those of which two engines give different ones."""

import dataclasses

import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.protocol import engine
from mechlab.experiment.scene import Settings
from mechlab.lab.single_run import complete

SHARP = Settings("pinocchio", "DOP853", tolerance=1e-10, preset="sharp")
FIRST = {"fourbar": "free-run", "slider_crank": "free-run", "rscr": "driven"}
VOID = ("oldham", "thompson", "agile_eye", "watt_governor", "sarrus")


@pytest.mark.parametrize("name", [*FIRST, *VOID])
def test_loads_that_engines_choose_are_named(name: str) -> None:
    scene = FIRST.get(name, "driven")
    design = ml.load(name).for_scene(scene)
    plan = dataclasses.replace(design.scene(scene), duration=0.02)
    m = design.mechanism(plan.fidelity)
    ours = ml.simulate(design, scene=scene, duration=plan.duration)
    theirs = complete(design, engine("pinocchio").run(m, plan, SHARP, ours.t.tolist()), plan)
    at = np.searchsorted(theirs.t, ours.t * (1.0 - 1e-12))
    apart = set()
    for loop in m.loops:
        names = [n for x in ("fx", "fy", "fz", "mx", "my", "mz") if (n := f"{loop.name}_{x}") in ours.channels]
        both = [(ours.channels[n], theirs.channels[n][at]) for n in names]
        size = max(float(np.max(np.abs(b))) for pair in both for b in pair)
        # two engines know a determined load to 1e-4
        if max(float(np.max(np.abs(a - b))) for a, b in both) > 1e-3 * size:
            apart.add(loop.name)
    found = [f for f in ours.health.findings if f.name == "shared_loads"]
    assert bool(found) == bool(apart) == (name in VOID)
    assert all(f.severity == "warning" and all(loop in f.sentence for loop in apart) and f.value == len(apart) for f in found)
