"""The runner on Pinocchio: Mechanism, Scene, Settings to Recording. Rigid constraints, projected after every step."""

from __future__ import annotations

import platform
import threading
import time
from collections.abc import Callable
from dataclasses import field
from functools import lru_cache

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from mechlab.clock import costed, spent_on
from mechlab.engines.pinocchio.dynamics import PinPlant
from mechlab.engines.pinocchio.equations import Equations
from mechlab.engines.pinocchio.reactions import channels
from mechlab.engines.state import BlowUp, Instant
from mechlab.errors import unknown
from mechlab.experiment.assembly_modes import WATCHED, ModeWatch
from mechlab.experiment.energy import energy_finding
from mechlab.experiment.findings import (
    friction_finding,
    kinematic_findings,
    saturation_finding,
    sticks,
    stopped_finding,
)
from mechlab.experiment.held_rates import capture_finding
from mechlab.experiment.ranges import unstopped_finding
from mechlab.experiment.recording import (
    Cost,
    Finding,
    Health,
    Recording,
    Trace,
    basic_channels,
    limit_finding,
    over_samples,
)
from mechlab.experiment.scene import PINOCCHIO_INTEGRATORS, Scene, Settings, initial_state, sample_grid
from mechlab.integrate import RK4, integrate_adaptive, integrate_fixed
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

CORRECTION_LIMIT = 1e-2
RESTART = 20
"""DOP853 is restarted from the projected state after so many samples."""


@dataclass
class _Log:
    """The samples of a run so far, its number of steps, and what ended it early; whole: not the states alone; watched: how many samples
    are known to be in the first assembly mode."""

    watch: ModeWatch
    whole: bool = True
    t: list[float] = field(default_factory=list)
    y: list[Array] = field(default_factory=list)
    instants: list[Instant] = field(default_factory=list)
    steps: int = 0
    end: BlowUp | None = None
    watched: int = 0


