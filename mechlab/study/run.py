"""Running a scene of a design with an engine: settings, engine, channels of the entry, provenance."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import metadata
from typing import Any

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
    lived = design.for_scene(scene)
    level = fidelity
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
    if fidelity == "kinematic":
        lived.mechanism(fidelity)
    made = lived.scene(scene, level, duration, extra)
    chosen = PRESETS[settings] if isinstance(settings, str) else settings or made.settings
    if engine == "pinocchio" and chosen.engine != "pinocchio":
        chosen = replace(chosen, engine="pinocchio", integrator="RK4")
    if (engine or chosen.engine) == "mujoco" and (settings is None or chosen.engine != "mujoco"):
        chosen = by_nature(chosen, lived.mechanism(made.fidelity), made)
    if timestep is not None:
        chosen = replace(chosen, timestep=timestep)
    finest = chosen.timestep if max_error is None else chosen.timestep / 2**HALVINGS
    made = with_static_motors(made, replace(chosen, engine=engine or chosen.engine, timestep=finest))
    for t in at:
        if not 0.0 <= t <= made.duration:
            raise MechlabError(f"{design.name}: the time {t:g} s lies outside the run (0 to {made.duration:g} s).")
    if engine == "analytic":
        if lived.entry.reference is None:
            raise MechlabError(f"{design.name}: it has no closed form to simulate with; engines: mujoco, pinocchio.")
        if extra:
            raise MechlabError(
                f"{design.name}: engine analytic takes no initial values or loads beyond the scene's: {', '.join(extra)}."
            )
        return _complete(lived, lived.entry.reference(lived.parameters, made), made)
    controlled = max_error is not None and engine is None and settings is None
    if "hybrid" in (engine, chosen.engine if engine is None else "") and not controlled:
        return _complete(lived, _hybrid(lived, made, chosen, at, timestep, max_error), made)
    if engine == "one_freedom" and chosen.engine != "one_freedom":
        chosen = replace(chosen, engine="one_freedom", integrator="RK4")

    def once(s: Settings) -> Recording:
        m = lived.mechanism(made.fidelity)
        if s.engine == "one_freedom":
            from mechlab.study.one_freedom import run as run_one_freedom

            return run_one_freedom(m, made, s, list(at) or None)
        done: Recording = room(s.engine).run(m, made, s, list(at) or None)
        return replace(done, health=done.health + Health(friction_findings(m, s)))

    if max_error is None:
        run = once(chosen)
        return _complete(lived, with_step_error(run, made) if estimate else run, made)
    if not controlled:
        return _complete(lived, _refine(once, chosen, max_error, made.duration), made)
    from mechlab.study.error_control import control

    try:
        return _complete(lived, control(lived, made, max_error, at), made)
    except NoSolution as cause:
        text = f"the error asked for ({max_error:g}) cannot be reached: {cause} This run is by {chosen.preset!r}; do not trust it"
        run = once(chosen) if chosen.engine != "hybrid" else _hybrid(lived, made, chosen, at, timestep, max_error)
        unmet = Finding("max_error", math.inf, max_error, "m or rad", "error", text)
        return _complete(lived, replace(run, health=Health((unmet,)) + run.health), made)


def _hybrid(
    design: Design,
    scene: Scene,
    settings: Settings,
    at: Sequence[float],
    timestep: float | None,
    max_error: float | None,
) -> Recording:
    """A run with located friction events. Its accuracy is the tolerance of the settings, or a hundredth of `max_error`."""
    room("pinocchio")
    from mechlab.solve.hybrid import run

    tolerance = min(settings.tolerance, 1e-10) if max_error is None else min(1e-6, 1e-2 * max_error)
    step = settings.timestep if timestep is None else timestep
    chosen = Settings(engine="hybrid", integrator="DOP853", timestep=step, tolerance=tolerance, preset="hybrid")
    return run(design.mechanism(scene.fidelity), scene, chosen, list(at) or None)


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


def _refine(once: Any, settings: Settings, max_error: float, duration: float) -> Recording:
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
