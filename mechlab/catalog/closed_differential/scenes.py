"""Scenes in and around the source's claim, their closed form, and the poses of the full train along any recording."""

from __future__ import annotations

from functools import partial

import numpy as np

from mechlab.analytic import differential as closed
from mechlab.catalog.closed_differential.build import Parameters, build, planet_name
from mechlab.catalog.closed_differential.questions import SPEEDS
from mechlab.errors import MechlabError
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.held_rates import HeldRates, RateHold, ViscousBetween
from mechlab.experiment.laws import Constant, ConstantPower, Law, Motor, Viscous
from mechlab.experiment.recording import Recording, basic_channels
from mechlab.experiment.scene import Scene, Settings
from mechlab.integrate import integrate_adaptive
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array

STEP, DRY_STEP = 1e-3, 5e-4
"""Timesteps [s]. Stops, held inputs and locks capture a rate with a time constant of one step; scenes with dry friction
take the finer step, so that the time at which it stops the motion is right."""
MOST_MOTOR_MOMENT = 2000.0
"""Moment [N m] at which a motor of constant power is limited near standstill."""
CHANNELS_SHOWN = ("w_H1", "w_H2", "w1", "w3", "w2", "w5", "angular_momentum", "outer_power")


def _drags(p: Parameters) -> tuple[Law, ...]:
    pairs = (("block_14", p.drag_14), ("block_36", p.drag_36))
    inner = (ViscousBetween("block_14", "block_36", p.drag_internal),) if p.drag_internal else ()
    return (*(Viscous(on, c) for on, c in pairs if c), *inner)


def _moments(p: Parameters) -> tuple[Law, ...]:
    return Constant("H1", p.M_H1), Constant("H2", -p.M_H2)


def _laws(name: str, p: Parameters) -> tuple[Law, ...]:
    stop = RateHold("block_36", 0.0, low=0.0)
    held = RateHold("H1", p.w_H1_0)
    locked = RateHold((("block_14", 1.0), ("block_36", -float(p.lock_ratio))))
    dry = RateHold("H2", 0.0, -abs(p.M_H2), abs(p.M_H2))
    drags, load = _drags(p), Constant("H2", -p.M_H2)
    if name == "held-input-dry-load":
        return (HeldRates((held, dry), drags, DRY_STEP),)
    if name == "one-way-stop":
        return (HeldRates((stop,), (*_moments(p), *drags), STEP),)
    if name == "locked-pair":
        return (HeldRates((locked,), (*_moments(p), *drags), STEP),)
    if name == "backstop-two-range":
        return (HeldRates((held, stop), (load, *drags), STEP),)
    if name == "motor-and-viscous-load":
        return (Motor("H1", p.motor_stall, p.motor_no_load), Viscous("H2", p.load_drag), *drags)
    if name == "constant-power":
        return (ConstantPower("H1", p.motor_power, MOST_MOTOR_MOMENT), Viscous("H2", p.load_drag), *drags)
    return (*_moments(p), *drags)


def make(name: str, duration: float, p: Parameters, fidelity: str) -> Scene:
    """The scene of that name."""
    laws = _laws(name, p)
    dry = name == "held-input-dry-load"
    # the capture of held rates is of first order in its time: it leaves up to 4e-4 rad of some 200
    tolerance = 1e-3 if dry else 1e-4 if isinstance(laws[0], HeldRates) else 1e-5
    step = DRY_STEP if dry else STEP
    return Scene(
        name, fidelity, duration, laws, initial_rates={"H1": p.w_H1_0, "H2": p.w_H2_0}, channels=CHANNELS_SHOWN,
        needs=("poses", "drive_forces"), tolerance=tolerance, settings=Settings(timestep=step), text=TEXTS[name],
    )  # fmt: skip


