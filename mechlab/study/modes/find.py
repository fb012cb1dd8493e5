"""The modes of a design, from Pinocchio, MuJoCo and, where there is one freedom, the generalised inertia of the path."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np

from mechlab.errors import EngineMissing, MechlabError, NoSolution, Untrustworthy
from mechlab.experiment.acting import acting, what_acts
from mechlab.experiment.initial import initial_pose
from mechlab.experiment.laws import Law
from mechlab.experiment.parameters import describe
from mechlab.experiment.scene import Scene
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.structure import structure
from mechlab.study.design import Design, with_extra
from mechlab.study.modes.at_rest import laws_at_rest
from mechlab.study.modes.dynamics import Dynamics, linear
from mechlab.study.modes.eigen import modes
from mechlab.study.modes.equilibrium import settle
from mechlab.study.modes.one_freedom import one_freedom_modes
from mechlab.study.modes.result import ModesResult, Witness
from mechlab.study.run import versions
from mechlab.study.witness import room

ENGINES = {"pinocchio": "mechlab.solve.linearise", "mujoco": "mechlab.simulate.linearise"}
REFERENCE = "the reference pose"


def find_modes(
    design: Design,
    scene: str | None = None,
    fidelity: str | None = None,
    extra: Mapping[str, float] | None = None,
    free: bool = False,
) -> ModesResult:
    """Equilibrium and modes of a design.

    Without a scene the drives hold their targets from the reference pose; with one what acts in it, from its start. free:
    neither; weight, springs and dampers alone. extra: X_0 (start of the search), X_force (constant loads). Raises
    NoSolution for a motion that does not rest or a start without equilibrium near, MechlabError for bad input.
    """
    lived = design if scene is None else design.for_scene(scene)
    m, made, laws, notes = _situation(lived, scene, fidelity, dict(extra or {}), free)
    start = initial_pose(m, made.initial, f"{m.name}, {made.name}")
    rough = [*(j.name for j in m.joints if j.friction), *(s.name for s in m.shafts if s.friction)]
    if rough:
        notes = (*notes, f"dry friction of {', '.join(rough)} is left out: where it sticks nothing swings at all")
    witnesses: dict[str, Witness] = {}
    for engine in ENGINES:
        witnesses[engine] = _ask(lambda engine=engine: _engine(engine, m, laws, start))  # type: ignore[misc]
    if structure(m).freedoms == 1:
        witnesses["one_freedom"] = _ask(lambda: _one_freedom(m, laws, start))
    parameters = {i.name: getattr(lived.parameters, i.name) for i in describe(lived.entry.parameters)}
    acts = what_acts(m, replace(made, laws=laws))
    return ModesResult(lived.name, m, made.name, made.fidelity, witnesses, notes, parameters, versions(), acts)


def _situation(
    design: Design, scene: str | None, fidelity: str | None, extra: dict[str, float], free: bool
) -> tuple[Mechanism, Scene, tuple[Law, ...], tuple[str, ...]]:
    """The mechanism, the start, what acts, and notes."""
    moving = [k for k in extra if k.endswith("_rate_0")]
    if moving:
        raise MechlabError(
            f"{design.name}: {moving[0]}: modes are about a rest; give X_0 (where to look) and X_force (constant loads)."
        )
    if scene is not None:
        made = design.scene(scene, fidelity, None, extra)
        m = design.mechanism(made.fidelity)
        laws, notes = laws_at_rest(m, made)
        return m, made, () if free else laws, notes
    m = design.mechanism(fidelity)
    still = Scene(REFERENCE, design.fidelity(fidelity), 1.0, drives="free" if free else "hold")
    made = with_extra(design, acting(m, still), extra)
    return m, made, *laws_at_rest(m, made)


def _ask(work: Callable[[], Witness]) -> Witness:
    """A witness that is not installed, or has no path, says so; other errors are the user's."""
    try:
        return work()
    except EngineMissing as error:
        return Witness(cannot=str(error))


def _engine(engine: str, m: Mechanism, laws: tuple[Law, ...], q: Array) -> Witness:
    room(engine)
    dynamics: Dynamics = import_module(ENGINES[engine]).SmallMotions(m, laws)
    rest = settle(dynamics, q)
    found = linear(dynamics, rest.x)
    freedoms, here = structure(m).freedoms, found.basis.shape[1]
    if here != freedoms:
        raise Untrustworthy(
            f"{m.name}: the equilibrium is a singular position: {here} freedoms by linearisation, {freedoms} in truth. Small motions "
            "about it are not linear; give another start (X_0=...)."
        )
    return Witness(dynamics.coordinates(rest.x), rest.residual, modes(found, dynamics.rates))


def _one_freedom(m: Mechanism, laws: tuple[Law, ...], q: Array) -> Witness:
    try:
        rest, found = one_freedom_modes(m, laws, q)
    except (NoSolution, MechlabError) as error:
        return Witness(cannot=str(error))
    return Witness(np.asarray(rest), 0.0, found)


__all__: list[Any] = ["find_modes"]
