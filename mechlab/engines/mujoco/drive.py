"""The laws of a scene, acting on a MuJoCo run inside the engine's control callback."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from mechlab.engines.mujoco.model import MujocoMap, passive, to_mujoco
from mechlab.engines.mujoco.plant import MujocoPlant
from mechlab.engines.state import RATE_LIMIT
from mechlab.errors import MechlabError
from mechlab.experiment.acting import held_drives
from mechlab.experiment.laws import AppliedForce, DcMotor, Law, LawStates, Servo
from mechlab.experiment.prices import CALLBACK, price_of_laws
from mechlab.experiment.scene import Settings
from mechlab.integrate import count_work
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

_RK4 = (1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0)


class Driver:
    """Applies the laws at every evaluation of the equations of motion, and integrates their work.

    `forces`: joint or shaft -> force of all laws on it, at the last evaluation. `work` [J] is integrated with the
    weights of the method: the four stages of RK4, or the trapezoidal rule for the methods of one evaluation a step.
    States of laws (`mechlab.experiment.laws.LawStates`) are integrated here: with the stages of RK4, which keeps its order (an
    activation of the engine would lower it to the first), else exactly for the rates at the start of the step.

    Declared drives that `engage` gave to actuators are applied by the engine, whose implicit methods take them
    implicitly; their forces are computed here a second time, for the record and for the work.

    `at_once`: all laws are constant and the method is RK4. Then the forces are in the engine from the start, and no call
    is needed: with the weights of RK4 the integral of force x rate is force x displacement, to rounding.
    """

    def __init__(self, mechanism: Mechanism, laws: tuple[Law, ...], plant: MujocoPlant) -> None:
        self.mechanism, self.laws, self.plant = mechanism, laws, plant
        in_engine = engaged(laws)
        self.applied = AppliedForce(mechanism, [law for law in laws if law not in in_engine])
        self.held = AppliedForce(mechanism, in_engine) if in_engine else None
        self._qfrc, self._qvel = plant.data.qfrc_applied, plant.data.qvel
        dof = plant.map.dof
        self._dof: Array | slice = slice(None) if np.array_equal(dof, np.arange(len(self._qvel))) else dof
        self._option = plant.model.opt
        self.targets = tuple(dict.fromkeys(name for law in laws for name in law.targets()))
        self.forces: dict[str, float] = dict.fromkeys(self.targets, 0.0)
        self._work = 0.0
        self.evaluations = 0
        self._price = CALLBACK + price_of_laws(laws)
        self._rk4 = bool(plant.model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4)
        self._stage = 0
        self._last: tuple[float, float] | None = None
        self.sampling = False
        self.memory = LawStates(laws)
        self._kept = self._seen = self.memory.initial
        self._slopes: list[Array] = []
        self.memory.put(plant, self._kept)
        self.at_once = self._rk4 and self.applied.constant and self.held is None
        self._from = {name: plant.value(name) for name in self.targets} if self.at_once else {}
        if self.at_once:
            total, self.forces = self.applied(plant.t, plant)
            self._qfrc[self._dof] = total
            self._refuse(self.forces)

    @property
    def called(self) -> bool:
        """Whether the engine must call it while it steps."""
        return bool(self.laws) and not self.at_once

    @property
    def work(self) -> float:
        """Work of the laws since the start [J]."""
        if self.at_once:
            return sum(f * (self.plant.value(name) - self._from[name]) for name, f in self.forces.items())
        return self._work

    def __call__(self) -> None:
        """One evaluation: the engine's state is current, its forces are not computed yet."""
        count_work(self._price)
        plant = self.plant
        if len(self.memory):
            self.memory.put(plant, self._kept if self.sampling or not self._rk4 or not self._stage else self._seen)
        t = plant.t
        total, self.forces = self.applied(t, plant)
        self._qfrc[self._dof] = total
        if self.held is not None:
            held, forces = self.held(t, plant)
            total = total + held
            self.forces = {n: self.forces.get(n, 0.0) + forces.get(n, 0.0) for n in (self.forces | forces)}
        self.evaluations += 1
        power = float(total.dot(self._qvel[self._dof]))
        if not math.isfinite(power):
            self._refuse(self.forces)
        if len(self.memory) and not self.sampling:
            self._remember()
        if self._rk4:
            if not self.sampling:
                self._work += _RK4[self._stage] * self._option.timestep * power
                self._stage = (self._stage + 1) % 4
            return
        if self._last is not None:
            self._work += 0.5 * (t - self._last[0]) * (power + self._last[1])
        self._last = (t, power)

    def _remember(self) -> None:
        """Advance the states of the laws by one stage of RK4, or by one step of another method."""
        plant, h = self.plant, float(self._option.timestep)
        if not self._rk4:
            self._kept = self.memory.after(plant.t, plant, self._kept, h)
            return
        if self._stage == 0:
            self._slopes, self._seen = [], self._kept
        self._slopes.append(self.memory.rate(plant.t, plant, self._seen))
        if self._stage < 3:
            self._seen = self._kept + (0.5, 0.5, 1.0)[self._stage] * h * self._slopes[-1]
        else:
            self._kept = self._kept + h * sum(w * k for w, k in zip(_RK4, self._slopes, strict=True))

    def _refuse(self, forces: Mapping[str, float]) -> None:
        """Raise MechlabError for a force that is not finite, unless the state has already blown up."""
        data = self.plant.data
        if not np.all(np.abs(data.qvel) < RATE_LIMIT) or not np.all(np.isfinite(data.qpos)):
            return
        for name, f in forces.items():
            if not math.isfinite(f):
                raise MechlabError(
                    f"{self.mechanism.name}: the laws give {name!r} the force {f} at t = {self.plant.t:.6g} s."
                )

    def now(self) -> list[float]:
        """Forces in the order of `targets`."""
        return [self.forces.get(name, 0.0) for name in self.targets]


