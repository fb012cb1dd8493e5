"""Timed runs of MuJoCo: nothing but stepping between output points is timed, and nothing but the state is kept."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import lru_cache

import mujoco
import numpy as np

from mechlab.engines.mujoco.control import controlled, engine
from mechlab.engines.mujoco.drive import (
    Driver,
    RunModel,
    engaged,
    lent_model,
    put_start,
    run_model,
    springs_of,
    tunable_model,
)
from mechlab.engines.mujoco.model import MujocoMap, Tuning
from mechlab.engines.mujoco.plant import MujocoPlant
from mechlab.engines.mujoco.sparse import sparse_is_right, sparse_steps
from mechlab.engines.mujoco.springs import SpringDamper, put_springs
from mechlab.engines.mujoco.stepping import INTEGRATION_STATE, UNSOLVED
from mechlab.engines.state import RATE_LIMIT
from mechlab.experiment.laws import Law
from mechlab.experiment.prices import MUJOCO
from mechlab.experiment.recording import Trace
from mechlab.experiment.scene import Scene, Settings, initial_state
from mechlab.integrate import count_work, integrate_lsoda
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import unit_quaternions
from mechlab.mechanism.model import Mechanism


def step_through(
    model: mujoco.MjModel, data: mujoco.MjData, outputs: int, each: int, price: float = 0.0
) -> tuple[Array, Array, float, str]:
    """qpos (n, nq), qvel (n, nv) at the start and after every `each` steps, CPU seconds of the stepping, and why it
    stopped early ("" when it did not). price: counted work of a step [s]. The caller has switched `autoreset` off: a blow-up
    ends the run."""
    qpos, qvel = np.empty((outputs + 1, model.nq)), np.empty((outputs + 1, model.nv))
    qpos[0], qvel[0] = data.qpos, data.qvel
    step, clock, spent = mujoco.mj_step, time.thread_time, 0.0
    q, v, warnings = data.qpos, data.qvel, [data.warning[w] for w in UNSOLVED]
    for k in range(1, outputs + 1):
        count_work(price * each)
        began = clock()
        step(model, data, nstep=each)
        spent += clock() - began
        qpos[k], qvel[k] = q, v
        # the sum of squares bounds the largest rate, in a tenth of the time
        fast = not v.dot(v) < RATE_LIMIT**2 and not np.max(np.abs(v), initial=0.0) < RATE_LIMIT
        if fast or warnings[0].number or warnings[1].number or warnings[2].number:
            return qpos[:k], qvel[:k], spent, f"diverged before t = {data.time:.4g} s"
    return qpos, qvel, spent, ""


class Steps:
    """A timed run of a scene that can be continued; the timestep must divide `between`, the time between outputs [s].

    Laws are evaluated at every stage, inside the timed steps; those that are springs and dampers to the engine
    (`mechlab.engines.mujoco.springs`) become part of its model. Runs of a thread share one MjModel and MjData for a mechanism under
    the same springs and drives that hold, and each keeps its state. Raises MechlabError for bad input.
    """

    def __init__(self, mechanism: Mechanism, scene: Scene, settings: Settings, between: float) -> None:
        self.mechanism, self.scene = mechanism, scene
        self.each = max(1, round(between / settings.timestep))
        self.timestep = between / self.each
        self.price = MUJOCO.of(mechanism) * (4.0 if settings.integrator == "RK4" else 1.0)
        springs = None if mechanism.curves else springs_of(mechanism, scene.laws, settings)
        constant: Array | None = None
        self._settings = settings
        self._tuning: Tuning | None = None
        if mechanism.curves:
            self.model, self.data, self.map = run_model(mechanism, settings, engaged(scene.laws))
        else:
            made = _kept(mechanism, engaged(scene.laws), springs or (), threading.get_ident())
            (self.model, self.data, self.map), self._tuning, force = made
            constant = None if springs is None else force
            self._tuning.put(settings)
            mujoco.mj_resetData(self.model, self.data)
        put_start(self.data, self.map, *initial_state(mechanism, scene))
        self._laws: Callable[[], AbstractContextManager[None]] = engine
        dense = False
        if constant is not None:
            self.data.qfrc_applied[:] = constant
        else:
            driver = Driver(mechanism, scene.laws, MujocoPlant(mechanism, self.model, self.data, self.map))
            self._laws, dense = lambda: controlled(self.data, driver.push), driver.reads_rows
        self._sparse = not dense and sparse_is_right(self.model, self.data)
        self._state = np.empty(mujoco.mj_stateSize(self.model, INTEGRATION_STATE))
        mujoco.mj_getState(self.model, self.data, self._state, INTEGRATION_STATE)

    def advance(self, outputs: int) -> Trace:
        """The present state and the states after each of `outputs` further intervals `between`."""
        model, data = self.model, self.data
        if self._tuning is not None:
            self._tuning.put(self._settings)
        model.opt.timestep = self.timestep
        mujoco.mj_setState(model, data, self._state, INTEGRATION_STATE)
        for w in UNSOLVED:
            data.warning[w].number = 0  # counted in another run
        with self._laws(), sparse_steps(model, self._sparse):
            qpos, qvel, spent, reason = step_through(model, data, outputs, self.each, self.price)
        mujoco.mj_getState(model, data, self._state, INTEGRATION_STATE)
        done = (len(qpos) - 1) * self.each
        return Trace(self.map.coordinates(qpos), self.map.rates(qvel), spent, done, reason)


def trace(mechanism: Mechanism, scene: Scene, settings: Settings, outputs: int) -> Trace:
    """A scene at `outputs` + 1 even times; see `Steps`."""
    return Steps(mechanism, scene, settings, scene.duration / outputs).advance(outputs)


@lru_cache(maxsize=16)
def _kept(
    mechanism: Mechanism, held: tuple[Law, ...], springs: tuple[SpringDamper, ...], thread: int
) -> tuple[RunModel, Tuning, Array]:
    """`tunable_model` with springs and dampers in it, and their constant force; made once for a thread."""
    made, tuning = tunable_model(mechanism, Settings(), held)
    return made, tuning, put_springs(made[2], springs)


def _constant(scene: Scene) -> bool:
    """Whether no law needs a callback: each is constant or applied by an actuator of the engine."""
    return all(law.kind == "constant" for law in _called(scene))


def _called(scene: Scene) -> tuple[Law, ...]:
    """The laws that the engine's actuators do not apply."""
    held = engaged(scene.laws)
    return tuple(law for law in scene.laws if law not in held)


