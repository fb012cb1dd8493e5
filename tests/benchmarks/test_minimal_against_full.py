"""Steps per second of the exact reduction against the train with every planet. Run with -s to see the numbers.

The best of six turns each, MuJoCo 4.0.0. Speed is not asserted: machines differ.
"""

import time

import mujoco
import pytest

from mechlab.engines.mujoco.model import to_mujoco
from mechlab.experiment.scene import Settings
from mechlab.mechanism import Mechanism
from mechlab.mechanism.reduction import reduce
from tests.mechanism.trains import closed_differential

STEPS, REPEATS = 10_000, 6


def steps_per_second(m: Mechanism, settings: Settings) -> float:
    model, data = to_mujoco(m, settings)
    mujoco.mj_step(model, data, nstep=100)
    start = time.perf_counter()
    mujoco.mj_step(model, data, nstep=STEPS)
    return STEPS / (time.perf_counter() - start)


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["RK4", "implicitfast"])
def test_minimal_against_full(integrator: str) -> None:
    full = closed_differential(3)
    small = reduce(full).mechanism
    settings = Settings(integrator=integrator)
    assert (small.nv, len(small.relations)) == (2, 0) and (full.nv, len(full.relations)) == (10, 12)
    best = {"minimal": 0.0, "full": 0.0}
    for _ in range(REPEATS):  # turn by turn, so that both meet the same load of the machine
        for name, m in (("minimal", small), ("full", full)):
            best[name] = max(best[name], steps_per_second(m, settings))
    line = f"minimal {best['minimal']:.0f}, full {best['full']:.0f} steps/s, {best['minimal'] / best['full']:.2f} times"
    print(f"\n{integrator}: {line}")
    assert all(x > 0 for x in best.values())
