"""Running a scene of a design with an engine: settings, engine, channels of the entry, provenance."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib import metadata

import numpy as np

from mechlab.engines.protocol import engine as engine_named
from mechlab.errors import MechlabError, NoSolution, unknown
from mechlab.experiment.acting import what_acts
from mechlab.experiment.errors import differences, with_errors
from mechlab.experiment.parameters import describe
from mechlab.experiment.recording import Finding, Health, Recording, limit_finding
from mechlab.experiment.scene import ENGINES, PRESETS, Scene, Settings
from mechlab.lab.accuracy.control import ControlledRun, run_to_error
from mechlab.lab.design import Design
from mechlab.lab.problem_settings import (
    FASTEST,
    drive_step,
    motor_findings,
    other_softness,
    settings_for,
    with_static_motors,
)
from mechlab.lab.step_error import with_step_error
from mechlab.mechanism.geometry import Array

HALVINGS = 7
LOOSER = 30.0
MOST_STEPS = 5e7
"""Most steps of one run: about ten minutes for a small mechanism."""


def versions() -> dict[str, str]:
    """Installed versions of what numbers depend on."""
    out = {}
    for name in ("mechlab", "numpy", "scipy", "mujoco", "pin"):
        try:
            out[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return out


def run_scene(
    design: Design,
    scene: str | None = None,
    *,
    engine: str | None = None,
    fidelity: str | None = None,
    duration: float | None = None,
    timestep: float | None = None,
    max_error: float | None = None,
    settings: Settings | str | None = None,
    at: Sequence[float] = (),
    extra: Mapping[str, float] | None = None,
    estimate: bool = True,
) -> Recording:
    """A Recording of a scene. `settings`: a Settings, the name of a preset, or None for the scene's own.

    max_error: method, timestep and constraint settings are chosen, and the error of the tracked quantities is estimated and
    checked (`mechlab.lab.accuracy`); with a given engine or settings only the timestep is halved until the run
    changes by less. The estimate stands in the health record, as an error when it is not reached; the error of every channel,
    controlled or not, stands in `errors`.
    estimate: whether a run carries the errors of its channels and its "step_error", which takes more runs.
    fidelity: one of the entry (default: that of the scene); `mechlab.lab.fidelity.choose.run_chosen` also takes "auto".
    Raises MechlabError for unknown names and engines that cannot run the scene.
    """
    if engine is not None and engine not in ENGINES:
        raise unknown("engine", engine, ENGINES)
    of_scene = design.for_scene(scene)
    if fidelity == "kinematic":
        of_scene.mechanism(fidelity)  # raises: it has none
    made = of_scene.scene(scene, fidelity, duration, extra)
    chosen = _settings(of_scene, made, engine, settings, timestep)
    _refuse_idle(design, chosen.engine, timestep, max_error, free=engine is None and settings is None)
    _refuse_too_long(design.name, made, chosen)
    finest = chosen.timestep if max_error is None else chosen.timestep / 2**HALVINGS
    made = with_static_motors(made, replace(chosen, timestep=finest))
    for t in at:
        if not 0.0 <= t <= made.duration:
            raise MechlabError(f"{design.name}: the time {t:g} s lies outside the run (0 to {made.duration:g} s).")
    if chosen.engine == "analytic":
        run = _analytic(of_scene, made, extra or {})
    elif max_error is not None:
        return _to_error(of_scene, made, chosen, max_error, at, choose=engine is None and settings is None)
    else:
        run = _once(of_scene, made, chosen, at)
    done = _complete(of_scene, run, made)
    if not estimate or chosen.engine == "analytic":
        return done
    return with_step_error(
        done, made, lambda scene, s, times: _complete(of_scene, _once(of_scene, scene, s, times), scene)
    )


def _to_error(
    design: Design, scene: Scene, settings: Settings, max_error: float, at: Sequence[float], choose: bool
) -> Recording:
    """A run under `max_error`, with the error of every channel. choose: the method is chosen too; else the given
    settings are refined."""
    if choose:
        run = _controlled(design, scene, settings, max_error, at)
    elif settings.engine == "hybrid":
        run = _sharper(lambda s: _once(design, scene, s, at), settings, max_error)
    else:
        run = _refine(lambda s: _once(design, scene, s, at), settings, max_error)
    others = [(_complete(design, other, scene), factor) for other, factor in run.others]
    return with_errors(_complete(design, run.recording, scene), others)


def _refuse_too_long(name: str, scene: Scene, settings: Settings) -> None:
    """Raise MechlabError for a run of more than MOST_STEPS steps, before it begins."""
    steps = scene.duration / settings.timestep
    if steps > MOST_STEPS:
        raise MechlabError(
            f"{name}: a timestep of {settings.timestep:g} s over {scene.duration:g} s makes {steps:.3g} steps; at most "
            f"{MOST_STEPS:.3g} are run. Take a timestep of at least {scene.duration / MOST_STEPS:.2g} s, or a shorter duration."
        )


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


def _settings(
    design: Design, scene: Scene, engine: str | None, settings: Settings | str | None, timestep: float | None
) -> Settings:
    """The settings of a run: those that were asked for, else the scene's, as the kind of problem and the engine demand."""
    if isinstance(settings, str) and settings not in PRESETS:
        raise unknown(f"{design.name}: settings", settings, PRESETS)
    chosen = PRESETS[settings] if isinstance(settings, str) else settings or scene.settings
    wanted = engine or chosen.engine
    if wanted == "mujoco" and (settings is None or chosen.engine != "mujoco"):
        chosen = settings_for(chosen, design.mechanism(scene.fidelity), scene)
    elif wanted == "hybrid":
        tolerance = min(chosen.tolerance, 1e-10)
        chosen = Settings("hybrid", "DOP853", chosen.timestep, tolerance=tolerance, preset="hybrid")
    elif wanted != chosen.engine:
        step = max(FASTEST, drive_step(design.mechanism(scene.fidelity), scene))
        chosen = replace(chosen, engine=wanted, integrator="RK4", timestep=min(chosen.timestep, step))
    return chosen if timestep is None else replace(chosen, timestep=timestep)