TEXTS = {
    "constant-moments": "M_H1 drives, M_H2 resists, nothing else: (8) holds at one instant",
    "held-input-dry-load": "a servo holds w_H1 at w_H1_0, dry friction of M_H2 loads the output: it stops and sticks",
    "housing-drag": "constant moments, both blocks drag on the housing",
    "internal-drag": "constant moments, viscous drag between the blocks only: the train runs backwards",
    "one-way-stop": "constant moments from rest, block 36 cannot turn backwards: an ordinary gear of ratio a/b",
    "locked-pair": "constant moments, w1 = lock_ratio w3 held: an ordinary gear of one freedom",
    "motor-and-viscous-load": "a motor with a straight characteristic, a viscous load: the output comes to rest",
    "constant-power": "a motor of constant power, a viscous load: the input runs away, the output comes to rest",
    "backstop-two-range": "input held, one-way stop of block 36, drag between the blocks: two ranges, with losses",
}
_DURATIONS = (0.5, 1.0, 20.0, 2.0, 1.0, 1.0, 10.0, 60.0, 10.0)
_OVERRIDES: dict[str, dict[str, float]] = {
    "housing-drag": {"drag_14": 0.02, "drag_36": 2.0},
    "internal-drag": {"drag_internal": 0.5},
    "one-way-stop": {"w_H1_0": 0.0, "w_H2_0": 0.0},
    "backstop-two-range": {"drag_internal": 0.2},
}
SCENES = {
    name: SceneRecipe(partial(make, name, duration), "minimal", text, _OVERRIDES.get(name, {}))
    for (name, text), duration in zip(TEXTS.items(), _DURATIONS, strict=True)
}


def _speed(name: str, p: Parameters, recording: Recording) -> Array:
    return recording.channel(f"{SPEEDS[name]}_rate")


def _momentum(p: Parameters, recording: Recording) -> Array:
    """Angular momentum about the axis: its rate is the sum of all moments from outside."""
    row = closed.momentum_row(p.train, p.inertias)
    return row[0] * recording.channel("block_14_rate") + row[1] * recording.channel("block_36_rate")


def _power(p: Parameters, recording: Recording) -> Array:
    """Power of the moments on both carriers; zero where (8) holds."""
    return sum(
        (recording.channel(f"{n}_force") * recording.channel(f"{n}_rate") for n in ("H1", "H2")), 0.0 * recording.t
    )


CHANNELS = {name: ("rad/s", partial(_speed, name)) for name in SPEEDS} | {
    "angular_momentum": ("N m s", _momentum),
    "outer_power": ("W", _power),
}

SAMPLES = 501


def rows(p: Parameters) -> dict[str, Array]:
    """(2,) coefficients in (w1, w3) of everything that a law may act on."""
    (u1, u2), (s2, s5) = p.train.carriers, p.train.spins
    blocks = {"block_14": np.array([1.0, 0.0]), "block_36": np.array([0.0, 1.0])}
    return {"H1": u1, "H2": u2, "planet_2_spin": s2, "planet_5_spin": s5} | blocks


class _Linear:
    """The laws of a scene as damping D, force Q and contacts; ConstantPower is kept aside."""

    def __init__(self, p: Parameters, laws: tuple[Law, ...]) -> None:
        self.rows, self.damping, self.force = rows(p), np.zeros((2, 2)), np.zeros(2)
        self.contacts: tuple[closed.Contact, ...] = ()
        self.power: ConstantPower | None = None
        self.acting: list[Law] = []
        for law in laws:
            self.add(law)

    def add(self, law: Law) -> None:
        self.acting.append(law)
        if isinstance(law, HeldRates):
            for hold in law.holds:
                row = sum((c * self.rows[n] for n, c in hold.terms), np.zeros(2))
                name = "+".join(n for n, _ in hold.terms)
                contact = closed.Contact(name, (float(row[0]), float(row[1])), hold.rate, hold.low, hold.high)
                self.contacts += (contact,)
            for inner in law.laws:
                self.add(inner)
        elif isinstance(law, Constant):
            self.force += law.value * self.rows[law.on]
        elif isinstance(law, Viscous):
            self.damping += law.coefficient * np.outer(self.rows[law.on], self.rows[law.on])
        elif isinstance(law, ViscousBetween):
            row = self.rows[law.a] - self.rows[law.b]
            self.damping += law.coefficient * np.outer(row, row)
        elif isinstance(law, Motor):
            self.force += law.stall * self.rows[law.on]
            self.damping += law.stall / law.no_load_rate * np.outer(self.rows[law.on], self.rows[law.on])
        elif isinstance(law, ConstantPower):
            self.power = law
        else:
            raise MechlabError(f"closed_differential: there is no closed form for the law {law.kind!r}.")

    def moment(self, on: str, rates: Array, contacts: dict[str, Array]) -> Array:
        """(n,) moment of all laws on H1 or H2."""
        w = rates @ self.rows[on]
        out = contacts.get(on, np.zeros(len(w))) + 0.0 * w
        for law in self.acting:
            if getattr(law, "on", "") != on:
                continue
            if isinstance(law, Constant):
                out = out + law.value
            elif isinstance(law, Viscous):
                out = out - law.coefficient * w
            elif isinstance(law, Motor):
                out = out + law.stall * (1.0 - w / law.no_load_rate)
            elif isinstance(law, ConstantPower):
                out = out + _powered(law, w)
        return out


