"""The accepted motion against another method: over as much of the scene as a share of the work done allows.

What error control gives: a motion with its error, and the sentence that says how it was found.

Whether an error is met and believed, and the sentence that says so.

A Recording of a motion whose error is known: the states that were estimated, at even times and at those asked for.
"""

from __future__ import annotations

import math
import platform
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from mechlab.engines.protocol import is_rough
from mechlab.errors import MechlabError
from mechlab.experiment.energy import dissipation, energy_finding
from mechlab.experiment.findings import kinematic_findings
from mechlab.experiment.laws import applied_force
from mechlab.experiment.recording import Cost, Finding, Health, Recording, basic_channels, limit_finding
from mechlab.experiment.scene import Scene, Settings
from mechlab.experiment.tree_plant import TreePlant
from mechlab.integrate import work_done
from mechlab.lab.accuracy.batch import BatchTree
from mechlab.lab.accuracy.measure import Measure, Meter, Motion, most
from mechlab.lab.accuracy.rules import LADDERS, RULES, LadderRule
from mechlab.lab.methods import METHODS, Method, Problem, Stepper
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.statics import passive_force

CHECKING = ("mujoco", "pinocchio")
_FAILURES = (MechlabError, ArithmeticError, ValueError, np.linalg.LinAlgError)
LEAST = 1e-4
"""Work that a check may take at least [s]."""
FIRST_INTERVAL = 20.0
"""What an adaptive method spends on the first output interval, in later ones: the start of a stiff motion is rough."""


@dataclass(frozen=True)
class Checked:
    """What the check method says: it differs by `difference` up to time `until`; by itself it is good to `own`."""

    method: str
    difference: float
    own: float
    until: float
    sentence: str

    def contradicts(self, estimate: float, size: float) -> bool:
        """Whether the difference is more than both errors explain; `size`: of the tracked quantities."""
        return self.difference > RULES.contradiction * (self.own + estimate) + 1e-11 * size


class Checker:
    """Another engine than `used`, ready to follow a motion over its first output times, at two sharpnesses: the cheapest that
    can. None can where there is dry friction.

    fastest: rate of the mechanism [1/s]; sharp: False where a quarter of the steps may do for a tree, which has no softness
    that goes with them, and ten times the tolerance. Making one builds models.
    """

    def __init__(self, problem: Problem, used: str, fastest: float, sharp: bool = True) -> None:
        self.problem = problem
        rough = is_rough(problem.mechanism)
        self.ways = [] if rough else sorted(_ways(problem, used, fastest, sharp), key=lambda x: x.cost)
        self.pair: list[Stepper] = []
        self._prepare()

    def _prepare(self) -> None:
        """Drops the ways that cannot run the problem, and gets the first that can ready."""
        while self.ways:
            way = self.ways[0]
            if not way.method.available(self.problem):
                try:
                    self.pair = [way.method.stepper(self.problem, x) for x in way.values]
                except _FAILURES:
                    pass
                else:
                    return
            del self.ways[0]

    def check(self, measure: Measure, tracked: Array, meter: Meter) -> Checked | None:
        """What it says of tracked (n, names), the accepted motion at all output times; None where nothing could follow it."""
        while self.ways:
            found = _compare(self.problem, measure, tracked, self.ways[0], self.pair, meter)
            if found is not None:
                return found
            with meter.building():
                del self.ways[0]
                self._prepare()
        return None


@dataclass(frozen=True)
class _Way:
    """A method that may check, the two values that it is run at, and the work that the first output interval may take [s]."""

    method: Method
    values: tuple[float, float]
    cost: float


