"""Timed runs on Pinocchio for charts and error control: states at even times, and what the stepping costs.

`trace`: Pinocchio's own constrained dynamics (proximal, in C++) with Baumgarte stabilization, for mechanisms of one-coordinate
joints, loops of kind spherical and revolute, springs, and laws of single joints. What has more goes through
`mechlab.engines.pinocchio.runner`, which is slower and projects.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import lru_cache

import numpy as np
import pinocchio as pin

from mechlab.engines.pinocchio.form import rigid_constraints
from mechlab.engines.pinocchio.model import PinModel, build
from mechlab.engines.pinocchio.runner import states
from mechlab.engines.pinocchio.workspace import refuse_large
from mechlab.engines.state import RATE_LIMIT
from mechlab.experiment.laws import Law
from mechlab.experiment.laws.compiled import CompiledLaws
from mechlab.experiment.prices import CONSTRAINED, price_of_laws
from mechlab.experiment.recording import Trace
from mechlab.experiment.scene import Scene, Settings, initial_state
from mechlab.integrate import count_work, integrate_adaptive, integrate_lsoda
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Spring

SIMPLE_LAWS = ("constant", "harmonic", "table", "servo", "constant_power", "motor", "viscous", "one_sided_stop")
MU, ITERATIONS, ACCURACY = 1e-6, 5, 1e-12
"""Of pin.ProximalSettings. mu = 1e-10 loses Bricard's redundant loop, 1e-4 the singular positions of n_fourbar."""


@dataclass(frozen=True)
class Stabilisation:
    """Baumgarte's gains in steps: kp = position / h^2, kd = velocity / h; `mu` regularizes rows that repeat each other."""

    position: float
    velocity: float
    mu: float = MU


GAINS = {"soft": (0.01, 0.2), "stiff": (0.25, 1.0)}
"""Baumgarte gains kp h^2, kd h. Soft keeps the order of RK4; stiff survives singular positions."""


def fits(mechanism: Mechanism, laws: tuple[Law, ...]) -> bool:
    """Whether the fast way can compute this mechanism under these laws."""
    return (
        all(j.nv == 1 and not j.friction for j in mechanism.joints)
        and not mechanism.relations
        and not mechanism.curves
        and not any(s.inertia or s.damping or s.friction or s.stiffness for s in mechanism.shafts)
        and all(x.kind in ("spherical", "revolute") for x in mechanism.loops)
        and all(law.kind in SIMPLE_LAWS for law in laws)
    )


class ConstrainedDynamics:
    """Accelerations of a mechanism that `fits`, by pin.constraintDynamics; also the state that a law sees."""

    def __init__(self, mechanism: Mechanism, laws: tuple[Law, ...], kp: float, kd: float, mu: float = MU) -> None:
        self.mechanism, self.laws = mechanism, laws
        self.price = CONSTRAINED.of(mechanism) + price_of_laws(laws)
        refuse_large(mechanism.name, mechanism.nv)
        made = _built(mechanism)
        self.model = made.model
        self.springs = [_Spring(made, s) for s in mechanism.springs]
        self.data = self.model.createData()
        self.contacts = _contacts(made, kp, kd)
        self.contact_data = pin.StdVec_RigidConstraintData()
        for contact in self.contacts:
            self.contact_data.append(contact.createData())
        pin.initConstraintDynamics(self.model, self.data, self.contacts, self.contact_data)
        self.proximal = pin.ProximalSettings(ACCURACY, mu, ITERATIONS)
        joints = mechanism.joints
        self.damping = np.array([j.damping for j in joints])
        self.stiffness = np.array([j.stiffness for j in joints])
        self.rest = np.array([j.spring_rest - j.zero for j in joints])
        self.passive = bool(np.any(self.damping) or np.any(self.stiffness))
        self.applied = CompiledLaws(mechanism, laws)
        self.t, self.q, self.v = 0.0, np.zeros(mechanism.nq), np.zeros(mechanism.nv)
        self.applied.put(self.t, self.q, self.v)
        self.constant = self.applied.affine_force()
        self.driven = not self.applied.constant

    def value(self, name: str) -> float:
        """Value of a joint or shaft, for the laws."""
        return float(self.mechanism.value(name, self.q))

    def rate(self, name: str) -> float:
        """Rate of a joint or shaft, for the laws."""
        return float(self.mechanism.row(name) @ self.v)

    def _pushes(self, t: float, q: Array, v: Array) -> Array:
        """(nv,) generalized force of the laws."""
        laws = self.applied
        laws.put(t, q, v)
        if laws.affine:
            return laws.affine_force()
        self.t, self.q, self.v = t, q, v
        return laws.forces(t, self)[1]  # type: ignore[arg-type]

    def __call__(self, t: float, q: Array, v: Array) -> Array:
        """(nv,) accelerations."""
        count_work(self.price)
        tau = self._pushes(t, q, v) if self.driven else self.constant
        if self.passive:
            tau = tau - self.damping * v - self.stiffness * (q - self.rest)
        if self.springs:
            pin.computeJointJacobians(self.model, self.data, q)
            for spring in self.springs:
                tau = tau + spring.force(self.data, v)
        if not len(self.contacts):
            return np.asarray(pin.aba(self.model, self.data, q, v, tau))
        return np.asarray(
            pin.constraintDynamics(self.model, self.data, q, v, tau, self.contacts, self.contact_data, self.proximal)
        )


