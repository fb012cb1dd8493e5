"""The parts of a mechanism: bodies with joints and shapes, what closes them, what couples them, what drives them.

Everything is immutable and plain: tuples of floats, exact fractions, names. The meshes of shapes are made in
`mechlab.shapes`. `revolute`, `prismatic`, `spherical`, `universal` and `floating` make the joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from fractions import Fraction

from mechlab.errors import MechlabError, explained, unknown
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import IDENTITY, Placement, Vector, unit
from mechlab.mechanism.given import options_of, pair, si
from mechlab.mechanism.inertia import Inertia

Color = tuple[float, float, float, float]


@explained
@dataclass(frozen=True)
class Shape:
    """A solid of `kind` (see `mechlab.shapes.KINDS`) with named `size` parameters [m, rad, counts], placed in its body.

    data: the surface of a shape of kind "mesh", as a text of `mechlab.shapes.surface`.

    Shapes carry no mass: inertia is given separately, so that a picture never changes the physics.
    """

    kind: str
    size: tuple[tuple[str, float], ...] = ()
    placement: Placement = IDENTITY
    color: Color = (0.62, 0.66, 0.72, 1.0)
    name: str = ""
    data: str = field(default="", repr=False, metadata={"brief": True})

    @property
    def parameters(self) -> dict[str, float]:
        """The size parameters as a dict."""
        return dict(self.size)


def shape(
    kind: str, placement: Placement = IDENTITY, color: Color = (0.62, 0.66, 0.72, 1.0), name: str = "", **size: float
) -> Shape:
    """A Shape from keyword sizes: `shape("cylinder", radius=0.01, length=0.1)`. `mechlab.shapes.shape` also checks the kind.

    Raises MechlabError for a size that is no number, or a colour that is not (red, green, blue, alpha).
    """
    try:
        sizes = tuple(sorted((k, float(v)) for k, v in size.items()))
    except (TypeError, ValueError):
        wrong = next(f"{k}={v!r}" for k, v in size.items() if not isinstance(v, int | float))
        raise MechlabError(f"shape {kind!r}: {wrong} is not a number.") from None
    if isinstance(color, str) or len(color) != 4:
        raise MechlabError(f"shape {kind!r}: color: expected (red, green, blue, alpha) from 0 to 1, got {color!r}.")
    return Shape(kind, sizes, placement, color, name)


Coefficients = tuple[tuple[str, Fraction], ...]


def as_fraction(value: object, what: str) -> Fraction:
    """An exact ratio: of tooth counts, or of the decimal as written. Raises MechlabError that names `what`."""
    try:
        if isinstance(value, Fraction | int | str):
            return Fraction(value)
        return Fraction(str(float(value)))  # type: ignore[arg-type]
    except (TypeError, ValueError, ZeroDivisionError):
        raise MechlabError(f"{what}: expected a number or a ratio such as '17/22', got {value!r}.") from None


FLOOR = "floor"
"""Kind of a shape that is a sheet: in a page, the floor itself."""
GROUND = "ground"
"""Name of the fixed body; every Mechanism has it without listing it."""

MAX_BODIES = 500
"""Most bodies of one mechanism. Trains and chains of so many are built in 0.3 s, analysed in 2 s; files and runs take seconds."""
MAX_RATES = 1800
"""Most rates of one mechanism, those of 300 free bodies: ranks are taken of dense matrices, the work grows with the cube (10 s)."""
MAX_ROWS = MAX_RATES
"""Most constraint rows of one mechanism: as many as rates, so that more rows only repeat others."""
MAX_SHAPES = 10_000
"""Most shapes of one mechanism: each is drawn, and written to every file."""

JOINT_KINDS = ("revolute", "prismatic", "spherical")
LOOP_ROWS = {"spherical": 3, "revolute": 5, "universal": 4, "cylindrical": 4, "prismatic": 5, "fixed": 6, "distance": 1}
"""Kinds of Loop, named after the joint they stand for, and their number of constraint rows."""
FORCES, MOMENTS = ("fx", "fy", "fz"), ("mx", "my", "mz")
"""Parts of a load, in world axes: the ends of the names of its channels."""


@explained
@dataclass(frozen=True)
class Joint:
    """One joint of a body, acting at the origin of the body frame after the joints before it.

    kind: "revolute" [rad], "prismatic" [m] or "spherical" (quaternion w, x, y, z; rates are the angular velocity in
    the body). `axis` is a unit vector in the body frame (not used by a spherical joint). `zero` is the physical value
    at the reference pose: what a user sees is zero + coordinate. `range` and `spring_rest` are physical values; the range of a
    spherical joint is (0, largest angle of its rotation from the identity) [rad].
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


@explained
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


@explained
@dataclass(frozen=True)
class Frame:
    """A named point of interest, fixed in a body."""

    name: str
    body: str = GROUND
    placement: Placement = IDENTITY


@explained
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


