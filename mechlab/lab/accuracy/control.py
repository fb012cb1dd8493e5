"""A scene recorded to a stated error: the motion that `solve_to` found as a Recording, and the runs it is compared with.

error of a channel = sum over the compared runs of factor x largest difference
"""

from __future__ import annotations

import math
import platform
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import scipy

from mechlab.clock import move_cost, spent_on
from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.energy import dissipation, energy, energy_finding
from mechlab.experiment.findings import kinematic_findings
from mechlab.experiment.held_rates import HeldRates, captured
from mechlab.experiment.ranges import unstopped_finding
from mechlab.experiment.recording import Cost, Finding, Health, Recording, limit_finding, run_channels
from mechlab.experiment.scene import Scene, Settings
from mechlab.integrate import work_done
from mechlab.lab.accuracy.dense import BETWEEN, closed_states, driven, interpolated, law_forces
from mechlab.lab.accuracy.measure import ErrorMeasure, largest
from mechlab.lab.accuracy.result import NeighbourMotion, Solution
from mechlab.lab.accuracy.rules import default_budget
from mechlab.lab.accuracy.solve import solve_to
from mechlab.lab.design import Design
from mechlab.lab.methods import Problem, has_kinks
from mechlab.lab.problem_settings import other_softness
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.mechanism.singularity import may_pass_singular
from mechlab.mechanism.structure import structure

OUTPUTS = 400
SAMPLED = 1.5
"""Where every second sample leaves this many times more energy unaccounted for, what is unaccounted for is work between samples."""
CAPTURES, SHORTER = 3, 0.4
"""How often held rates are captured in less time, where that time is most of the error, and the share of the target that their
next error, which is of first order in it, shall be."""
EVERY, EVERY_ONE = 4, 16
"""The runs compared with are recorded at every EVERYth output, and at the first ones, where motions start that die away at once, and the
last, where what is interpolated has no further neighbour."""
SLOWER = 2.0
"""Factor on the errors of channels: one that is not tracked may converge more slowly than those that are. Without it 3 of the channels of
100 scenes of the campaign `tests.benchmarks.stated_forty` were stated at .55 to .96 of their errors."""
FINER = 0.1
"""Share of the error asked for that is asked for where the energy of a run does not balance."""
STATES_SUFFICE = frozenset({"poses", "drive_forces"})

ComparedRuns = tuple[tuple[Recording, float], ...]


@dataclass(frozen=True)
class ControlledRun:
    """A Recording, and the runs it is compared with: factor x difference is a part of the error of each channel. No
    runs where the errors of the channels are not known."""

    recording: Recording
    others: ComparedRuns


def run_to_error(
    design: Design, scene: Scene, max_error: float, at: Sequence[float] = (), budget: float | None = None
) -> ControlledRun:
    """A Recording of the scene whose tracked quantities are off by at most `max_error` [m or rad], or one that says why not.

    It is made from the states whose error was estimated where those are all that the scene needs; otherwise an engine runs the
    scene with the accepted settings, and its difference from those states counts as error too. budget: most counted work [s] of
    the trials; default: `default_budget`.

    Positions may be right to a step that does not resolve fast rates, and the forces that damp them. The energy says so, and the scene
    is solved once more to FINER of the error.
    """
    made = _to_error(design, scene, max_error, at, budget)
    if not _only_energy(made.recording):
        return made
    try:
        finer = _to_error(design, scene, FINER * max_error, at, budget)
    except NoSolution:
        return made
    found = finer.recording.health.findings
    if any(f.severity == "error" for f in found):
        return made
    why = f"{FINER * max_error:g} was tried because at {max_error:g} the energy does not balance"
    found = tuple(replace(f, limit=max_error, sentence=f"{f.sentence}; {why}") if f.name == "max_error" else f for f in found)
    return replace(finer, recording=replace(finer.recording, health=Health(found)))


def _only_energy(made: Recording) -> bool:
    """Whether the energy balance is all that is wrong with a run."""
    return {f.name for f in made.health.findings if f.severity == "error"} == {"energy_balance"}


