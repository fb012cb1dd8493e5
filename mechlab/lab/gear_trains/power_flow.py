"""Power flow of a train of gears: `solve NAME X_rate=… X_force=… efficiency=…` on a Mechanism of gear relations.

X_rate: speeds of as many joints or shafts as there are freedoms [rad/s]. X_force: external torques [N m]; those that are not
given are found. efficiency: of every mesh; MESH_efficiency: of one. Power goes into a member where torque x rate > 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechlab.analytic.power_flow import Flow, circulating_power, efficiency, flow
from mechlab.engines.protocol import engine
from mechlab.errors import EngineMissing, MechlabError, NoSolution, unknown
from mechlab.experiment.question import Answer, Question
from mechlab.lab.design import Design
from mechlab.lab.gear_trains import ETA, FORCE, RATE
from mechlab.lab.gear_trains.train import (
    GearTrain,
    LoadCase,
    each_case,
    gear_train,
    load_case,
    train_mechanism,
)
from mechlab.mechanism import GROUND, Mechanism
from mechlab.mechanism.geometry import Array


def train_of(design: Design) -> Mechanism:
    """The mechanism at the cheapest fidelity whose constraints are all gear relations. Raises MechlabError without one."""
    m = train_mechanism(design)
    if m is not None:
        return m
    raise MechlabError(
        f"{design.name}: X_force and efficiency ask for the power flow of a train of gears, and no fidelity of it "
        f"({', '.join(design.entry.fidelities)}) consists of gear relations alone."
    )


def power_flow_question(design: Design, values: Mapping[str, Any]) -> Question:
    """The question that X_rate, X_force and efficiency make. Raises MechlabError for unknown keys."""
    t = gear_train(train_of(design))
    m = t.mechanism
    names = m.scalar_names
    known = {*(f"{n}{RATE}" for n in names), *(f"{n}{FORCE}" for n in names), ETA,
             *(f"{r.name}_{ETA}" for r in t.roles)}  # fmt: skip
    for key in values:
        if key not in known:
            raise unknown(f"{design.name}: power flow: quantity", key, known)
    units = {f"{n}{RATE}": "rad/s" for n in names} | {f"{n}{FORCE}": "N m" for n in names} | {"circulating": "W"}
    wanted = tuple(f"{n}{RATE}" for n in names if f"{n}{RATE}" not in values)

    def engine(title: str) -> Any:
        return lambda p, given: _engine(title, t, given)

    return Question(
        "power flow", tuple(values), wanted,
        {
            "analytic": lambda p, given: each_case(given, lambda case: _answer_case(t, case)),
            "pinocchio": engine("pinocchio"), "mujoco": engine("mujoco"),
        },
        units=units, text="speeds, torques, power through every mesh and carrier, efficiency both ways",
    )  # fmt: skip


def _flow_and_torques(
    t: GearTrain, case: LoadCase, given: Mapping[str, float], left: tuple[str, ...]
) -> tuple[Flow, dict[str, float]]:
    """The flow, and all external torques by name."""
    rows = [t.mechanism.row(n) for n in given]
    found = flow(t.meshes, case.rates, case.eta, rows, list(given.values()), [t.mechanism.row(n) for n in left])
    return found, dict(given) | dict(zip(left, found.torques.tolist(), strict=True))


def _powers(t: GearTrain, case: LoadCase, torques: Mapping[str, float]) -> dict[str, float]:
    return {n: x * float(t.mechanism.row(n) @ case.rates) for n, x in torques.items()}


def _answer_case(t: GearTrain, given: Mapping[str, float]) -> Answer:
    m, case = t.mechanism, load_case(t, given)
    found, torques = _flow_and_torques(t, case, case.given, case.open)
    powers = _powers(t, case, torques)
    values: dict[str, Any] = {
        f"{n}{RATE}": float(m.row(n) @ case.rates) for n in m.scalar_names if f"{n}{RATE}" not in given
    }
    values |= {f"{n}{FORCE}": torques[n] for n in case.open}
    notes = [f"{n}: free, no torque (it has no drive and none was given)" for n in case.free]
    if found.shared:
        notes.append(
            "meshes that repeat each other share the load equally: real planets share by their stiffness and errors"
        )
    details: dict[str, Any] = {
        "members": [{"member": n, "torque": x, "rate": float(m.row(n) @ case.rates), "power": powers[n]} for n, x in torques.items()],
        "meshes": _mesh_list(t, found, case.eta), "carriers": _carrier_list(t, found, case),
        "losses": float(found.meshes.loss.sum()),
    }  # fmt: skip
    who = np.array([[x.a, x.b, x.carrier] for x in t.meshes])
    through = np.column_stack([found.meshes.power_a, found.meshes.power_b, found.meshes.power_carrier])
    values["circulating"] = circulating_power(who, through)
    ahead = efficiency(list(powers.values()))
    if ahead is not None:
        put_in = sum(x for x in powers.values() if x > 0.0)
        values["rolling_over_input"] = float(np.max(found.meshes.rolling)) / put_in
        values["efficiency_forward"] = ahead
    back, sentence = _backward(t, case, torques, powers)
    if back is not None:
        values["efficiency_backward"] = back
        details["self_locking"] = back <= 0.0
    notes += [sentence] if sentence else []
    return Answer(values, notes=tuple(notes), details=details)


def _backward(
    t: GearTrain, case: LoadCase, torques: Mapping[str, float], powers: Mapping[str, float]
) -> tuple[float | None, str]:
    """Efficiency when the output drives at the same speeds. Not positive where it cannot drive: power must come from
    both ends. None, with the reason, where it is not defined."""
    active = [n for n, x in powers.items() if abs(x) > 1e-12 * max(map(abs, powers.values()))]
    outputs = [n for n in active if powers[n] < 0.0]
    inputs = [n for n in active if powers[n] > 0.0]
    loaded = [n for n, x in case.given.items() if x != 0.0]
    if not inputs or not outputs or len(loaded) != 1:
        return None, "the efficiency backwards needs one given torque, and power that goes in and comes out"
    output = min(outputs, key=lambda n: powers[n])
    given = {n: 0.0 for n, x in torques.items() if x == 0.0} | {output: -torques[output]}
    left = tuple(n for n in torques if n not in given)
    try:
        _, back = _flow_and_torques(t, case, given, left)
    except NoSolution as cause:
        return None, f"backwards: {cause}"
    p = _powers(t, case, back)
    put_in, taken_out = sum(p[n] for n in outputs), -sum(p[n] for n in inputs)
    if put_in <= 0.0:
        return None, "backwards no power goes in at the output"
    ratio = taken_out / put_in
    if ratio <= 0.0:
        return (
            ratio,
            f"self-locking: {output} cannot drive it, {', '.join(inputs)} must help with {-ratio:.3g} of its power",
        )
    return ratio, ""


def _mesh_list(t: GearTrain, found: Flow, eta: Array) -> list[dict[str, Any]]:
    f = found.meshes
    out = []
    for k, r in enumerate(t.roles):
        toward = float(f.toward_b[k])
        out.append({
            "mesh": r.name, "from": r.a if toward >= 0 else r.b, "to": r.b if toward >= 0 else r.a, "carrier": r.carrier,
            "rolling_power": float(f.rolling[k]), "loss": float(f.loss[k]), "efficiency": float(eta[k]),
            "power_to_carrier": float(f.power_carrier[k]),
            "torques": {r.a: float(f.torque_a[k]), r.b: float(f.torque_b[k])},
            "power_to": {r.a: float(f.power_a[k]), r.b: float(f.power_b[k])},
        })  # fmt: skip
    return out


def _carrier_list(t: GearTrain, found: Flow, case: LoadCase) -> list[dict[str, Any]]:
    """Coupling power of every carrier that moves: the power that its meshes give to it and take from it."""
    out = []
    for name in dict.fromkeys(r.carrier for r in t.roles if r.carrier != GROUND):
        parts = [float(found.meshes.power_carrier[k]) for k, r in enumerate(t.roles) if r.carrier == name]
        got, given = sum(x for x in parts if x > 0), -sum(x for x in parts if x < 0)
        joint = t.mechanism.body(name).joints[0].name
        out.append({
            "carrier": name, "rate": float(t.mechanism.row(joint) @ case.rates), "coupling_power": max(got, given),
            "taken_from_meshes": got, "given_to_meshes": given,
        })  # fmt: skip
    return out


def _engine(title: str, t: GearTrain, given: Mapping[str, float]) -> Answer:
    """Speeds, and without losses torques, from the engine's own constraint Jacobian in the reference pose."""
    m, case = t.mechanism, load_case(t, given)
    try:
        jacobian = engine(title).state(m, m.reference()).rows[:, : m.nv]
    except EngineMissing as missing:
        return Answer(cannot=str(missing))
    speeds = {k.removesuffix(RATE): float(x) for k, x in given.items() if k.endswith(RATE)}
    matrix = np.vstack([jacobian, *[m.row(n)[None] for n in speeds]])
    wanted = np.concatenate([np.zeros(len(jacobian)), list(speeds.values())])
    v = np.linalg.lstsq(matrix, wanted, rcond=1e-12)[0]
    values: dict[str, Any] = {f"{n}{RATE}": float(m.row(n) @ v) for n in m.scalar_names if f"{n}{RATE}" not in given}
    if np.any(case.eta < 1.0):
        return Answer(values, notes=("speeds only: the engine's gears have no losses",))
    columns = np.vstack([jacobian, *[m.row(n)[None] for n in case.open]]).T
    load = sum((x * m.row(n) for n, x in case.given.items()), np.zeros(m.nv))
    solution = np.linalg.lstsq(columns, -load, rcond=1e-11)[0][len(jacobian) :]
    return Answer(values | {f"{n}{FORCE}": float(x) for n, x in zip(case.open, solution, strict=True)})