def _driven(
    mechanism: Mechanism, scene: Scene, model: mujoco.MjModel, data: mujoco.MjData, map_: MujocoMap
) -> Callable[[], AbstractContextManager[None]]:
    """The context in which the engine steps under the laws of a scene. Where all laws are constant their forces are set
    once and no callback runs at every stage."""
    if _constant(scene):
        for law in _called(scene):
            data.qfrc_applied[map_.dof] += law.value * mechanism.row(law.on)  # type: ignore[attr-defined]
        return engine
    driver = Driver(mechanism, scene.laws, MujocoPlant(mechanism, model, data, map_))
    driver.sampling = True
    return lambda: controlled(data, driver.push)


def adaptive(mechanism: Mechanism, scene: Scene, settings: Settings, outputs: int) -> Trace:
    """A scene of a tree of one-coordinate joints at `outputs` + 1 even times: MuJoCo's equations of motion (mj_forward, exact
    without constraints) under LSODA, to the tolerance of the settings."""
    with lent_model(mechanism, settings, scene.laws) as made:
        flags = made[0].opt.disableflags
        found = _by_lsoda(*made, scene, settings.tolerance, np.linspace(0.0, scene.duration, outputs + 1))
        made[0].opt.disableflags = flags
    return found


def _by_lsoda(
    model: mujoco.MjModel, data: mujoco.MjData, map_: MujocoMap, scene: Scene, tolerance: float, times: Array
) -> Trace:
    mechanism = map_.mechanism
    put_start(data, map_, *initial_state(mechanism, scene))
    n = model.nq
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    qvel, qacc, put, forward = data.qvel, data.qacc, mujoco.mj_setState, mujoco.mj_forwardSkip
    price = MUJOCO.of(mechanism)
    every, no_sensors, timed = mujoco.mjtStage.mjSTAGE_NONE, True, bool(scene.laws)
    slope = np.empty(2 * n)
    rates, accelerations = slope[:n], slope[n:]

    def f(t: float, y: Array) -> Array:
        if timed:
            data.time = t
        put(model, data, y, COORDINATES_AND_RATES)
        rates[:] = qvel
        forward(model, data, every, no_sensors)
        accelerations[:] = qacc
        return slope

    jacobian = _Linearised(model, data, price) if _constant(scene) else None
    # LSODA goes back and forth in time: nothing may be summed up over its evaluations
    with _driven(mechanism, scene, model, data, map_)():
        began = time.thread_time()
        found = integrate_lsoda(f, np.concatenate([data.qpos, qvel]), times, tolerance, jacobian, price)
        spent = time.thread_time() - began
    q, v = map_.coordinates(found.y[:, :n]), map_.rates(found.y[:, n:])
    return Trace(q, v, spent, found.steps, found.reason, found.evaluations)


