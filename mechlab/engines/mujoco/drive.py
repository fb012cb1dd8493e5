"""The laws of a scene, and the rows of curves, on a MuJoCo run inside the engine's control callback."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache

import mujoco
import numpy as np

from mechlab.engines.mujoco.after_run import MOST_NUMBERS, AfterRun, ConstantLoads, HeldDrives, StepsBetween
from mechlab.engines.mujoco.model import MujocoMap, Tuning, passive, to_mujoco
from mechlab.engines.mujoco.plant import MujocoPlant
from mechlab.engines.mujoco.springs import SpringDamper, put_springs, spring_dampers
from mechlab.engines.mujoco.stepping import Grid, length
from mechlab.engines.state import RATE_LIMIT
from mechlab.errors import MechlabError
from mechlab.experiment.acting import held_drives
from mechlab.experiment.laws import DcMotor, Law, Servo
from mechlab.experiment.laws.compiled import CompiledLaws, StateOrder
from mechlab.experiment.prices import CALLBACK, price_of_laws
from mechlab.experiment.scene import Settings
from mechlab.integrate import count_work
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

_RK4 = (1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0)


class Driver:
    """Applies the laws at every evaluation of the equations of motion, and integrates their work.

    `work` [J] is integrated with the
    weights of the method: the four stages of RK4, or the trapezoidal rule for the methods of one evaluation a step.
    States of laws (`mechlab.experiment.laws.LawStates`) are integrated here: with the stages of RK4, which keeps its order (an
    activation of the engine would lower it to the first), else exactly for the rates at the start of the step.

    Declared drives that `engage` gave to actuators are applied by the engine, whose implicit methods take them
    implicitly; their forces are computed here a second time, for the record and for the work. So are those of all laws that are
    in the model as springs and dampers (`in_model`).

    `at_once`: all laws are constant and the method is RK4. Then the forces are in the engine from the start, and no call
    is needed: with the weights of RK4 the integral of force x rate is force x displacement, to rounding.
    """

    def __init__(self, mechanism: Mechanism, laws: tuple[Law, ...], plant: MujocoPlant, in_model: bool = False) -> None:
        self.mechanism, self.laws, self.plant = mechanism, laws, plant
        in_engine, order = laws if in_model else engaged(laws), order_of(plant.map)
        self.applied = CompiledLaws(mechanism, [law for law in laws if law not in in_engine], order)
        self.held = CompiledLaws(mechanism, in_engine, order) if in_engine else None
        data = self._data = plant.data
        self._qfrc, self._qvel, self._qpos = data.qfrc_applied, data.qvel, data.qpos
        self._option = plant.model.opt
        self.curves = plant.map.curves
        self.targets = tuple(dict.fromkeys(name for law in laws for name in law.targets()))
        self._forces, self._held_forces = np.zeros(0), np.zeros(0)
        self._work = 0.0
        self.evaluations = 0
        self._price = CALLBACK + price_of_laws(laws)
        self._rk4 = bool(plant.model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4)
        self._stage = 0
        self._last: tuple[float, float] | None = None
        self.sampling = self.leads = False
        self._at_sample: float | None = None
        self.memory = self.applied.states
        self._remembers = len(self.memory) > 0
        self._kept = self._seen = self.memory.initial
        self._mean = np.zeros(len(self.memory))
        self.memory.put(plant, self._kept)
        self.at_once = self._rk4 and self.applied.constant and self.held is None
        self._from = {name: plant.value(name) for name in self.targets} if self.at_once else {}
        if self.at_once:
            self._apply(plant.t)
            self._refuse()

    @property
    def called(self) -> bool:
        """Whether the engine must call it while it steps."""
        return bool(self.curves) or (bool(self.laws) and not self.at_once)

    def afterwards(self, steps: Grid, judged: bool) -> AfterRun | None:
        """What tells forces and work from the states of a run, so that no call is needed; None where the calls have to. judged: whether
        somebody asks for the work."""
        if self.curves:
            return None
        if self.at_once or not self.laws:
            return ConstantLoads(self.plant.map, self.forces)
        if self.held is None or self.applied.laws or not self.held.steady:
            return None
        model = self.plant.model
        if judged and steps.count * (model.nq + 2 * model.nv) > MOST_NUMBERS:
            return None
        return HeldDrives(self.held, steps, self._rk4, StepsBetween(model, self._data) if judged else None)

    @property
    def reads_rows(self) -> bool:
        """Whether it is called and a law may read the constraint rows, which must be dense then."""
        return self.called and not self.applied.all_formulas

    @property
    def forces(self) -> dict[str, float]:
        """Joint or shaft -> force of all laws on it, at the last evaluation."""
        out = dict.fromkeys(self.targets, 0.0)
        for laws, forces in ((self.applied, self._forces), (self.held, self._held_forces)):
            if laws is not None:
                for name, f in zip(laws.targets, forces.tolist(), strict=False):
                    out[name] = out.get(name, 0.0) + f
        return out

    @property
    def work(self) -> float:
        """Work of the laws since the start [J]."""
        if self.at_once:
            return sum(f * (self.plant.value(name) - self._from[name]) for name, f in self.forces.items())
        return self._work if self._at_sample is None else self._at_sample

    def push(self) -> None:
        """One evaluation that keeps no account of forces and work, for runs of which states alone are kept."""
        if self.curves:
            self.curves.put(self._data)
        count_work(self._price)
        laws, t = self.applied, self._data.time
        if not laws.laws:
            return
        if self._remembers:
            self._apply(t)
            if not math.isfinite(length(self._forces)):
                self._refuse()
            if not self.sampling:
                self._remember(t)
                self._stage = (self._stage + 1) % 4 if self._rk4 else 0
            return
        laws.put(t, self._qpos, self._qvel)
        if laws.affine:
            self._qfrc[:] = laws.affine_force()
            return
        forces, self._qfrc[:] = laws.forces(t, self.plant)
        if not math.isfinite(length(forces)):
            self._forces = forces
            self._refuse()

    def unaccounted(self) -> None:
        """`push`, and forces at the samples alone: for runs that are compared with another one."""
        if self.sampling:
            self()
        else:
            self.push()

    def __call__(self) -> None:
        """One evaluation: the engine's state is current, its forces are not computed yet. `sampling`: for the record; `leads`: the
        next step goes on from it, so that it is the first stage of that step too."""
        if self.curves:
            self.curves.put(self._data)
        count_work(self._price)
        counts = self.leads or not self.sampling
        t = self._data.time
        total = self._apply(t)
        if self.held is not None:
            self.held.put(t, self._qpos, self._qvel)
            self._held_forces, held = self.held.forces(t, self.plant)
            total = total + held
        self.evaluations += 1
        power = float(total.dot(self._qvel))
        if not math.isfinite(power):
            self._refuse()
        if self._remembers and counts:
            self._remember(t)
        if self._rk4:
            self._at_sample = self._work if self.sampling else None
            if counts:
                self._work += _RK4[self._stage] * self._option.timestep * power
                self._stage = (self._stage + 1) % 4
            return
        if self._last is not None:
            self._work += 0.5 * (t - self._last[0]) * (power + self._last[1])
        self._last = (t, power)

    def _apply(self, t: float) -> Array:
        """(engine nv,) the generalized force of the laws that the engine does not apply by itself; it is put into the data."""
        laws = self.applied
        laws.put(t, self._qpos, self._qvel)
        if self._remembers:
            states = self._kept if self.sampling or not self._rk4 or not self._stage else self._seen
            laws.put_states(states)
            if not laws.all_formulas:
                self.memory.put(self.plant, states)
        self._forces, total = laws.forces(t, self.plant)
        if laws.laws:
            self._qfrc[:] = total
        return total

    def _remember(self, t: float) -> None:
        """Advance the states of the laws by one stage of RK4, or by one step of another method."""
        plant, h = self.plant, float(self._option.timestep)
        if not self._rk4:
            self._kept = self.memory.after(t, plant, self._kept, h)
            return
        rates, stage = self.applied.state_rates(t, plant), self._stage
        mean = _RK4[stage] * rates
        self._mean = mean if stage == 0 else self._mean + mean
        if stage < 3:
            self._seen = self._kept + (0.5, 0.5, 1.0)[stage] * h * rates
        else:
            self._kept = self._kept + h * self._mean

    def _refuse(self) -> None:
        """Raise MechlabError for a force that is not finite, unless the state has already blown up."""
        data = self.plant.data
        if not np.all(np.abs(data.qvel) < RATE_LIMIT) or not np.all(np.isfinite(data.qpos)):
            return
        for name, f in self.forces.items():
            if not math.isfinite(f):
                raise MechlabError(
                    f"{self.mechanism.name}: the laws give {name!r} the force {f} at t = {self.plant.t:.6g} s."
                )

    def now(self) -> list[float]:
        """Forces in the order of `targets`."""
        if self.held is None and len(self._forces) == len(self.targets) and self.applied.targets == self.targets:
            return self._forces.tolist()
        forces = self.forces
        return [forces[name] for name in self.targets]


def order_of(map_: MujocoMap) -> StateOrder:
    """Where a model of the engine keeps the state of a Mechanism."""
    m = map_.mechanism
    return StateOrder(map_.qpos[m.q_columns], map_.dof, int(map_.model.nq), int(map_.model.nv))


def engaged(laws: Sequence[Law]) -> tuple[Servo | DcMotor, ...]:
    """The laws that the engine's own actuators apply: declared drives whose force has no memory."""
    return tuple(law for law in held_drives(laws) if isinstance(law, Servo) or not law.inductance)


