"""Building a Mechanism step by step: bodies, loops, meshes; then `build()`, or `assemble(guess)` when it does not close
yet.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism.assembly import assembled_pose, rebased
from mechlab.mechanism.gears import GearMesh, relation
from mechlab.mechanism.geometry import IDENTITY, Placement, frame_along, vector
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import (
    GROUND,
    MAX_BODIES,
    AxisLike,
    Body,
    Color,
    Drive,
    Frame,
    Joint,
    LinearRelation,
    Loop,
    Shaft,
    Shape,
    Spring,
    Winding,
    X,
    Z,
    as_fraction,
    axis_vector,
    shape,
)
from mechlab.mechanism.tilt import with_balls
from mechlab.mechanism.tree import depth_first, too_many_bodies
from mechlab.mechanism.validate import validate

PIN: Color = (0.28, 0.31, 0.36, 1.0)


def uniform_bar(
    name: str, joint: Joint, length: float, mass: float | None, width: float | None, color: Color, layer: float
) -> tuple[Inertia, tuple[Shape, ...]]:
    """Inertia and shapes of the bar along its local x, from its joint to `length` [m]; see `Builder.bar`."""
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
    return rod, (looks, *pins)


class _Open(Mechanism):
    """A mechanism under construction: checked in everything but closure."""

    def __post_init__(self) -> None:
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
        if len(self.bodies) == MAX_BODIES:
            raise too_many_bodies(self.name)
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
        rod, shapes = uniform_bar(name, joint, length, mass, width, color, layer)
        return self.body(name, joint, parent=parent, at=at, inertia=rod, shapes=shapes)

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
        frame_a = frame_along(axis_vector(axis_a, what))
        frame_b = frame_along(axis_vector(axis_a if axis_b is None else axis_b, what))
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
        target: float | None = None,
    ) -> Builder:
        """An actuator on a joint or shaft; its name defaults to that of the joint. `target`: see `Drive`."""
        self.drives.append(Drive(name or on, on, stiffness, damping, limit, winding, target))
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

    def opened(self) -> Mechanism:
        """The mechanism as it stands, its loops closed or not: for tools that close it. Its coordinates are 0 there."""
        return self._open(self.bodies)

    def build(self) -> Mechanism:
        """The Mechanism; raises MechlabError when a part is not valid or the reference pose does not close."""
        m = self._open(self.bodies)
        return Mechanism(**self._parts(self.bodies, m.relations))  # type: ignore[arg-type]

    def assemble(self, guess: Mapping[str, float] | None = None, hold: Sequence[str] = ()) -> Mechanism:
        """The Mechanism, closed by Newton from `guess` (joint name -> change from the placements as given).

        Joints in `hold` keep their guess exactly. The closed pose becomes the reference pose: placements absorb it, and
        it is added to the `zero` of each joint and shaft. Raises MechlabError that names the loop that stays open.
        """
        m = self._open(self.bodies)
        q = assembled_pose(m, guess or {}, hold)
        self.bodies = [rebased(b, m, q) for b in depth_first(self.bodies)]
        self.shafts = [replace(s, zero=float(m.value(s.name, q))) for s in self.shafts]
        return self.build()
