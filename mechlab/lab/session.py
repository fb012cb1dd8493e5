"""Sessions and fleets of a design: the scene, the settings and the step of a loop in which the user commands the drives."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from mechlab.engines.protocol import engine as engine_named
from mechlab.errors import MechlabError
from mechlab.experiment.acting import acting
from mechlab.experiment.observed import Observed, observed
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.lab.design import AUTO, Design, with_extra
from mechlab.lab.fastest_rate import drive_step
from mechlab.lab.run import engine_of
from mechlab.lab.single_run import chosen_settings, complete

if TYPE_CHECKING:
    from mechlab.engines.mujoco.step_loop import Start, StepLoop

HOLD = 0.01
"""Time of an action [s] where none is given."""
JUMPS = 0.5
"""Timestep as a share of that which resolves drives that hold: commands jump. A four-bar's servo under random commands: 0.2 % of
the energy is lost, 5 % at the whole."""


def commanded(design: Design, scene: str | None, fidelity: str | None, extra: Mapping[str, float]) -> Scene:
    """The scene without its laws that act on driven joints and shafts alone, which the session commands; loads of `extra` are added."""
    wanted = fidelity or design.recipe(scene).fidelity
    if wanted in (AUTO, "kinematic"):  # the session needs bodies that move
        wanted = next(f for f in (design.entry.default_fidelity, *design.entry.fidelities) if f != "kinematic")
    made = design.scene(scene, wanted)
    if made.file is not None:  # run as it is: nothing gives way
        return with_extra(design, made, extra)
    driven = {d.on for d in design.mechanism(made.fidelity).drives}
    laws = tuple(law for law in made.laws if not law.targets() or not driven.issuperset(law.targets()))
    return with_extra(design, replace(made, laws=laws), extra)


def completed(design: Design, run: Recording, scene: Scene) -> Recording:
    """The Recording with provenance, those channels of the entry that it has the data for, whose model of a file moved, and what
    gave way to the commands."""
    full = complete(design, run, replace(scene, channels=()))
    if scene.file is not None:
        return full
    for name in scene.channels:
        if name in design.entry.channels and name not in full.channels:
            unit, function = design.entry.channels[name]
            try:
                full = full.with_channels({name: function(design.parameters, full)}, {name: unit})
            except MechlabError:  # it needs a force of a law that the commands replace
                continue
    before = design.scene(scene.name, scene.fidelity).laws
    gone = [
        f"{x.kind} on {', '.join(x.targets())}" for x in before if x not in scene.laws and not getattr(x, "drive", "")
    ]
    file = design.entry.file
    which = f"mechlab's model of {file.name}, not the file as it is: " if file is not None and not file.ours else ""
    return replace(full, acts=which + (f"{run.acts}; in place of {', '.join(gone)}" if gone else run.acts))


def substeps_of(hold: float | None, settings: Settings) -> tuple[int, Settings]:
    """Timesteps of an action, and the settings with a timestep that divides it; a file that is run as it is keeps its timestep. Raises
    MechlabError for a bad `hold`."""
    if hold is None:
        return 1, settings
    if not (math.isfinite(hold) and hold > 0.0):
        raise MechlabError(f"hold: expected a time > 0 s that an action is held, got {hold!r}.")
    count = max(1, math.ceil(hold / settings.timestep - 1e-9))
    return count, settings if settings.engine == "file" else replace(settings, timestep=hold / count)


def setting(
    design: Design,
    scene: str | None,
    fidelity: str | None,
    settings: Settings | str | None,
    hold: float | None,
    extra: Mapping[str, float],
    engine: str | None = None,
) -> tuple[Design, Scene, Settings, int]:
    """The design with the parameters of the scene, the scene, the settings, and the timesteps of an action."""
    if engine not in (None, "mujoco", "file"):
        raise MechlabError(f"{design.name}: engine: a session steps mujoco, or the MJCF file as it is (file), got {engine!r}.")
    scene = scene or design.scene_for(engine or engine_of(settings))
    of_scene = design.for_scene(scene)
    made = commanded(of_scene, scene, fidelity, extra)
    of_file = made.file is not None
    chosen = chosen_settings(of_scene, design.scene(scene, made.fidelity), engine or (None if of_file else "mujoco"), settings)
    if settings is None and not of_file:
        mechanism = of_scene.mechanism(made.fidelity)
        holding = acting(mechanism, replace(made, laws=(), drives="hold"))
        chosen = replace(chosen, timestep=min(chosen.timestep, JUMPS * drive_step(mechanism, holding)))
    substeps, chosen = substeps_of(hold, chosen)
    return of_scene, made, chosen, substeps


def open_session(
    design: Design,
    scene: str | None = None,
    *,
    fidelity: str | None = None,
    settings: Settings | str | None = None,
    hold: float | None = HOLD,
    observe: Sequence[str] = (),
    start: Start | None = None,
    seed: int | None = None,
    extra: Mapping[str, float] | None = None,
    engine: str | None = None,
) -> StepLoop:
    """A session of a design; see `mechlab.api.sessions.session`."""
    of_scene, made, chosen, substeps = setting(design, scene, fidelity, settings, hold, extra or {}, engine)
    mechanism = of_scene.moving(made)
    seen: Observed = observed(mechanism, observe)
    session: StepLoop = engine_named(chosen.engine).session(mechanism, made, chosen, seen, substeps, start, seed)
    session.complete = lambda run: completed(of_scene, run, made)
    return session
