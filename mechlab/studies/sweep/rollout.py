"""Runs of many points at once: MuJoCo steps a block of them inside the engine, whatever they differ in: initial state, constant
loads, or parameters that leave the structure of the model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.experiment.many_starts import many_initial_states
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings, initial_state
from mechlab.lab.design import AUTO, Design
from mechlab.lab.problem_settings import settings_for
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.mechanism.batch_tree import BatchTree
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_poses import ManyPoses
from mechlab.studies.named.number import NamedNumber, reduced
from mechlab.studies.sweep.request import UNTRUSTED, SweepBlock, SweepRequest

if TYPE_CHECKING:
    from mechlab.engines.mujoco.batch import Batch, Motions

FEWEST = 16
"""Least number of motions for a rollout; fewer are run one by one, each with a complete health record."""
NUMBERS = 20_000_000
"""Largest number of values in the samples of motions that are rolled out together (160 MB)."""
FINDINGS = ("energy_balance", "relation_residual", "loop_gap", "loop_angle")
"""Findings that a rollout computes; it also tells whether a motion reached its end, opened a loop or changed the mode that its scene
keeps."""

Group = tuple[np.ndarray, Design, Mapping[str, Any]]
"""Points of a block that share a design: their indices (n,), the design, the other given values, each a number or (n,)."""


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
    if request.count < FEWEST and request.backend is None:
        return f"fewer than {FEWEST} points"
    if request.engine not in (None, "mujoco"):
        return f"the engine is {request.engine}"
    if AUTO in (request.fidelity, design.recipe(request.scene).fidelity):
        return "the fidelity is chosen for each run"
    _, mechanism, scene, settings = scene_of(request, design)
    if scene.file is not None:
        return "a file is run as it is"
    engine("mujoco")  # raises EngineMissing where it is not installed
    from mechlab.engines.mujoco.batch import why_not_together

    reason = why_not_together(mechanism, scene, settings)
    if reason:
        return reason
    for q in request.quantities:
        if q.of_check or (q.kind == "finding" and q.name not in FINDINGS):
            return f"{q.label} takes a run of its own"
        if q.kind == "channel" and not _from_states(q, design, request):
            return f"{q.label} takes more than the states"
    return ""


def _from_states(quantity: NamedNumber, design: Design, request: SweepRequest) -> bool:
    _, mechanism, _, _ = scene_of(request, design)
    basic = {n for s in mechanism.scalar_names for n in (s, f"{s}_rate")}
    basic |= {f"{f.name}_{a}" for f in mechanism.frames for a in "xyz"}
    if quantity.name in basic:
        return True
    if quantity.name not in design.entry.channels:
        return False
    one = np.zeros((2, mechanism.nv))
    states = _States(mechanism, np.tile(mechanism.reference(), (2, 1)), one, [])
    bare = Recording(mechanism, np.arange(2.0), states.q, one, states)
    try:
        design.entry.channels[quantity.name][1](design.parameters, bare)
    except (KeyError, MechlabError):
        return False
    return True


class _States(dict[str, Array]):
    """Basic channels of states q (n, nq), v (n, nv), computed at the first access; `trees` is shared by the states of a mechanism."""

    def __init__(self, mechanism: Mechanism, q: Array, v: Array, trees: list[BatchTree]) -> None:
        super().__init__()
        self.mechanism, self.q, self.v, self._trees = mechanism, q, v, trees

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
            if any(j.nv != 1 for j in m.joints):
                places = ManyPoses(m).set(self.q).frame_positions()
            else:
                if not self._trees:
                    self._trees.append(BatchTree(m))
                places = self._trees[0].frame_positions(self.q)
            self.update({n: places[:, k, i] for n, (k, i) in points.items()})
            return self[name]
        self[name] = np.asarray(found)
        return self[name]


def roll_block(request: SweepRequest, groups: Sequence[Group], out: SweepBlock, threads: int) -> list[Group]:
    """Roll out the motions of the groups and put their numbers into the block; the groups that cannot be rolled out are returned."""
    from mechlab.engines.mujoco.batch import why_not_together

    left: list[Group] = []
    waiting: dict[tuple[float, float], list[_Start]] = {}
    for where, design, rest in groups:
        try:
            in_scene, mechanism, scene, settings = scene_of(request, design)
        except MechlabError as cause:
            out.failed(where, cause)
            continue
        if scene.file is not None or why_not_together(mechanism, scene, settings):
            left.append((where, design, rest))
            continue
        values = {k: np.broadcast_to(np.asarray(v, dtype=float), where.shape) for k, v in rest.items()}
        q, v, closed = starts(mechanism, scene, values, where, out)
        if not closed.any():
            continue
        values = {k: x[closed] for k, x in values.items()}
        start = _Start(where[closed], in_scene, mechanism, scene, settings, q[closed], v[closed], values)
        waiting.setdefault((scene.duration, settings.timestep), []).append(start)
    for alike in waiting.values():
        _roll(request, alike, out, threads)
    return left


@dataclass(frozen=True)
class _Start:
    """Points (n,) of one design that can start: q (n, nq), v (n, nv), other given values -> (n,)."""

    where: np.ndarray
    design: Design
    mechanism: Mechanism
    scene: Scene
    settings: Settings
    q: Array
    v: Array
    values: Mapping[str, Array]

    @property
    def motions(self) -> Motions:
        """What the engine needs."""
        from mechlab.engines.mujoco.batch import Motions

        loads = {k.removesuffix("_force"): x for k, x in self.values.items() if k.endswith("_force")}
        return Motions(self.mechanism, self.scene, self.settings, self.q, self.v, loads)

    def portions(self, most: int) -> Iterator[_Start]:
        """The same points, at most so many at a time."""
        for i in range(0, len(self.where), most):
            s = slice(i, i + most)
            values = {k: x[s] for k, x in self.values.items()}
            yield replace(self, where=self.where[s], q=self.q[s], v=self.v[s], values=values)


def _roll(request: SweepRequest, alike: Sequence[_Start], out: SweepBlock, threads: int) -> None:
    """Roll out points of equal duration and timestep."""
    from mechlab.engines.mujoco.batch import LOOKED_AT, roll
    from mechlab.engines.mujoco.stepping import grid

    steps = grid(alike[0].scene.duration, alike[0].settings.timestep)
    entry = alike[0].design.entry.channels
    whole = any(q.kind == "channel" and (q.reduce != "final" or q.name in entry) for q in request.quantities)
    samples = len(steps.samples) if whole else min(len(steps.samples), LOOKED_AT)
    many = max(1, NUMBERS // (samples * max(x.mechanism.nq + x.mechanism.nv for x in alike)))
    portion: list[_Start] = []
    stepping: dict[str, Any] = {"threads": threads}
    if request.backend == "warp":
        from mechlab.engines.mujoco import warp_steps

        stepping = {"take": warp_steps.steps_of_warp, "numbers": warp_steps.NUMBERS}

    def roll_out() -> None:
        for start, batch in zip(portion, roll([x.motions for x in portion], steps, whole, **stepping), strict=True):
            _take(request, start, batch, out)
        portion.clear()

    for start in alike:
        for part in start.portions(many):
            if portion and sum(len(x.where) for x in portion) + len(part.where) > many:
                roll_out()
            portion.append(part)
    roll_out()


def _take(request: SweepRequest, start: _Start, batch: Batch, out: SweepBlock) -> None:
    """Put the numbers of the motions of one design into the block."""
    design, mechanism, where = start.design, start.mechanism, start.where
    trees: list[BatchTree] = []
    final = _States(mechanism, batch.q[:, -1], batch.v[:, -1], trees)
    flat = _States(mechanism, batch.q.reshape(-1, mechanism.nq), batch.v.reshape(-1, mechanism.nv), trees)
    wrong = np.array([bool(reason) for reason in batch.reasons])
    for k, quantity in enumerate(request.quantities):
        if quantity.kind == "trusted":
            out.values[where, k] = ~wrong
        elif quantity.kind == "finding":
            out.values[where, k] = batch.findings[quantity.name]
        elif quantity.name in design.entry.channels:
            function = design.entry.channels[quantity.name][1]
            for i, at in enumerate(where):
                part = _States(mechanism, batch.q[i], batch.v[i], trees)
                bare = Recording(
                    mechanism, batch.t, batch.q[i], batch.v[i], part, settings=start.settings, scene=start.scene.name
                )
                out.values[at, k] = reduced(quantity.reduce, batch.t, function(design.parameters, bare))
        elif quantity.reduce == "final":
            out.values[where, k] = final[quantity.name]
        else:
            series = flat[quantity.name].reshape(len(where), -1)
            out.values[where, k] = [reduced(quantity.reduce, batch.t, x) for x in series]
    numbers = np.array([q.kind == "channel" for q in request.quantities])
    for i in np.flatnonzero(wrong).tolist():
        out.values[where[i], numbers] = np.nan
        out.gap(where[i], UNTRUSTED, batch.reasons[i])


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
    if not mechanism.is_closed and set(first) | set(rates) <= set(joints):
        q, v = np.tile(mechanism.reference(), (n, 1)), np.zeros((n, mechanism.nv))
        for name, x in first.items():
            q[:, mechanism.q_slice[name].start] = x - mechanism.zero(name)
        for name, x in rates.items():
            v[:, mechanism.v_slice[name].start] = x
        return q, v, closed
    q, v, sure = np.zeros((n, mechanism.nq)), np.zeros((n, mechanism.nv)), np.zeros(n, dtype=bool)
    if n >= FEWEST and any(np.ndim(x) and np.ptp(x) > 0.0 for x in first.values()):
        begin, going = ({k: np.broadcast_to(np.asarray(x, dtype=float), n) for k, x in d.items()} for d in (first, rates))
        q, v, sure = many_initial_states(mechanism, begin, going, n)
    for i in np.flatnonzero(~sure):
        here = [{k: float(np.broadcast_to(x, n)[i]) for k, x in given.items()} for given in (first, rates)]
        try:
            q[i], v[i] = initial_state(mechanism, replace(scene, initial=here[0], initial_rates=here[1]))
        except MechlabError as cause:
            out.failed(where[i], cause)
            closed[i] = False
    return q, v, closed
