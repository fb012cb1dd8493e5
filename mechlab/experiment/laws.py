"""Force laws as data: what drives and loads a mechanism. A law is evaluated at every stage of a step, never held."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.motion import Motion
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism


class Plant(Protocol):
    """The state that a law sees; each engine implements it. Values are physical: zero + coordinate."""

    mechanism: Mechanism
    t: float

    def value(self, name: str) -> float:
        """Value of a joint or shaft [rad or m]."""
        ...

    def rate(self, name: str) -> float:
        """Rate of a joint or shaft."""
        ...

    def mass_matrix(self) -> Array:
        """(nv, nv) mass matrix, shafts and armatures included."""
        ...

    def bias(self) -> Array:
        """(nv,) h of M a + h = applied + J^T reactions: velocity, gravity and passive terms."""
        ...

    def jacobian(self) -> Array:
        """(rows, nv) constraint Jacobian."""
        ...

    def constraint_bias(self) -> Array:
        """(rows,) dJ/dt v."""
        ...


class Law(Protocol):
    """A force law: forces on joints and shafts [N m or N] by name."""

    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """Forces at time t [s] in the state of the plant."""
        ...

    def targets(self) -> tuple[str, ...]:
        """Names of the joints and shafts that the law may act on."""
        ...


LAWS: dict[str, type[Any]] = {}
"""Registered laws by name."""

T = TypeVar("T", bound=type)


def register(kind: str) -> Callable[[T], T]:
    """Class decorator: the law is known as `kind`."""

    def add(cls: T) -> T:
        cls.kind = kind  # type: ignore[attr-defined]
        LAWS[kind] = cls
        return cls

    return add


class _OnOne:
    on: str

    def targets(self) -> tuple[str, ...]:
        """The one joint or shaft that the law acts on."""
        return (self.on,)


@register("constant")
@dataclass(frozen=True)
class Constant(_OnOne):
    """A constant force or torque."""

    on: str
    value: float
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The constant."""
        return {self.on: self.value}


@register("harmonic")
@dataclass(frozen=True)
class Harmonic(_OnOne):
    """offset + amplitude sin(frequency t + phase), frequency in rad/s."""

    on: str
    amplitude: float
    frequency: float
    phase: float = 0.0
    offset: float = 0.0
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The harmonic at t."""
        return {self.on: self.offset + self.amplitude * math.sin(self.frequency * t + self.phase)}


@register("table")
@dataclass(frozen=True)
class TableLaw(_OnOne):
    """A force given at times, linear between, held at the ends."""

    on: str
    times: tuple[float, ...]
    values: tuple[float, ...]
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The interpolated force."""
        return {self.on: float(np.interp(t, self.times, self.values))}


@register("servo")
@dataclass(frozen=True)
class Servo(_OnOne):
    """A servo: stiffness (target - value) + damping (target rate - rate) + feedforward, limited to +-limit."""

    on: str
    motion: Motion
    stiffness: float
    damping: float
    feedforward: float = 0.0
    limit: float = math.inf
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The servo force."""
        x, dx, _ = self.motion.at(t)
        f = self.stiffness * (x - plant.value(self.on)) + self.damping * (dx - plant.rate(self.on)) + self.feedforward
        return {self.on: min(max(f, -self.limit), self.limit)}


@register("constant_power")
@dataclass(frozen=True)
class ConstantPower(_OnOne):
    """power / rate, limited to `limit` near standstill."""

    on: str
    power: float
    limit: float
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The force at the present rate."""
        rate = plant.rate(self.on)
        f = (
            self.power / rate
            if abs(rate) * self.limit > abs(self.power)
            else math.copysign(self.limit, self.power * (rate or 1.0))
        )
        return {self.on: min(max(f, -self.limit), self.limit)}


@register("motor")
@dataclass(frozen=True)
class Motor(_OnOne):
    """A motor with a straight characteristic: stall (1 - rate / no_load_rate)."""

    on: str
    stall: float
    no_load_rate: float
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The torque at the present rate."""
        return {self.on: self.stall * (1.0 - plant.rate(self.on) / self.no_load_rate)}


@register("dc_motor")
@dataclass(frozen=True)
class DcMotor(_OnOne):
    """A DC motor: torque = constant i with inductance i' = voltage - resistance i - constant rate, from i = `current`.

    Its current is a state of the law (`mechlab.experiment.memory`), integrated with the motion; without inductance it is
    (voltage - constant rate) / resistance at once.
    """

    on: str
    voltage: float
    constant: float
    resistance: float
    inductance: float = 0.0
    current: float = 0.0
    kind: ClassVar[str]

    def __post_init__(self) -> None:
        if not self.resistance > 0 or self.inductance < 0:
            raise MechlabError(
                f"dc_motor on {self.on!r}: expected resistance > 0 and inductance >= 0, "
                f"got {self.resistance!r} and {self.inductance!r}."
            )

    def start(self) -> tuple[float, ...]:
        """The states at t = 0: the current, or none without inductance."""
        return (self.current,) if self.inductance else ()

    def rest(self, plant: Plant) -> Array:
        """(1,) the current that belongs to the present rate when it does not change."""
        return np.array([(self.voltage - self.constant * plant.rate(self.on)) / self.resistance])

    def state_rate(self, t: float, plant: Plant, state: Array) -> Array:
        """(1,) rate of the current."""
        return (self.rest(plant) - state) * (self.resistance / self.inductance)

    def after(self, t: float, plant: Plant, state: Array, h: float) -> Array:
        """(1,) current after h seconds at the present rate, exactly: stable for every step."""
        rest = self.rest(plant)
        return np.asarray(rest + (state - rest) * math.exp(-h * self.resistance / self.inductance))

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The torque of the present current."""
        if self.inductance:
            state = getattr(plant, "memory", {}).get(self, (self.current,))
        else:
            state = self.rest(plant)
        return {self.on: self.constant * float(state[0])}