@costed
def run(
    mechanism: Mechanism,
    scene: Scene,
    settings: Settings | None = None,
    times: ArrayLike | None = None,
    *,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """A run of the scene with rigid loops and gears: `settings.integrator` RK4 or semi_implicit_Euler with steps of
    at most `timestep`, that end on the sample times, or DOP853 with `tolerance`. Laws are evaluated at every stage.

    After each step (DOP853: at each sample) the state is projected onto the constraints. A run that blows up ends there
    with the finding "blow_up" (error) that says when and why, and records what there is. `progress(t)` is called at
    samples. Raises MechlabError for an unknown integrator or name, NoSolution when the start does not close.
    """
    settings = settings or Settings(engine="pinocchio")
    motion, log, start, spent = _run(mechanism, scene, settings, times, progress, ModeWatch(mechanism, scene.keep_mode), True)
    with spent_on("record"):
        return _recording(mechanism, scene, settings, motion, log, start, spent)


def states(mechanism: Mechanism, scene: Scene, settings: Settings, times: Array) -> Trace:
    """The states of `run` at the times alone: nothing else is recorded or examined. Runs of a thread take over the plant of the same
    mechanism from each other."""
    unused = _unused(mechanism, threading.get_ident())
    plant = unused.pop() if unused else PinPlant(mechanism)
    plant.memory, plant.evaluations = {}, 0
    motion, log, start, spent = _run(mechanism, scene, settings, times, None, ModeWatch(mechanism, scene.keep_mode), False, plant)
    unused.append(plant)  # not after an error
    y = np.array(log.y or [start])
    reason = "" if log.end is None else stopped_finding(log.end.t, scene.duration, log.end.reason).sentence
    return Trace(y[:, : mechanism.nq], y[:, mechanism.nq : mechanism.nq + mechanism.nv], spent, log.steps, reason)


@lru_cache(maxsize=8)
def _unused(mechanism: Mechanism, thread: int) -> list[PinPlant]:
    """Plants of runs of a thread that have ended."""
    return []


def _run(
    mechanism: Mechanism, scene: Scene, settings: Settings, times: ArrayLike | None, progress: Callable[[float], None] | None,
    watch: ModeWatch, instants: bool, plant: PinPlant | None = None,
) -> tuple[Equations, _Log, Array, float]:  # fmt: skip
    """The equations, the samples, the state at the start and the CPU seconds of a run."""
    if settings.integrator not in PINOCCHIO_INTEGRATORS:
        raise unknown("integrator of pinocchio", settings.integrator, PINOCCHIO_INTEGRATORS)
    samples = sample_grid(scene.duration, settings.timestep, times)
    q, v = initial_state(mechanism, scene)
    motion = Equations(mechanism, scene.laws, settings.timestep, plant)
    began = time.thread_time()
    start = motion.start(q, v)
    log = _Log(watch, whole=instants)
    with spent_on("integrate"):
        _integrate(motion, settings, samples, start, progress, log)
    return motion, log, start, time.thread_time() - began


def _integrate(
    motion: Equations, settings: Settings, times: Array, y: Array, progress: Callable[[float], None] | None, log: _Log
) -> None:
    try:
        _sample(motion, log, 0.0, y, progress)
        if settings.integrator == "DOP853":
            _adaptive(motion, log, settings, times, y, progress)
            return
        for t0, t1 in zip(times[:-1], times[1:], strict=True):
            y = _fixed(motion, log, settings, t0, t1, y)
            _sample(motion, log, t1, y, progress)
    except BlowUp as end:
        log.end = end
    log.end = _mode_lost(motion, log, 1) or log.end


def _sample(motion: Equations, log: _Log, t: float, y: Array, progress: Callable[[float], None] | None) -> None:
    if log.whole:
        with spent_on("record"):
            log.instants.append(motion.instant(t, y))
    log.t.append(float(t))
    log.y.append(y)
    if progress is not None:
        progress(float(t))
    lost = _mode_lost(motion, log, WATCHED)
    if lost is not None:
        raise lost


def _mode_lost(motion: Equations, log: _Log, least: int) -> BlowUp | None:
    """The end of the run where the assembly mode changed in the samples that were not looked at yet; they are looked at from `least`
    on. The samples after it are dropped."""
    if not log.watch.watches or len(log.y) - log.watched < least:
        return None
    change = log.watch.first_change(np.array(log.y[log.watched :])[:, : motion.mechanism.nq])
    if change is not None:
        for kept in (log.t, log.y, log.instants):
            del kept[log.watched + change + 1 :]
    log.watched = len(log.y)
    return None if change is None else BlowUp(log.t[-1], f"the assembly mode with respect to {', '.join(log.watch.held)} changed")


def _fixed(motion: Equations, log: _Log, settings: Settings, t0: float, t1: float, y: Array) -> Array:
    """From t0 to t1 in equal steps of at most the timestep."""
    count = max(1, int(np.ceil((t1 - t0) / settings.timestep - 1e-9)))
    h = (t1 - t0) / count
    if settings.integrator == "RK4":
        end = integrate_fixed(RK4, motion.slope, t0, y, h, count, project=motion.project)
        log.steps += end.steps
        if not end.complete:
            raise BlowUp(end.t, end.reason)
        return end.y
    for k in range(count):
        y = motion.project(t0 + (k + 1) * h, motion.semi_implicit(t0 + k * h, y, h))
        log.steps += 1
    return y


def _adaptive(
    motion: Equations, log: _Log, settings: Settings, times: Array, y: Array, progress: Callable[[float], None] | None
) -> None:
    """Through all samples with step-size control, projected at every sample; restarted on the constraints now and
    then."""
    step_size = settings.timestep
    for k in range(0, len(times) - 1, RESTART):
        part = times[k : k + RESTART + 1]
        found = integrate_adaptive(
            motion.slope,
            part[0],
            y,
            part[-1],
            rtol=settings.tolerance,
            atol=1e-3 * settings.tolerance,
            first_step=min(step_size, part[-1] - part[0]),
            times=part,
        )
        log.steps += len(found.t) - 1
        for t in part[1:][part[1:] <= found.t[-1]]:
            y = motion.project(t, found.at(t))
            _sample(motion, log, t, y, progress)
        if not found.complete:
            raise BlowUp(float(found.t[-1]), found.outcome.value)
        step_size = found.last_step


def _recording(
    mechanism: Mechanism, scene: Scene, settings: Settings, motion: Equations, log: _Log, start: Array, spent: float
) -> Recording:
    t, y = np.array(log.t or [0.0]), np.array(log.y or [start])
    q, v = y[:, : mechanism.nq], y[:, mechanism.nq : mechanism.nq + mechanism.nv]
    evaluations = motion.plant.evaluations
    if log.instants:
        found, units = channels(motion.plant, t, q, v, log.instants)
        with spent_on("check"):
            findings = _findings(mechanism, scene, settings, motion, log, t, y)
    else:
        found, units = basic_channels(mechanism, q, v)
        findings = []
    if log.end is not None:
        advice = f"{log.end.reason}; try a smaller timestep"
        findings.insert(0, stopped_finding(log.end.t, scene.duration, advice))
    return Recording(
        mechanism=mechanism,
        t=t,
        q=q,
        v=v,
        channels=found,
        units=units,
        health=Health(tuple(findings)),
        cost=Cost(spent, log.steps, evaluations),
        settings=settings,
        scene=scene.name,
        name=mechanism.name,
        fidelity=scene.fidelity,
        versions=versions(),
    )


def _findings(
    mechanism: Mechanism,
    scene: Scene,
    settings: Settings,
    motion: Equations,
    log: _Log,
    t: Array,
    y: Array,
) -> list[Finding]:
    q, v = y[:, : mechanism.nq], y[:, mechanism.nq : mechanism.nq + mechanism.nv]
    out = list(kinematic_findings(mechanism, q, v, keep_mode=scene.keep_mode))
    beyond = unstopped_finding(mechanism, q)
    out += [] if beyond is None else [beyond]
    power = np.array([x.power for x in log.instants])
    out.append(energy_finding(mechanism, t, q, v, power, y[:, -1], laws=scene.laws))
    if len(motion.plant.constraints):
        text = "the largest projection onto the constraints in a step was"
        out.append(limit_finding("closure_correction", motion.corrected, CORRECTION_LIMIT, "m or rad", text, 1e-4))
    forces = over_samples([x.forces for x in log.instants])
    limits = (saturation_finding(scene.laws, forces), capture_finding(scene.laws, settings))
    out += [f for f in limits if f is not None]
    if len(motion.width):
        rows, able = motion.plant.passive.friction.rows, motion.able
        rates, a = v @ rows.T, np.array([x.a for x in log.instants]) @ rows.T
        how = f"is smoothed below rates of {motion.width.max():.3g}"
        standing = sticks(rates, a, motion.width, able)
        rubbed = friction_finding(motion.plant.passive.friction.names, t, rates, standing, scene.tolerance, how)
        out += [rubbed] if rubbed is not None else []
    if settings.integrator == "semi_implicit_Euler":
        text = "first-order integration: energy and phase may be wrong by several per cent"
        out.append(Finding("first_order", settings.timestep, 0.0, "s", "warning", text))
    return out


def versions() -> dict[str, str]:
    """Versions of what computed the run."""
    return {"pinocchio": pin.__version__, "numpy": np.__version__, "python": platform.python_version()}
