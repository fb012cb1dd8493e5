"""What is asked of the train, and its closed forms: speeds, moments, starting rule and accelerations at an instant from the
speed of the input and one more quantity; motions in the scenes; the turn of every planet along a motion.

Pinocchio and MuJoCo answer with a mass matrix and constraint rows of their own (`Machine`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial
from typing import Any

import numpy as np

from mechlab.analytic import differential as closed
from mechlab.catalog.closed_differential.build import Parameters, build
from mechlab.catalog.closed_differential.scenes import TorqueConverter
from mechlab.engines.protocol import engine
from mechlab.errors import EngineMissing, MechlabError, NoSolution
from mechlab.experiment.held_rates import HeldRates, RateHold, ViscousBetween
from mechlab.experiment.laws import Constant, ConstantPower, Law, Motor, Viscous
from mechlab.experiment.question import Answer, Question, Witness
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene
from mechlab.integrate import integrate_adaptive
from mechlab.kit.checks import closed_form_recording
from mechlab.kit.epicyclic_motion import expand_by
from mechlab.kit.questions import for_engines
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import null_space

SPEEDS = {
    "w_H1": "H1", "w_H2": "H2", "w1": "block_14", "w3": "block_36", "w2": "planet_2_spin", "w5": "planet_5_spin",
}  # fmt: skip
"""Names of speeds -> joint or shaft."""


@dataclass(frozen=True)
class Machine:
    """Mass matrix (nv, nv) and rows (relations, nv) of an engine at rest in the reference pose; both are constant."""

    mechanism: Mechanism
    mass: Array
    rows: Array

    def row(self, speed: str) -> Array:
        """(nv,) coefficients of a speed by its short name, or of a joint or shaft."""
        return self.mechanism.row(SPEEDS.get(speed, speed))

    @property
    def free(self) -> Array:
        """(nv, freedoms) basis of the motions that the rows allow."""
        return null_space(self.rows)

    def rates(self, given: Mapping[str, float]) -> Array:
        """(nv,) rates from as many given speeds as freedoms; raises NoSolution when they do not fix the motion."""
        return self.fit(np.array([self.row(name) for name in given]), np.array(list(given.values()), dtype=float))

    def fit(self, rows: Array, values: Array) -> Array:
        """(nv,) allowed rates with rows @ rates = values."""
        reduced = rows @ self.free
        if reduced.shape[0] != reduced.shape[1] or np.linalg.cond(reduced) > 1e10:
            raise NoSolution(f"{self.mechanism.name}: these quantities do not fix the two freedoms of the train.")
        return np.asarray(self.free @ np.linalg.solve(reduced, values))

    def applied(self, **moments: float) -> Array:
        """(nv,) generalized force of moments on speeds or joints or shafts by name."""
        return np.asarray(sum((f * self.row(name) for name, f in moments.items()), np.zeros(self.mechanism.nv)))

    def accelerations(self, applied: Array) -> Array:
        """(nv,) accelerations under a generalized force (nv,)."""
        free = self.free
        return np.asarray(free @ np.linalg.solve(free.T @ self.mass @ free, free.T @ applied))

    def balance(self, applied: Array, holders: Sequence[str]) -> tuple[Array, dict[str, float]]:
        """Moments (holders,) that keep the train in equilibrium, and the load of each relation by name."""
        rows = np.array([self.row(name) for name in holders])
        matrix = np.vstack([rows, self.rows]).T
        found = np.linalg.lstsq(matrix, -applied, rcond=1e-12)[0]
        loads = found[len(rows) :].tolist()
        return found[: len(rows)], dict(zip([r.name for r in self.mechanism.relations], loads, strict=True))


def mesh_sums(loads: Mapping[str, float]) -> dict[str, float]:
    """Moments on the wheels 1, 3, 4, 6 from all planets: mesh_12, mesh_23, mesh_45, mesh_56 -> sum of the loads."""
    meshes = dict.fromkeys(name.rpartition("_")[0] for name in loads)
    return {mesh: sum(f for name, f in loads.items() if name.startswith(f"{mesh}_")) for mesh in meshes}


@lru_cache(maxsize=64)
def machine(implementation: str, p: Parameters, fidelity: str) -> Machine:
    """The machine of "numpy" (for checks) or of an engine; raises EngineMissing when that is not installed."""
    m = build(p, fidelity)
    plant = engine(implementation).plant(m)
    return Machine(m, plant.mass_matrix().copy(), plant.relation_rows())


MOMENTS = ("M21", "M23", "M54", "M56", "start_moment", "internal_moment", "held_output_moment")
RATES = ("w_H1_rate", "w_H2_rate", "w1_rate", "w3_rate")
ANSWERS = (*SPEEDS, *MOMENTS, "start_ratio", *RATES)
KINDS = {"rad/s": SPEEDS, "N m": MOMENTS, "": ("start_ratio",), "rad/s2": RATES}
UNITS = {name: unit for unit, names in KINDS.items() for name in names}
PRINTED_W_H2 = (
    "w_H2 is that of the source's (10), M_H1 w_H1 = M_H2 w_H2: no law of this train, its two freedoms leave w_H2 free; "
    "at these speeds the outer power is zero for an instant and w_H2 changes by {rate:.6g} rad/s2. "
    "See `claims closed_differential`"
)


def _by_power(p: Parameters, given: Mapping[str, Any]) -> bool:
    """True when only w_H1 is given: w_H2 comes from (10)."""
    if set(given) != {"w_H1"}:
        return False
    if p.M_H2 == 0.0:
        raise MechlabError("closed_differential: (10) gives no w_H2 for M_H2 = 0; give w_H2, or w1 or w3.")
    return True


def analytic(p: Parameters, given: Mapping[str, Any]) -> Answer:
    """Closed forms."""
    train, known = p.train, dict(given)
    printed = _by_power(p, given)
    if printed:
        known["w_H2"] = np.asarray(given["w_H1"]) * p.M_H1 / p.M_H2
    values: dict[str, Any] = vars(closed.speeds(train, **known)).copy()
    values |= vars(closed.mesh_moments(train, p.M_H1, p.M_H2))
    J = closed.mass_matrix(train, p.inertias)
    values["start_moment"] = closed.start_moment(train, p.M_H1)
    values["internal_moment"] = closed.internal_moment(train, p.M_H1)
    values["start_ratio"] = closed.start_ratio(train)
    blocks = np.linalg.solve(J, closed.block_torques(train, p.M_H1, p.M_H2))
    values |= dict(zip(RATES, (*(train.carriers @ blocks), *blocks), strict=True))
    if train.regular:
        values["held_output_moment"] = closed.held_output_moment(train, J, p.M_H1)
    notes = (PRINTED_W_H2.format(rate=float(values["w_H2_rate"])),) if printed else ()
    return Answer({k: values[k] for k in ANSWERS if k in values and k not in given}, notes=notes)


def by_engine(engine: str, p: Parameters, given: Mapping[str, Any]) -> Answer:
    """An engine's mass matrix and gear rows; w_H2 of (10) as the motion at which its outer forces do no work."""
    try:
        parts = machine(engine, p, "parts")
    except EngineMissing as missing:
        return Answer(cannot=str(missing))
    load = parts.applied(w_H1=p.M_H1, w_H2=-p.M_H2)
    if _by_power(p, given):
        v = parts.fit(np.array([parts.row("w_H1"), load]), np.array([float(given["w_H1"]), 0.0]))
    else:
        v = parts.rates({k: float(x) for k, x in given.items()})
    a = parts.accelerations(load)
    values = {name: float(parts.row(name) @ v) for name in SPEEDS}
    values |= {name: float(parts.row(name.removesuffix("_rate")) @ a) for name in RATES}
    return Answer({k: x for k, x in (values | moments(parts, p)).items() if k not in given})


