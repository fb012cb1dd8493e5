"""CPU time of `track` for one pose, beside placo where MECHLAB_PLACO names a Python with it.

python -m tests.benchmarks.bench_track
"""

from __future__ import annotations

import os

import mechlab as ml
from mechlab.tables import table
from tests.studies.test_track_placo import ITERATIONS, cases, job, placo

POSES = 201


def main() -> None:
    python, rows = os.environ.get("MECHLAB_PLACO"), []
    for name, case in cases(POSES).items():
        m, frame, path, _, _ = case
        best = min((ml.track(m, {frame: path}) for _ in range(3)), key=lambda x: x.cpu_s)
        theirs = f"{1e3 * placo(python, job(*case))['step_s']:.3f}" if python else "-"
        rows.append([name, m.nv, f"{1e3 * best.cpu_s / POSES:.2f}", f"{best.steps / POSES:.1f}", theirs])
    print(table(["mechanism", "coordinates", "ms a pose", "steps a pose", f"placo, {ITERATIONS} solves [ms]"], rows))


if __name__ == "__main__":
    main()