@lru_cache(maxsize=8)
def _built(mechanism: Mechanism) -> PinModel:
    """The model, which runs only read."""
    return build(mechanism)


class _Spring:
    """Generalized force of a spring between two points, by the wrench that it exerts: both ends lie on its line."""

    def __init__(self, made: PinModel, spring: Spring) -> None:
        s = spring
        self.law = (s.stiffness, s.damping, s.rest_length)
        self.ends: list[tuple[int, Array]] = []
        for body, point in ((s.body_a, s.point_a), (s.body_b, s.point_b)):
            rotation, shift = made.offset_of[body]
            self.ends.append((made.joint_of[body], shift + rotation @ np.array(point)))
        (a, _), (b, _) = self.ends
        self.moves = np.zeros(made.model.nv)
        for joint, sign in ((b, 1.0), (a, -1.0)):
            for k in made.model.supports[joint]:
                first = made.model.joints[k].idx_v
                if k:
                    self.moves[first : first + made.model.joints[k].nv] += sign

    def force(self, data: pin.Data, v: Array) -> Array:
        """(nv,) after computeJointJacobians."""
        (a, at_a), (b, at_b) = self.ends
        x0, y0, z0 = (data.oMi[a] * at_a).tolist()
        x, y, z = (data.oMi[b] * at_b).tolist()
        length = math.sqrt((x - x0) ** 2 + (y - y0) ** 2 + (z - z0) ** 2)
        a, b, c = (x - x0) / length, (y - y0) / length, (z - z0) / length
        row = np.array((a, b, c, y * c - z * b, z * a - x * c, x * b - y * a)) @ data.J * self.moves
        stiffness, damping, rest = self.law
        return np.asarray(row * -(stiffness * (length - rest) + damping * float(row @ v)))


def _contacts(made: PinModel, kp: float, kd: float) -> pin.StdVec_RigidConstraintModel:
    out = pin.StdVec_RigidConstraintModel()
    for loop in made.mechanism.loops:
        for contact in rigid_constraints(made, loop):
            contact.m_baumgarte_parameters.Kp = kp
            contact.m_baumgarte_parameters.Kd = kd
            out.append(contact)
    return out


class Steps:
    """A run of a scene that `fits`, with RK4 or semi_implicit_Euler, that can be continued; the timestep must divide `between`, the time
    between outputs [s]."""

    def __init__(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, between: float, stabilisation: Stabilisation
    ) -> None:
        self.between, self.each = between, max(1, round(between / settings.timestep))
        self.h = h = between / self.each
        kp, kd = stabilisation.position / h**2, stabilisation.velocity / h
        self.dynamics = ConstrainedDynamics(mechanism, scene.laws, kp, kd, stabilisation.mu)
        self.step = _rk4 if settings.integrator == "RK4" else _semi_implicit
        self.done, self.state = 0, initial_state(mechanism, scene)

    def advance(self, outputs: int) -> Trace:
        """The present state and the states after each of `outputs` further intervals `between`."""
        q, v = self.state
        qs, vs, reason, step, f, h = [q], [v], "", self.step, self.dynamics, self.h
        began = time.thread_time()
        for k in range(self.done, self.done + outputs):
            for i in range(self.each):
                q, v = step(f, k * self.between + i * h, q, v, h)
            if not np.max(np.abs(v)) < RATE_LIMIT:
                reason = f"diverged before t = {(k + 1) * self.between:.4g} s"
                break
            qs.append(q)
            vs.append(v)
        spent = time.thread_time() - began
        self.state, self.done = (q, v), self.done + outputs
        return Trace(np.array(qs), np.array(vs), spent, (len(qs) - (not reason)) * self.each, reason)


