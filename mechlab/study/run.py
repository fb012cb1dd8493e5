"""Running a scene of a design with an engine: settings, engine, channels of the entry, provenance."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib import metadata

from mechlab.errors import MechlabError, NoSolution, unknown
from mechlab.experiment.health import Finding, Health, measured
from mechlab.experiment.parameters import describe
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene
from mechlab.experiment.settings import ENGINES, PRESETS, Settings
from mechlab.study.design import AUTO, Design
from mechlab.study.nature import by_nature, friction_findings, motor_findings, with_static_motors
from mechlab.study.order_check import with_step_error
from mechlab.study.witness import room

HALVINGS = 7


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
    checked (`mechlab.study.error_control`); with a given engine or settings only the timestep is halved until the run
    changes by less. The estimate stands in the health record, as an error when it is not reached.
    estimate: whether a run with fixed steps carries its "step_error", which takes more runs.
    fidelity "auto": the cheapest that answers what the scene needs; the finding "fidelity" says why.
    Raises MechlabError for unknown names and engines that cannot run the scene.
    """
    if (fidelity or design.recipe(scene).fidelity) == AUTO:
        from mechlab.study.fidelity import choose

        choice = choose(design, scene, None, duration, extra)
        done = run_scene(
            design, scene, engine=engine, fidelity=choice.chosen, duration=duration, timestep=timestep,
            max_error=max_error, settings=settings, at=at, extra=extra,
        )  # fmt: skip
        return replace(done, health=done.health + Health((choice.finding(),)))
    if engine is not None and engine not in ENGINES:
        raise unknown("engine", engine, ENGINES)
    lived = design.for_scene(scene)
    if fidelity == "kinematic":
        lived.mechanism(fidelity)  # raises: it has none
    made = lived.scene(scene, fidelity, duration, extra)
    chosen = _settings(lived, made, engine, settings, timestep)
    _refuse_idle(design, chosen.engine, timestep, max_error, free=engine is None and settings is None)
    finest = chosen.timestep if max_error is None else chosen.timestep / 2**HALVINGS
    made = with_static_motors(made, replace(chosen, timestep=finest))
    for t in at:
        if not 0.0 <= t <= made.duration:
            raise MechlabError(f"{design.name}: the time {t:g} s lies outside the run (0 to {made.duration:g} s).")
    if chosen.engine == "analytic":
        run = _analytic(lived, made, extra or {})
    elif max_error is not None and engine is None and settings is None:
        run = _controlled(lived, made, chosen, max_error, at)
    elif max_error is not None and chosen.engine != "hybrid":
        run = _refine(lambda s: _once(lived, made, s, at), chosen, max_error)
    else:
        sharper = chosen if max_error is None else replace(chosen, tolerance=min(1e-6, 1e-2 * max_error))
        run = _once(lived, made, sharper, at)
        fixed_steps = max_error is None and chosen.engine != "hybrid"
        run = with_step_error(run, made) if estimate and fixed_steps else run
    return _complete(lived, run, made)


def _refuse_idle(design: Design, engine: str, timestep: float | None, max_error: float | None, free: bool) -> None:
    """Raises MechlabError for a timestep or an error that a run would not look at. free: engine and settings are chosen."""
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
    """The settings of a run: those that were asked for, else the scene's, as its nature and the engine demand."""
    if isinstance(settings, str) and settings not in PRESETS:
        raise unknown(f"{design.name}: settings", settings, PRESETS)
    chosen = PRESETS[settings] if isinstance(settings, str) else settings or scene.settings
    wanted = engine or chosen.engine
    if wanted == "mujoco" and (settings is None or chosen.engine != "mujoco"):
        chosen = by_nature(chosen, design.mechanism(scene.fidelity), scene)
    elif wanted == "hybrid":
        tolerance = min(chosen.tolerance, 1e-10)
        chosen = Settings("hybrid", "DOP853", chosen.timestep, tolerance=tolerance, preset="hybrid")
    elif wanted != chosen.engine:
        chosen = replace(chosen, engine=wanted, integrator="RK4")
    return chosen if timestep is None else replace(chosen, timestep=timestep)