def springs_of(mechanism: Mechanism, laws: Sequence[Law], settings: Settings) -> tuple[SpringDamper, ...] | None:
    """The laws without those `engaged`, as springs and dampers of the model; None where one of them is something else."""
    held = engaged(laws)
    return spring_dampers(mechanism, [law for law in laws if law not in held], settings.integrator == "RK4")


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
    return tunable_model(mechanism, settings, laws)[0]


def tunable_model(mechanism: Mechanism, settings: Settings, laws: Sequence[Law]) -> tuple[RunModel, Tuning]:
    """`run_model`, and what gives it other settings."""
    model, data = to_mujoco(mechanism, None, bare=True)
    tuning = Tuning(model)
    tuning.put(settings)
    map_ = MujocoMap(mechanism, model)
    engage(map_, laws)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return (model, data, map_), tuning


@lru_cache(maxsize=8)
def _unused(
    mechanism: Mechanism, held: tuple[Law, ...], springs: tuple[SpringDamper, ...], thread: int
) -> list[tuple[RunModel, Tuning, Array]]:
    """Models of runs of a thread that have ended; `lent_model` takes from them and gives back."""
    return []


@contextmanager
def lent_model(
    mechanism: Mechanism, settings: Settings, laws: Sequence[Law], springs: tuple[SpringDamper, ...] = ()
) -> Iterator[RunModel]:
    """A `run_model` with springs and their constant force for this block: what the same mechanism under the same held drives ran on
    before is tuned and reset, which is cheaper than another MjModel and MjData. Whatever else the block changes in the model it has
    to put back."""
    unused = _unused(mechanism, engaged(laws), springs, threading.get_ident())
    if unused:
        made, tuning, force = unused.pop()
        tuning.put(settings)
        mujoco.mj_resetData(made[0], made[1])
    else:
        made, tuning = tunable_model(mechanism, settings, laws)
        force = put_springs(made[2], springs)
    made[1].qfrc_applied[:] = force
    yield made
    unused.append((made, tuning, force))  # not after an error: nobody knows what it left


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
