"""Running a scene of a design: fidelity, method and error control as asked for, with the error of every channel."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from mechlab.clock import costed, spent_on
from mechlab.errors import MechlabError, NoSolution, unknown
from mechlab.experiment.errors import differences, with_errors
from mechlab.experiment.recording import Finding, Health, Recording, limit_finding
from mechlab.experiment.scene import ENGINES, PRESETS, Scene, Settings
from mechlab.lab.accuracy.control import ControlledRun, run_to_error
from mechlab.lab.accuracy.measure import tracked_units
from mechlab.lab.accuracy.rules import default_budget
from mechlab.lab.channel_error import run_to_channel_error
from mechlab.lab.design import Design
from mechlab.lab.fidelity.choose import choose, is_auto
from mechlab.lab.methods import Problem
from mechlab.lab.problem_settings import other_softness, with_static_motors
from mechlab.lab.single_run import analytic_run, chosen_settings, compared_run, complete, engine_run, refuse_too_long
from mechlab.lab.step_error import with_step_error
from mechlab.values import Quantity

HALVINGS = 7
LOOSER = 30.0


@costed
def run_scene(
    design: Design,
    scene: str | None = None,
    *,
    engine: str | None = None,
    fidelity: str | None = None,
    duration: float | None = None,
    timestep: float | None = None,
    max_error: float | None = None,
    budget: float | None = None,
    settings: Settings | str | None = None,
    at: Sequence[float] = (),
    extra: Mapping[str, float] | None = None,
    estimate: bool = True,
) -> Recording:
    """A Recording of a scene. `settings`: a Settings, the name of a preset, or None for the scene's own.

    max_error: method, timestep and constraint settings are chosen, and the error of the tracked quantities is estimated and
    checked (`mechlab.lab.accuracy`); with a given engine or settings only the timestep is halved until the run
    changes by less. The estimate stands in the health record, as an error when it is not reached; the error of every channel,
    controlled or not, stands in `errors`. A Quantity in another unit than that of the tracked positions (1 W) controls the tracked
    channels in that unit (`mechlab.lab.channel_error`). budget: most counted work [s], about seconds of CPU, of finding the method;
    default: 3 s and 1.5 s for each second of the scene, at most 30.
    estimate: whether a run carries the errors of its channels and its "step_error", which takes more runs.
    fidelity: one of the entry (default: that of the scene), or "auto", the cheapest that answers; the finding "fidelity" then says
    which one was taken and why.
    Raises MechlabError for unknown names and engines that cannot run the scene.
    """
    if engine is not None and engine not in ENGINES:
        raise unknown("engine", engine, ENGINES)
    if scene is None:
        scene = design.scene_for(engine or engine_of(settings))
    choice = choose(design, scene, None, duration, extra) if is_auto(design, scene, fidelity) else None
    fidelity = choice.chosen if choice is not None else fidelity
    of_scene = design.for_scene(scene)
    if fidelity == "kinematic":
        of_scene.mechanism(fidelity)  # raises: it has none
    made = of_scene.scene(scene, fidelity, duration, extra)
    chosen = chosen_settings(of_scene, made, engine, settings, timestep)
    free = engine is None and settings is None and chosen.engine != "file"
    _refuse_idle(design, chosen.engine, timestep, max_error, free)
    _refuse_budget(design, budget, max_error, free)
    refuse_too_long(design.name, made, chosen)
    finest = chosen.timestep if max_error is None else chosen.timestep / 2**HALVINGS
    made = with_static_motors(made, replace(chosen, timestep=finest))
    for t in at:
        if not 0.0 <= t <= made.duration:
            raise MechlabError(f"{design.name}: the time {t:g} s lies outside the run (0 to {made.duration:g} s).")
    if chosen.engine == "analytic":
        done = complete(of_scene, analytic_run(of_scene, made, extra or {}), made)
    elif max_error is not None:
        done = _to_error(of_scene, made, chosen, max_error, at, free, budget)
    else:
        done = complete(of_scene, engine_run(of_scene, made, chosen, at), made)
        if estimate:
            with spent_on("probe"):
                done = with_step_error(done, made, partial(compared_run, of_scene))
    return done if choice is None else replace(done, health=done.health + Health((choice.finding(),)))


def engine_of(settings: Settings | str | None) -> str | None:
    """The engine that settings or a preset are for; None without."""
    if isinstance(settings, str):
        return PRESETS[settings].engine if settings in PRESETS else None
    return None if settings is None else settings.engine


def _to_error(
    design: Design,
    scene: Scene,
    settings: Settings,
    max_error: float,
    at: Sequence[float],
    choose: bool,
    budget: float | None,
) -> Recording:
    """A run under `max_error`, with the error of every channel. choose: the method is chosen too; else the given
    settings are refined."""

    def once(error: float, most: float) -> Recording:
        if choose:
            run = _controlled(design, scene, settings, error, at, most)
        elif settings.engine == "hybrid":
            run = _sharper(lambda s: engine_run(design, scene, s, at), settings, error)
        else:
            run = _refine(lambda s: engine_run(design, scene, s, at), settings, error)
        others = [(complete(design, other, scene), factor) for other, factor in run.others]
        return with_errors(complete(design, run.recording, scene), others)

    work = default_budget(scene.duration) if budget is None else budget
    if isinstance(max_error, Quantity) and max_error.unit not in tracked_units(Problem(design, scene)):
        return run_to_channel_error(design.name, scene, max_error, once, work)
    return once(max_error, work)


def _refuse_budget(design: Design, budget: float | None, max_error: float | None, free: bool) -> None:
    """Raise MechlabError for a budget that is none, or that nothing would spend."""
    if budget is None:
        return
    if max_error is None or not free:
        raise MechlabError(
            f"{design.name}: budget: it is what max_error may spend on choosing a method; give max_error, no engine."
        )
    if not (math.isfinite(budget) and budget > 0.0):
        raise MechlabError(f"{design.name}: budget: expected a number > 0 s, got {budget!r}.")


def _refuse_idle(design: Design, engine: str, timestep: float | None, max_error: float | None, free: bool) -> None:
    """Raise MechlabError for a timestep or an error that a run would ignore. free: no engine, no settings given."""
    if engine == "analytic" and (timestep is not None or max_error is not None):
        what = "timestep" if timestep is not None else "max_error"
        raise MechlabError(
            f"{design.name}: {what}: the engine analytic takes no steps and chooses no error; leave it out."
        )
    if timestep is not None and max_error is not None and free:
        raise MechlabError(
            f"{design.name}: timestep: max_error chooses the steps; give one of them, or an engine with both."
        )


def _controlled(
    design: Design, scene: Scene, default: Settings, max_error: float, at: Sequence[float], budget: float
) -> ControlledRun:
    """A run for which only the error is given; where no method gets to the end, the default run, marked untrusted."""
    try:
        return run_to_error(design, scene, max_error, at, budget)
    except NoSolution as cause:
        text = f"the error asked for ({max_error:g}) cannot be reached: {cause} This run is by {default.preset!r}; do not trust it"
        run = engine_run(design, scene, default, at)
        unmet = Finding("max_error", math.inf, max_error, "m or rad", "error", text)
        return ControlledRun(replace(run, health=Health((unmet,)) + run.health), ())


def _sharper(once: Callable[[Settings], Recording], settings: Settings, max_error: float) -> ControlledRun:
    """A run with step control at a tolerance well below `max_error`, compared with one at LOOSER times it."""
    tolerance = min(1e-6, 1e-2 * max_error)
    run, looser = (once(replace(settings, tolerance=x)) for x in (tolerance, LOOSER * tolerance))
    found = differences(run, looser, 1.0)
    change = max((found[n] for n in run.mechanism.scalar_names), default=math.inf)
    text = f"change of the joints between the tolerances {LOOSER * tolerance:.1g} and {tolerance:.1g}"
    finding = limit_finding("max_error", change, max_error, "rad or m", text)
    return ControlledRun(replace(run, health=Health((finding,)) + run.health), ((looser, 1.0),))


def _refine(once: Callable[[Settings], Recording], settings: Settings, max_error: float) -> ControlledRun:
    """Halves the timestep until the joints change by less than `max_error` at 101 times."""
    if not max_error > 0:
        raise MechlabError(f"max_error: expected a number > 0, got {max_error!r}.")
    before = coarse = once(settings)
    estimate = float("inf")
    for _ in range(HALVINGS):
        settings = replace(settings, timestep=0.5 * settings.timestep)
        fine = once(settings)
        if not fine.health.trusted:
            before, coarse = coarse, fine
            if any(f.name == "range" and f.severity == "error" for f in fine.health.findings):
                break  # an engine without stops does not get them by finer steps
            continue
        names = [n for n in fine.mechanism.scalar_names if n in coarse.channels]
        times = np.linspace(0.0, min(coarse.t[-1], fine.t[-1]), 101)
        gaps = [abs(coarse.at(n, t) - fine.at(n, t)) for n in names for t in times]
        estimate = max(gaps, default=float("inf"))
        before, coarse = coarse, fine
        if estimate <= max_error:
            break
    finding = limit_finding(
        "max_error", estimate, max_error, "rad or m", "change of the joints between the last two timesteps"
    )
    # with first order the change is the error; with rows or kinks no higher order is assumed
    others = [(before, 1.0)]
    other = other_softness(coarse.mechanism, settings)
    if other is not None:
        others.append((once(other), 1.0))
    return ControlledRun(replace(coarse, health=coarse.health + Health((finding,))), tuple(others))
