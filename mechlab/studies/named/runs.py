"""Numbers that are read from a run, from a check or from a cycle, and the short runs that show which of them exist."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechlab.errors import MechlabError, NoSolution, Untrustworthy, unknown
from mechlab.experiment.recording import Recording
from mechlab.lab.design import Design
from mechlab.lab.fidelity.choose import chosen_scene
from mechlab.lab.run import run_scene
from mechlab.mechanism.geometry import Array
from mechlab.studies.check.check import checks_of
from mechlab.studies.cycle.cycle import CycleResult
from mechlab.studies.named.number import NamedNumber, reduced, reduced_finite

FEW_STEPS = 4
"""Number of steps of a run that only shows which channels and findings exist."""
POLE = 1e3
"""A column of a cycle has a pole where a value between positions exceeds every value at a position by this factor."""


def short_run(
    design: Design, scene: str | None, extra: Mapping[str, float], timestep: float | None = None, **run: Any
) -> Recording:
    """A few steps of a run, for its channels and findings. run: further options of `run_scene`."""
    step = timestep or chosen_scene(design.for_scene(scene), scene, None).settings.timestep
    return run_scene(design, scene, duration=FEW_STEPS * step, timestep=timestep, extra=extra, **run)


def channel(design: Design, recording: Recording, name: str) -> Array:
    """A channel (n,) of the run, or one of the entry that the scene does not record."""
    if name not in recording.channels and name in design.entry.channels:
        return np.asarray(design.entry.channels[name][1](design.parameters, recording))
    return recording.channel(name)


def finding(recording: Recording, name: str) -> float:
    """The value of a finding of the run. Raises Untrustworthy, listing the findings, where the run lacks it."""
    found = {f.name: f.value for f in recording.health.findings}
    if name not in found:
        raise Untrustworthy(f"this run has no finding {name!r}; it has {', '.join(sorted(found))}.")
    return float(found[name])


def distrust(recording: Recording) -> tuple[str, ...]:
    """Why the run cannot be trusted: the sentences of its findings of severity "error"; empty where it can."""
    return tuple(f.sentence for f in recording.health.findings if f.severity == "error")


def number_of_run(number: NamedNumber, design: Design, recording: Recording) -> float:
    """The value of a number of kind channel, finding or trusted."""
    if number.kind == "trusted":
        return float(recording.health.trusted)
    if number.kind == "finding":
        return finding(recording, number.name)
    return reduced(number.reduce, recording.t, channel(design, recording, number.name))


def measured_check(design: Design, id: str) -> Any:
    """What the check `id` measures, of the entry or generic; raises MechlabError, listing the checks, for an unknown one."""
    checks = {c.id: c for c in checks_of(design.entry)}
    if id not in checks:
        raise unknown(f"{design.name}: check", id, checks)
    return checks[id].run(design.parameters)


def number_of_cycle(number: NamedNumber, found: CycleResult) -> float:
    """One number of a column, with extrema of the curve between positions. Raises NoSolution where the curve has a
    pole."""
    column = number.name
    values = found[column]
    if number.reduce in ("mean", "final"):
        return reduced_finite(number.reduce, found[found.drive], values)
    low, high = found.extremum(column, -1), found.extremum(column, 1)
    if low is None or high is None:
        raise MechlabError(f"{found.name}: {column}: no finite value in the column.")
    for end in (low, high):
        if abs(end.value) > POLE * float(np.nanmax(np.abs(values))):
            raise NoSolution(
                f"{found.name}: {column} has no least and largest value: it grows without bound at {found.drive} = {end.at:.6g}."
            )
    return {
        "least": low.value, "largest": high.value, "peak": max(abs(low.value), abs(high.value)),
        "span": high.value - low.value,
    }[number.reduce]  # fmt: skip