def _ways(problem: Problem, used: str, fastest: float, sharp: bool) -> Iterator[_Way]:
    between = problem.scene.duration / problem.outputs
    few, most_steps = RULES.check_steps
    for rule in LADDERS:
        if rule.engine not in CHECKING or rule.engine == used or rule.extrapolated:
            continue
        method = _registered(rule, problem)
        if method is None:
            continue
        price = method.price(problem)
        if rule.control == "tolerance":
            looser = 1.0 if sharp else 10.0
            coarse, fine = RULES.check_tolerances
            yield _Way(method, (looser * coarse, looser * fine), FIRST_INTERVAL * rule.evaluations * price)
            continue
        fewer = not (sharp or problem.mechanism.loops or problem.mechanism.relations)
        least = math.ceil(between * fastest / rule.stable) if rule.stable and fastest > 0.0 else 0
        for each in sorted({max(x, least) for x in ((few // 4, few // 2, few) if fewer else (few,))}):
            if each > most_steps:
                continue
            yield _Way(method, (between / each, 0.5 * between / each), 3.0 * each * price)


def _round(count: float) -> int:
    """The largest of 1, 2, 3, 4, 6, 8, 12, ... that is not more: evaluations of methods with step-size control differ in their last
    digits between processors, and how far a check goes does not."""
    if count < 2.0:
        return 1
    power = 2 ** int(math.log2(count))
    return power + (power // 2 if count >= 1.5 * power else 0)


def _registered(rule: LadderRule, problem: Problem) -> Method | None:
    rows = problem.mechanism.loops or problem.mechanism.relations
    kind = "default" if rule.engine == "mujoco" and rule.control == "step" and not rows else rule.constraints
    for m in METHODS:
        if (m.engine, m.integrator, m.constraints) == (rule.engine, rule.integrator, kind):
            return m
    return None


def _compare(
    problem: Problem, measure: Measure, tracked: Array, way: _Way, pair: list[Stepper], meter: Meter
) -> Checked | None:
    between = problem.scene.duration / problem.outputs
    size = max(1e-3, most(tracked - tracked[0]))
    budget = max(RULES.check_share * meter.work, LEAST)
    count, more, spent = 0, 1, 0.0
    said: Array | None = None  # of both runs: (2, count + 1, names)
    while True:
        try:
            with meter.stepping() as told:
                before = work_done()
                runs = [stepper.advance(more) for stepper in pair]
                told.cpu_s, told.work = sum(run.cpu_s for run in runs), work_done() - before
        except _FAILURES:
            return None
        if any(run.reason or len(run.q) != more + 1 for run in runs):
            return None
        q, v = np.concatenate([run.q for run in runs]), np.concatenate([run.v for run in runs])
        t = between * np.arange(count, count + more + 1)
        new = measure(np.concatenate([t, t]), q, v).reshape(2, more + 1, -1)
        said = new if said is None else np.concatenate([said, new[:, 1:]], axis=1)
        count, spent = count + more, spent + told.work
        change = np.abs(said[0] - said[1]).max(axis=1)
        good = int(np.argmax(change > RULES.check_own * size)) or count + 1
        if good < 2:
            return None
        reach = _round(count + (budget - spent) / max(spent / count, 1e-7))
        more = min(problem.outputs, reach) - count
        if good <= count or more < 3 * count:
            break
    own, away, until = float(change[:good].max()), most(said[1, :good] - tracked[:good]), float(between * (good - 1))
    sentence = (
        f"check by {way.method.name} up to t = {until:.4g} s: it differs by {away:.2g} {measure.unit}, and changes by "
        f"{own:.2g} {measure.unit} when it is made sharper"
    )
    return Checked(way.method.name, away, own, until, sentence)


@dataclass(frozen=True)
class Neighbour:
    """A cruder or slightly other motion of the same scene: `factor` times its difference from the accepted one is, for every
    channel, a part of the error.

    motion, or q (n, nq), v (n, nv) at the output times; settings: those that a runner makes it with; captured: held rates are
    captured in so many times their `time`.
    """

    factor: float
    settings: Settings
    q: Array
    v: Array
    motion: Motion | None = None
    captured: float = 1.0


@dataclass(frozen=True)
class Result:
    """A motion with its error.

    t (n,); q (n, nq), v (n, nv): at the output times. estimate [unit]: of the largest error of the tracked quantities;
    method, step (a step [s], a tolerance, the nodes of a cell, 0 of a closed form; see `control`); cpu_s: all CPU spent, probing and check
    included, imports and building of models excluded; reached: whether the estimate meets `max_error`; sentence: what was
    chosen and why, or why it cannot be reached; neighbours: from which the errors of all channels follow, none where there was
    one run alone.
    """

    t: Array
    q: Array
    v: Array
    estimate: float
    max_error: float
    unit: str
    method: str
    step: float
    control: str
    cpu_s: float
    evaluations: int
    reached: bool
    sentence: str
    settings: Settings
    checked: Checked | None
    motion: Motion | None = None
    extrapolated: bool = False
    neighbours: tuple[Neighbour, ...] = ()

    @property
    def accelerations(self) -> Array | None:
        """(n, nv) where the method knows them."""
        return None if self.motion is None else self.motion.states(self.t, accelerations=True).a


LOW = 1e-7
"""Below this error, what rounding does to the motion is looked at and told [m or rad]."""


ROUNDING = "double precision does not allow it"
CAPTURE = "it is the time in which the law captures held rates; a smaller `time` of the law makes it less"


def verdict(
    estimate: float, max_error: float, measure: Measure, chosen: str, checked: Checked | None, size: float,
    part: str = "", cause: str = "",
) -> tuple[bool, str]:  # fmt: skip
    """Whether the error is met and believed, and the sentence; `part`: what makes it up most, `cause`: why it cannot be less,
    where these are known; `size`: of the tracked quantities."""
    unit = measure.unit
    told = f"error of {measure.what} estimated at {estimate:.2g} {unit}"
    told += f" ({max_error:g} {unit} asked for{', of which ' + part if part else ''})"
    says = checked.sentence if checked is not None else "no other method could check it"
    against = checked is not None and checked.contradicts(estimate, size)
    ok = estimate <= max_error and not against
    text = f"{told}; {chosen}; {says}"
    if against:
        text += "; the two contradict each other: do not trust this run"
    elif not ok:
        text += f"; the error asked for cannot be reached: {cause or 'this is the best that was found'}"
    return ok, text


def findings(result: Result) -> tuple[Finding, ...]:
    """Findings "max_error" and, where there is one, "check_method"."""
    severity = "ok" if result.reached else "error"
    out = [Finding("max_error", result.estimate, result.max_error, result.unit, severity, result.sentence)]
    if result.checked is not None:
        c = result.checked
        out.append(Finding("check_method", c.difference, c.own, result.unit, "ok", c.sentence))
    return tuple(out)


def motion_of(mechanism: Mechanism, scene: Scene, result: Result, at: Sequence[float], every: int = 1) -> Recording:
    """States and channels: the basic ones, NAME_accel of joints and shafts, NAME_force of what constant loads and laws act on.
    every: only every so many of the output times are used, where states between them are interpolated."""
    t = np.union1d(result.t, np.asarray(at, dtype=float))
    if result.motion is not None:
        states = result.motion.states(t, accelerations=True)
        assert states.a is not None
        q, v, a = states.q, states.v, states.a
    else:
        q, v, a = _between(mechanism, scene, result, t, every)
    simple = mechanism.joints and all(j.nv == 1 for j in mechanism.joints)
    channels, units = basic_channels(mechanism, q, v, BatchTree(mechanism).frame_positions(q) if simple else None)
    for name in mechanism.scalar_names:
        channels[f"{name}_accel"] = a @ mechanism.row(name)
        units[f"{name}_accel"] = f"{units[name]}/s2"
    plant = TreePlant(mechanism)
    forces = []
    for k in range(len(t)):
        plant.set(q[k], v[k], float(t[k]))
        forces.append(applied_force(mechanism, scene.laws, float(t[k]), plant)[1] if scene.laws else {})
    for name in dict.fromkeys(n for x in forces for n in x):
        channels[f"{name}_force"] = np.array([x.get(name, 0.0) for x in forces])
        units[f"{name}_force"] = "N" if units[name] == "m" else "N m"
    return Recording(
        mechanism, t, q, v, channels, units, settings=result.settings, scene=scene.name, name=mechanism.name,
        fidelity=scene.fidelity,
    )  # fmt: skip


def recording_of(mechanism: Mechanism, scene: Scene, result: Result, at: Sequence[float]) -> Recording:
    """`motion_of`, with its health, cost and versions."""
    made = motion_of(mechanism, scene, result, at)
    t, q, v, channels = made.t, made.q, made.v, made.channels
    power, done = np.zeros(len(t)), np.zeros(len(t))
    for name in mechanism.scalar_names:
        force = channels.get(f"{name}_force", np.zeros(len(t)))
        power += force * channels[f"{name}_rate"]
        done += force * (channels[name] - channels[name][0])
    constant = result.motion is not None
    balance = (
        energy_finding(mechanism, t, q, v, power, done)
        if constant
        else energy_finding(mechanism, t, q, v, power - dissipation(mechanism, q, v), laws=scene.laws)
    )
    found = [*findings(result), *kinematic_findings(mechanism, q, v, keep_mode=scene.keep_mode), balance]
    versions = {"numpy": np.__version__, "scipy": scipy.__version__, "python": platform.python_version()}
    cost = Cost(result.cpu_s, len(result.t) - 1, result.evaluations)
    return replace(made, health=Health(tuple(found)), cost=cost, versions=versions)


def _between(mechanism: Mechanism, scene: Scene, result: Result, t: Array, every: int) -> tuple[Array, Array, Array]:
    """States at times t: those of the result, and between (every `every`-th of) them the quintic through positions, rates and
    accelerations."""
    m = mechanism
    known = np.array([_acceleration(m, scene, x, q, v) for x, q, v in zip(result.t, result.q, result.v, strict=True)])
    if len(t) == len(result.t) and every == 1:
        return result.q, result.v, known
    from scipy.interpolate import BPoly

    nodes = np.stack([result.q, result.v, known], axis=1)
    spline = BPoly.from_derivatives(result.t[::every], nodes[::every])
    return spline(t), spline.derivative()(t), spline.derivative(2)(t)


def _acceleration(m: Mechanism, scene: Scene, t: float, q: Array, v: Array) -> Array:
    """(nv,) rigid dynamics at a state, without dry friction: M a + J^T r = forces, J a = -dJ/dt v."""
    tree, constraints = TreeKinematics(m, q, v), ConstraintSet(m)
    plant = TreePlant(m)
    plant.set(q, v, t)
    applied = applied_force(m, scene.laws, t, plant)[0] if scene.laws else np.zeros(m.nv)
    force = applied + passive_force(tree) - tree.bias_force()
    rows = constraints.jacobian(tree)
    size = m.nv + len(rows)
    matrix, side = np.zeros((size, size)), np.zeros(size)
    matrix[: m.nv, : m.nv], matrix[: m.nv, m.nv :], matrix[m.nv :, : m.nv] = tree.mass_matrix(), rows.T, rows
    side[: m.nv], side[m.nv :] = force, -constraints.bias(tree)
    return np.asarray(np.linalg.lstsq(matrix, side, rcond=1e-12)[0][: m.nv])


def with_estimate(recording: Recording, result: Result, difference: float) -> Recording:
    """A Recording that an engine made with the accepted settings; what it differs from the estimated run counts too."""
    total = result.estimate + difference
    own = findings(result)
    text = f"{result.sentence}; the recorded run differs from the estimated one by {difference:.2g} {result.unit}"
    if result.reached:
        first = limit_finding("max_error", total, result.max_error, result.unit, f"{text}; together")
    else:
        first = Finding("max_error", total, result.max_error, result.unit, "error", text)
    return replace(recording, health=Health((first, *own[1:])) + recording.health)
