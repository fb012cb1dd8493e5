"""Random parameters, every scene of the catalog: is a motion under --max-error ever wrong by more than it states?

    python -m tests.benchmarks.stated_errors [rounds] [first seed] [mechanism ...]

A round draws for each mechanism a scene, up to three parameters (0.6 to 1.6 times their default), a target from 1e-3 to 1e-9
and a duration, solves it, and holds it against the entry's own equations, else against Pinocchio at 1e-12. Prints a line
for each case, and counts: wrong (more than the target while it says that this is met), surprising (more than ten times the
estimate), not reached, refused by its mechanism, without a reference. Parameters that a mechanism refuses are no fault;
everything else that is raised is.
"""

from __future__ import annotations

import dataclasses
import sys
import time
from collections import Counter

import numpy as np

import mechlab as ml
from mechlab import catalog
from mechlab.errors import MechlabError
from mechlab.experiment.entry import Entry
from mechlab.lab.accuracy.solve import solve_to
from mechlab.lab.methods import Problem
from mechlab.studies.chart.score import reference_of, tracked

TARGETS, SHARES, LONGEST = (1e-3, 1e-5, 1e-7, 1e-9), (0.2, 0.5, 1.0), 3.0
RESOLVED = 1e-10
"""Errors below this one [m or rad] are those of the references."""


def drawn(rng: np.random.Generator, entry: Entry) -> dict[str, float]:
    """Up to three parameters that are numbers, but no durations."""
    fields = [f for f in dataclasses.fields(entry.parameters) if isinstance(f.default, float) and f.default]
    fields = [f for f in fields if "duration" not in f.name]
    chosen = rng.permutation(len(fields))[: int(rng.integers(0, 4))]
    return {fields[i].name: float(fields[i].default * rng.uniform(0.6, 1.6)) for i in chosen}


def case(name: str, seed: int) -> tuple[str, str]:
    """What became of one case, and the line that says so."""
    entry = catalog.entry(name)
    rng = np.random.default_rng([seed, catalog.NAMES.index(name)])
    scene, changes = str(rng.choice(list(entry.scenes))), drawn(rng, entry)
    target, share = float(rng.choice(TARGETS)), float(rng.choice(SHARES))
    told = f"{name} {scene} {target:.0e} x {share} {' '.join(f'{k}={v:.17g}' for k, v in changes.items())}"
    try:
        lived = ml.load(name, **changes).for_scene(scene)
        plan = lived.scene(scene)
        problem = Problem(lived, dataclasses.replace(plan, duration=share * min(plan.duration, LONGEST)))
        began = time.perf_counter()
        found = solve_to(lived, problem.scene, target)
        wall = time.perf_counter() - began
    except MechlabError as why:
        return "refused", f"{told}: {why}"
    try:
        truth = reference_of(problem)
    except MechlabError as why:
        return "no reference", f"{told}: {why}"
    error = float(np.max(np.abs(tracked(problem, truth.names, found.q, found.v) - truth.values)))
    own = np.nan_to_num(truth.own_error)
    line = f"{told}: {found.method}, error {error:.1e} ({own:.0e}), estimate {found.estimate:.1e}, {wall:.1f} s"
    if error <= RESOLVED:
        return "right", line
    if found.reached and error > target + 10.0 * own:
        return "wrong", line
    if error > 10.0 * (found.estimate + own):
        return "surprising", line
    return "right" if found.reached else "not reached", line


def main(rounds: int = 3, first: int = 0, names: tuple[str, ...] = ()) -> None:
    """Run and print."""
    counts: Counter[str] = Counter()
    for seed in range(first, first + rounds):
        for name in names or catalog.NAMES:
            outcome, line = case(name, seed)
            counts[outcome] += 1
            print(f"{outcome:13s}{seed:5d} {line}", flush=True)
    print(", ".join(f"{k}: {n}" for k, n in counts.items()))


if __name__ == "__main__":
    numbers = [int(x) for x in sys.argv[1:] if x.isdigit()]
    main(*(numbers or [3])[:2], names=tuple(x for x in sys.argv[1:] if not x.isdigit()))
