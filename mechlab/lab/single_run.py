"""One run of a scene: its settings, the engine, the channels of the entry and where the numbers come from."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from importlib import metadata

import numpy as np

from mechlab.clock import costed, spent_on
from mechlab.engines.protocol import engine as engine_named
from mechlab.errors import DISTRIBUTION, MechlabError, unknown
from mechlab.experiment.acting import what_acts
from mechlab.experiment.findings import shared_finding
from mechlab.experiment.parameters import describe
from mechlab.experiment.recording import Health, Recording
from mechlab.experiment.scene import PRESETS, Scene, Settings, sample_grid
from mechlab.lab.design import Design
from mechlab.lab.fastest_rate import rk4_step
from mechlab.lab.own_mechanism import AS_IS
from mechlab.lab.problem_settings import FASTEST, motor_findings, settings_for, with_static_motors
from mechlab.mechanism.geometry import Array

MOST_STEPS = 5e7
"""Most steps of one run: about ten minutes for a small mechanism."""


def versions() -> dict[str, str]:
    """Installed versions of what numbers depend on."""
    return dict(_versions())


@lru_cache(maxsize=1)
def _versions() -> dict[str, str]:
    """`versions`, looked up once in a process: what is imported stays as it is."""
    out = {}
    with spent_on("imports"):
        for name, distribution in {"mechlab": DISTRIBUTION, **{p: p for p in ("numpy", "scipy", "mujoco", "pin")}}.items():
            try:
                text = metadata.distribution(distribution).read_text("METADATA") or ""
            except metadata.PackageNotFoundError:
                continue
            # `metadata.version` parses the whole text as a message, which takes ten times as long
            found = re.search(r"^Version: (.+)$", text, re.M)
            out[name] = found[1].strip() if found else metadata.version(distribution)
    return out


@costed
def single_run(
    design: Design, scene: str | None, fidelity: str, duration: float | None, extra: Mapping[str, float]
) -> Recording:
    """The scene once, at one fidelity, with the settings that it recommends; no error is estimated."""
    of_scene = design.for_scene(scene)
    made = of_scene.scene(scene, fidelity, duration, extra)
    settings = chosen_settings(of_scene, made)
    refuse_too_long(design.name, made, settings)
    made = with_static_motors(made, settings)
    if settings.engine == "analytic":
        return complete(of_scene, analytic_run(of_scene, made, extra), made)
    return complete(of_scene, engine_run(of_scene, made, settings), made)


def chosen_settings(
    design: Design, scene: Scene, engine: str | None = None, settings: Settings | str | None = None,
    timestep: float | None = None,
) -> Settings:  # fmt: skip
    """The settings of a run: those that were asked for, else the scene's, as the kind of problem and the engine demand."""
    if isinstance(settings, str) and settings not in PRESETS:
        raise unknown(f"{design.name}: settings", settings, PRESETS)
    chosen = PRESETS[settings] if isinstance(settings, str) else settings or scene.settings
    wanted = engine or chosen.engine
    if wanted == "file":
        chosen = file_settings(design, scene) if chosen.engine != "file" else chosen
        return chosen if timestep is None else replace(chosen, timestep=timestep)
    if scene.file is not None:
        others = [n for n in design.entry.scenes if n != scene.name]
        if not others:
            design.mechanism(scene.fidelity)  # raises: it has none
        raise MechlabError(
            f"{design.name}: the scene {scene.name} is run by the engine 'file' alone; for the engine {wanted} take another scene: "
            f"{', '.join(others)}."
        )
    if wanted == "mujoco" and (settings is None or chosen.engine != "mujoco"):
        chosen = settings_for(chosen, design.mechanism(scene.fidelity), scene)
    elif wanted == "hybrid":
        tolerance = min(chosen.tolerance, 1e-10)
        chosen = Settings("hybrid", "DOP853", chosen.timestep, tolerance=tolerance, preset="hybrid")
    elif wanted != chosen.engine:
        step = max(min(FASTEST, chosen.timestep), rk4_step(design.mechanism(scene.fidelity), scene, chosen.timestep))
        chosen = replace(chosen, engine=wanted, integrator="RK4", timestep=step)
    return chosen if timestep is None else replace(chosen, timestep=timestep)


def file_settings(design: Design, scene: Scene) -> Settings:
    """Settings of the engine `file` for a scene. Raises MechlabError for a scene that is not of a file."""
    if scene.file is not None:
        return scene.settings
    if AS_IS in design.entry.scenes:
        raise MechlabError(f"{design.name}: the engine 'file' runs the scene {AS_IS}, not {scene.name}.")
    raise MechlabError(f"{design.name}: the engine 'file' runs an MJCF file of somebody else; this is none.")


def engine_run(design: Design, scene: Scene, settings: Settings, at: Sequence[float] | Array = ()) -> Recording:
    """One run by an engine, sampled at the times `at` [s] at least: no fewer samples than without, for page and errors."""
    grid = sample_grid(scene.duration, min(settings.timestep, scene.duration / 200.0))
    times = None if len(at) == 0 else np.union1d(grid, at).tolist()
    return engine_named(settings.engine).run(design.moving(scene), scene, settings, times)


def compared_run(design: Design, scene: Scene, settings: Settings, times: Array) -> Recording:
    """One run by an engine with the channels of the entry, to compare another one with at the times [s]; it may lack findings."""
    made = engine_named(settings.engine).at_times(design.moving(scene), scene, settings, times)
    return _with_channels(design, made, scene)


def analytic_run(design: Design, scene: Scene, extra: Mapping[str, float]) -> Recording:
    """The closed form or the own equations of the entry."""
    if design.entry.reference is None:
        raise MechlabError(f"{design.name}: it has no closed form to simulate with; engines: mujoco, pinocchio.")
    if extra:
        raise MechlabError(
            f"{design.name}: engine analytic takes no initial values or loads beyond the scene's: {', '.join(extra)}."
        )
    return design.entry.reference(design.parameters, scene)


def refuse_too_long(name: str, scene: Scene, settings: Settings) -> None:
    """Raise MechlabError for a run of more than MOST_STEPS steps, before it begins."""
    steps = scene.duration / settings.timestep
    if steps > MOST_STEPS:
        raise MechlabError(
            f"{name}: a timestep of {settings.timestep:g} s over {scene.duration:g} s makes {steps:.3g} steps; at most "
            f"{MOST_STEPS:.3g} are run. Take a timestep of at least {scene.duration / MOST_STEPS:.2g} s, or a shorter duration."
        )


def complete(design: Design, recording: Recording, scene: Scene) -> Recording:
    """Provenance, and the channels of the entry that the scene asks for."""
    entry = design.entry
    parameters = {i.name: getattr(design.parameters, i.name) for i in describe(entry.parameters)}
    level = recording.fidelity or scene.fidelity
    shared = shared_finding(recording.mechanism, recording.q, recording.channels)
    health = recording.health + Health(motor_findings(scene, recording) + (() if shared is None else (shared,)))
    full = replace(
        recording, name=entry.name, fidelity=level, parameters=parameters, versions=versions(), health=health,
        acts=recording.acts or what_acts(recording.mechanism, scene),
    )  # fmt: skip
    return _with_channels(design, full, scene)


def _with_channels(design: Design, recording: Recording, scene: Scene) -> Recording:
    """The channels of the entry that the scene asks for."""
    entry = design.entry
    asked = {name: entry.channels[name] for name in scene.channels if name in entry.channels}
    with spent_on("record"):
        values = {name: function(design.parameters, recording) for name, (_, function) in asked.items()}
    return recording.with_channels(values, {name: unit for name, (unit, _) in asked.items()})
