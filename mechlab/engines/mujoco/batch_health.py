"""The health of many motions of one mechanism, a block of them at a time: steps that failed, loops that opened, gaps, slip of relations,
the assembly mode, and the balance of energy.

Rates, gaps and energies are looked at after every step, from the engine's states and sensors; the residuals of loops and relations and
the assembly mode at the samples that a single run looks at, by the kinematics of the Mechanism.
"""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from mechlab.engines.mujoco.drive import engaged, springs_of
from mechlab.engines.mujoco.findings import GAP_KINDS, LoopWatch
from mechlab.engines.mujoco.model import Indices, MujocoMap
from mechlab.engines.state import RATE_LIMIT
from mechlab.experiment.assembly_modes import mode_signs
from mechlab.experiment.energy import CREEP, ENERGY_LIMIT, NOTHING, STANDSTILL, kinetic_energy
from mechlab.experiment.findings import GAP_LIMIT, open_loop_finding, row_kinds
from mechlab.experiment.laws import Servo
from mechlab.experiment.recording import limit_finding
from mechlab.experiment.scene import Scene, Settings
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.batch_tree import BatchRows, BatchTree
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_poses import ManyPoses
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Joint, Shaft

POSES = 2000
"""Poses that are evaluated at once: more do not fit into the processor's memory, and cost more each."""


@dataclass(frozen=True)
class Course:
    """States of n motions at the start and after each of k steps: t (n, k + 1), of the mechanism q (n, k + 1, nq) and
    v (n, k + 1, nv), of the engine all its coordinates and rates (n, k + 1, nq + nv); sensed (n, k, sensors) before each step;
    loads: joint or shaft -> (n,)."""

    t: Array
    q: Array
    v: Array
    state: Array
    sensed: Array
    loads: Mapping[str, Array]