def _to_error(design: Design, scene: Scene, max_error: float, at: Sequence[float], budget: float | None) -> ControlledRun:
    """`run_to_error`, whatever the energy says."""
    m = design.mechanism(scene.fidelity)
    remembers = any(tuple(getattr(law, "start", tuple)()) for law in scene.laws)
    # kinks come between the samples: only the steps account for the energy there
    suffice = set(scene.needs) <= STATES_SUFFICE and not remembers and not has_kinks(scene)
    with spent_on("probe"):
        most = default_budget(scene.duration) if budget is None else budget
        times = np.union1d(np.linspace(0.0, scene.duration, OUTPUTS + 1), np.asarray(at, dtype=float)).tolist()
        record = None if suffice else partial(_run, design, times=times)
        scene, result = _solved(design, scene, max_error, suffice, most, record)
    move_cost("probe", "integrate", result.run_s)
    suffice = suffice and result.settings.engine in ("mujoco", "pinocchio")
    if result.motion is not None or result.extrapolated or suffice:
        return ControlledRun(_confirmed(recording_of(m, scene, result, at), result), _of_states(m, scene, result, at))

    def run(scene: Scene, settings: Settings, share: float = 1.0) -> Recording:
        known = result.recorded.get(settings.timestep) if share == 1.0 else None
        return _run(design, scene, settings, times) if known is None else replace(known, settings=settings)

    made = run(scene, result.settings)
    with spent_on("probe"):
        difference = _difference(design, scene, result, made)
        more = 1.0 + difference / result.estimate if result.estimate > 0.0 else 1.0
        others = _compared(result, lambda: [run(_captured(scene, n), n.settings, n.captured) for n in result.neighbours], more)
        other = other_softness(m, result.settings)
        if others and other is not None:
            others += ((_run(design, scene, other, times), 1.0),)
    return ControlledRun(_confirmed(with_estimate(made, result, difference), result), others)


def _confirmed(made: Recording, result: Solution) -> Recording:
    """The recording; not to be trusted where it may pass a singular position of the constraints and the other method does not confirm
    the way that it took: where two assembly modes meet, finer steps of one method may agree on a way that another does not take. A limit
    position of the drive alone, where the closed poses go on smoothly, is no such place."""
    check = result.check
    if result.motion is not None or check is None or check.difference <= result.max_error:
        return made
    if not may_pass_singular(made.mechanism, result.q):
        return made
    text = (
        "the run passes, or nearly, a place where assembly modes meet, and another method does not confirm the way: it is "
        f"{check.difference:.2g} {result.unit} away, {'more' if check.difference > check.own else 'less'} than it changed by in its last "
        "refinement; do not trust this run"
    )
    found = tuple(
        # what one method says of itself is no bound for the way it took
        replace(f, value=math.inf, severity="error", sentence=f"{f.sentence}; {text}") if f.name == "max_error" else f
        for f in made.health.findings
    )
    return replace(made, health=Health(found))


def _solved(
    design: Design, scene: Scene, max_error: float, sparse: bool, budget: float, record: Callable[[Scene, Settings], Recording] | None
) -> tuple[Scene, Solution]:
    """The solution, and the scene with the capture times of held rates that it needed."""
    before = work_done()
    found = scene, solve_to(design, scene, max_error, OUTPUTS, sparse, budget, record)
    for _ in range(CAPTURES):
        result, left = found[1], budget - (work_done() - before)
        if result.reached or result.capture <= 0.5 * result.estimate or left <= 0.0:
            break
        shorter = replace(found[0], laws=captured(found[0].laws, SHORTER * max_error / result.capture))
        try:
            other = solve_to(design, shorter, max_error, OUTPUTS, sparse, left, record)
        except NoSolution:
            break
        if not other.reached and other.estimate >= result.estimate:
            break
        times = {law.time for law in shorter.laws if isinstance(law, HeldRates)}
        caught = f"{other.sentence}; held rates are captured in {min(times):.2g} s here"
        found = shorter, replace(other, sentence=caught)
    return found


def _of_states(m: Mechanism, scene: Scene, result: Solution, at: Sequence[float]) -> ComparedRuns:
    """The runs that a recording of the estimated states is compared with; one more where it is interpolated between them."""
    with spent_on("probe"):
        others = _compared(result, partial(_neighbours, m, scene, result))
    if others and result.motion is None and np.setdiff1d(at, result.t).size:
        others += ((motion_of(m, scene, result, at, every=2), BETWEEN),)
    return others


