"""The chart of any MJCF file: every integrator of MuJoCo, with the constraints of the file and with hard ones.

The reference is a run of one integrator with small steps and hard constraints, extrapolated in the step. The difference
to another integrator, extrapolated too, estimates its error. An error that all integrators of MuJoCo share stays
unseen.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError, NoSolution
from mechlab.lab.single_run import versions
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.studies.chart.advice import flat_defaults, recommend
from mechlab.studies.chart.data import Chart, ChartPoint
from mechlab.studies.chart.run import Budget, refine
from mechlab.studies.chart.score import THRESHOLD, Score

if TYPE_CHECKING:
    from mechlab.engines.mujoco.model_file.trace import FileModel, FileTrace


OUTPUTS = 100
DURATION = 1.0
PUSH = 1.0
"""Start rate [rad/s or m/s] of every joint of a model that would otherwise stand still."""


@dataclass(frozen=True)
class _Truth:
    points: Array
    energy: Array
    text: str
    error: float


def chart_of_mjcf_file(
    path: Path, duration: float | None = None, target: float | None = None, budget: Budget | None = None
) -> Chart:
    """The chart of an MJCF file over `duration` (default 1 s). target [m]: default a thousandth of the model's size.

    Raises MechlabError for a file that MuJoCo refuses, NoSolution when no run with small steps reaches the end.
    """
    engine("mujoco")  # raises EngineMissing where it is not installed
    from mechlab.engines.mujoco.model_file.trace import INTEGRATORS, file_order, read_model, trace_file

    length = DURATION if duration is None else duration
    if not 0.0 < length < 1e6 or (target is not None and not target > 0):
        raise MechlabError(f"chart {path.name}: duration and target must be positive.")
    model = read_model(path)
    notes = [f"The file itself says: {model.integrator}, timestep {model.timestep:g} s."]
    first = trace_file(model, "implicitfast", False, length, OUTPUTS, 8)
    if _still(first, model) and model.model.nu:
        model = replace(model, driven=False)
        notes.append("With its controls it stands still; here it moves freely, actuators off.")
        first = trace_file(model, "implicitfast", False, length, OUTPUTS, 8)
    if _still(first, model):
        model = replace(model, push=PUSH)
        notes.append(f"Nothing moves it; here it starts with a rate of {PUSH:g} rad/s or m/s, all joints forward.")
        first = trace_file(model, "implicitfast", False, length, OUTPUTS, 8)
    if _still(first, model):
        raise MechlabError(f"chart {path.name}: nothing in it can move, so there is no error to measure.")
    hard = model.has_equalities

    def run(integrator: str, stiff: bool, each: int) -> FileTrace:
        return trace_file(model, integrator, stiff, length, OUTPUTS, each)

    truth = _reference(run, hard)
    order = file_order(run, model.model, hard, length / OUTPUTS)
    notes += [f"RK4: {order.sentence}."] if order.severity != "ok" else []
    points: list[ChartPoint] = []
    between = length / OUTPUTS
    values = tuple(between / 2**k for k in range(13))
    for integrator in INTEGRATORS:
        for stiff in (False, True) if hard else (False,):
            name = f"MuJoCo {integrator}, {'hard' if stiff else 'as in the file'}"

            def once(h: float, integrator: str = integrator, stiff: bool = stiff) -> Any:
                return run(integrator, stiff, round(between / h))

            points += refine(name, "step", not stiff, values, once, partial(_score, truth), budget or Budget())
    aim = 1e-3 * model.extent if target is None else target
    notes += [s.replace("MuJoCo's default softness", "the softness that the file gives its constraints")
              for s in flat_defaults(points, aim, "m")]  # fmt: skip
    if truth.error > 0.1 * aim:
        notes.append(
            f"Take care: the reference itself is only known to {truth.error:.1e} m (contacts, friction or chaos)."
        )
    return Chart(
        path.stem, path.name, "as in the file", length, "m", ("two points of every body",), truth.text, truth.error, tuple(points), {},
        recommend(points, aim, "m"), tuple(notes), (), versions(),
    )  # fmt: skip


def _still(trace: FileTrace, model: FileModel) -> bool:
    """True when the run reaches the end and no point moves by more than a thousandth of the model's size."""
    return not trace.reason and float(np.ptp(trace.points, axis=0).max(initial=0.0)) < 1e-3 * model.extent


def _extrapolated(run: Any, integrator: str, hard: bool, order: int, each: int) -> tuple[Array, Array, float]:
    """Richardson extrapolation from `each` and 2 `each` steps between outputs: points [m], energy [J], and the largest
    change of a coordinate by it [m]. Raises NoSolution when a run ends early."""
    coarse, fine = (run(integrator, hard, n) for n in (each, 2 * each))
    if coarse.reason or fine.reason:
        raise NoSolution(fine.reason or coarse.reason)
    k = 1.0 / (2**order - 1)
    change = fine.points - coarse.points
    return fine.points + k * change, fine.energy + k * (fine.energy - coarse.energy), float(np.max(np.abs(k * change)))


def _reference(run: Any, hard: bool) -> _Truth:
    """The reference: of the first two integrators that reach the end, the one that extrapolation changes less.

    The other one checks it. Raises NoSolution when no integrator reaches the end.
    """
    # hard constraint rows lower the order of RK4 from 4 to 2
    orders = {"RK4": 2 if hard else 4, "implicitfast": 1, "discrete": 1}
    found: dict[str, tuple[Array, Array, float]] = {}
    for integrator, order in orders.items():
        for each in (64, 512):
            try:
                found[integrator] = _extrapolated(run, integrator, hard, order, each)
                break
            except NoSolution:
                continue
        if len(found) == 2:
            break
    if not found:
        raise NoSolution("chart: no integrator of MuJoCo comes through with fine steps; check the model.")
    name = min(found, key=lambda n: found[n][2])
    points, energy, moved = found[name]
    text = f"MuJoCo {name}{', hard' if hard else ''}, steps extrapolated (which moved it by {moved:.1e} m)"
    apart = moved
    for other in found.keys() - {name}:
        apart = float(np.max(np.abs(found[other][0] - points)))
        text += f"; {other}, extrapolated, agrees to {apart:.1e} m"
    # where the other integrator's own error explains the difference, the estimate from the extrapolation is the better one
    error = moved if apart <= 3.0 * max(found[n][2] for n in found) else apart
    return _Truth(points, energy, text, error)


def _score(truth: _Truth, trace: Any) -> Score:
    points, energy = trace.points, trace.energy
    if trace.reason or len(points) != len(truth.points) or not np.all(np.isfinite(points)):
        return Score(math.inf, math.inf, math.inf, math.inf)
    distance = np.linalg.norm(points - truth.points, axis=2)
    relative = distance / np.maximum(np.linalg.norm(truth.points, axis=2), THRESHOLD)
    drift = float(np.max(np.abs(energy - truth.energy)))
    return Score(float(distance.max()), float(np.sqrt(np.mean(relative**2))), drift, trace.gap)
