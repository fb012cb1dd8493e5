"""Many motions at once, stepped inside the engine by all cores (mujoco.rollout): of one mechanism or of many of the same structure,
with loops and gears, under constant loads, servos that hold, motors, viscous loads and declared drives that hold.

Nothing calls Python between the steps. The steps are those of `mechlab.engines.mujoco.run`, whatever the number of threads: bit for bit,
but to rounding where a servo or a viscous load is put into the model (`mechlab.engines.mujoco.springs`). Every motion is judged
(`mechlab.engines.mujoco.batch_health`), blocks of them at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout

from mechlab.engines.mujoco.batch_health import BatchHealth, Course
from mechlab.engines.mujoco.control import compiling, engine
from mechlab.engines.mujoco.curve_rows import NO_ROLLOUT
from mechlab.engines.mujoco.drive import engage, engaged, springs_of
from mechlab.engines.mujoco.findings import GAP_KINDS, masses_finding
from mechlab.engines.mujoco.model import Indices, MujocoMap
from mechlab.engines.mujoco.sparse import LARGE, sparse_is_right
from mechlab.engines.mujoco.springs import put_springs, spring_dampers
from mechlab.engines.mujoco.stepping import Grid
from mechlab.errors import MechlabError
from mechlab.experiment.laws import Servo
from mechlab.experiment.motion import Hold
from mechlab.experiment.scene import Scene, Settings
from mechlab.formats import to_mjcf
from mechlab.formats.mjcf.write_loops import site_names, tendon_name
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Joint, Shaft

NUMBERS = 4_000_000
"""Most numbers (32 MB) of one call of the engine, which keeps every step of all motions that it rolls out together."""
LOOKED_AT = 250
"""Most samples of a motion at which loops and the assembly mode are looked at; as many as in a single run."""
FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS

Steps = Callable[[Sequence[mujoco.MjModel], Array, Array, int], tuple[Array, Array]]
"""Takes `count` steps of n motions: models (n), states (n, size) and forces on the rates (n, nv) to the states (n, count, size) after
each step and the sensor data (n, count, sensors) before each."""


@dataclass(frozen=True)
class Motions:
    """N motions of a mechanism in a scene: q (N, nq), v (N, nv) at the start, on all constraints; loads: joint or shaft -> (N,) constant
    forces [N m or N] besides those of the scene."""

    mechanism: Mechanism
    scene: Scene
    settings: Settings
    q: Array
    v: Array
    loads: Mapping[str, Array]


@dataclass(frozen=True)
class Batch:
    """t (m,) of the kept samples; q (N, m, nq), v (N, m, nv); findings: name -> (N,) values, as in the health record of a run;
    reasons (N,): why a motion cannot be trusted, "" where it can."""

    t: Array
    q: Array
    v: Array
    findings: Mapping[str, Array]
    reasons: tuple[str, ...]


def why_not_together(mechanism: Mechanism, scene: Scene, settings: Settings) -> str:
    """Why motions of a mechanism in a scene cannot be rolled out; "" where they can."""
    held, rk4 = engaged(scene.laws), settings.integrator == "RK4"
    others = [x.kind for x in scene.laws if not (_holds(x) if x in held else spring_dampers(mechanism, [x], rk4) is not None)]
    steps = scene.duration / settings.timestep
    parts: tuple[Joint | Shaft, ...] = (*mechanism.joints, *mechanism.shafts)
    reasons = {
        f"the engine of the scene is {settings.engine}": settings.engine != "mujoco",
        f"the scene has laws that Python evaluates ({', '.join(dict.fromkeys(others))})": bool(others),
        NO_ROLLOUT: bool(mechanism.curves),
        "there is dry friction": any(x.friction for x in parts),
        "there are springs with a range": any(s.range is not None for s in mechanism.springs),
        "there are spherical joints with a range": any(j.nv != 1 and j.range is not None for j in mechanism.joints),
        "the timestep does not divide the duration": abs(steps - round(steps)) > 1e-9,
    }
    return next((text for text, holds in reasons.items() if holds), "")


def _holds(law: object) -> bool:
    return isinstance(law, Servo) and isinstance(law.motion, Hold)


def roll(
    motions: Sequence[Motions], steps: Grid, whole: bool = True, take: Steps | None = None, threads: int = 1, numbers: int = NUMBERS
) -> list[Batch]:
    """The motions over the steps of the grid; whole: keep all its samples, not only those that are looked at.

    take: who steps, by default the engine itself on `threads` threads; numbers: most of one call of it. Raises MechlabError for a
    mechanism or scene of `why_not_together`.
    """
    for x in motions:
        reason = why_not_together(x.mechanism, x.scene, x.settings)
        if reason:
            raise MechlabError(f"{x.mechanism.name}: its motions cannot be rolled out together: {reason}.")
    seen = np.unique(np.linspace(0, len(steps.samples) - 1, min(len(steps.samples), LOOKED_AT)).round().astype(int))
    samples = np.array(steps.samples)
    keep, look = (samples, seen) if whole else (samples[seen], np.arange(len(seen)))
    same: dict[Any, list[int]] = {}
    for k, x in enumerate(motions):
        key = (x.mechanism, x.settings, x.scene.laws, x.scene.keep_mode, x.scene.duration, tuple(x.loads))
        same.setdefault(key, []).append(k)
    prepared = [_Prepared(_joined([motions[k] for k in group]), steps, keep, look) for group in same.values()]
    alike: dict[tuple[int, ...], list[_Prepared]] = {}
    for one in prepared:
        alike.setdefault(_shape(one.model), []).append(one)
    for shaped in alike.values():
        _roll_alike(shaped, steps, take or steps_of_engine(threads), numbers)
    out: dict[int, Batch] = {}
    for one, group in zip(prepared, same.values(), strict=True):
        ends = np.cumsum([0, *(len(motions[k].q) for k in group)]).tolist()
        out |= {k: one.result(slice(a, b)) for k, a, b in zip(group, ends, ends[1:], strict=False)}
    return [out[k] for k in range(len(motions))]


def _joined(motions: Sequence[Motions]) -> Motions:
    """Motions that differ only in their start and the sizes of their loads, as one."""
    loads = {name: np.concatenate([x.loads[name] for x in motions]) for name in motions[0].loads}
    return replace(motions[0], q=np.concatenate([x.q for x in motions]), v=np.concatenate([x.v for x in motions]), loads=loads)


def _roll_alike(group: Sequence[_Prepared], steps: Grid, take: Steps, numbers: int) -> None:
    """Roll out motions whose models have the same shape, some of them at a time."""
    ends = np.cumsum([0, *(len(x.start) for x in group)])
    start, push = np.concatenate([x.start for x in group]), np.concatenate([x.push for x in group])
    models = [x.model for x in group for _ in range(len(x.start))]
    many = max(1, numbers // (steps.count * (start.shape[1] + models[0].nsensordata)))
    for i in range(0, len(models), many):
        s = slice(i, min(i + many, len(models)))
        states, sensed = take(models[s], start[s], push[s], steps.count)
        for k in range(np.searchsorted(ends, i, side="right") - 1, len(group)):
            if ends[k] >= s.stop:
                break
            low, high = max(int(ends[k]), i), min(int(ends[k + 1]), s.stop)
            group[k].take(slice(low - ends[k], high - ends[k]), states[low - i : high - i], sensed[low - i : high - i])


def steps_of_engine(threads: int) -> Steps:
    """Steps by MuJoCo itself in double precision."""

    def take(models: Sequence[mujoco.MjModel], start: Array, push: Array, count: int) -> tuple[Array, Array]:
        with engine(), rollout.Rollout(nthread=threads) as pool:
            workers = [mujoco.MjData(models[0]) for _ in range(max(1, threads))]
            states, sensed = pool.rollout(
                list(models), workers, start, push[:, None], nstep=count,
                control_spec=int(mujoco.mjtState.mjSTATE_QFRC_APPLIED), initial_warmstart=np.zeros((1, models[0].nv)),
            )  # fmt: skip
        return states, sensed

    return take


class _Prepared:
    """Motions with their model, their start in the engine's coordinates, and room for what is kept of them."""

    def __init__(self, motions: Motions, steps: Grid, keep: Indices, look: Indices) -> None:
        m, scene = motions.mechanism, motions.scene
        self.motions, self.steps, self.keep = motions, steps, keep
        self.model = _model(m, motions.settings)
        self.map = MujocoMap(m, self.model)
        engage(self.map, scene.laws)
        data = mujoco.MjData(self.model)
        count, nq, nv = len(motions.q), self.model.nq, self.model.nv
        first = np.empty(mujoco.mj_stateSize(self.model, FULL))
        mujoco.mj_getState(self.model, data, first, FULL)
        self.start = np.tile(first, (count, 1))
        qpos, qvel = self.start[:, 1 : 1 + nq], self.start[:, 1 + nq : 1 + nq + nv]
        if len(self.map.other_dof):
            for k in range(count):
                qpos[k] = self.map.engine_coordinates(motions.q[k])
                qvel[k] = self.map.engine_rates(qpos[k], motions.v[k])
        else:
            qpos[:, self.map.qpos], qvel[:, self.map.dof] = motions.q, motions.v
        self.loads = {name: np.asarray(x, dtype=float) for name, x in motions.loads.items()}
        springs = springs_of(m, scene.laws, motions.settings) or ()
        put_springs(self.map, springs)
        for x in springs:
            if x.load:
                self.loads[x.on] = self.loads.get(x.on, 0.0) + np.full(count, x.load)
        self.push = np.zeros((count, nv))
        for name, values in self.loads.items():
            self.push[:, self.map.dof] += values[:, None] * m.row(name)
        if count:
            with engine():
                data.qpos[:], data.qvel[:] = qpos[0], qvel[0]
                if nv > LARGE and sparse_is_right(self.model, data):
                    self.model.opt.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
        masses = masses_finding(self.map, motions.q[0], data) if count else None
        ahead = "" if masses is None else masses.sentence
        self.health = BatchHealth(m, scene, motions.settings, self.model, self.map, look, count, ahead)
        self.q, self.v = np.empty((count, len(keep), m.nq)), np.empty((count, len(keep), m.nv))

    def take(self, at: slice, states: Array, sensed: Array) -> None:
        """Keep the samples of motions `at`, and judge them."""
        nq, nv = self.model.nq, self.model.nv
        whole = np.concatenate([self.start[at, None, : 1 + nq + nv], states[:, :, : 1 + nq + nv]], axis=1)
        q, v = self.map.coordinates(whole[:, :, 1 : 1 + nq]), self.map.rates(whole[:, :, 1 + nq :])
        self.q[at], self.v[at] = q[:, self.keep], v[:, self.keep]
        course = Course(whole[:, :, 0], q, v, whole[:, :, 1:], sensed, {n: x[at] for n, x in self.loads.items()})
        self.health.take(at, course, self.q[at], self.v[at])

    def result(self, at: slice) -> Batch:
        """What is kept of motions `at`."""
        t = np.array([self.steps.t(int(k)) for k in self.keep])
        findings = {name: x[at] for name, x in self.health.findings.items()}
        return Batch(t, self.q[at], self.v[at], findings, tuple(self.health.reasons[at]))