@explained
@dataclass(frozen=True)
class Shaft:
    """A part that turns but needs no coordinate: its angle is `zero` + the sum of coefficient x joint coordinate.

    inertia [kg m2], damping, dry friction, stiffness, range as of a joint. Shapes are drawn in `body`, at `placement`, turned
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
    range: tuple[float, float] | None = field(default=None, metadata={"brief": True})


@explained
@dataclass(frozen=True)
class LinearRelation:
    """A shaft that must stand still: the sum of coefficient x joint coordinate is zero.

    Made by `mechlab.mechanism.gears`. `kind` is its origin ("external", "internal", "bevel", "rack", "belt", "screw",
    "mimic", "linear"). Its reaction is conjugate to the sum: with the first coefficient 1 it is the torque on that joint.
    """

    name: str
    coefficients: Coefficients
    kind: str = "linear"


@explained
@dataclass(frozen=True)
class Spring:
    """A linear spring and damper between two points: force = stiffness (length - rest_length) + damping length rate [N].
    range: stops of the length [m]; without stiffness and damping that is a string (0, longest) or a strut."""

    name: str
    body_a: str
    body_b: str
    point_a: Vector = (0.0, 0.0, 0.0)
    point_b: Vector = (0.0, 0.0, 0.0)
    stiffness: float = 0.0
    damping: float = 0.0
    rest_length: float = 0.0
    range: tuple[float, float] | None = field(default=None, metadata={"brief": True})


@explained
@dataclass(frozen=True)
class Winding:
    """Electrical side of a DC motor: constant [N m/A = V s/rad], resistance [ohm], inductance [H].

    torque = constant x current; inductance x current' = voltage - resistance x current - constant x rate.
    """

    constant: float
    resistance: float
    inductance: float = 0.0


@explained
@dataclass(frozen=True)
class Control:
    """The units of the control u of a drive, as a file gives them; the force of the actuator is

        f = gain u + push - stiffness / gear value - damping / gear rate     within `force_range`,

    and `gear` f acts on the joint or shaft, whose physical value and rate these are; stiffness, damping and limit of the
    Drive are those at the joint. range: u is clamped to it. force_range: only where it is not symmetric.
    """

    gain: float = 1.0
    gear: float = 1.0
    push: float = 0.0
    range: tuple[float, float] | None = None
    force_range: tuple[float, float] | None = None


@explained
@dataclass(frozen=True)
class Drive:
    """An actuator on a joint or shaft: a position servo of the given `stiffness` and `damping`, force limited by `limit`;
    with a `winding` a DC motor whose input is the voltage. `target`: physical value that a servo holds without another
    command; None: that of the reference pose. `control`: units of its control in a model file; None: the force of a motor
    [N or N m], the change of a servo's target from its reference."""

    name: str
    on: str
    stiffness: float = 0.0
    damping: float = 0.0
    limit: float | None = None
    winding: Winding | None = None
    target: float | None = field(default=None, metadata={"brief": True})
    control: Control | None = field(default=None, metadata={"brief": True})


AxisLike = str | Sequence[float]
X: Vector = (1.0, 0.0, 0.0)
Y: Vector = (0.0, 1.0, 0.0)
Z: Vector = (0.0, 0.0, 1.0)


def axis_vector(axis: AxisLike, what: str) -> Vector:
    """The unit vector of an axis: "x", "-z" and the like, or three numbers. Raises MechlabError that names `what`."""
    if isinstance(axis, str):
        named = {"x": X, "y": Y, "z": Z, "-x": (-1.0, 0.0, 0.0), "-y": (0.0, -1.0, 0.0), "-z": (0.0, 0.0, -1.0)}
        if axis not in named:
            raise unknown(f"{what}: axis", axis, named)
        return named[axis]
    return unit(axis, f"{what}: axis")


def _joint(name: str, kind: str, axis: Vector, options: dict[str, object]) -> Joint:
    """A joint with checked options; numbers may be text with a unit ("30deg", "5mm")."""
    what, unit = f"joint {name!r}", "m" if kind == "prismatic" else "rad"
    options_of(Joint, options, what, fixed=("name", "kind", "axis"))
    for key in ("zero", "spring_rest"):
        if key in options:
            options[key] = si(options[key], f"{what}: {key}", unit)
    if options.get("range") is not None:
        options["range"] = pair(options["range"], f"{what}: range", unit)
    return Joint(name, kind, axis, **options)  # type: ignore[arg-type]


@explained
def revolute(name: str, axis: AxisLike = "z", **options: object) -> Joint:
    """A revolute joint [rad]; options as of `Joint`: zero, range, damping, armature, friction, stiffness, spring_rest."""
    return _joint(name, "revolute", axis_vector(axis, f"joint {name!r}"), options)


@explained
def prismatic(name: str, axis: AxisLike = "z", **options: object) -> Joint:
    """A prismatic joint [m]; options as of `Joint`."""
    return _joint(name, "prismatic", axis_vector(axis, f"joint {name!r}"), options)


@explained
def spherical(name: str, **options: object) -> Joint:
    """A spherical joint (quaternion w, x, y, z)."""
    return _joint(name, "spherical", Z, options)


@explained
def universal(first: str, second: str, axis_1: AxisLike = "x", axis_2: AxisLike = "y") -> tuple[Joint, Joint]:
    """A universal joint: two revolutes with crossing axes in one body."""
    return revolute(first, axis_1), revolute(second, axis_2)


@explained
def floating(name: str) -> tuple[Joint, Joint, Joint, Joint]:
    """Six freedoms in one body: prismatics NAME_x, NAME_y, NAME_z and the spherical NAME_turn."""
    return prismatic(f"{name}_x", X), prismatic(f"{name}_y", Y), prismatic(f"{name}_z", Z), spherical(f"{name}_turn")
