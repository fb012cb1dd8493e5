"""Closed form of every scene, and the poses of the full train along any recording."""

from __future__ import annotations

import numpy as np

from mechlab.analytic import differential as closed
from mechlab.catalog.closed_differential.build import build
from mechlab.catalog.closed_differential.looks import planet_name
from mechlab.catalog.closed_differential.parameters import Parameters
from mechlab.errors import MechlabError
from mechlab.experiment.held_rates import HeldRates, ViscousBetween
from mechlab.experiment.laws import Constant, ConstantPower, Law, Motor, Viscous
from mechlab.experiment.recording import Recording, basic_channels
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array

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
    from mechlab.integrate import integrate_adaptive

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
    """All gears along a recording of any fidelity."""
    full = build(p, "full")
    if recording.fidelity == "full":
        return full, recording.q
    (z1, z2, _, z4, z5, _) = p.teeth
    values = {name: recording.channel(name) for name in ("H1", "H2", "block_14", "block_36")}
    for stage, ratio in ((1, z1 / z2), (2, z4 / z5)):
        turn = -ratio * (values["block_14"] - values[f"H{stage}"])
        values |= {f"{planet_name(stage)}_{k + 1}": turn for k in range(p.planets)}
    return full, np.column_stack([values[j.name] for j in full.joints])