def moments(parts: Machine, p: Parameters) -> dict[str, float]:
    """Mesh moments with the blocks held; the start with the output held, by statics (as the source) and by dynamics."""
    drive = parts.applied(w_H1=p.M_H1)
    loads = mesh_sums(parts.balance(parts.applied(w_H1=p.M_H1, w_H2=-p.M_H2), ["w1", "w3"])[1])
    held, _ = parts.balance(drive, ["w_H2", "w5"])
    out = {
        "M21": loads["mesh_12"], "M23": loads["mesh_23"], "M54": -loads["mesh_45"], "M56": -loads["mesh_56"],
        "start_moment": -float(held[0]), "internal_moment": float(held[1]),
    }  # fmt: skip
    if p.train.regular:
        free = parts.rates({"w_H1": 1.0, "w_H2": 0.0})
        speed = p.M_H1 / float(free @ parts.mass @ free)
        moving = parts.rates({"w_H2": 1.0, "w_H1": 0.0})
        out["held_output_moment"] = -float(moving @ parts.mass @ free) * speed
        out["start_ratio"] = 1.0 / float(parts.row("w5") @ free)
    return out


WITNESSES: dict[str, Witness] = {"analytic": analytic} | for_engines(by_engine)
QUESTIONS = tuple(
    Question(name, given, tuple(k for k in ANSWERS if k not in given), WITNESSES, optional, units=UNITS, text=text)
    for name, given, optional, text in (
        ("input speed and moments", ("w_H1",), {"w_H2": None},
         "all speeds and moments; without w_H2 the source's (10) is taken for it"),
        ("input and block 36", ("w_H1", "w3"), {}, "speeds with the speed of block 36 given (0: braked)"),
        ("input and block 14", ("w_H1", "w1"), {}, "speeds with the speed of block 14 given (0: braked)"),
        ("blocks", ("w1", "w3"), {}, "speeds of the carriers from those of the blocks"),
    )
)  # fmt: skip

