"""--max-error on the benchmark problems; run it: python tests/benchmarks/bench_max_error.py [repeats]. No limits are asserted.

Prints for each problem and target: the true error (against the entry's own equations, 1e-12 or better), the estimate, the CPU
time of everything that was spent (probing and check included; imports and building of models excluded; the smallest of the
repeats, since other work on the machine only adds), and what was chosen.
"""

from __future__ import annotations

import sys
from importlib import metadata

import numpy as np

from mechlab import api
from mechlab.lab.accuracy.solve import solve_to
from mechlab.lab.methods import Problem
from mechlab.studies.chart.score import reference_of, tracked

PROBLEMS: tuple[tuple[str, dict[str, object]], ...] = (
    ("pendulum", {}),
    ("n_fourbar", {"N": 2}),
    ("andrews", {}),
    ("bricard", {}),
    ("flyball", {}),
    ("slider_crank", {}),
    ("n_fourbar", {"N": 7}),
    ("n_fourbar", {"N": 20}),
    ("n_fourbar", {"N": 40, "duration": 20.0}),
)
TARGETS = (1e-3, 1e-6, 1e-9)


def main(repeats: int = 3) -> None:
    """Print the table."""
    print(", ".join(f"{n} {metadata.version(n)}" for n in ("numpy", "scipy", "mujoco", "pin")))
    print(f"{'problem':34s}{'target':>8s}{'error':>10s}{'estimate':>10s}{'CPU ms':>9s}  met  method")
    for name, changes in PROBLEMS:
        lived = api.load(name, **changes).for_scene(None)
        problem = Problem(lived, lived.scene())
        truth = reference_of(problem)
        for target in TARGETS:
            runs = [solve_to(lived, problem.scene, target) for _ in range(repeats)]
            best = min(runs, key=lambda r: r.cpu_s)
            error = float(np.max(np.abs(tracked(problem, truth.names, best.q, best.v) - truth.values)))
            told = f"{name} {' '.join(f'{k}={v}' for k, v in changes.items())}"
            print(
                f"{told:34s}{target:8.0e}{error:10.1e}{best.estimate:10.1e}{1e3 * best.cpu_s:9.2f}  "
                f"{'yes' if best.reached else 'no ':3s}  {best.method}, {best.control} {best.step:.3g}",
                flush=True,
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 3)
