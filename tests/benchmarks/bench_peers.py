"""`--max-error` against the fastest of other people's engines on the benchmark problems, both by the same clock.

    python -m tests.benchmarks.bench_peers [PROBLEM ...]

Ours: all CPU time from the call to the recording, models built anew. Theirs: building the model, stepping, output, at the best
setting of the best engine (`mechlab.studies.chart.peers`). Needs the extra [peers]; takes a minute of CPU for a problem.
"""

from __future__ import annotations

import math
import sys

from mechlab import api
from mechlab.lab.methods import Problem
from mechlab.studies.chart.data import PeerRow, PeerTable
from mechlab.studies.chart.peers import compare
from mechlab.studies.chart.score import reference_of
from tests.benchmarks.rows import Row

PROBLEMS = ("pendulum", "n_fourbar", "andrews", "bricard", "flyball", "slider_crank")


def table(name: str) -> PeerTable:
    """The comparison of a problem at its own scene."""
    design = api.load(name).for_scene(None)
    problem = Problem(design, design.scene())
    return compare(problem, reference_of(problem))


def row(name: str, found: PeerTable, r: PeerRow) -> Row:
    """A target of a problem. Where no peer meets it, the reference is the time after which none was refined further."""
    title = f"{name} to {r.target:.0e} {found.unit}"
    if not r.ours_reached or not r.ours_error <= r.target:
        title += f" (not reached: {r.ours_error:.1e})"
    asked = "ratio <= 1" if (name, r.target) == ("pendulum", 1e-3) else "ratio <= 0.5"
    if r.peer:
        return Row(title, r.ours_cpu_s, "s", r.peer, r.peer_cpu_s, asked)
    if not found.versions:
        return Row(title, r.ours_cpu_s, "s", "no peer is installed", math.nan, asked)
    beside = f"no peer meets it ({r.peer_error:.0e}); ended at"
    return Row(title, r.ours_cpu_s, "s", beside, found.costly, asked)


def rows(names: tuple[str, ...] = PROBLEMS) -> list[Row]:
    """Every problem at the three targets."""
    return [row(name, found, r) for name in names for found in [table(name)] for r in found.rows]


if __name__ == "__main__":
    for one in rows(tuple(sys.argv[1:]) or PROBLEMS):
        print(f"{one.name:32s} {one.value:9.3g} s {one.beside:45s} {one.reference:9.3g} s  ratio {one.ratio:.3g}")