def _powered(law: ConstantPower, w: Array) -> Array:
    return np.asarray(law.power / np.where(np.abs(w) > law.power / law.limit, w, np.copysign(law.power / law.limit, w)))


def reference(p: Parameters, scene: Scene) -> Recording:
    """Matrix exponentials between exact events; constant power by DOP853 at 1e-11. Rates start as the scene says."""
    J, laws = closed.mass_matrix(p.train, p.inertias), _Linear(p, scene.laws)
    start = closed.speeds(p.train, w_H1=scene.initial_rates["H1"], w_H2=scene.initial_rates["H2"])
    w0 = np.array([start.w1, start.w3])
    t = np.linspace(0.0, scene.duration, SAMPLES)
    if laws.power is None:
        found = closed.motion(J, laws.damping, laws.force, w0, laws.contacts, t)
        t, angles, rates, held = found.t, found.angles, found.rates, found.moments
    else:
        angles, rates = _powered_motion(J, laws, laws.power, w0, t)
        held = {}
    m = build(p, "minimal")
    turn, speed = angles @ p.train.carriers.T, rates @ p.train.carriers.T
    q, v = (np.column_stack([x[:, 0], x[:, 1] - x[:, 0]]) for x in (turn, speed))
    channels, units = basic_channels(m, q, v)
    for name in ("H1", "H2"):
        channels[f"{name}_force"], units[f"{name}_force"] = laws.moment(name, rates, held), "N m"
    return Recording(
        m, t, q, v, channels, units, settings=Settings(engine="analytic"), scene=scene.name, fidelity="minimal"
    )


def _powered_motion(J: Array, laws: _Linear, law: ConstantPower, w0: Array, t: Array) -> tuple[Array, Array]:

    inverse, row = np.linalg.inv(J), laws.rows[law.on]

    def slope(_: float, y: Array) -> Array:
        w = y[2:]
        push = float(_powered(law, np.asarray(row @ w)))
        return np.concatenate([w, inverse @ (laws.force - laws.damping @ w + push * row)])

    found = integrate_adaptive(slope, 0.0, np.concatenate([np.zeros(2), w0]), float(t[-1]), rtol=1e-11, atol=1e-11)
    if not found.complete:
        raise MechlabError(f"closed_differential: the reference ended at t = {found.t[-1]:g} s: {found.outcome.value}.")
    y = found.at(t)
    return y[:, :2], y[:, 2:]


def expand(p: Parameters, recording: Recording) -> tuple[Mechanism, Array]:
    """The full train and its coordinates (n, nq) along a recording of any fidelity."""
    full = build(p, "full")
    if recording.fidelity == "full":
        return full, recording.q
    (z1, z2, _, z4, z5, _) = p.teeth
    values = {name: recording.channel(name) for name in ("H1", "H2", "block_14", "block_36")}
    for stage, ratio in ((1, z1 / z2), (2, z4 / z5)):
        turn = -ratio * (values["block_14"] - values[f"H{stage}"])
        values |= {f"{planet_name(stage)}_{k + 1}": turn for k in range(p.planets)}
    return full, np.column_stack([values[j.name] for j in full.joints])
