"""One turn of the drive of any mechanism with one freedom: motion, forces, transmission, curves."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.engines.own.closed_path import ClosedPath, PathPoint, choose_path
from mechlab.errors import EngineMissing, MechlabError, unknown
from mechlab.experiment.acting import what_acts
from mechlab.experiment.findings import SHARED
from mechlab.experiment.laws import Constant
from mechlab.experiment.parameters import checked, mechanism_units
from mechlab.experiment.recording import basic_channels
from mechlab.experiment.scene import Scene
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.length_unit import is_length
from mechlab.mechanism.parts import FORCES, MOMENTS
from mechlab.mechanism.structure import shared_loads
from mechlab.results import Result
from mechlab.studies.cycle.quantities import (
    TRANSMITTED,
    Extremum,
    ReactionTable,
    extremum,
    instant_centres,
    outputs,
    planar_normal,
    reactions,
    shaking,
    transmission,
    without_guides,
    witness_difference,
)

POINTS = 72
INSIDE = 0.01
"""Share of the range that is left out before a limit position, where rates have no bound."""

ZERO = 1e-11


@dataclass(frozen=True, repr=False)
class CycleResult(Result[Path]):
    """A cycle: columns name -> (n,) in SI units at the positions of the drive, with units and notes.

    Force, moment and position columns that are zero at every position are left out of `columns` and named in `zero`.
    """

    mechanism: Mechanism
    name: str
    drive: str
    output: str
    columns: dict[str, Array]
    units: dict[str, str]
    notes: tuple[str, ...] = ()
    zero: tuple[str, ...] = ()
    witnesses: Mapping[str, float] = field(default_factory=dict)
    normal: tuple[float, float, float] | None = None
    course: Course | None = field(default=None, repr=False, compare=False)
    exit_code: int = 0
    acts: str = ""

    def __getitem__(self, name: str) -> Array:
        if name in self.zero:
            return np.zeros(len(self.columns[self.drive]))
        if name not in self.columns:
            raise unknown(f"{self.name}: column of the cycle", name, [*self.columns, *self.zero])
        return self.columns[name]

    def extremum(self, name: str, sign: int) -> Extremum | None:
        """The largest (sign 1) or least (-1) value of a column, and the position of the drive where it occurs.

        With a course the search covers the path between the positions too. None where no value is finite.
        """
        column = None if self.course is None else lambda phi: self.course.columns(np.array([phi]), {name})[name][0]  # type: ignore[union-attr]
        phi, values = self.columns[self.drive], self[name]
        same = abs(values[-1] - values[0]) <= 1e-9 * max(1.0, float(np.ptp(values)))
        closed = bool(same) and self.course is not None and self.course.turns(phi)
        return extremum(phi, values, sign, column, closed)

    @property
    def message(self) -> str:
        """One sentence: number of positions, the drive and its range."""
        phi = self.columns[self.drive]
        unit = self.units[self.drive]
        return f"{self.name}: {len(phi)} positions of {self.drive} from {phi[0]:.6g} to {phi[-1]:.6g} {unit}"

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {
            "mechanism": self.name, "acts": self.acts, "drive": self.drive,
            "output": self.output, "columns": self.columns, "units": self.units,
            "zero": list(self.zero), "notes": list(self.notes), "max_difference": dict(self.witnesses), "message": self.message,
        }  # fmt: skip


@dataclass(frozen=True)
class Sample:
    """Columns (n,) with units at positions of the drive, the motion q (n, nq), v (n, nv), and the table of
    reactions."""

    columns: dict[str, Array]
    units: dict[str, str]
    q: Array
    v: Array
    table: ReactionTable


@dataclass(frozen=True)
class Course:
    """Computes the columns at any position of the path, from rate and acceleration of the drive and constant loads
    (nv,).

    aim: the output joint of the transmission, None without one.
    """

    path: ClosedPath
    rate: float
    accel: float
    load: Array
    aim: str | None

    @cached_property
    def normal(self) -> Array | None:
        """Normal (3,) of a planar mechanism, None for a spatial one."""
        return planar_normal(self.path.mechanism, self.path.start)

    def turns(self, phis: Array) -> bool:
        """True when the positions span a full turn of the drive and the mechanism is then back in its pose."""
        return bool(abs(phis[-1] - phis[0] - 2.0 * np.pi) < 1e-9) and self.path.full_turn() is not None

    def sample(self, phis: Array) -> Sample:
        """All columns at positions (n,) of the drive."""
        m, drive = self.path.mechanism, self.path.coordinate
        poses, q, v, a = self._motion(phis)
        columns, units = _motion(m, q, v, a)
        columns = {drive: phis} | columns
        found = reactions(m, drive, self.accel, q, v, self.load)
        columns |= found.columns
        units |= found.units
        force, moment = shaking(m, q, v, a)
        for k, letter in enumerate("xyz"):
            columns[f"shaking_f{letter}"], columns[f"shaking_m{letter}"] = force[:, k], moment[:, k]
            units |= {f"shaking_f{letter}": "N", f"shaking_m{letter}": "N m"}
        if self.aim is not None:
            more, more_units = transmission(m, drive, self.aim, poses)
            columns |= without_guides(more)
            units |= more_units
        if self.normal is not None:
            columns |= (centres := instant_centres(m, poses, self.normal))
            units |= dict.fromkeys(centres, "m")
        return Sample(columns, units, q, v, found)

    def columns(self, phis: Array, names: Collection[str]) -> dict[str, Array]:
        """At least the named columns at positions (n,); reactions are computed only when a name needs them."""
        m, drive = self.path.mechanism, self.path.coordinate
        poses, q, v, a = self._motion(phis)
        found = {drive: phis} | _motion(m, q, v, a)[0]
        if not set(names) <= set(found):
            if any(n.endswith(TRANSMITTED) for n in names) and self.aim is not None:
                found |= transmission(m, drive, self.aim, poses)[0]
            else:
                found |= reactions(m, drive, self.accel, q, v, self.load).columns
        return found if set(names) <= set(found) else self.sample(phis).columns

    def _motion(self, phis: Array) -> tuple[list[PathPoint], Array, Array, Array]:
        poses = self.path.at_all(phis)
        v = np.array([x.u * self.rate for x in poses])
        a = np.array([x.u * self.accel + x.du * self.rate**2 for x in poses])
        return poses, np.array([x.q for x in poses]), v, a


def run_cycle(
    mechanism: Mechanism,
    name: str = "",
    motion: Mapping[str, float] | None = None,
    drive: str | None = None,
    output: str | None = None,
    points: int = POINTS,
    span: tuple[float, float] | None = None,
    only: Collection[str] | None = None,
) -> CycleResult:
    """A cycle of a mechanism with one freedom, from its reference pose, at `points` equal steps of the drive.

    motion: X_rate (default 1) and X_accel (0) of the drive X (crank_rate means crank_angle_rate where there is no
    crank), X_force: constant loads on joints or shafts. drive: default the joint of the first Drive, else the first
    that turns fully. output: the joint that carries the load of the transmission angle. span: first and last position
    of the drive [rad or m], default a full turn, or the range between the limit positions less 1 % at each end.
    only: the columns that are needed; others may be left out, and no engine compares forces then.

    Columns: X, X_rate, X_accel of joints and shafts; DRIVE_force; of every loop and joint _fx _fy _fz _mx _my _mz (on
    the body from its parent, about the joint, world axes; loops: on body b) and _reaction, the size of the force;
    shaking_fx .. _mz about the world's origin; LOOP_transmission_angle, velocity_ratio, mechanical_advantage; FRAME_x
    _y _z; centre_A_B_x .. for planar mechanisms.
    """
    m = mechanism
    rate, accel, load, named = _given(m, dict(motion or {}))
    wanted = drive or named or next((d.on for d in m.drives), None)
    if points < 2 or points > 100_000:
        raise MechlabError(f"points: expected a number from 2 to 100000, got {points!r}.")
    path = ClosedPath(m, wanted) if wanted else choose_path(m)[0]
    if named not in (None, path.coordinate):
        raise MechlabError(
            f"{m.name}: a rate or an acceleration of {named} is given, and the drive is {path.coordinate}: give "
            f"{path.coordinate}_rate, or drive {named}."
        )
    phis, notes = _range(path, span, points)
    poses = path.at_all(phis)
    aim = outputs(m, path.coordinate, poses, output)
    course = Course(path, rate, accel, load, aim)
    if only is not None:
        return CycleResult(m, name or m.name, path.coordinate, aim or "", course.columns(phis, only), {}, course=course)
    found = course.sample(phis)
    columns, units, normal = found.columns, found.units, course.normal
    zero = tuple(n for n, x in columns.items() if _vanishes(n, x, m))
    kept = {n: x for n, x in columns.items() if n not in zero}
    witnesses, missing = _witnesses(m, path.coordinate, accel, found.q, found.v, load, found.table)
    shared = shared_loads(m)
    notes += (SHARED.format(", ".join(shared)) + ", there and in the joints between",) if shared else ()
    return CycleResult(
        m, name or m.name, path.coordinate, aim or "", kept, units, (*notes, *missing), zero, witnesses,
        None if normal is None else (float(normal[0]), float(normal[1]), float(normal[2])), course,
        acts=_acts(m, path.coordinate, dict(motion or {})),
    )  # fmt: skip


def _acts(m: Mechanism, drive: str, motion: Mapping[str, float]) -> str:
    """One line on what acts: the constant loads, and the drive on its given motion in place of its declared law."""
    loads = tuple(
        Constant(k.removesuffix("_force"), float(x)) for k, x in motion.items() if k.endswith("_force") and float(x)
    )
    others = replace(m, drives=tuple(d for d in m.drives if d.on != drive))
    return f"{what_acts(others, Scene('cycle', '', 1.0, loads, drives='free'))}; {drive} on the given motion"


def _given(m: Mechanism, motion: dict[str, float]) -> tuple[float, float, Array, str | None]:
    """Rate, acceleration, loads (nv,) and the drive that the keys name."""
    rate, accel, drive = 1.0, 0.0, None
    load = np.zeros(m.nv)
    names, seen = set(m.scalar_names), dict[tuple[str, str], str]()
    for key, value in checked(motion, mechanism_units(m)).items():
        x = float(value)
        if not np.isfinite(x):
            raise MechlabError(f"{key}: expected a finite number, got {value!r}.")
        stem, _, what = key.rpartition("_")
        if stem not in names and f"{stem}_angle" in names:  # questions say crank_rate for crank_angle_rate
            stem = f"{stem}_angle"
        if (stem, what) in seen:
            raise MechlabError(f"{m.name}: {key} is given twice, as {seen[stem, what]} too. Keep one.")
        seen[stem, what] = key
        if stem not in names or what not in ("rate", "accel", "force"):
            raise unknown(
                f"{m.name}: quantity", key, [f"{n}_{s}" for n in m.scalar_names for s in ("rate", "accel", "force")]
            )
        if what == "force":
            load = load + x * m.row(stem)
            continue
        if drive not in (None, stem):
            raise MechlabError(f"{m.name}: rates of {drive} and {stem} are given; a cycle has one drive.")
        drive = stem
        rate, accel = (x, accel) if what == "rate" else (rate, x)
    return rate, accel, load, drive


def _range(path: ClosedPath, span: tuple[float, float] | None, points: int) -> tuple[Array, list[str]]:
    start = path.start.phi
    if span is not None:
        return np.linspace(float(span[0]), float(span[1]), points + 1), []
    if path.full_turn() is not None:
        return start + np.linspace(0.0, 2.0 * np.pi, points + 1), []
    slides = is_length(path.mechanism, path.coordinate)
    low, high = path.limits(1.0 if slides else 2.0 * np.pi)
    if not slides and high - start >= 2.0 * np.pi * (1 - 1e-12):
        note = f"after a turn of {path.coordinate} the mechanism is not back in its pose"
        return start + np.linspace(0.0, 2.0 * np.pi, points + 1), [note]
    room = INSIDE * (high - low)
    unit = "m" if slides else "rad"
    note = f"{path.coordinate} makes no full turn: from {low:.9g} to {high:.9g} {unit}; the cycle stays {room:.3g} {unit} inside"
    return np.linspace(low + room, high - room, points + 1), [note]


def _motion(m: Mechanism, q: Array, v: Array, a: Array) -> tuple[dict[str, Array], dict[str, str]]:
    columns, units = basic_channels(m, q, v)
    for name in m.scalar_names:
        columns[f"{name}_accel"] = a @ m.row(name)
        units[f"{name}_accel"] = f"{units[name]}/s2"
    return columns, units


def _vanishes(name: str, values: Array, m: Mechanism) -> bool:
    force = name.rsplit("_", 1)[-1]
    if force in (*FORCES, *MOMENTS, "x", "y", "z"):
        return not np.any(np.abs(values) >= ZERO * max(1.0, m.total_mass))
    return False


def _witnesses(
    m: Mechanism, drive: str, accel: float, q: Array, v: Array, load: Array, found: ReactionTable
) -> tuple[dict[str, float], tuple[str, ...]]:
    try:
        gap = witness_difference(m, drive, accel, q, v, load, found)
    except EngineMissing as missing:
        return {}, (str(missing),)
    except MechlabError as cause:
        return {}, (f"reactions not compared with MuJoCo: {cause}",)
    return {"of drive force and reactions, pinocchio and mujoco [N, N m]": gap}, ()
