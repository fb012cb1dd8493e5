"""Building a Mechanism step by step: bodies, loops, meshes; then `build()`, or `assemble(guess)` when it does not close yet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.mechanism.assembly import close
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.gears import GearMesh, belt, mimic, relation, screw
from mechlab.mechanism.geometry import (
    IDENTITY,
    Array,
    Placement,
    Vector,
    axis_rotation,
    frame_along,
    quaternion_to_matrix,
    unit,
    vector,
)
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import (
    GROUND,
    LOOP_ROWS,
    Body,
    Drive,
    Frame,
    Joint,
    LinearRelation,
    Loop,
    Mechanism,
    Shaft,
    Spring,
    Winding,
    as_fraction,
)
from mechlab.mechanism.shape import Color, Shape, shape
from mechlab.mechanism.tilt import with_balls

AxisLike = str | Sequence[float]
X: Vector = (1.0, 0.0, 0.0)
Y: Vector = (0.0, 1.0, 0.0)
Z: Vector = (0.0, 0.0, 1.0)
PIN: Color = (0.28, 0.31, 0.36, 1.0)


def _axis(axis: AxisLike, what: str) -> Vector:
    if isinstance(axis, str):
        named = {"x": X, "y": Y, "z": Z, "-x": (-1.0, 0.0, 0.0), "-y": (0.0, -1.0, 0.0), "-z": (0.0, 0.0, -1.0)}
        if axis not in named:
            raise unknown(f"{what}: axis", axis, named)
        return named[axis]
    return unit(axis, f"{what}: axis")


def revolute(name: str, axis: AxisLike = "z", **options: object) -> Joint:
    """A revolute joint [rad]; options as of `Joint`: zero, range, damping, armature, friction, stiffness, spring_rest."""
    return Joint(name, "revolute", _axis(axis, f"joint {name!r}"), **options)  # type: ignore[arg-type]


def prismatic(name: str, axis: AxisLike = "z", **options: object) -> Joint:
    """A prismatic joint [m]; options as of `Joint`."""
    return Joint(name, "prismatic", _axis(axis, f"joint {name!r}"), **options)  # type: ignore[arg-type]


def spherical(name: str, **options: object) -> Joint:
    """A spherical joint (quaternion w, x, y, z)."""
    return Joint(name, "spherical", Z, **options)  # type: ignore[arg-type]


def universal(first: str, second: str, axis_1: AxisLike = "x", axis_2: AxisLike = "y") -> tuple[Joint, Joint]:
    """A universal joint: two revolutes with crossing axes in one body."""
    return revolute(first, axis_1), revolute(second, axis_2)


def floating(name: str) -> tuple[Joint, Joint, Joint, Joint]:
    """Six freedoms in one body: prismatics NAME_x, NAME_y, NAME_z and the spherical NAME_turn."""
    return prismatic(f"{name}_x", X), prismatic(f"{name}_y", Y), prismatic(f"{name}_z", Z), spherical(f"{name}_turn")


class _Open(Mechanism):
    """A mechanism under construction: checked in everything but closure."""

    def __post_init__(self) -> None:
        from mechlab.mechanism.validate import validate

        validate(self, closed=False)


class Builder:
    """Collects the parts of a mechanism in any order. All placements are those of the reference pose."""

    def __init__(self, name: str, gravity: Sequence[float] = (0.0, 0.0, -9.81), summary: str = "") -> None:
        self.name = name
        self.gravity = vector(gravity, "gravity")
        self.summary = summary
        self.bodies: list[Body] = []
        self.loops: list[Loop] = []
        self.meshes: list[GearMesh | LinearRelation] = []
        self.shafts: list[Shaft] = []
        self.springs: list[Spring] = []
        self.drives: list[Drive] = []
        self.frames: list[Frame] = []
        self.ground_shapes: list[Shape] = []

    # -- parts -------------------------------------------------------------------------------------------------------

    def body(
        self,
        name: str,
        *joints: Joint,
        parent: str = GROUND,
        at: Sequence[float] = (0.0, 0.0, 0.0),
        turned: Placement = IDENTITY,
        inertia: Inertia | None = None,
        shapes: Sequence[Shape] = (),
    ) -> Builder:
        """A body whose frame stands `at` a point of its parent, rotated by `turned`, moving by `joints` in their order."""
        placement = Placement(vector(at, f"body {name!r}: at")) @ turned
        self.bodies.append(Body(name, parent, placement, tuple(joints), inertia or Inertia(), tuple(shapes)))
        return self

    def bar(
        self,
        name: str,
        joint: Joint,
        length: float,
        *,
        parent: str = GROUND,
        at: Sequence[float] = (0.0, 0.0, 0.0),
        mass: float | None = None,
        width: float | None = None,
        color: Color = (0.25, 0.45, 0.75, 1.0),
        layer: float = 0.0,
    ) -> Builder:
        """A straight uniform bar along its local x, from its joint to `length` [m]; mass defaults to 1 kg per metre.

        `layer` [m] lifts its picture along the axis of its joint, so that bars do not cut through each other.
        """
        if not np.isfinite(length) or length <= 0:
            raise MechlabError(f"{self.name}: bar {name!r}: length must be positive, got {length!r} m.")
        w = 0.08 * length if width is None else width
        m = length if mass is None else mass
        axis = np.array(joint.axis) if joint.kind == "revolute" and abs(joint.axis[0]) < 0.5 else np.array(Z)
        facing = np.column_stack([np.array(X), np.cross(axis, X), axis])
        place = Placement.of(facing, layer * axis)
        looks = shape("link", place, color, name, length=length, width=w, thickness=0.4 * w, bore=0.18 * w)
        ends = (layer * axis, layer * axis + np.array([length, 0.0, 0.0]))
        pins = [
            shape("cylinder", Placement.of(facing, p), PIN, f"pin_{k}", radius=0.18 * w, length=0.9 * w)
            for k, p in enumerate(ends)
        ]
        rod = Inertia.rod(m, (0.0, 0.0, 0.0), (length, 0.0, 0.0), w / 4)
        return self.body(name, joint, parent=parent, at=at, inertia=rod, shapes=[looks, *pins])

    def frame(
        self, name: str, body: str, at: Sequence[float] = (0.0, 0.0, 0.0), turned: Placement = IDENTITY
    ) -> Builder:
        """A named point of interest, `at` a point of the body."""
        self.frames.append(Frame(name, body, Placement(vector(at, f"frame {name!r}: at")) @ turned))
        return self

    def loop(
        self,
        name: str,
        body_a: str,
        body_b: str,
        at_a: Sequence[float] = (0.0, 0.0, 0.0),
        at_b: Sequence[float] = (0.0, 0.0, 0.0),
        kind: str = "spherical",
        axis_a: AxisLike = "z",
        axis_b: AxisLike | None = None,
        length: float = 0.0,
    ) -> Builder:
        """Close a loop: the point `at_a` of body a meets `at_b` of body b. Joint axes are given in each body's frame;
        `axis_b` defaults to `axis_a`. A planar loop closed by "spherical" has one void row, along its normal."""
        what = f"loop {name!r}"
        frame_a = frame_along(_axis(axis_a, what))
        frame_b = frame_along(_axis(axis_a if axis_b is None else axis_b, what))
        if kind in ("spherical", "distance") or axis_a == "z":
            frame_a = np.eye(3)
        if kind in ("spherical", "distance") or (axis_b or axis_a) == "z":
            frame_b = np.eye(3)
        self.loops.append(
            Loop(name, kind, body_a, body_b, Placement.of(frame_a, at_a), Placement.of(frame_b, at_b), length)
        )
        return self

    def close_here(self, loop: Loop) -> Builder:
        """Add a Loop that is already complete."""
        self.loops.append(loop)
        return self

    def mesh(self, mesh: GearMesh | LinearRelation) -> Builder:
        """A gear mesh, or any LinearRelation (`belt`, `screw`, `mimic`)."""
        self.meshes.append(mesh)
        return self

    def gears(
        self,
        name: str,
        a: str,
        b: str,
        teeth: tuple[object, object],
        carrier: str = GROUND,
        kind: str = "external",
        side: int = 1,
    ) -> Builder:
        """A gear mesh between the joints `a` and `b`, axes held by `carrier`: see `GearMesh`."""
        za, zb = (as_fraction(z, f"mesh {name!r}: teeth") for z in teeth)
        return self.mesh(GearMesh(name, a, b, carrier, kind, (za, zb), side=side))

    def relation(self, name: str, **coefficients: object) -> Builder:
        """A linear relation by its coefficients: sum of c x joint = 0."""
        terms = tuple((n, as_fraction(c, f"relation {name!r}: {n}")) for n, c in coefficients.items())
        self.meshes.append(LinearRelation(name, terms))
        return self

    def shaft(self, name: str, coefficients: Mapping[str, object], **options: object) -> Builder:
        """A Shaft: coefficients of joints (exact), options as of `Shaft`."""
        terms = tuple((n, as_fraction(c, f"shaft {name!r}: {n}")) for n, c in coefficients.items())
        self.shafts.append(Shaft(name, terms, **options))  # type: ignore[arg-type]
        return self

    def spring(self, spring: Spring) -> Builder:
        """A spring and damper between two points."""
        self.springs.append(spring)
        return self

    def drive(
        self,
        on: str,
        stiffness: float = 0.0,
        damping: float = 0.0,
        limit: float | None = None,
        name: str | None = None,
        winding: Winding | None = None,
    ) -> Builder:
        """An actuator on a joint or shaft; its name defaults to that of the joint."""
        self.drives.append(Drive(name or on, on, stiffness, damping, limit, winding))
        return self

    def ground(self, *shapes: Shape) -> Builder:
        """Shapes that stand still."""
        self.ground_shapes += shapes
        return self

    # -- the result --------------------------------------------------------------------------------------------------

    def _parts(self, bodies: Sequence[Body], relations: Sequence[LinearRelation]) -> dict[str, object]:
        return {
            "name": self.name,
            "bodies": depth_first(bodies),
            "loops": tuple(self.loops),
            "relations": tuple(relations),
            "shafts": tuple(self.shafts),
            "springs": tuple(self.springs),
            "drives": tuple(self.drives),
            "frames": tuple(self.frames),
            "gravity": self.gravity,
            "ground_shapes": tuple(self.ground_shapes),
            "summary": self.summary,
        }

    def _open(self, bodies: Sequence[Body]) -> Mechanism:
        bare = _Open(**{**self._parts(bodies, ()), "loops": ()})  # type: ignore[arg-type]
        relations = [relation(x, bare) if isinstance(x, GearMesh) else x for x in self.meshes]
        return _Open(**self._parts(bodies, relations))  # type: ignore[arg-type]

    def balls_for_tilt(self) -> Builder:
        """Give one binary link of every planar loop with a tilted axis a ball joint (see `mechlab.mechanism.tilt`).

        Call it when all parts are there. Raises MechlabError when a tilted loop has no link that could take one.
        """
        named = {d.on for d in self.drives} | {n for s in self.shafts for n, _ in s.coefficients}
        for mesh in self.meshes:
            named |= {n for n, _ in mesh.coefficients} if isinstance(mesh, LinearRelation) else {mesh.a, mesh.b}
        self.bodies = list(with_balls(self.bodies, self.loops, frozenset(named))[0])
        return self

    def build(self) -> Mechanism:
        """The Mechanism; raises MechlabError when anything is not sound or the reference pose does not close."""
        m = self._open(self.bodies)
        return Mechanism(**self._parts(self.bodies, m.relations))  # type: ignore[arg-type]

    def assemble(self, guess: Mapping[str, float] | None = None, hold: Sequence[str] = ()) -> Mechanism:
        """The Mechanism, closed by Newton from `guess` (joint name -> value away from the placements as given).

        Joints in `hold` keep their guess exactly. The closed pose becomes the reference pose: placements absorb it, and
        it is added to the `zero` of each joint and shaft. Raises MechlabError that names the loop that stays open.
        """
        m = self._open(self.bodies)
        q = m.reference()
        for name, value in (guess or {}).items():
            m.joint(name)
            start = m.q_slice[name].start
            if m.joint(name).kind == "spherical":  # a ball joint for a tilt: the guess turns about the axis it had
                turn = np.array(m.joint(name).axis) * np.sin(0.5 * float(value))
                q[start : start + 4] = [np.cos(0.5 * float(value)), *turn]
            else:
                q[start] = float(value)
        zeros = {n: m.zero(n) for n in hold}
        found = close(m, q, {n: zeros[n] + q[m.q_slice[n].start] for n in hold})
        if not found.closed:
            constraints = ConstraintSet(m)
            residual = constraints.residual(TreeKinematics(m, found.q))
            loops = sum(LOOP_ROWS[x.kind] for x in m.loops)  # a loop that cannot meet also keeps relations open
            worst = int(np.argmax(np.abs(residual[: loops or None])))
            raise MechlabError(
                f"{self.name}: it does not close: {constraints.rows[worst]} stays open by {abs(residual[worst]):.3g} "
                f"({found.status.value}). Are the lengths long enough to meet? Is the guess near the mode you want?"
            )
        bodies = [_rebase(b, m, found.q) for b in depth_first(self.bodies)]
        self.bodies = bodies
        self.shafts = [replace(s, zero=float(m.value(s.name, found.q))) for s in self.shafts]
        return self.build()


def _rebase(body: Body, m: Mechanism, q: Array) -> Body:
    """The same body with its coordinates q taken into the placement, so that they become zero."""
    turn, shift = np.eye(3), np.zeros(3)
    moves: list[Array] = []
    for joint in body.joints:
        x = q[m.q_slice[joint.name]]
        if joint.kind == "prismatic":
            if x[0] != 0.0 and not np.allclose(turn, np.eye(3)):
                raise MechlabError(
                    f"body {body.name!r}: joint {joint.name!r} slides after a turn; put it into a body of its own."
                )
            shift = shift + np.array(joint.axis) * x[0]
            moves.append(np.eye(3))
        else:
            r = axis_rotation(joint.axis, x[0]) if joint.kind == "revolute" else quaternion_to_matrix(x)
            turn = turn @ r
            moves.append(r)
    joints = []
    for k, joint in enumerate(body.joints):
        after = np.eye(3)
        for r in moves[k + 1 :]:
            after = after @ r
        axis = joint.axis if np.array_equal(after, np.eye(3)) else unit(after.T @ np.array(joint.axis), "axis")
        moved = float(q[m.q_slice[joint.name].start]) if joint.nv == 1 else 0.0
        joints.append(replace(joint, axis=axis, zero=joint.zero + moved))
    placement = body.placement
    if np.any(shift) or not np.array_equal(turn, np.eye(3)):
        placement = placement @ Placement.of(turn, shift)
    return replace(body, placement=placement, joints=tuple(joints))


def depth_first(bodies: Sequence[Body]) -> tuple[Body, ...]:
    """The bodies sorted so that each follows its parent depth-first; siblings keep their order.

    Raises MechlabError for a parent that does not exist or a cycle.
    """
    names = {b.name for b in bodies}
    children: dict[str, list[Body]] = {}
    for body in bodies:
        if body.parent != GROUND and body.parent not in names:
            raise unknown(f"parent of body {body.name!r}:", body.parent, names | {GROUND})
        children.setdefault(body.parent, []).append(body)
    out: list[Body] = []
    stack = list(reversed(children.get(GROUND, [])))
    while stack:
        body = stack.pop()
        out.append(body)
        stack += reversed(children.get(body.name, []))
    if len(out) != len(bodies):
        lost = sorted({b.name for b in bodies} - {b.name for b in out}) or ["a body used twice"]
        raise MechlabError(f"the parents of {', '.join(lost)} form a cycle, or a name is used twice.")
    return tuple(out)


__all__ = [
    "Builder", "belt", "depth_first", "floating", "mimic", "prismatic", "revolute", "screw", "spherical", "universal",
]  # fmt: skip
