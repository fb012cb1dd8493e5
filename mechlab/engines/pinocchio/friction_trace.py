"""Timed runs on Pinocchio with dry friction as one would write it first, a right-hand side with sign() or tanh() of the sliding
rate, to be compared with the engine `hybrid`, which follows the friction exactly.

With sign() the force jumps where a rate passes zero. Fixed steps go over the jump: the error falls with the first power of the step
and not steadily, and what should stick trembles about standstill by limit x step / inertia. Step-size control searches for the jump
with ever smaller steps and hardly advances while anything sticks.
"""

from __future__ import annotations

import time

import numpy as np

from mechlab.engines.pinocchio.equations import Equations
from mechlab.engines.state import BlowUp
from mechlab.errors import unknown
from mechlab.experiment.laws import Law
from mechlab.experiment.recording import Trace
from mechlab.experiment.scene import Scene, Settings, initial_state
from mechlab.integrate import RK4, IntegrationStatus, integrate_adaptive, integrate_fixed
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

FRICTION = ("sign", "tanh")
MOST_EVALUATIONS = 400_000
"""Evaluations after which a run with step-size control is given up."""


def trace_friction(mechanism: Mechanism, scene: Scene, settings: Settings, outputs: int, friction: str) -> Trace:
    """A scene at `outputs` + 1 even times, without events: RK4 and semi_implicit_Euler with fixed steps that divide their
    distance, DOP853 with the tolerance of the settings."""
    times = np.linspace(0.0, scene.duration, outputs + 1)
    each = max(1, round(scene.duration / outputs / settings.timestep))
    h = scene.duration / outputs / each
    motion = _equations(mechanism, scene.laws, friction, h)
    states = [motion.start(*initial_state(mechanism, scene))]
    steps, reason = 0, ""
    began = time.thread_time()
    motion.plant.evaluations = 0
    try:
        for t0, t1 in zip(times[:-1], times[1:], strict=True):
            done, y, reason = _span(motion, settings, float(t0), float(t1), states[-1], each)
            steps += done
            if reason:
                break
            states.append(y)
    except BlowUp as end:
        reason = f"diverged at t = {end.t:.4g} s: {end}"
    spent = time.thread_time() - began
    nq, nv, y = mechanism.nq, mechanism.nv, np.array(states)
    return Trace(y[:, :nq], y[:, nq : nq + nv], spent, steps, reason, motion.plant.evaluations)


def _span(motion: Equations, settings: Settings, t0: float, t1: float, y: Array, each: int) -> tuple[int, Array, str]:
    """From one output time to the next: number of steps, the state there, why it was not reached ("" when it was)."""
    h = (t1 - t0) / each
    if settings.integrator == "DOP853":
        left = MOST_EVALUATIONS - motion.plant.evaluations
        found = integrate_adaptive(
            motion.slope, t0, y, t1, rtol=settings.tolerance, atol=1e-3 * settings.tolerance, most_evaluations=left
        )
        why = (
            f"it chatters, {MOST_EVALUATIONS} evaluations"
            if found.outcome is IntegrationStatus.TOO_MANY
            else found.outcome.value
        )
        reason = "" if found.complete else f"stopped at t = {found.t[-1]:.4g} s: {why}"
        return len(found.t) - 1, motion.project(t1, found.y[-1]), reason
    if settings.integrator == "RK4":
        done = integrate_fixed(RK4, motion.slope, t0, y, h, each, project=motion.project)
        return done.steps, done.y, done.reason
    for k in range(each):
        y = motion.project(t0 + (k + 1) * h, motion.semi_implicit(t0 + k * h, y, h))
    return each, y, ""


def _equations(mechanism: Mechanism, laws: tuple[Law, ...], friction: str, h: float) -> Equations:
    """The equations with friction -limit sign(rate) or -limit tanh(rate / width), with the smallest width for which RK4
    with steps of h is stable. Raises MechlabError for another `friction`."""
    if friction not in FRICTION:
        raise unknown("friction", friction, FRICTION)
    motion = Equations(mechanism, laws, h)
    if friction == "sign":
        motion.width = np.zeros_like(motion.width)
    return motion
