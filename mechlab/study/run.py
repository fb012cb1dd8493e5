"""Running a scene of a design with an engine: settings, engine, channels of the entry, provenance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import metadata
from typing import Any

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.health import Finding, Health, measured
from mechlab.experiment.parameters import describe
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene
from mechlab.experiment.settings import ENGINES, PRESETS, Settings
from mechlab.mechanism import Mechanism
from mechlab.mechanism.structure import structure
from mechlab.study.design import Design
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
) -> Recording:
    """A Recording of a scene. `settings`: a Settings, the name of a preset, or None for the scene's own.

    max_error: the timestep is halved until the run changes by less than that between two timesteps (largest difference
    of any joint, at the common samples); the estimate stands in the health record, as an error when it is not reached.
    Where neither engine nor settings are given, a mechanism of one freedom is run by `one_freedom`, which has no rows.
    Raises MechlabError for unknown names and engines that cannot run the scene.
    """
    lived = design.for_scene(scene)
    level = fidelity
    if engine is not None and engine not in ENGINES:
        raise unknown("engine", engine, ENGINES)
    if fidelity == "kinematic":
        lived.mechanism(fidelity)
    made = lived.scene(scene, level, duration, extra)
    chosen = PRESETS[settings] if isinstance(settings, str) else settings or made.settings
    if engine == "pinocchio" and chosen.engine != "pinocchio":
        chosen = replace(chosen, engine="pinocchio", integrator="RK4")
    if engine == "mujoco" and chosen.engine != "mujoco":
        chosen = (
            replace(PRESETS["stiff"], timestep=1e-4) if _rough(lived.mechanism(made.fidelity)) else PRESETS["accurate"]
        )
    if timestep is not None:
        chosen = replace(chosen, timestep=timestep)
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
    if "hybrid" in (engine, chosen.engine if engine is None else ""):
        return _complete(lived, _hybrid(lived, made, chosen, at, timestep, max_error), made)
    if engine == "one_freedom" and chosen.engine != "one_freedom":
        chosen = replace(chosen, engine="one_freedom", integrator="RK4")

    def once(s: Settings) -> Recording:
        m = lived.mechanism(made.fidelity)
        if s.engine == "one_freedom":
            from mechlab.study.one_freedom import run as run_one_freedom

            return run_one_freedom(m, made, s, list(at) or None)
        done: Recording = room(s.engine).run(m, made, s, list(at) or None)
        return replace(done, health=done.health + Health(_softened(m, s)))

    if max_error is None:
        return _complete(lived, once(chosen), made)
    if engine is None and settings is None and _has_one_freedom(lived.mechanism(made.fidelity), made):
        exact = replace(chosen, engine="one_freedom", integrator="RK4")
        try:
            return _complete(lived, _refine(once, exact, max_error, made.duration), made)
        except MechlabError:
            pass  # the path ends at a change point, or a law wants a plant that it does not have: the engine does it
    return _complete(lived, _refine(once, chosen, max_error, made.duration), made)


def _has_one_freedom(mechanism: Mechanism, scene: Scene) -> bool:
    """Whether the generalised inertia of one freedom answers what the scene needs, without any constraint row."""
    return structure(mechanism).freedoms == 1 and set(scene.needs) <= {"poses", "drive_forces"}


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


def _rough(mechanism: Mechanism) -> tuple[str, ...]:
    """Names of the joints and shafts with dry friction."""
    joints = [j.name for j in mechanism.joints if j.friction]
    return (*joints, *(s.name for s in mechanism.shafts if s.friction))


def _softened(mechanism: Mechanism, settings: Settings) -> tuple[Finding, ...]:
    """What an engine with fixed steps does to dry friction."""
    names = ", ".join(_rough(mechanism))
    if not names or settings.engine != "mujoco":
        return ()
    text = (
        f"dry friction of {names}: the engine's is of first order whatever the integrator (step {settings.timestep:g} s) "
        "and creeps instead of sticking; --engine hybrid follows it exactly"
    )
    return (Finding("friction", settings.timestep, 0.0, "s", "warning", text),)


def _complete(design: Design, recording: Recording, scene: Scene) -> Recording:
    """Provenance, and the channels of the entry that the scene asks for."""
    entry = design.entry
    parameters = {i.name: getattr(design.parameters, i.name) for i in describe(entry.parameters)}
    level = recording.fidelity or scene.fidelity
    full = replace(recording, name=entry.name, fidelity=level, parameters=parameters, versions=versions())
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