SAMPLES = 501
Term = tuple[Array, float, float]


def rows(p: Parameters) -> dict[str, Array]:
    """(2,) coefficients in (w1, w3) of everything that a law may act on."""
    (u1, u2), (s2, s5) = p.train.carriers, p.train.spins
    blocks = {"block_14": np.array([1.0, 0.0]), "block_36": np.array([0.0, 1.0])}
    return {"H1": u1, "H2": u2, "planet_2_spin": s2, "planet_5_spin": s5} | blocks


def _term(law: Law, on: Mapping[str, Array]) -> Term:
    """A law as row (2,), force [N m] and damping [N m s]: force - damping row . w acts along the row."""
    match law:
        case Constant():
            return on[law.on], law.value, 0.0
        case Viscous():
            return on[law.on], 0.0, law.coefficient
        case ViscousBetween():
            return on[law.a] - on[law.b], 0.0, law.coefficient
        case Motor():
            return on[law.on], law.stall, law.stall / law.no_load_rate
    raise MechlabError(f"closed_differential: there is no closed form for the law {law.kind!r}.")


def _powered(law: ConstantPower, w: Array) -> Array:
    """The moment [N m] of a law of constant power at the speeds w [rad/s]."""
    least = law.power / law.limit
    return np.asarray(law.power / np.where(np.abs(w) > least, w, np.copysign(least, w)))


def _contact(hold: RateHold, on: Mapping[str, Array]) -> closed.Contact:
    row = sum((c * on[n] for n, c in hold.terms), np.zeros(2))
    name = "+".join(n for n, _ in hold.terms)
    return closed.Contact(name, (float(row[0]), float(row[1])), hold.rate, hold.low, hold.high)