@register("viscous")
@dataclass(frozen=True)
class Viscous(_OnOne):
    """A load proportional to the rate: -coefficient x rate."""

    on: str
    coefficient: float
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The drag at the present rate."""
        return {self.on: -self.coefficient * plant.rate(self.on)}


@register("one_sided_stop")
@dataclass(frozen=True)
class OneSidedStop(_OnOne):
    """A spring and damper that pushes when the value passes `at` towards `side` (+1 or -1), and never pulls."""

    on: str
    at: float
    side: int
    stiffness: float
    damping: float = 0.0
    kind: ClassVar[str]

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """The push."""
        depth = self.side * (plant.value(self.on) - self.at)
        if depth <= 0:
            return {self.on: 0.0}
        push = self.stiffness * depth + self.damping * self.side * plant.rate(self.on)
        return {self.on: -self.side * max(0.0, push)}


@register("computed_torque")
@dataclass(frozen=True)
class ComputedTorque:
    """Inverse dynamics with feedback: each commanded coordinate gets the acceleration

        acc = target acc + velocity_gain (target rate - rate) + position_gain (target - value)

    and the drives give the forces that make it so under the constraints. `commands` name joints or shafts, one Motion
    each, as many as the drives; gains are pairs (position_gain [1/s2], velocity_gain [1/s]).
    """

    drives: tuple[str, ...]
    commands: tuple[tuple[str, Motion], ...]
    gains: tuple[tuple[float, float], ...]
    kind: ClassVar[str]

    def __post_init__(self) -> None:
        if not len(self.drives) == len(self.commands) == len(self.gains):
            raise MechlabError(
                f"computed_torque: {len(self.drives)} drives, {len(self.commands)} commands, {len(self.gains)} gains; "
                "there must be as many of each."
            )

    def targets(self) -> tuple[str, ...]:
        """The drives."""
        return self.drives

    def accelerations(self, t: float, plant: Plant) -> Array:
        """(commands,) commanded accelerations."""
        out = []
        for (name, motion), (kp, kv) in zip(self.commands, self.gains, strict=True):
            x, dx, ddx = motion.at(t)
            out.append(ddx + kv * (dx - plant.rate(name)) + kp * (x - plant.value(name)))
        return np.array(out)

    def force(self, t: float, plant: Plant) -> Mapping[str, float]:
        """Forces of the drives from inverse dynamics."""
        m = plant.mechanism
        rows = np.array([m.row(name) for name, _ in self.commands])
        forces = drive_forces(plant, rows, self.accelerations(t, plant), self.drives)
        return dict(zip(self.drives, forces.tolist(), strict=True))


def drive_forces(plant: Plant, rows: Array, accelerations: Array, drives: tuple[str, ...]) -> Array:
    """(drives,) forces that give `rows @ a = accelerations` (k, nv), (k,) under the constraints.

    Solves M a + h = B^T f + J^T r together with J a + b = 0; redundant rows are met in the least-squares sense.
    Raises MechlabError when these drives cannot produce the accelerations (singular position).
    """
    m = plant.mechanism
    jacobian, bias = plant.jacobian(), plant.constraint_bias()
    a = np.linalg.lstsq(np.vstack([jacobian, rows]), np.concatenate([-bias, accelerations]), rcond=1e-11)[0]
    needed = plant.mass_matrix() @ a + plant.bias()
    actuation = np.array([m.row(name) for name in drives])
    solution = np.linalg.lstsq(np.vstack([actuation, jacobian]).T, needed, rcond=1e-11)[0]
    return np.asarray(solution[: len(drives)])


def applied_force(
    mechanism: Mechanism, laws: tuple[Law, ...], t: float, plant: Plant
) -> tuple[Array, dict[str, float]]:
    """(nv,) generalised force of all laws, and the force on each joint or shaft by name."""
    total = np.zeros(mechanism.nv)
    by_name: dict[str, float] = {}
    for law in laws:
        for name, f in law.force(t, plant).items():
            by_name[name] = by_name.get(name, 0.0) + f
    for name, f in by_name.items():
        total += f * mechanism.row(name)
    return total, by_name


def law(kind: str, **data: object) -> Any:
    """A registered law by its name; raises MechlabError that lists the laws."""
    if kind not in LAWS:
        raise unknown("law", kind, LAWS)
    return LAWS[kind](**data)