def engaged(laws: Sequence[Law]) -> tuple[Servo | DcMotor, ...]:
    """The laws that the engine's own actuators apply: declared drives whose force has no memory."""
    return tuple(law for law in held_drives(laws) if isinstance(law, Servo) or not law.inductance)


def engage(map_: MujocoMap, laws: Sequence[Law]) -> None:
    """Leave in a model the actuators that stand for `engaged` laws, with the stiffness and damping of the law (a
    stability map varies them), and take out all others. Controls stay 0, the target of a drive."""
    model = map_.model
    passive(model)
    in_file_units = {d.name for d in map_.mechanism.drives if d.control is not None}
    for law in engaged(laws):
        k = map_.actuators[law.drive]
        model.actuator_group[k] = 0
        if law.drive in in_file_units and isinstance(law, Servo):
            _at_the_joint(model, k, law)
        if isinstance(law, Servo) and (law.stiffness or math.isfinite(law.limit) or law.drive in in_file_units):
            offset = law.motion.at(0.0)[0] - map_.mechanism.zero(law.on)
            if law.stiffness:
                model.actuator_gainprm[k, 0] = law.stiffness
            model.actuator_biasprm[k, :3] = law.stiffness * offset, -law.stiffness, -law.damping
        elif isinstance(law, Servo):
            model.actuator_damping[k] = law.damping


RunModel = tuple[mujoco.MjModel, mujoco.MjData, MujocoMap]


def run_model(mechanism: Mechanism, settings: Settings, laws: Sequence[Law]) -> RunModel:
    """A model for a run under laws, without the automatic reset and with the actuators of `engage` alone."""
    model, data = to_mujoco(mechanism, settings)
    map_ = MujocoMap(mechanism, model)
    engage(map_, laws)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return model, data, map_


def put_start(data: mujoco.MjData, map_: MujocoMap, q: Array, v: Array) -> None:
    """Put the start of a run, q (nq,) and v (nv,), into the data; the solver remembers nothing."""
    data.qpos[:] = map_.engine_coordinates(q)
    data.qvel[:] = map_.engine_rates(data.qpos, v)
    data.qacc_warmstart[:] = 0.0


def _at_the_joint(model: mujoco.MjModel, k: int, law: Servo) -> None:
    """Take the units of its control from an actuator: its force is that at the joint, its control 0 is in range."""
    model.actuator_gear[k, 0] = 1.0
    model.actuator_ctrllimited[k] = False
    model.actuator_biastype[k] = mujoco.mjtBias.mjBIAS_AFFINE
    model.actuator_forcelimited[k] = math.isfinite(law.limit)
    if math.isfinite(law.limit):
        model.actuator_forcerange[k] = -law.limit, law.limit


def motor_states(mechanism: Mechanism, control: float, rates: Array, currents: Array) -> tuple[Array, Array, Array]:
    """The first actuator of the model file at states with rates (n, engine nv) and activations (n,), under a constant control: its
    speed, the rate of its activation, and its force, (n,) each.

    The force is that of the activation at the state itself, not at the end of the step (`actearly`).
    """
    model, data = to_mujoco(mechanism)
    model.actuator_actearly[:] = False
    data.ctrl[0] = control
    out = []
    for v, current in zip(rates, currents, strict=True):
        data.qvel[:], data.act[0] = v, current
        mujoco.mj_forward(model, data)
        out.append((data.actuator_velocity[0], data.act_dot[0], data.actuator_force[0]))
    speed, rate, force = np.array(out).T
    return speed, rate, force
