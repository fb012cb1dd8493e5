"""Speeds, moments, starting rule and true accelerations from the speed of the input and one more quantity.

Pinocchio and MuJoCo answer with a mass matrix and constraint rows of their own (`Machine`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np

from mechlab.analytic import differential as closed
from mechlab.catalog.closed_differential.build import MESHES, Parameters, build
from mechlab.engines.protocol import engine
from mechlab.errors import EngineMissing, MechlabError, NoSolution
from mechlab.experiment.question import Answer, Question
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import null_space

ENGINES = ("pinocchio", "mujoco")
SPEEDS = {
    "w_H1": "H1", "w_H2": "H2", "w1": "block_14", "w3": "block_36", "w2": "planet_2_spin", "w5": "planet_5_spin",
}  # fmt: skip
"""Names of speeds -> joint or shaft."""


@dataclass(frozen=True)
class Machine:
    """Mass matrix (nv, nv) and rows (relations, nv) of an engine at rest in the reference pose; both are constant."""

    engine: str
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
        """(nv,) generalised force of moments on speeds or joints or shafts by name."""
        return np.asarray(sum((f * self.row(name) for name, f in moments.items()), np.zeros(self.mechanism.nv)))

    def accelerations(self, applied: Array) -> Array:
        """(nv,) accelerations under a generalised force (nv,)."""
        free = self.free
        return np.asarray(free @ np.linalg.solve(free.T @ self.mass @ free, free.T @ applied))

    def balance(self, applied: Array, holders: Sequence[str]) -> tuple[Array, dict[str, float]]:
        """Moments (holders,) that keep the train in equilibrium, and the load of each relation by name."""
        rows = np.array([self.row(name) for name in holders])
        matrix = np.vstack([rows, self.rows]).T
        found = np.linalg.lstsq(matrix, -applied, rcond=1e-12)[0]
        loads = found[len(rows) :].tolist()
        return found[: len(rows)], dict(zip([r.name for r in self.mechanism.relations], loads, strict=True))

    def loads(self, applied: Array, accelerations: Array) -> dict[str, float]:
        """Load of each relation in an accelerated motion: M a = applied + J^T load."""
        found = np.linalg.lstsq(self.rows.T, self.mass @ accelerations - applied, rcond=1e-12)[0]
        return dict(zip([r.name for r in self.mechanism.relations], found.tolist(), strict=True))


def mesh_sums(loads: Mapping[str, float]) -> dict[str, float]:
    """Moments on the wheels 1, 3, 4, 6 from all planets: `MESHES` -> sum of the loads."""
    return {mesh: sum(f for name, f in loads.items() if name.startswith(f"{mesh}_")) for mesh in MESHES}


@lru_cache(maxsize=64)
def machine(implementation: str, p: Parameters, fidelity: str) -> Machine:
    """The machine of "numpy" (for checks and the predicted lag) or of an engine; raises EngineMissing when that is not installed."""
    m = build(p, fidelity)
    plant = engine(implementation).plant(m)
    return Machine(implementation, m, plant.mass_matrix().copy(), plant.relation_rows())


MOMENTS = ("M21", "M23", "M54", "M56", "start_moment", "internal_moment", "held_output_moment")
RATES = ("w_H1_rate", "w_H2_rate", "w1_rate", "w3_rate")
ANSWERS = (*SPEEDS, *MOMENTS, "start_ratio", *RATES)
UNITS = (
    dict.fromkeys(SPEEDS, "rad/s")
    | dict.fromkeys(MOMENTS, "N m")
    | {"start_ratio": ""}
    | dict.fromkeys(RATES, "rad/s2")
)
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


def _question(name: str, given: tuple[str, ...], optional: Mapping[str, float | None], text: str) -> Question:
    witnesses: dict[str, Callable[[Any, Mapping[str, Any]], Answer]] = {"analytic": analytic}
    witnesses |= {engine: partial(by_engine, engine) for engine in ENGINES}
    return Question(
        name, given, tuple(k for k in ANSWERS if k not in given), witnesses, optional, units=UNITS, text=text
    )


QUESTIONS = (
    _question("input speed and moments", ("w_H1",), {"w_H2": None},
              "all speeds and moments; without w_H2 the source's (10) is taken for it"),
    _question("input and block 36", ("w_H1", "w3"), {}, "speeds with the speed of block 36 given (0: braked)"),
    _question("input and block 14", ("w_H1", "w1"), {}, "speeds with the speed of block 14 given (0: braked)"),
    _question("blocks", ("w1", "w3"), {}, "speeds of the carriers from those of the blocks"),
)  # fmt: skip