COORDINATES_AND_RATES = mujoco.mjtState.mjSTATE_QPOS | mujoco.mjtState.mjSTATE_QVEL


class _Linearised:
    """df/dy of the equations of motion y = (q, v) of a tree, by MuJoCo's differences of a step of symplectic Euler,
    v+ = v + h a(q, v): compiled, and without kinematics anew where only a rate is moved."""

    MOVED = 1e-7
    """Difference by which a coordinate [rad or m] or rate [rad/s or m/s] is moved."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, price: float = 0.0) -> None:
        self._price = 2.0 * model.nv * price
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
        # with the damping of joints taken implicitly, the step would not be v + h a
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EULERDAMP
        self.model, self.data, n = model, data, model.nv
        self._next, self._slope = np.empty((2 * n, 2 * n)), np.zeros((2 * n, 2 * n))
        self._slope[:n, n:] = np.eye(n)
        self._still = self._slope[:n].copy()

    def __call__(self, t: float, y: Array) -> Array:
        count_work(self._price)
        n, data, h = self.model.nv, self.data, self.model.opt.timestep
        mujoco.mj_setState(self.model, data, y, COORDINATES_AND_RATES)
        mujoco.mjd_transitionFD(self.model, data, self.MOVED, False, self._next, None, None, None)
        np.subtract(self._next[n:], self._still, out=self._slope[n:])
        self._slope[n:] /= h
        return self._slope


def extrapolated(mechanism: Mechanism, scene: Scene, settings: Settings, outputs: int) -> Trace:
    """The run at half the timestep of the settings, corrected by its difference from the run at the whole (Richardson):
    2 x(h / 2) - x(h), of second order where the integrator is of first. It costs three runs at the whole timestep."""
    coarse = trace(mechanism, scene, settings, outputs)
    fine = trace(mechanism, scene, replace(settings, timestep=0.5 * settings.timestep), outputs)
    spent, steps = coarse.cpu_s + fine.cpu_s, coarse.steps + fine.steps
    if not (coarse.complete and fine.complete):
        return replace(fine, cpu_s=spent, steps=steps, reason=fine.reason or coarse.reason)
    q, v = 2.0 * fine.q - coarse.q, 2.0 * fine.v - coarse.v
    return Trace(unit_quaternions(mechanism, q), v, spent, steps)
