"""Points that are simulations or checks: one after the other, each with its own health record."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechlab.errors import MechlabError, Untrustworthy, unknown
from mechlab.experiment.recording import Recording
from mechlab.mechanism.geometry import Array
from mechlab.study.check import checks_of
from mechlab.study.design import Design
from mechlab.study.run import run_scene
from mechlab.study.sweep.block import UNTRUSTED, Block
from mechlab.study.sweep.request import Quantity, Request

STEP_ERROR = "step_error"
"""The finding that takes more runs; it is made only where it is asked for."""


def one_by_one(request: Request, design: Design, where: np.ndarray, rest: Mapping[str, Any], out: Block) -> None:
    """The run of each point, and the checks of its design."""
    for i, at in enumerate(where):
        extra = {k: float(v[i]) if np.ndim(v) else float(v) for k, v in rest.items()}
        try:
            _point(request, design, extra, int(at), out)
        except (Exception, SystemExit) as cause:  # one point must not end the others
            out.values[at] = np.nan
            out.failed(at, cause)


def _point(request: Request, design: Design, extra: Mapping[str, float], at: int, out: Block) -> None:
    values = np.full(len(request.quantities), np.nan)
    bad = ""
    if any(q.of_run for q in request.quantities):
        estimate = any(q.name == STEP_ERROR for q in request.quantities)
        recording = run_scene(
            design, request.scene, engine=request.engine, fidelity=request.fidelity, duration=request.duration,
            timestep=request.timestep, extra=extra, estimate=estimate,
        )  # fmt: skip
        bad = next((f.sentence for f in recording.health.findings if f.severity == "error"), "")
        for k, quantity in enumerate(request.quantities):
            if quantity.of_run and not (bad and quantity.kind == "channel"):
                values[k] = of_recording(quantity, design, recording)
    measured: dict[str, Any] = {}
    for k, quantity in enumerate(request.quantities):
        if quantity.of_check:
            if quantity.name not in measured:
                measured[quantity.name] = check(design, quantity.name).run(design.parameters)
            found = measured[quantity.name]
            values[k] = found.difference if quantity.kind == "difference" else float(found.passed)
    out.values[at] = values
    if bad:
        out.gap(at, UNTRUSTED, bad)


def check(design: Design, id: str) -> Any:
    """A check of the entry, or a generic one where it has none of its own; raises MechlabError that lists them."""
    checks = {c.id: c for c in checks_of(design.entry)}
    if id not in checks:
        raise unknown(f"{design.name}: check", id, checks)
    return checks[id]


def of_recording(quantity: Quantity, design: Design, recording: Recording) -> float:
    """A quantity of a run."""
    if quantity.kind == "trusted":
        return float(recording.health.trusted)
    if quantity.kind == "finding":
        found = {f.name: f.value for f in recording.health.findings}
        if quantity.name not in found:
            raise Untrustworthy(f"this run has no finding {quantity.name!r}; it has {', '.join(sorted(found))}.")
        return float(found[quantity.name])
    return reduced(quantity.reduce, recording.t, channel(design, recording, quantity.name))


def channel(design: Design, recording: Recording, name: str) -> Array:
    """(n,) a channel of the run, or one of the entry that the scene does not ask for."""
    if name not in recording.channels and name in design.entry.channels:
        return np.asarray(design.entry.channels[name][1](design.parameters, recording))
    return recording.channel(name)


def reduced(how: str, t: Array, values: Array) -> float:
    """final, max, min, mean or rms (over time, by the trapezoidal rule) of a channel (n,) at times t (n,)."""
    x = np.asarray(values, dtype=float)
    if how == "final":
        return float(x[-1])
    if how in ("max", "min"):
        return float(np.max(x) if how == "max" else np.min(x))
    span = float(t[-1] - t[0])
    if not span > 0.0:
        raise MechlabError(f"a {how} over time needs a run that lasts.")
    if how == "mean":
        return float(np.trapezoid(x, t)) / span
    return float(np.sqrt(np.trapezoid(x * x, t) / span))


REDUCTIONS = ("final", "max", "min", "mean", "rms")