def _neighbours(m: Mechanism, scene: Scene, result: Solution) -> list[Recording]:
    """The neighbours of a solution as recordings of some of its states (see EVERY), all of one scene in one batch."""
    count, t, neighbours = len(result.t), result.t, result.neighbours
    # where every EVERYth output is a node of longer steps, those between are looked at
    ends = np.r_[0 : min(EVERY_ONE, count), max(0, count - EVERY_ONE) : count]
    some = np.union1d(ends, np.arange(EVERY // 2, count, EVERY))
    each = [replace(result, motion=n.motion, t=t[some], q=n.q[some], v=n.v[some], between=None) for n in neighbours]
    if any(n.motion is not None or n.captured != 1.0 for n in neighbours) or not neighbours:
        return [motion_of(m, _captured(scene, n), x, ()) for n, x in zip(neighbours, each, strict=True)]
    t, q, v = (np.concatenate([getattr(x, name) for x in each]) for name in ("t", "q", "v"))
    made = motion_of(m, scene, replace(each[0], t=t, q=q, v=v), ())
    parts = [slice(k, k + len(some)) for k in range(0, len(made.t), len(some))]
    return [
        replace(made, t=made.t[s], q=made.q[s], v=made.v[s], channels={name: x[s] for name, x in made.channels.items()}) for s in parts
    ]


def _compared(result: Solution, make: Callable[[], Sequence[Recording]], more: float = 1.0) -> ComparedRuns:
    """The neighbours of a solution as recordings, each with `more` times its factor. Empty where one of them cannot be
    made, because its part of the error would be missing."""
    try:
        return tuple((made, SLOWER * more * n.factor) for made, n in zip(make(), result.neighbours, strict=True))
    except MechlabError:
        return ()


def _captured(scene: Scene, n: NeighbourMotion) -> Scene:
    return scene if n.captured == 1.0 else replace(scene, laws=captured(scene.laws, n.captured))


def _run(design: Design, scene: Scene, settings: Settings, times: list[float]) -> Recording:
    m = design.mechanism(scene.fidelity)
    return replace(engine(settings.engine).run(m, scene, settings, times), settings=settings)


def _difference(design: Design, scene: Scene, result: Solution, made: Recording) -> float:
    """Largest difference of the tracked quantities between the recorded run and the estimated one."""
    at = np.clip(np.searchsorted(made.t, result.t * (1.0 - 1e-12)), 0, len(made.t) - 1)
    if np.max(np.abs(made.t[at] - result.t)) > 1e-9 * scene.duration:
        return float("inf")
    measure = ErrorMeasure(Problem(design, scene, len(result.t) - 1), None)
    ours = measure(result.t, result.q, result.v)
    return float(np.max(np.abs(measure(made.t[at], made.q[at], made.v[at]) - ours), initial=0.0))


def solution_findings(result: Solution) -> tuple[Finding, ...]:
    """Findings "max_error" and, where there is one, "check_method"."""
    severity = "ok" if result.reached else "error"
    out = [Finding("max_error", result.estimate, result.max_error, result.unit, severity, result.sentence)]
    if result.check is not None:
        c = result.check
        out.append(Finding("check_method", c.difference, c.own, result.unit, "ok", c.sentence))
    return tuple(out)


def motion_of(mechanism: Mechanism, scene: Scene, result: Solution, at: Sequence[float], every: int = 1) -> Recording:
    """States and channels: the basic ones, NAME_accel of joints and shafts, NAME_force of what constant loads and laws act on.
    every: states between output times are interpolated from each `every`-th of these times."""
    t = np.union1d(result.t, np.asarray(at, dtype=float)) if len(at) else result.t
    if result.motion is not None:
        states = result.motion.states(t, accelerations=True)
        assert states.a is not None
        q, v, a = states.q, states.v, states.a
        forces = law_forces(mechanism, scene, t, q, v)
    else:
        q, v = result.q, result.v
        if result.between is None:
            # where rows repeat each other, poses that are a little open have accelerations without meaning
            poses = closed_states(mechanism, q, v) if mechanism.is_closed and structure(mechanism).redundant else (q, v)
            forces, a = driven(mechanism, scene, result.t, *poses)
        else:
            a, forces = result.between
        if mechanism.nq != mechanism.nv and (len(t) > len(q) or every > 1):
            q, v = interpolated(mechanism, result.t[::every], q[::every], v[::every], a[::every], t)
            forces, a = driven(mechanism, scene, t, q, v)
        elif len(t) > len(q) or every > 1:
            with spent_on("imports"):
                from scipy.interpolate import BPoly
            spline = BPoly.from_derivatives(result.t[::every], np.stack([q, v, a], axis=1)[::every])
            q, v, a = spline(t), spline.derivative()(t), spline.derivative(2)(t)
            forces = law_forces(mechanism, scene, t, q, v)
    channels, units = run_channels(mechanism, q, v, a, forces)
    return Recording(
        mechanism, t, q, v, channels, units, settings=result.settings, scene=scene.name, name=mechanism.name,
        fidelity=scene.fidelity,
    )  # fmt: skip


def recording_of(mechanism: Mechanism, scene: Scene, result: Solution, at: Sequence[float]) -> Recording:
    """`motion_of`, with its health, cost and versions."""
    with spent_on("record"):
        made = motion_of(mechanism, scene, result, at)
    with spent_on("check"):
        return _with_health(made, scene, result)


def _with_health(made: Recording, scene: Scene, result: Solution) -> Recording:
    mechanism = made.mechanism
    t, q, v, channels = made.t, made.q, made.v, made.channels
    power, done = np.zeros(len(t)), np.zeros(len(t))
    for name in mechanism.scalar_names:
        force = channels.get(f"{name}_force", np.zeros(len(t)))
        power += force * channels[f"{name}_rate"]
        done += force * (channels[name] - channels[name][0])
    if result.motion is not None:
        balance = energy_finding(mechanism, t, q, v, power, done)
    else:
        net = power - dissipation(mechanism, q, v)
        balance = energy_finding(mechanism, t, q, v, net, laws=scene.laws)
        if balance.severity == "error":
            fewer = energy_finding(mechanism, t[::2], q[::2], v[::2], net[::2], laws=scene.laws)
            less = energy_finding(mechanism, t, q, v, net, in_rows=_energy_error(mechanism, result), laws=scene.laws)
            balance = _between_samples(balance, fewer) if less.severity == "error" else _of_the_error(balance, result)
    found = [*solution_findings(result), *kinematic_findings(mechanism, q, v, keep_mode=scene.keep_mode), balance]
    beyond = unstopped_finding(mechanism, q) if result.settings.engine != "mujoco" else None
    found += [] if beyond is None else [beyond]
    versions = {"numpy": np.__version__, "scipy": scipy.__version__, "python": platform.python_version()}
    cost = Cost(result.cpu_s, len(result.t) - 1, result.evaluations)
    return replace(made, health=Health(tuple(found)), cost=cost, versions=versions)


def _energy_error(m: Mechanism, result: Solution) -> float:
    """What the errors of the states make of the energy, at most [J]: from the neighbours, as the errors of the channels."""
    own = energy(m, result.q, result.v)
    return sum(n.factor * largest(energy(m, n.q, n.v) - own) for n in result.neighbours)


def _of_the_error(balance: Finding, result: Solution) -> Finding:
    """The energy balance of states whose stated error is as large as what is unaccounted for: a warning alone."""
    text = (
        f"energy balance: {balance.value:.2g} of the turnover is unaccounted for; the states are known to {result.estimate:.2g} "
        f"{result.unit}, which makes as much of their energy uncertain"
    )
    return replace(balance, severity="warning", sentence=text)


def _between_samples(balance: Finding, fewer: Finding) -> Finding:
    """The energy balance; a warning alone where it hangs on the distance of the samples, as every second of them shows: forces that
    come and go between samples do work that these do not see, and the error of the states says how right the motion is."""
    if fewer.value < SAMPLED * balance.value:
        return balance
    text = (
        f"energy balance: the samples do not resolve the work of forces that come and go between them: {balance.value:.2g} of the turnover "
        f"is unaccounted for with all of them, {fewer.value:.2g} with every second"
    )
    return replace(balance, severity="warning", sentence=text)


def with_estimate(recording: Recording, result: Solution, difference: float) -> Recording:
    """The Recording of an engine with the accepted settings; `difference` from the estimated run adds to the error."""
    total = result.estimate + difference
    own = solution_findings(result)
    text = f"{result.sentence}; the recorded run differs from the estimated one by {difference:.2g} {result.unit}"
    if result.reached:
        first = limit_finding("max_error", total, result.max_error, result.unit, f"{text}; together")
    else:
        first = Finding("max_error", total, result.max_error, result.unit, "error", text)
    return replace(recording, health=Health((first, *own[1:])) + recording.health)