def _once(design: Design, scene: Scene, settings: Settings, at: Sequence[float]) -> Recording:
    """One run by an engine."""
    m, times = design.mechanism(scene.fidelity), list(at) or None
    if settings.engine == "hybrid":
        room("pinocchio")
        from mechlab.solve.hybrid import run as run_hybrid

        return run_hybrid(m, scene, settings, times)
    if settings.engine == "one_freedom":
        from mechlab.study.one_freedom import run as run_one_freedom

        return run_one_freedom(m, scene, settings, times)
    done: Recording = room(settings.engine).run(m, scene, settings, times)
    return replace(done, health=done.health + Health(friction_findings(m, settings)))


def _analytic(design: Design, scene: Scene, extra: Mapping[str, float]) -> Recording:
    """The closed form or the own equations of the entry."""
    if design.entry.reference is None:
        raise MechlabError(f"{design.name}: it has no closed form to simulate with; engines: mujoco, pinocchio.")
    if extra:
        raise MechlabError(
            f"{design.name}: engine analytic takes no initial values or loads beyond the scene's: {', '.join(extra)}."
        )
    return design.entry.reference(design.parameters, scene)


def _controlled(design: Design, scene: Scene, default: Settings, max_error: float, at: Sequence[float]) -> Recording:
    """A run of which only the error is asked for; the default run, not to be trusted, where no method gets to the end."""
    from mechlab.study.error_control import control

    try:
        return control(design, scene, max_error, at)
    except NoSolution as cause:
        text = f"the error asked for ({max_error:g}) cannot be reached: {cause} This run is by {default.preset!r}; do not trust it"
        run = _once(design, scene, default, at)
        unmet = Finding("max_error", math.inf, max_error, "m or rad", "error", text)
        return replace(run, health=Health((unmet,)) + run.health)


def _complete(design: Design, recording: Recording, scene: Scene) -> Recording:
    """Provenance, and the channels of the entry that the scene asks for."""
    entry = design.entry
    parameters = {i.name: getattr(design.parameters, i.name) for i in describe(entry.parameters)}
    level = recording.fidelity or scene.fidelity
    health = recording.health + Health(motor_findings(scene))
    full = replace(
        recording, name=entry.name, fidelity=level, parameters=parameters, versions=versions(), health=health
    )
    asked = {name: entry.channels[name] for name in scene.channels if name in entry.channels}
    values = {name: function(design.parameters, full) for name, (_, function) in asked.items()}
    return full.with_channels(values, {name: unit for name, (unit, _) in asked.items()})


def _refine(once: Callable[[Settings], Recording], settings: Settings, max_error: float) -> Recording:
    """Halves the timestep until the joints change by less than `max_error` at 101 times."""
    import numpy as np

    if not max_error > 0:
        raise MechlabError(f"max_error: expected a number > 0, got {max_error!r}.")
    coarse = once(settings)
    estimate = float("inf")
    for _ in range(HALVINGS):
        settings = replace(settings, timestep=0.5 * settings.timestep)
        fine = once(settings)
        if not fine.health.trusted:
            coarse = fine
            continue
        names = [n for n in fine.mechanism.scalar_names if n in coarse.channels]
        times = np.linspace(0.0, min(coarse.t[-1], fine.t[-1]), 101)
        gaps = [abs(coarse.at(n, t) - fine.at(n, t)) for n in names for t in times]
        estimate = max(gaps, default=float("inf"))
        coarse = fine
        if estimate <= max_error:
            break
    finding = measured("max_error", estimate, max_error, "rad or m", "change between the last two timesteps")
    return replace(coarse, health=coarse.health + Health((finding,)))
