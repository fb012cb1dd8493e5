"""How far soft gear rows lag under load: `solve NAME X_force=… row_timeconst=2ms row_impedance=0.9999` on a train of gears.

A row of MuJoCo is a spring and damper: under a load f it stands open by (1 - d) tc^2 A f. The closed form predicts that,
MuJoCo is run until the onset has died out, and Pinocchio, whose rows are rigid, gives the loads.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechlab.engines.protocol import engine
from mechlab.errors import EngineMissing, MechlabError, unknown
from mechlab.experiment.lag import predicted_lags
from mechlab.experiment.laws import Constant
from mechlab.experiment.question import Answer, Question
from mechlab.experiment.scene import Scene, Settings
from mechlab.lab.design import Design
from mechlab.lab.gear_trains import FORCE, ROW_SOFTNESS
from mechlab.lab.gear_trains.train import each_case, train_mechanism
from mechlab.mechanism import ConstraintSet, Mechanism
from mechlab.mechanism.length_unit import is_length

STEPS = 4
"""Steps in a time constant."""
ONSET = 30.0
"""Time constants after which the onset has died out to exp(-30)."""


def lag_question(design: Design, values: Mapping[str, Any]) -> Question:
    """The question that X_force, row_timeconst and row_impedance make. Raises MechlabError for unknown keys, softness out of
    range, no load, and mechanisms that are not trains of gears."""
    m = train_mechanism(design)
    if m is None:
        raise MechlabError(
            f"{design.name}: the lag of soft rows is asked of trains of gears, and no fidelity of it "
            f"({', '.join(design.entry.fidelities)}) consists of gear relations alone."
        )
    loads = {f"{n}{FORCE}": "N" if is_length(m, n) else "N m" for n in m.scalar_names}
    for key in values:
        if key not in loads and key not in ROW_SOFTNESS:
            raise unknown(f"{design.name}: lag of soft rows: quantity", key, {*loads, *ROW_SOFTNESS})
    complete = ROW_SOFTNESS | dict(values)
    for key, good, wanted in (
        ("row_timeconst", lambda x: x > 0.0, "more than 0 s"),
        ("row_impedance", lambda x: (x > 0.0) & (x < 1.0), "a number between 0 and 1"),
    ):
        if not np.all(good(np.asarray(complete[key], dtype=float))):
            raise MechlabError(f"{design.name}: {key}: expected {wanted}, got {complete[key]!r}.")
    if not any(np.any(values[k]) for k in loads if k in values):
        raise MechlabError(
            f"{design.name}: give a load other than 0, for example {next(iter(loads))}=1; members: {', '.join(m.scalar_names)}."
        )
    first = {r.name: r.coefficients[0][0] in m.slides for r in m.relations}
    units = loads | {"row_timeconst": "s", "row_impedance": ""}
    units |= {f"{n}_lag": "m" if slid else "rad" for n, slid in first.items()}
    units |= {f"{n}_load": "N" if slid else "N m" for n, slid in first.items()}
    return Question(
        "lag of soft rows", tuple(values), tuple(f"{n}_{what}" for what in ("lag", "load") for n in first),
        {
            "analytic": lambda p, given: each_case(given, lambda case: Answer(_predicted(m, case))),
            "pinocchio": lambda p, given: _rigid(m, given),
            "mujoco": lambda p, given: _measured(m, given),
        },
        ROW_SOFTNESS, units=units, text="how far soft gear rows lag under load, and the loads of the rows",
        tolerance=1e-3,  # the law is that of a row at rest; what remains of the onset in the run: 1e-4
    )  # fmt: skip


def _loaded(m: Mechanism, given: Mapping[str, float]) -> tuple[Scene, Settings]:
    """From rest under constant loads, for as long as the onset takes; settings with these rows."""
    tc = float(given["row_timeconst"])
    laws = tuple(Constant(k.removesuffix(FORCE), float(x)) for k, x in given.items() if k.endswith(FORCE))
    settings = Settings(timestep=tc / STEPS, timeconst=float(STEPS), impedance=float(given["row_impedance"]))
    return Scene("load", "parts", ONSET * tc, laws), settings


def _named(lags: Mapping[str, float], loads: Mapping[str, float]) -> dict[str, float]:
    return {f"{n}_lag": x for n, x in lags.items()} | {f"{n}_load": x for n, x in loads.items()}


def _predicted(m: Mechanism, given: Mapping[str, float]) -> dict[str, float]:
    found = predicted_lags(m, *_loaded(m, given))
    return _named({x.relation: x.lag for x in found}, {x.relation: x.load for x in found})


def _rigid(m: Mechanism, given: Mapping[str, float]) -> Answer:
    """Loads of rigid rows at rest, the least ones where rows repeat each other."""
    try:
        plant = engine("pinocchio").plant(m)
    except EngineMissing as missing:
        return Answer(cannot=str(missing))
    force = -plant.bias()
    for key, x in given.items():
        if key.endswith(FORCE):
            force = force + float(x) * m.row(key.removesuffix(FORCE))
    free = np.linalg.solve(plant.mass_matrix(), np.column_stack([force, plant.jacobian().T]))
    compliance, gap = plant.jacobian() @ free[:, 1:], plant.jacobian() @ free[:, 0] + plant.constraint_bias()
    load = np.linalg.lstsq(compliance, -gap, rcond=1e-11)[0]
    slices = ConstraintSet(m).slices
    loads = {r.name: abs(float(load[slices[r.name].start])) for r in m.relations}
    return Answer(_named({}, loads), notes=("its rows are rigid: they do not lag",))


def _measured(m: Mechanism, given: Mapping[str, float]) -> Answer:
    """Residual and load of each row at the end of a run of MuJoCo."""
    try:
        recording = engine("mujoco").run(m, *_loaded(m, given))
    except EngineMissing as missing:
        return Answer(cannot=str(missing))
    q = recording.q[-1]
    lags = {r.name: abs(float(m.coefficient_row(r.coefficients) @ q)) for r in m.relations}
    return Answer(_named(lags, {n: abs(float(recording.channel(f"{n}_load")[-1])) for n in lags}))
