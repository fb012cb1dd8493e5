"""Workspace of the delta: CPU time and peak memory for 8.1 million nodes, and against the number of nodes.

Run as `python tests/benchmarks/bench_workspace.py`; prints a table, asserts nothing.
"""

from __future__ import annotations

import resource
import time

import numpy as np

from mechlab import api
from mechlab.analytic import delta6
from mechlab.studies.workspace.plan import plan
from mechlab.studies.workspace.study import workspace
from mechlab.studies.workspace.survey import survey
from mechlab.values import Range

ALL = {"least_condition": 0.1, "least_clearance": 0.05}


def grid(count: int) -> dict[str, Range]:
    """The source's cube with `count` nodes an axis."""
    return dict.fromkeys("xyz", Range(-1.0, 1.0, count))


def row(what: str, nodes: int, began: float) -> None:
    """CPU time and peak memory so far."""
    cpu, peak = time.process_time() - began, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    print(f"{what:58s} {nodes:12d} {cpu:9.3f} {1e9 * cpu / nodes:9.1f} {peak:9.0f}")


def main() -> None:
    """Print the table."""
    design = api.load("delta6", bend_limit=np.radians(60.0))
    geom = design.parameters.geometry
    print(f"{'what':58s} {'nodes':>12s} {'CPU [s]':>9s} {'ns/node':>9s} {'peak [MB]':>9s}")
    began = time.process_time()
    delta6.workspace_counts(geom, bend_limit=np.radians(60.0))
    row("counts by columns (closed form)", 201**3, began)
    made = plan(design, grid(201))
    began = time.process_time()
    for cut in made.grid.slabs():
        made.region.decide(made.grid.points(*cut))
    row("margins and deciding clause: reach, sliders, bend", 201**3, began)
    for name, asked in (("survey: reach, sliders, bend", {}), ("survey: also condition and clearance", ALL)):
        chosen = plan(design, grid(201) | asked)
        began = time.process_time()
        survey(chosen.region, chosen.grid)
        row(name, 201**3, began)
    began = time.process_time()
    workspace(design, grid(201) | ALL)
    row("mechlab workspace: survey with all clauses, and four maps", 201**3, began)
    for count in (41, 87, 187, 403, 600):
        chosen = plan(design, grid(count) | ALL)
        began = time.process_time()
        survey(chosen.region, chosen.grid)
        row(f"survey with all clauses, {count} nodes an axis", count**3, began)


if __name__ == "__main__":
    main()
