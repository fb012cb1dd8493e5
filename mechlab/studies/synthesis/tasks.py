"""The tasks by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from mechlab.analytic.gear_linkage import TARGETS
from mechlab.errors import unknown
from mechlab.experiment.entry import Entry
from mechlab.progress import silent
from mechlab.studies.synthesis.dwells import dwell
from mechlab.studies.synthesis.functions import function
from mechlab.studies.synthesis.gears import closed_differential, gear_linkage, planetary
from mechlab.studies.synthesis.given import Given
from mechlab.studies.synthesis.linkages import path
from mechlab.studies.synthesis.motions import motion
from mechlab.studies.synthesis.result import SynthesisResult
from mechlab.studies.synthesis.segments import straight_line

TASKS: dict[str, tuple[tuple[str, ...], Callable[[Given], SynthesisResult]]] = {
    "motion": (("x", "y", "angle", "chain", "arm", "size", "transmission_angle_min", "limit"), motion),
    "path": (("x", "y", "angle", "chain", "size", "transmission_angle_min", "limit"), path),
    "function": (
        ("x", "y", "points", "turn", "turn_out", "first", "first_out", "chain", "ratio", "transmission_angle_min", "ground", "limit"),
        function,
    ),
    "straight_line": (("length", "angle", "size", "transmission_angle_min", "limit"), straight_line),
    "dwell": (("angle", "swing", "segment", "clearance", "crank", "size", "transmission_angle_min", "limit"), dwell),
    "planetary": (("ratio", "planets", "z1", "z2", "z3", "z4", "pressure_angle_max", "limit"), planetary),
    "gear_linkage": (("coupler", "rocker", "idler_radius", "frame", "mode", *TARGETS), gear_linkage),
    "closed_differential": (("ratio_36_braked", "ratio_14_braked", "planets", "teeth", "tolerance", "limit"), closed_differential),
}
"""Tasks by name: the keys that they take, and their function."""


def synthesize(
    task: str, values: Mapping[str, Any], find: Callable[[str], Entry], progress: Callable[[int, int], None] = silent
) -> SynthesisResult:
    """Run a task; find(name) is an entry of the catalog, by which what was found is built and verified; progress hears (done, total).

    Raises MechlabError for an unknown task or key, listing those that exist, or for a bad value; NoSolution when no dimensions have the
    wanted properties.
    """
    if task not in TASKS:
        raise unknown("the task", task, TASKS)
    keys, run = TASKS[task]
    for key in values:
        if key not in keys:
            raise unknown(f"synthesize {task}: key", key, keys)
    return run(Given(task, values, find, progress))
