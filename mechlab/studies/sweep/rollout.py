"""Runs of points that differ only in initial state and constant loads: MuJoCo steps a whole block inside the engine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.experiment.acting import is_rough
from mechlab.experiment.energy import ENERGY_LIMIT
from mechlab.experiment.findings import GAP_LIMIT
from mechlab.experiment.laws import Constant
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings, initial_state
from mechlab.lab.design import AUTO, Design
from mechlab.lab.problem_settings import settings_for
from mechlab.mechanism import Mechanism
from mechlab.mechanism.batch_tree import BatchTree
from mechlab.mechanism.geometry import Array
from mechlab.studies.named.number import NamedNumber, reduced
from mechlab.studies.sweep.request import UNTRUSTED, SweepBlock, SweepRequest

FEWEST = 16
"""Least number of motions for a rollout; fewer are run one by one, each with a complete health record."""
NUMBERS = 20_000_000
"""Largest number of values in the samples of motions that are rolled out together (160 MB)."""
FINDINGS = ("energy_balance", "relation_residual")
"""Findings that a rollout computes; it also tells whether a motion reached its end."""


def scene_of(request: SweepRequest, design: Design) -> tuple[Design, Mechanism, Scene, Settings]:
    """Design, mechanism, scene and settings that `run_scene` would use, without initial values and loads of the
    points."""
    in_scene = design.for_scene(request.scene)
    scene = in_scene.scene(request.scene, request.fidelity, request.duration)
    mechanism = in_scene.mechanism(scene.fidelity)
    chosen = settings_for(scene.settings, mechanism, scene)
    if request.timestep is not None:
        chosen = replace(chosen, timestep=request.timestep)
    return in_scene, mechanism, scene, chosen


def why_not(request: SweepRequest, design: Design) -> str:
    """The reason why the points of a request cannot be rolled out; empty when they can."""
    varied = [a for a in request.axes if a.role != "parameter"]
    if int(np.prod([len(a.values) for a in varied])) < FEWEST:
        return f"fewer than {FEWEST} initial states or loads for each design"
    if request.engine not in (None, "mujoco"):
        return f"the engine is {request.engine}"
    if AUTO in (request.fidelity, design.recipe(request.scene).fidelity):
        return "the fidelity is chosen for each run"
    for q in request.quantities:
        if q.of_check or (q.kind == "finding" and q.name not in FINDINGS):
            return f"{q.label} takes a run of its own"
        if q.kind == "channel" and not _from_states(q, design, request):
            return f"{q.label} takes more than the states"
    _, mechanism, scene, settings = scene_of(request, design)
    others = [x.kind for x in scene.laws if not isinstance(x, Constant)]
    steps = scene.duration / settings.timestep
    reasons = {
        f"the scene has laws that Python evaluates ({', '.join(others)})": bool(others),
        "the scene keeps its assembly mode": bool(scene.keep_mode), "there are loops": bool(mechanism.loops),
        "there is dry friction": is_rough(mechanism), "there are damped springs": any(s.damping for s in mechanism.springs),
        "there are joints of three coordinates": any(j.nv != 1 for j in mechanism.joints),
        f"the engine of the scene is {settings.engine}": settings.engine != "mujoco",
        "the timestep does not divide the duration": abs(steps - round(steps)) > 1e-9,
    }  # fmt: skip
    return next((text for text, holds in reasons.items() if holds), "")


def _from_states(quantity: NamedNumber, design: Design, request: SweepRequest) -> bool:
    _, mechanism, _, _ = scene_of(request, design)
    basic = {n for s in mechanism.scalar_names for n in (s, f"{s}_rate")}
    basic |= {f"{f.name}_{a}" for f in mechanism.frames for a in "xyz"}
    if quantity.name in basic:
        return True
    if quantity.name not in design.entry.channels:
        return False
    one = np.zeros((2, mechanism.nv))
    states = _States(mechanism, mechanism.reference()[None] + one, one)
    bare = Recording(mechanism, np.arange(2.0), states.q, one, states)
    try:
        design.entry.channels[quantity.name][1](design.parameters, bare)
    except (KeyError, MechlabError):
        return False
    return True


class _States(dict[str, Array]):
    """Basic channels of states q (n, nq), v (n, nv), computed at the first access."""

    def __init__(self, mechanism: Mechanism, q: Array, v: Array) -> None:
        super().__init__()
        self.mechanism, self.q, self.v = mechanism, q, v

    def __contains__(self, name: object) -> bool:
        try:
            self[str(name)]
        except KeyError:
            return False
        return True

    def __missing__(self, name: str) -> Array:
        m = self.mechanism
        joint = name.removesuffix("_rate")
        if name in m.scalar_names:
            found = m.value(name, self.q)
        elif name != joint and joint in m.scalar_names:
            found = self.v @ m.row(joint)
        else:
            points = {f"{f.name}_{a}": (k, i) for k, f in enumerate(m.frames) for i, a in enumerate("xyz")}
            if name not in points:
                raise KeyError(name)
            places = BatchTree(m).frame_positions(self.q)
            self.update({n: places[:, k, i] for n, (k, i) in points.items()})
            return self[name]
        self[name] = np.asarray(found)
        return self[name]


def roll_block(
    request: SweepRequest, design: Design, where: np.ndarray, rest: Mapping[str, Any], out: SweepBlock, threads: int
) -> None:
    """Roll out all motions of a group and put their numbers into the block."""
    engine("mujoco")  # raises EngineMissing where it is not installed
    from mechlab.engines.mujoco.stepping import grid

    in_scene, mechanism, scene, settings = scene_of(request, design)
    steps = grid(scene.duration, settings.timestep)
    whole = any(q.reduce != "final" or q.name in design.entry.channels for q in request.quantities)
    steps = replace(steps, samples=steps.samples if whole or mechanism.relations else (0, steps.count))
    values = {k: np.broadcast_to(np.asarray(v, dtype=float), where.shape) for k, v in rest.items()}
    many = max(1, NUMBERS // (len(steps.samples) * (mechanism.nq + mechanism.nv)))
    for i in range(0, len(where), many):
        some = {k: v[i : i + many] for k, v in values.items()}
        _roll(request, in_scene, mechanism, scene, settings, steps, where[i : i + many], some, out, threads)


def _roll(
    request: SweepRequest, design: Design, mechanism: Mechanism, scene: Scene, settings: Settings, steps: Any, where: np.ndarray,
    values: Mapping[str, Array], out: SweepBlock, threads: int,
) -> None:  # fmt: skip
    q, v, closed = starts(mechanism, scene, values, where, out)
    where, q, v = where[closed], q[closed], v[closed]
    if not len(where):
        return
    loads: dict[str, Array] = {}
    given = {k.removesuffix("_force"): x[closed] for k, x in values.items() if k.endswith("_force")}
    for law in scene.laws:
        loads[law.on] = loads.get(law.on, 0.0) + np.full(len(where), law.value)  # type: ignore[attr-defined]
    for name, force in given.items():
        loads[name] = loads.get(name, 0.0) + force
    from mechlab.engines.mujoco.batch import roll

    found = roll(mechanism, settings, steps, q, v, loads, threads)
    flat = _States(mechanism, found.q.reshape(-1, mechanism.nq), found.v.reshape(-1, mechanism.nv))
    size = len(found.t)
    early = found.reached < scene.duration * (1.0 - 1e-9)
    wrong = early | ~(found.unaccounted <= ENERGY_LIMIT) | ~(found.slip <= GAP_LIMIT)
    for k, quantity in enumerate(request.quantities):
        if quantity.kind == "trusted":
            out.values[where, k] = ~wrong
        elif quantity.kind == "finding":
            out.values[where, k] = found.unaccounted if quantity.name == "energy_balance" else found.slip
        elif quantity.name in design.entry.channels:
            function = design.entry.channels[quantity.name][1]
            for i, at in enumerate(where):
                part = _States(mechanism, found.q[i], found.v[i])
                bare = Recording(mechanism, found.t, found.q[i], found.v[i], part, settings=settings, scene=scene.name)
                out.values[at, k] = reduced(quantity.reduce, found.t, function(design.parameters, bare))
        elif quantity.reduce == "final":
            out.values[where, k] = flat[quantity.name].reshape(-1, size)[:, -1]
        else:
            series = flat[quantity.name].reshape(-1, size)
            out.values[where, k] = [reduced(quantity.reduce, found.t, x) for x in series]
    numbers = np.array([q.kind == "channel" for q in request.quantities])
    for i in np.flatnonzero(wrong).tolist():
        out.values[where[i], numbers] = np.nan
        if early[i]:
            text = f"the run blew up at t = {found.reached[i]:.6g} s; a smaller timestep (now {settings.timestep:g} s) may help"
        elif not found.unaccounted[i] <= ENERGY_LIMIT:
            text = f"energy balance: {found.unaccounted[i]:.3g} of the turnover is unaccounted for, the limit is {ENERGY_LIMIT:g}"
        else:
            text = f"the gears and relations slip by up to {found.slip[i]:.3g} rad or m, the limit is {GAP_LIMIT:g}"
        out.gap(where[i], UNTRUSTED, text)


def starts(
    mechanism: Mechanism, scene: Scene, values: Mapping[str, Array], where: np.ndarray, out: SweepBlock
) -> tuple[Array, Array, Array]:
    """Initial states q (n, nq), v (n, nv), and a mask (n,) of the points that have one.

    The reasons of the others are recorded in the block.
    """
    n = len(where)
    first: dict[str, Any] = dict(scene.initial)
    rates: dict[str, Any] = dict(scene.initial_rates)
    first |= {k.removesuffix("_0"): x for k, x in values.items() if k.endswith("_0") and not k.endswith("_rate_0")}
    rates |= {k.removesuffix("_rate_0"): x for k, x in values.items() if k.endswith("_rate_0")}
    joints = {j.name: j for j in mechanism.joints}
    closed = np.ones(n, dtype=bool)
    if not mechanism.relations and set(first) | set(rates) <= set(joints):
        q, v = np.tile(mechanism.reference(), (n, 1)), np.zeros((n, mechanism.nv))
        for name, x in first.items():
            q[:, mechanism.q_slice[name].start] = x - mechanism.zero(name)
        for name, x in rates.items():
            v[:, mechanism.v_slice[name].start] = x
        return q, v, closed
    q, v = np.zeros((n, mechanism.nq)), np.zeros((n, mechanism.nv))
    for i in range(n):
        here = [{k: float(np.broadcast_to(x, n)[i]) for k, x in given.items()} for given in (first, rates)]
        try:
            q[i], v[i] = initial_state(mechanism, replace(scene, initial=here[0], initial_rates=here[1]))
        except MechlabError as cause:
            out.failed(where[i], cause)
            closed[i] = False
    return q, v, closed