def _model(mechanism: Mechanism, settings: Settings) -> mujoco.MjModel:
    """The model with those sensors alone that the health record reads: gaps of loops, rates of damped springs, the two energies."""
    site = mujoco.mjtObj.mjOBJ_SITE
    with compiling():
        spec = mujoco.MjSpec.from_string(to_mjcf(mechanism, settings, bare=True))
        for name in (x.name for x in mechanism.loops if x.kind in GAP_KINDS):
            a, b = site_names(name)
            spec.add_sensor(
                type=mujoco.mjtSensor.mjSENS_FRAMEPOS, name=f"gap:{name}", objtype=site, objname=b, reftype=site, refname=a
            )
        for name in (x.name for x in mechanism.springs if x.damping):
            tendon = tendon_name(mechanism, name)
            spec.add_sensor(
                type=mujoco.mjtSensor.mjSENS_TENDONVEL, name=f"rate:{name}", objtype=mujoco.mjtObj.mjOBJ_TENDON, objname=tendon
            )
        for kind in (mujoco.mjtSensor.mjSENS_E_POTENTIAL, mujoco.mjtSensor.mjSENS_E_KINETIC):
            spec.add_sensor(type=kind, name=kind.name)
        try:
            model = spec.compile()
        except ValueError as error:
            raise MechlabError(f"{mechanism.name}: MuJoCo refuses the model: {error}") from None
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return model


def _shape(model: mujoco.MjModel) -> tuple[int, ...]:
    """What must be equal for models to be rolled out by one call."""
    sizes = ("nq", "nv", "na", "nu", "nbody", "njnt", "ngeom", "nsite", "ntendon", "nwrap", "neq", "nsensordata", "nkey")
    return (*(int(getattr(model, x)) for x in sizes), int(model.opt.jacobian), int(model.opt.integrator))