def reference(p: Parameters, scene: Scene) -> Recording:
    """Matrix exponentials between exact events; constant power by DOP853 at 1e-11. Rates start as the scene says."""
    J, on = closed.mass_matrix(p.train, p.inertias), rows(p)
    held = [law for law in scene.laws if isinstance(law, HeldRates)]
    laws = [x for law in scene.laws for x in (law.laws if isinstance(law, HeldRates) else (law,))]
    curved = [law for law in laws if isinstance(law, ConstantPower | TorqueConverter)]
    motors = [law for law in curved if isinstance(law, ConstantPower)]
    terms = [(law, *_term(law, on)) for law in laws if law not in curved]
    damping = sum((c * np.outer(row, row) for _, row, _, c in terms), np.zeros((2, 2)))
    force = sum((f * row for _, row, f, _ in terms), np.zeros(2))
    start = closed.speeds(p.train, w_H1=scene.initial_rates["H1"], w_H2=scene.initial_rates["H2"])
    w0, t = np.array([start.w1, start.w3]), np.linspace(0.0, scene.duration, SAMPLES)
    moments: Mapping[str, Array] = {}
    if curved:
        angles, rates = _curved_motion(J, damping, force, [partial(_push, law, on) for law in curved], w0, t)
    else:
        found = closed.motion(J, damping, force, w0, tuple(_contact(x, on) for law in held for x in law.holds), t)
        t, angles, rates, moments = found.t, found.angles, found.rates, found.moments
    m = build(p, "minimal")
    turned, speeds = angles @ p.train.carriers.T, rates @ p.train.carriers.T
    q, v = (np.column_stack([x[:, 0], x[:, 1] - x[:, 0]]) for x in (turned, speeds))
    made = closed_form_recording(m, scene, t, q, v)
    for name in ("H1", "H2"):
        w = rates @ on[name]
        acting = [f - c * w for law, _, f, c in terms if getattr(law, "on", "") == name]
        acting += [_powered(law, w) for law in motors if law.on == name]
        acting += [_turbine(law, rates @ on[law.pump], w) for law in curved if isinstance(law, TorqueConverter) and law.turbine == name]
        made.channels[f"{name}_force"] = sum(acting, moments.get(name, 0.0) + 0.0 * w)
        made.units[f"{name}_force"] = "N m"
    return made


def _turbine(law: TorqueConverter, pump: Array, turbine: Array) -> Array:
    """(n,) moment [N m] of the turbine at speeds (n,) [rad/s]."""
    return np.array([law.converter.moments(float(x), float(y))[1] for x, y in zip(pump, turbine, strict=True)])


def _push(law: ConstantPower | TorqueConverter, on: Mapping[str, Array], w: Array) -> Array:
    """(2,) moments on the blocks of a law that is not linear in the rates."""
    if isinstance(law, ConstantPower):
        return np.asarray(_powered(law, on[law.on] @ w) * on[law.on])
    pump, turbine = on[law.pump], on[law.turbine]
    taken, given = law.converter.moments(float(pump @ w), float(turbine @ w))
    return np.asarray(given * turbine - taken * pump)


def _curved_motion(
    J: Array, damping: Array, force: Array, pushes: Sequence[Callable[[Array], Array]], w0: Array, t: Array
) -> tuple[Array, Array]:
    inverse = np.linalg.inv(J)

    def slope(_: float, y: Array) -> Array:
        w = y[2:]
        return np.concatenate([w, inverse @ sum((push(w) for push in pushes), force - damping @ w)])

    found = integrate_adaptive(slope, 0.0, np.concatenate([np.zeros(2), w0]), float(t[-1]), rtol=1e-11, atol=1e-11)
    if not found.complete:
        raise MechlabError(f"closed_differential: the reference ended at t = {found.t[-1]:g} s: {found.outcome.value}.")
    y = found.at(t)
    return y[:, :2], y[:, 2:]


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


def _turns(p: Parameters, recording: Recording) -> dict[str, Array]:
    """Joint of the full train -> its angle along a recording."""
    values = {name: recording.channel(name) for name in ("H1", "H2", "block_14", "block_36")}
    for s in p.stages:
        turn = -s.teeth[0] / s.teeth[1] * (values["block_14"] - values[s.carrier])
        values |= {f"{s.planet}_{k + 1}": turn for k in range(p.planets)}
    return values


expand = expand_by(build, _turns)