def _once(design: Design, scene: Scene, settings: Settings, at: Sequence[float] | Array) -> Recording:
    """One run by an engine."""
    times = None if len(at) == 0 else list(at)
    return engine_named(settings.engine).run(design.mechanism(scene.fidelity), scene, settings, times)


def _analytic(design: Design, scene: Scene, extra: Mapping[str, float]) -> Recording:
    """The closed form or the own equations of the entry."""
    if design.entry.reference is None:
        raise MechlabError(f"{design.name}: it has no closed form to simulate with; engines: mujoco, pinocchio.")
    if extra:
        raise MechlabError(
            f"{design.name}: engine analytic takes no initial values or loads beyond the scene's: {', '.join(extra)}."
        )
    return design.entry.reference(design.parameters, scene)


def _controlled(
    design: Design, scene: Scene, default: Settings, max_error: float, at: Sequence[float]
) -> ControlledRun:
    """A run for which only the error is given; where no method gets to the end, the default run, marked untrusted."""
    try:
        return run_to_error(design, scene, max_error, at)
    except NoSolution as cause:
        text = f"the error asked for ({max_error:g}) cannot be reached: {cause} This run is by {default.preset!r}; do not trust it"
        run = _once(design, scene, default, at)
        unmet = Finding("max_error", math.inf, max_error, "m or rad", "error", text)
        return ControlledRun(replace(run, health=Health((unmet,)) + run.health), ())


def _complete(design: Design, recording: Recording, scene: Scene) -> Recording:
    """Provenance, and the channels of the entry that the scene asks for."""
    entry = design.entry
    parameters = {i.name: getattr(design.parameters, i.name) for i in describe(entry.parameters)}
    level = recording.fidelity or scene.fidelity
    health = recording.health + Health(motor_findings(scene, recording))
    full = replace(
        recording, name=entry.name, fidelity=level, parameters=parameters, versions=versions(), health=health,
        acts=what_acts(recording.mechanism, scene),
    )  # fmt: skip
    asked = {name: entry.channels[name] for name in scene.channels if name in entry.channels}
    values = {name: function(design.parameters, full) for name, (_, function) in asked.items()}
    return full.with_channels(values, {name: unit for name, (unit, _) in asked.items()})


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
