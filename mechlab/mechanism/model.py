"""The data of a mechanism: a tree of bodies, what closes it, what couples it, what drives it.

Everything is immutable and plain: tuples of floats, exact fractions, names. Two mechanisms are equal when their data are.
A Mechanism is checked when it is made (`mechlab.mechanism.validate`): an object that exists is sound.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.mechanism.geometry import IDENTITY, Array, Placement, Vector
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.shape import Shape

GROUND = "ground"
"""Name of the fixed body; every Mechanism has it without listing it."""

JOINT_KINDS = ("revolute", "prismatic", "spherical")
LOOP_ROWS = {"spherical": 3, "revolute": 5, "universal": 4, "cylindrical": 4, "prismatic": 5, "fixed": 6, "distance": 1}
"""Kinds of Loop, named after the joint they stand for, and their number of constraint rows."""

Coefficients = tuple[tuple[str, Fraction], ...]


@dataclass(frozen=True)
class Joint:
    """One joint of a body, acting at the origin of the body frame after the joints before it.

    kind: "revolute" [rad], "prismatic" [m] or "spherical" (quaternion w, x, y, z; rates are the angular velocity in
    the body). `axis` is a unit vector in the body frame (not used by a spherical joint). `zero` is the physical value
    at the reference pose: what a user sees is zero + coordinate. `range` and `spring_rest` are physical values.
    damping [N m s/rad or N s/m], armature [kg m2 or kg], friction: dry [N m or N], stiffness [N m/rad or N/m].
    """

    name: str
    kind: str = "revolute"
    axis: Vector = (0.0, 0.0, 1.0)
    zero: float = 0.0
    range: tuple[float, float] | None = None
    damping: float = 0.0
    armature: float = 0.0
    friction: float = 0.0
    stiffness: float = 0.0
    spring_rest: float = 0.0

    @property
    def nq(self) -> int:
        """Number of coordinates."""
        return 4 if self.kind == "spherical" else 1

    @property
    def nv(self) -> int:
        """Number of rates."""
        return 3 if self.kind == "spherical" else 1


@dataclass(frozen=True)
class Body:
    """A rigid part: where it stands in its parent in the reference pose, its joints (none: welded), inertia, looks.

    Several joints in one body make a compound joint without massless bodies: two revolutes are a universal joint.
    """

    name: str
    parent: str = GROUND
    placement: Placement = IDENTITY
    joints: tuple[Joint, ...] = ()
    inertia: Inertia = Inertia()
    shapes: tuple[Shape, ...] = ()


@dataclass(frozen=True)
class Frame:
    """A named point of interest, fixed in a body."""

    name: str
    body: str = GROUND
    placement: Placement = IDENTITY


@dataclass(frozen=True)
class Loop:
    """Closes a loop between two bodies; `kind` is one of LOOP_ROWS, the axis of a joint is local z of both placements.

    A universal loop has its two pins along x of `placement_a` and y of `placement_b`. `length` [m]: distance loops only.
    """

    name: str
    kind: str
    body_a: str
    body_b: str
    placement_a: Placement = IDENTITY
    placement_b: Placement = IDENTITY
    length: float = 0.0


@dataclass(frozen=True)
class Shaft:
    """A part that turns but needs no coordinate: its angle is `zero` + the sum of coefficient x joint coordinate.

    inertia [kg m2], damping, dry friction, stiffness as of a joint. Shapes are drawn in `body`, at `placement`, turned
    about the local z of the placement by the angle of the shaft.
    """

    name: str
    coefficients: Coefficients
    zero: float = 0.0
    inertia: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    stiffness: float = 0.0
    spring_rest: float = 0.0
    body: str = GROUND
    placement: Placement = IDENTITY
    shapes: tuple[Shape, ...] = ()


@dataclass(frozen=True)
class LinearRelation:
    """A shaft that must stand still: the sum of coefficient x joint coordinate is zero.

    Made by `mechlab.mechanism.gears`. `kind` says by what ("external", "internal", "bevel", "rack", "belt", "screw",
    "mimic", "linear"). Its reaction is conjugate to the sum: with the first coefficient 1 it is the torque on that joint.
    """

    name: str
    coefficients: Coefficients
    kind: str = "linear"


@dataclass(frozen=True)
class Spring:
    """A linear spring and damper between two points: force = stiffness (length - rest_length) + damping length rate [N]."""

    name: str
    body_a: str
    body_b: str
    point_a: Vector = (0.0, 0.0, 0.0)
    point_b: Vector = (0.0, 0.0, 0.0)
    stiffness: float = 0.0
    damping: float = 0.0
    rest_length: float = 0.0


@dataclass(frozen=True)
class Winding:
    """Electrical side of a DC motor: constant [N m/A = V s/rad], resistance [ohm], inductance [H].

    torque = constant x current; inductance x current' = voltage - resistance x current - constant x rate.
    """

    constant: float
    resistance: float
    inductance: float = 0.0


@dataclass(frozen=True)
class Drive:
    """An actuator on a joint or shaft: a position servo of the given `stiffness` and `damping`, force limited by `limit`;
    with a `winding` a DC motor whose input is the voltage."""

    name: str
    on: str
    stiffness: float = 0.0
    damping: float = 0.0
    limit: float | None = None
    winding: Winding | None = None


@dataclass(frozen=True)
class Mechanism:
    """A tree of bodies, depth-first, and what closes, couples and drives it. All coordinates are 0 in the reference
    pose (spherical joints: the identity), and the reference pose is assembled.

    Raises MechlabError at construction for anything that is not sound; see `mechlab.mechanism.validate`.
    """

    name: str
    bodies: tuple[Body, ...]
    loops: tuple[Loop, ...] = ()
    relations: tuple[LinearRelation, ...] = ()
    shafts: tuple[Shaft, ...] = ()
    springs: tuple[Spring, ...] = ()
    drives: tuple[Drive, ...] = ()
    frames: tuple[Frame, ...] = ()
    gravity: Vector = (0.0, 0.0, -9.81)
    ground_shapes: tuple[Shape, ...] = ()
    summary: str = field(default="", compare=True)

    def __post_init__(self) -> None:
        from mechlab.mechanism.validate import validate

        validate(self)

    # -- names ---------------------------------------------------------------------------------------------------

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """All joints, in the order of the coordinates."""
        return tuple(j for b in self.bodies for j in b.joints)

    @cached_property
    def nq(self) -> int:
        """Number of coordinates."""
        return sum(j.nq for j in self.joints)

    @cached_property
    def nv(self) -> int:
        """Number of rates."""
        return sum(j.nv for j in self.joints)

    @cached_property
    def q_slice(self) -> dict[str, slice]:
        """Joint name -> its coordinates in q."""
        return _slices([(j.name, j.nq) for j in self.joints])

    @cached_property
    def v_slice(self) -> dict[str, slice]:
        """Joint name -> its rates in v."""
        return _slices([(j.name, j.nv) for j in self.joints])

    @cached_property
    def rate_names(self) -> tuple[str, ...]:
        """One name for each entry of v: the joint, or joint_x, joint_y, joint_z of a spherical one."""
        return tuple(n for j in self.joints for n in ([j.name] if j.nv == 1 else [f"{j.name}_{a}" for a in "xyz"]))

    @cached_property
    def _by_name(self) -> dict[str, dict[str, object]]:
        return {
            "body": {b.name: b for b in self.bodies},
            "joint": {j.name: j for j in self.joints},
            "shaft": {s.name: s for s in self.shafts},
            "frame": {f.name: f for f in self.frames},
            "loop": {x.name: x for x in self.loops},
            "relation": {x.name: x for x in self.relations},
            "drive": {d.name: d for d in self.drives},
        }

    def _find(self, what: str, name: str) -> object:
        try:
            return self._by_name[what][name]
        except KeyError:
            raise unknown(f"{self.name}: {what}", name, self._by_name[what]) from None

    def body(self, name: str) -> Body:
        """The body of that name; raises MechlabError that lists the bodies."""
        found = self._find("body", name)
        assert isinstance(found, Body)
        return found

    def joint(self, name: str) -> Joint:
        """The joint of that name; raises MechlabError that lists the joints."""
        found = self._find("joint", name)
        assert isinstance(found, Joint)
        return found

    def frame(self, name: str) -> Frame:
        """The frame of that name; raises MechlabError that lists the frames."""
        found = self._find("frame", name)
        assert isinstance(found, Frame)
        return found

    # -- coordinates ---------------------------------------------------------------------------------------------

    def reference(self) -> Array:
        """(nq,) coordinates of the reference pose: zeros, and identity quaternions."""
        q = np.zeros(self.nq)
        for joint in self.joints:
            if joint.kind == "spherical":
                q[self.q_slice[joint.name].start] = 1.0
        return q

    @cached_property
    def scalar_names(self) -> tuple[str, ...]:
        """Names of everything that has one value: revolute and prismatic joints, then shafts."""
        return tuple(j.name for j in self.joints if j.nv == 1) + tuple(s.name for s in self.shafts)

    @cached_property
    def _rows(self) -> dict[str, Array]:
        rows: dict[str, Array] = {}
        for joint in self.joints:
            if joint.nv == 1:
                rows[joint.name] = np.eye(self.nv)[self.v_slice[joint.name].start]
        for shaft in self.shafts:
            rows[shaft.name] = self.coefficient_row(shaft.coefficients)
        for row in rows.values():
            row.flags.writeable = False
        return rows

    def row(self, name: str) -> Array:
        """(nv,) coefficients c of a joint or shaft: its rate is c @ v. Raises MechlabError that lists the names."""
        try:
            return self._rows[name]
        except KeyError:
            raise unknown(f"{self.name}: joint or shaft", name, self._rows) from None

    def coefficient_row(self, coefficients: Coefficients) -> Array:
        """(nv,) row of floats of exact coefficients."""
        row = np.zeros(self.nv)
        for name, c in coefficients:
            if name not in self.v_slice:
                raise unknown(f"{self.name}: joint", name, self.v_slice)
            row[self.v_slice[name].start] += float(c)
        return row

    def zero(self, name: str) -> float:
        """Physical value of a joint or shaft at the reference pose."""
        zeros = {j.name: j.zero for j in self.joints} | {s.name: s.zero for s in self.shafts}
        if name not in zeros:
            raise unknown(f"{self.name}: joint or shaft", name, self._rows)
        return zeros[name]

    def value(self, name: str, q: Array) -> Array:
        """Physical value of a joint or shaft at coordinates q (..., nq): zero + coordinate."""
        return self.zero(name) + np.asarray(q)[..., self._q_columns] @ self.row(name)

    @cached_property
    def _q_columns(self) -> Array:
        """For each rate the coordinate it changes; a spherical joint's vector part stands in (its rows are zero)."""
        columns: list[int] = []
        for joint in self.joints:
            start = self.q_slice[joint.name].start
            columns += [start] if joint.nv == 1 else [start + 1, start + 2, start + 3]
        return np.array(columns, dtype=int)

    @property
    def total_mass(self) -> float:
        """Mass of all moving parts and everything fixed that carries mass [kg]."""
        return sum(b.inertia.mass for b in self.bodies)

    def _repr_html_(self) -> str:
        from mechlab.mechanism.summary import mechanism_html

        return mechanism_html(self)


def _slices(sizes: list[tuple[str, int]]) -> dict[str, slice]:
    out: dict[str, slice] = {}
    start = 0
    for name, n in sizes:
        out[name] = slice(start, start + n)
        start += n
    return out


def as_fraction(value: object, what: str) -> Fraction:
    """An exact ratio: of tooth counts, or of the decimal as written. Raises MechlabError that names `what`."""
    try:
        if isinstance(value, Fraction | int | str):
            return Fraction(value)
        return Fraction(str(float(value)))  # type: ignore[arg-type]
    except (TypeError, ValueError, ZeroDivisionError):
        raise MechlabError(f"{what}: expected a number or a ratio such as '17/22', got {value!r}.") from None