def trace(mechanism: Mechanism, scene: Scene, settings: Settings, outputs: int, stabilisation: Stabilisation) -> Trace:
    """A scene at `outputs` + 1 even times: RK4 and semi_implicit_Euler with fixed steps that divide their distance, DOP853
    and, for trees, LSODA with the tolerance of the settings (Baumgarte gains are those of a step of one output distance)."""
    if not fits(mechanism, scene.laws):
        return states(mechanism, scene, settings, np.linspace(0.0, scene.duration, outputs + 1))
    between = scene.duration / outputs
    if settings.integrator not in ("DOP853", "LSODA"):
        return Steps(mechanism, scene, settings, between, stabilisation).advance(outputs)
    times = np.linspace(0.0, scene.duration, outputs + 1)
    kp, kd = stabilisation.position / between**2, stabilisation.velocity / between
    dynamics = ConstrainedDynamics(mechanism, scene.laws, kp, kd, stabilisation.mu)
    q, v = initial_state(mechanism, scene)
    adaptive = _adaptive if settings.integrator == "DOP853" else _lsoda
    return adaptive(dynamics, q, v, times, settings.tolerance)


Dynamics = Callable[[float, Array, Array], Array]


def _rk4(f: Dynamics, t: float, q: Array, v: Array, h: float) -> tuple[Array, Array]:
    half = 0.5 * h
    a1 = f(t, q, v)
    v2 = v + half * a1
    a2 = f(t + half, q + half * v, v2)
    v3 = v + half * a2
    a3 = f(t + half, q + half * v2, v3)
    v4 = v + h * a3
    a4 = f(t + h, q + h * v3, v4)
    return q + (h / 6.0) * (v + 2.0 * (v2 + v3) + v4), v + (h / 6.0) * (a1 + 2.0 * (a2 + a3) + a4)


def _semi_implicit(f: Dynamics, t: float, q: Array, v: Array, h: float) -> tuple[Array, Array]:
    v = v + h * f(t, q, v)
    return q + h * v, v


def _adaptive(dynamics: ConstrainedDynamics, q: Array, v: Array, times: Array, tolerance: float) -> Trace:
    nq = len(q)

    def slope(t: float, y: Array) -> Array:
        return np.concatenate([y[nq:], dynamics(t, y[:nq], y[nq:])])

    began = time.thread_time()
    found = integrate_adaptive(
        slope, 0.0, np.concatenate([q, v]), times[-1], rtol=tolerance, atol=1e-3 * tolerance, most_evaluations=100_000
    )
    y = found.at(times[times <= found.t[-1]])
    spent = time.thread_time() - began
    reason = "" if found.complete else f"stopped at t = {found.t[-1]:.4g} s: {found.outcome.value}"
    return Trace(y[:, :nq], y[:, nq:], spent, len(found.t) - 1, reason)


def _lsoda(dynamics: ConstrainedDynamics, q: Array, v: Array, times: Array, tolerance: float) -> Trace:
    nq = len(q)
    slope = np.empty(2 * nq)

    def f(t: float, y: Array) -> Array:
        v = y[nq:]
        slope[:nq], slope[nq:] = v, dynamics(t, y[:nq], v)
        return slope

    began = time.thread_time()
    found = integrate_lsoda(f, np.concatenate([q, v]), times, tolerance)
    spent = time.thread_time() - began
    return Trace(found.y[:, :nq], found.y[:, nq:], spent, found.steps, found.reason, found.evaluations)
