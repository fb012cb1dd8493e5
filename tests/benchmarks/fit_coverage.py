"""How often the 95 % intervals of a fit contain the true value: noisy simulated data of designs off their defaults.

    python -m tests.benchmarks.fit_coverage [REPETITIONS]

For an interval that is right, 95 % of all intervals contain the truth; with n of them the share scatters by sqrt(.05 x .95 / n).
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

import mechlab as ml
from mechlab.mechanism.geometry import Array
from mechlab.tables import table
from tests.studies.measured import clean_run, noisy


@dataclass(frozen=True, eq=False)
class CoverageCase:
    """A mechanism, its scene, the true parameters (none at its default), measured channels with their noise, the times [s]."""

    name: str
    scene: str
    true: Mapping[str, float]
    noise: Mapping[str, float]
    times: Array
    fixed: tuple[str, ...] = ()

    @property
    def free(self) -> tuple[str, ...]:
        """The parameters that are fitted."""
        return tuple(n for n in self.true if n not in self.fixed)


CASES = {
    "fourbar": CoverageCase(
        "fourbar", "constant-torque", {"mass_per_length": 1.2, "gravity": 9.6, "crank": 0.105, "torque": 0.22},
        {"crank_angle": 2e-3, "rocker_angle": 2e-3}, np.linspace(0.01, 0.5, 50), ("torque",),
    ),
    "impulse_transmission": CoverageCase(
        "impulse_transmission", "fig7", {"J1": 12.5, "h": 0.08, "c": 450.0}, {"alpha_rate": 0.02, "beta": 5e-4},
        np.linspace(0.005, 0.2, 60),
    ),
    "delta6": CoverageCase(
        "delta6", "pose-sweep", {"rod_length": 0.36, "platform_mass": 0.5, "slider_mass": 0.4},
        {"q1": 1e-4, "q2": 1e-4, "O_x": 1e-4, "q1_force": 0.1, "q2_force": 0.1}, np.linspace(0.01, 0.5, 50),
    ),
}  # fmt: skip


@cache
def _clean(case: CoverageCase) -> dict[str, Array]:
    return clean_run(case.name, case.scene, case.true, tuple(case.noise), case.times)


def covered(case: CoverageCase, seeds: Iterable[int]) -> tuple[int, int, bool]:
    """Intervals that contain the truth, all intervals, and whether every fit was trusted."""
    inside = count = 0
    trusted = True
    for seed in seeds:
        data = noisy(_clean(case), case.noise, seed)
        found = ml.fit(case.name, data, {n: case.true[n] for n in case.fixed}, free=case.free, scene=case.scene)
        trusted &= found.exit_code == 0
        for name in case.free:
            count += 1
            inside += found[name].low <= case.true[name] <= found[name].high
    return inside, count, trusted


def main(repetitions: int) -> None:
    """Print a row for each case."""
    rows = []
    for name, case in CASES.items():
        before = time.process_time()
        inside, count, trusted = covered(case, range(repetitions))
        scatter = 100.0 * np.sqrt(0.05 * 0.95 / count)
        each = (time.process_time() - before) / repetitions
        rows.append((name, ", ".join(case.free), f"{inside} of {count}", f"{100.0 * inside / count:.1f} +- {scatter:.1f} %",
                     "yes" if trusted else "no", f"{each:.2g}"))  # fmt: skip
    print(table(("mechanism", "fitted", "truth inside", "share (95 expected)", "all trusted", "CPU s a fit"), rows))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