class BatchHealth:
    """The health record of N motions. findings: name -> (N,) values; reasons [N]: "" or why a motion cannot be trusted.

    look: which of the kept samples are looked at; ahead: what is wrong with all of them.
    """

    def __init__(
        self, mechanism: Mechanism, scene: Scene, settings: Settings, model: mujoco.MjModel, map_: MujocoMap, look: Indices,
        count: int, ahead: str,
    ) -> None:  # fmt: skip
        m = self.mechanism = mechanism
        self.scene, self.settings, self.look, self.ahead = scene, settings, look, ahead
        self.held = [law for law in engaged(scene.laws) if isinstance(law, Servo)]
        parts: tuple[Joint | Shaft, ...] = (*(j for j in m.joints if j.nv == 1), *m.shafts)
        self.dampers = [(x.name, x.damping) for x in parts if x.damping]
        self.dampers += [(law.on, law.damping) for law in self.held if np.isinf(law.limit) and law.damping]
        self.dampers += [(x.on, x.damping) for x in springs_of(m, scene.laws, settings) or () if x.damping]
        self.balls = np.array([j.damping if j.nv != 1 else 0.0 for j in m.joints for _ in range(j.nv)])
        self.limit, self.nq = LoopWatch(map_).limit, model.nq
        self.rows = _Rows(m) if m.is_closed else None
        self.kinds = {} if self.rows is None else {k: at for k, at in self.rows.kinds.items() if len(at)}
        self.springs = {_sensor(model, f"rate:{x.name}"): x.damping for x in m.springs if x.damping}
        self.gaps = {x.name: _sensor(model, f"gap:{x.name}") for x in m.loops if x.kind in GAP_KINDS}
        self.energies = [_sensor(model, k.name) for k in (mujoco.mjtSensor.mjSENS_E_POTENTIAL, mujoco.mjtSensor.mjSENS_E_KINETIC)]
        names = [FINDING_OF_KIND[k] for k in self.kinds] + (["assembly_mode"] if scene.keep_mode else [])
        self.findings = {name: np.zeros(count) for name in [*names, "energy_balance"]}
        self.reasons = [""] * count

    def take(self, at: slice, course: Course, q: Array, v: Array) -> None:
        """Judge motions `at` by their course and their kept samples q (n, m, nq), v (n, m, nv)."""
        numbers = range(*at.indices(len(self.reasons)))
        with np.errstate(over="ignore", invalid="ignore"):  # of motions that blew up
            blown = self._blown(course)
            opened = self._opened(course)
            kinematic = self._kinematic(at, q[:, self.look])
            share = self.findings["energy_balance"][at] = self._unaccounted(course)
        for i, k in enumerate(numbers):
            self.reasons[k] = self.ahead or blown.get(i) or opened.get(i) or kinematic.get(i) or ""
            if not self.reasons[k] and not share[i] <= ENERGY_LIMIT:
                text = "energy balance: unaccounted for is a share of"
                self.reasons[k] = limit_finding("energy_balance", float(share[i]), ENERGY_LIMIT, "of the turnover", text).sentence

    def _blown(self, course: Course) -> dict[int, str]:
        """Motion -> the step at which its rates ran away or the engine gave up (it then repeats its last state, and its time)."""
        fastest = np.max(np.abs(course.state[:, :, self.nq :]), axis=2, initial=0.0)
        bad = ~((fastest < RATE_LIMIT) & np.all(np.isfinite(course.state[:, :, : self.nq]), axis=2))
        reached = course.t[np.arange(len(bad)), np.where(bad.any(axis=1), np.argmax(bad, axis=1), -1)]
        early = np.flatnonzero(~(reached >= self.scene.duration * (1.0 - 1e-9)) | bad.any(axis=1))
        step = self.settings.timestep
        return {
            int(i): f"the run blew up at t = {reached[i]:.6g} s; a smaller timestep (now {step:g} s) may help" for i in early
        }

    def _opened(self, course: Course) -> dict[int, str]:
        """Motion -> the first loop that is torn open, at any step."""
        out: dict[int, str] = {}
        if not self.gaps or not np.isfinite(self.limit):
            return out
        columns = np.array([[k, k + 1, k + 2] for k in self.gaps.values()])
        gaps = np.sqrt(np.sum(course.sensed[:, :, columns] ** 2, axis=3))
        for i in np.flatnonzero(~np.all(gaps <= self.limit, axis=(1, 2))):
            k = int(np.argmax(~np.all(gaps[i] <= self.limit, axis=1)))
            worst = int(np.argmax(gaps[i, k]))
            t, name = float(course.t[i, k]), [*self.gaps][worst]
            out[int(i)] = open_loop_finding(t, float(gaps[i, k, worst]), self.limit, self.scene.duration, name).sentence
        return out

    def _kinematic(self, at: slice, q: Array) -> dict[int, str]:
        """Motion -> the first of its residuals and changes of the assembly mode that is an error."""
        out: dict[int, str] = {}
        if self.rows is None:
            return out
        flat = q.reshape(-1, q.shape[2])
        size = np.empty((len(flat), len(self.rows.names)))
        for i in range(0, len(flat), POSES):
            size[i : i + POSES] = np.abs(self.rows.residual(flat[i : i + POSES]))
        size[~np.isfinite(size)] = np.inf
        worst = np.max(size.reshape(*q.shape[:2], -1), axis=1)
        for kind, rows in self.kinds.items():
            name, unit, what = FINDING_OF_KIND[kind], "m" if kind == "offset" else "rad or m", WORDS[kind]
            values = self.findings[name][at] = np.max(worst[:, rows], axis=1)
            bound = GAP_LIMIT * (self.mechanism.length_scale if kind == "offset" else 1.0)
            for i in np.flatnonzero(~(values <= bound)).tolist():
                culprit = self.rows.names[rows[int(np.argmax(worst[i, rows]))]]
                finding = limit_finding(name, float(values[i]), bound, unit, f"{what} (at {culprit})")
                out.setdefault(i, finding.sentence)
        if self.scene.keep_mode:
            changes = self.findings["assembly_mode"][at] = self._mode_changes(q)
            held = ", ".join(self.scene.keep_mode)
            for i in np.flatnonzero(changes).tolist():
                text = f"with respect to {held} the assembly mode changed: a toggle was passed, which the mechanism itself cannot do"
                out.setdefault(i, f"{text}. Try a smaller timestep")
        return out

    def _mode_changes(self, q: Array) -> Array:
        """(n,) how often the sign of the mode changes along the looked-at poses q (n, m, nq)."""
        finite = np.where(np.isfinite(q), q, 0.0)
        signs = mode_signs(self.mechanism, finite, self.scene.keep_mode)
        return np.array([np.count_nonzero(np.diff(x[x != 0])) for x in signs], dtype=float)

    def _unaccounted(self, course: Course) -> Array:
        """(n,) largest energy that neither the start nor the work of loads, drives, dampers and stops explains, as a share of the
        energy that the motion turns over; see `mechlab.experiment.energy.energy_finding`."""
        m, q, v = self.mechanism, course.q[:, :-1], course.v[:, :-1]
        potential, kinetic = (course.sensed[:, :, k] for k in self.energies)
        power = -(v**2 @ self.balls)
        for k, damping in self.springs.items():
            power -= damping * course.sensed[:, :, k] ** 2
        for law in self.held:
            off, rate = m.value(law.on, q) - law.motion.at(0.0)[0], v @ m.row(law.on)
            if np.isinf(law.limit):
                potential = potential + 0.5 * law.stiffness * off**2
            else:
                power += rate * np.clip(-law.stiffness * off - law.damping * rate, -law.limit, law.limit)
        lost = self._worked(power)
        for name, damping in self.dampers:
            rate = v @ m.row(name)
            lost = lost - damping * self._squared(m.value(name, q), rate)
            power -= damping * rate**2
        given = np.zeros(power.shape)
        for name, force in course.loads.items():
            value = m.value(name, q)
            given += force[:, None] * (value - value[:, :1])
            power = power + force[:, None] * (v @ m.row(name))
        balance = kinetic + potential - given - lost
        balance = balance - balance[:, :1]
        missing = np.abs(balance - self._at_stops(balance, q, v))
        weight = m.total_mass * float(np.linalg.norm(m.gravity)) * STANDSTILL
        turned = np.max(self._worked(np.abs(power))[:, -1:], axis=1, initial=max(weight, NOTHING))
        turned = np.maximum(turned, np.maximum(np.max(kinetic, axis=1), np.ptp(potential, axis=1)))
        creep = kinetic_energy(m, course.q[0, :1], np.full((1, m.nv), CREEP))[0]
        noise = np.maximum(1e-12 * np.max(np.abs(potential), axis=1), creep)
        worst = np.max(missing, axis=1)
        return np.asarray(np.where(worst <= noise, 0.0, worst / turned))

    def _worked(self, power: Array) -> Array:
        """(n, k) work [J] of the power (n, k) since the start: by Simpson's rule for RK4, else by the trapezoidal rule."""
        from scipy.integrate import cumulative_simpson, cumulative_trapezoid

        if not np.any(power):
            return np.zeros(power.shape)
        good = self.settings.integrator == "RK4" and power.shape[1] > 2
        return np.asarray((cumulative_simpson if good else cumulative_trapezoid)(power, dx=self.settings.timestep, axis=1, initial=0.0))

    def _squared(self, value: Array, rate: Array) -> Array:
        """(n, k) integral of rate^2 since the start: for RK4 that of the cubic through values and rates (n, k) at both ends of a step,

            6 d^2 / (5 h) - d (r0 + r1) / 5 + h (2 r0^2 - r0 r1 + 2 r1^2) / 15,    d = x1 - x0,

        which a damper that acts within a step or two does not mislead: 0.3 % for a time constant of h, the trapezoidal rule 31 %.
        """
        if self.settings.integrator != "RK4":
            return self._worked(rate**2)
        h, d, first, last = self.settings.timestep, np.diff(value, axis=1), rate[:, :-1], rate[:, 1:]
        out = np.zeros(value.shape)
        steps = d * (1.2 * d / h - 0.2 * (first + last)) + h / 15.0 * (2.0 * (first**2 + last**2) - first * last)
        np.cumsum(steps, axis=1, out=out[:, 1:])
        return out

    def _at_stops(self, balance: Array, q: Array, v: Array) -> Array | float:
        """(n, k) energy <= 0 that the ends of ranges have taken: a fall of the balance while a joint or shaft is at an end, or may be;
        a soft stop returns at most what it has stored in the same contact."""
        parts: tuple[Joint | Shaft, ...] = (*self.mechanism.joints, *self.mechanism.shafts)
        met = np.zeros((len(q), q.shape[1] - 1), dtype=bool)
        for x in parts:
            if x.range is None:  # a spherical joint has none here
                continue
            value, speed = self.mechanism.value(x.name, q), np.abs(v @ self.mechanism.row(x.name)) * self.settings.timestep
            reach = np.maximum(speed[:, 1:], speed[:, :-1])
            low, high = x.range
            met |= np.minimum(value[:, 1:], value[:, :-1]) - reach <= low
            met |= np.maximum(value[:, 1:], value[:, :-1]) + reach >= high
        if not met.any():
            return 0.0
        out, lent = np.zeros(balance.shape), np.zeros(len(balance))
        for k in range(met.shape[1]):
            change = np.where(met[:, k], np.minimum(balance[:, k + 1] - balance[:, k], -lent), 0.0)
            lent = np.where(met[:, k], lent + change, 0.0)
            out[:, k + 1] = out[:, k] + change
        return out


class _Rows:
    """Residuals of all loops and relations at many poses, with names and kinds of the rows."""

    def __init__(self, mechanism: Mechanism) -> None:
        if all(j.nv == 1 for j in mechanism.joints):
            rows = BatchRows(BatchTree(mechanism))
            self.names, self.kinds, self.residual = rows.names, rows.kinds, rows.residual
            return
        constraints = ConstraintSet(mechanism)
        self.names, self.residual = constraints.rows, self._at
        kinds = zip(FINDING_OF_KIND, row_kinds(mechanism, constraints), strict=True)
        self.kinds = {kind: np.array(rows, dtype=int) for kind, rows in kinds}
        self._poses = ManyPoses(mechanism)

    def _at(self, q: Array) -> Array:
        return self._poses.set(q).residual_and_jacobian()[0]


FINDING_OF_KIND = {"offset": "loop_gap", "angle": "loop_angle", "relation": "relation_residual"}
"""Kind of row -> the finding on its residual."""
WORDS = {
    "offset": "the loops open by up to", "angle": "the loops tilt by up to", "relation": "the gears and relations slip by up to"
}  # fmt: skip


def _sensor(model: mujoco.MjModel, name: str) -> int:
    return int(model.sensor_adr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, name)])
