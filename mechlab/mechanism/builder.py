"""Building a Mechanism step by step: bodies, loops, meshes; then `build()`, or `assemble(guess)` when it does not close yet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from mechlab.errors import MechlabError, explained, warn
from mechlab.mechanism.assembly import assembled_pose, rebased
from mechlab.mechanism.curve import Curve, CurveRelation
from mechlab.mechanism.editable import Editable
from mechlab.mechanism.gears import GearMesh, relations
from mechlab.mechanism.geometry import IDENTITY, Placement
from mechlab.mechanism.given import Number, many_turns, options_of, point, si
from mechlab.mechanism.inertia import Inertia
from mechlab.mechanism.links import BLUE, plate, uniform_bar
from mechlab.mechanism.loop_frames import loop_frames
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
    as_fraction,
)  # fmt: skip
from mechlab.mechanism.tilt import with_balls
from mechlab.mechanism.tree import depth_first, too_many_bodies
from mechlab.mechanism.validate import OpenMechanism


def _a_joint(joint: object, what: str) -> None:
    if not isinstance(joint, Joint):
        raise MechlabError(f"{what}: expected a joint such as revolute('name'), got {joint!r}.")


@explained
class Builder(Editable):
    """Collects the parts of a mechanism in any order. All placements are those of the reference pose."""

    @classmethod
    def of(cls, mechanism: Mechanism) -> Builder:
        """A Builder that holds the parts of a Mechanism: `build()` gives an equal one, until something is changed."""
        b = cls(mechanism.name, mechanism.gravity, mechanism.summary)
        b.bodies, b.loops, b.shafts = list(mechanism.bodies), list(mechanism.loops), list(mechanism.shafts)
        b.meshes, b.springs, b.drives = list(mechanism.relations), list(mechanism.springs), list(mechanism.drives)
        b.frames, b.ground_shapes = list(mechanism.frames), list(mechanism.ground_shapes)
        b.curves = list(mechanism.curves)
        return b

    # -- parts -------------------------------------------------------------------------------------------------------

    @explained
    def body(
        self,
        name: str,
        *joints: Joint,
        parent: str = GROUND,
        at: Sequence[Number] = (0.0, 0.0, 0.0),
        turned: Placement = IDENTITY,
        inertia: Inertia | None = None,
        shapes: Sequence[Shape] = (),
    ) -> Builder:
        """A body whose frame stands `at` a point of its parent, rotated by `turned`, moving by `joints` in their order."""
        if len(self.bodies) == MAX_BODIES:
            raise too_many_bodies(self.name)
        what = f"{self.name}: body {name!r}"
        for joint in joints:
            _a_joint(joint, what)
        if any(b.name == name for b in self.bodies):
            raise MechlabError(
                f"{what} exists already, names cannot be used more than once: give another name, or use change_body to change it."
            )
        if inertia is not None and not isinstance(inertia, Inertia):
            raise MechlabError(
                f"{what}: inertia: expected an Inertia such as Inertia.box(mass, x, y, z), got {inertia!r}."
            )
        placement = Placement(point(at, f"{what}: at")) @ turned
        self.bodies.append(Body(name, parent, placement, tuple(joints), inertia or Inertia(), tuple(shapes)))
        return self

    @explained
    def bar(
        self,
        name: str,
        joint: Joint,
        length: Number,
        *,
        parent: str = GROUND,
        at: Sequence[Number] = (0.0, 0.0, 0.0),
        mass: Number | None = None,
        width: Number | None = None,
        color: Color = BLUE,
        layer: Number = 0.0,
    ) -> Builder:
        """A straight uniform bar along its local x, from its joint to `length` [m]; mass defaults to 1 kg per metre.

        `layer` [m] lifts its picture along the axis of its joint, so that bars do not cut through each other. Numbers may
        be text with a unit ("100mm").
        """
        what = f"{self.name}: bar {name!r}"
        _a_joint(joint, what)
        long = si(length, f"{what}: length", "m", above=0.0)
        m = None if mass is None else si(mass, f"{what}: mass", "kg", low=0.0)
        w = None if width is None else si(width, f"{what}: width", "m", above=0.0)
        rod, shapes = uniform_bar(name, joint, long, m, w, color, si(layer, f"{what}: layer", "m"))
        return self.body(name, joint, parent=parent, at=at, inertia=rod, shapes=shapes)

    @explained
    def plate(
        self,
        name: str,
        joint: Joint,
        points: Sequence[Sequence[Number]],
        *,
        parent: str = GROUND,
        at: Sequence[Number] = (0.0, 0.0, 0.0),
        mass: Number | None = None,
        density: float | None = None,
        width: Number | None = None,
        thickness: Number | None = None,
        color: Color = BLUE,
        layer: Number = 0.0,
    ) -> Builder:
        """A flat plate with three or more pins (a ternary link): one at its joint, one at each of `points`, (x, y) or
        (x, y, z) [m] in its body, in the plane through the joint at right angles to its axis.

        Its outline is all within `width` / 2 of the convex hull of the pins (width: 12 % of its span by default). mass =
        area x `thickness` (0.4 x width) x `density` (2700 kg/m3) unless `mass` [kg] is given; centre and inertia are those
        of the outline exactly, the bores filled by their pins. Raises MechlabError for points off the plane, points closer
        than the bores, or both mass and density.
        """
        what = f"{self.name}: plate {name!r}"
        _a_joint(joint, what)
        if mass is not None and density is not None:
            raise MechlabError(f"{what}: give its mass or its density, not both.")
        m = None if mass is None else si(mass, f"{what}: mass", "kg", low=0.0)
        rho = None if density is None else si(density, f"{what}: density", "kg/m3", above=0.0)
        w = None if width is None else si(width, f"{what}: width", "m", above=0.0)
        t = None if thickness is None else si(thickness, f"{what}: thickness", "m", above=0.0)
        solid, shapes = plate(name, joint, points, m, rho, w, t, color, si(layer, f"{what}: layer", "m"))
        return self.body(name, joint, parent=parent, at=at, inertia=solid, shapes=shapes)

    @explained
    def frame(
        self, name: str, body: str, at: Sequence[Number] = (0.0, 0.0, 0.0), turned: Placement = IDENTITY
    ) -> Builder:
        """A named point of interest, `at` a point of the body."""
        self.frames.append(Frame(name, body, Placement(point(at, f"frame {name!r}: at")) @ turned))
        return self

    @explained
    def loop(
        self,
        name: str,
        body_a: str,
        body_b: str,
        at_a: Sequence[Number] = (0.0, 0.0, 0.0),
        at_b: Sequence[Number] = (0.0, 0.0, 0.0),
        kind: str = "spherical",
        axis_a: AxisLike | None = None,
        axis_b: AxisLike | None = None,
        length: Number = 0.0,
    ) -> Builder:
        """Close a loop: the point `at_a` of body a meets `at_b` of body b. Joint axes are given in each body's frame: `axis_a` is z where
        it is not given, `axis_b` defaults to `axis_a`. A planar loop closed by "spherical" has one void row, along its normal.

        "universal" has two pins, `axis_a` in body a and `axis_b` in body b, which stay perpendicular: give both, or neither for x of
        body a and y of body b. Raises MechlabError where only one is given.
        """
        what = f"loop {name!r}"
        frame_a, frame_b = loop_frames(kind, what, axis_a, axis_b)
        place_a = Placement.of(frame_a, point(at_a, f"{what}: at_a"))
        place_b = Placement.of(frame_b, point(at_b, f"{what}: at_b"))
        self.loops.append(Loop(name, kind, body_a, body_b, place_a, place_b, si(length, f"{what}: length", "m")))
        return self

    def close_here(self, loop: Loop) -> Builder:
        """Add a Loop that is already complete."""
        self.loops.append(loop)
        return self

    def mesh(self, mesh: GearMesh | LinearRelation) -> Builder:
        """A gear mesh, or any LinearRelation (`belt`, `screw`, `mimic`)."""
        self.meshes.append(mesh)
        return self

    @explained
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
        if isinstance(teeth, str) or not isinstance(teeth, Sequence) or len(teeth) != 2:
            raise MechlabError(f"mesh {name!r}: teeth: expected two tooth counts (of {a!r}, of {b!r}), got {teeth!r}.")
        za, zb = (as_fraction(z, f"mesh {name!r}: teeth") for z in teeth)
        return self.mesh(GearMesh(name, a, b, carrier, kind, (za, zb), side=side))

    def relation(self, name: str, **coefficients: object) -> Builder:
        """A linear relation by its coefficients: sum of c x joint = 0."""
        terms = tuple((n, as_fraction(c, f"relation {name!r}: {n}")) for n, c in coefficients.items())
        self.meshes.append(LinearRelation(name, terms))
        return self

    @explained
    def curve(self, name: str, output: str, input: str, curve: Curve) -> Builder:
        """Couple two joints by a function: value of `output` = curve(value of `input`), physical values [rad or m]."""
        if not isinstance(curve, Curve):
            raise MechlabError(f"curve {name!r}: expected a Curve such as hermite(knots, values, slopes, bends), got {curve!r}.")
        self.curves.append(CurveRelation(name, output, input, curve))
        return self

    def shaft(self, name: str, coefficients: Mapping[str, object], **options: object) -> Builder:
        """A Shaft: coefficients of joints (exact), options as of `Shaft`."""
        options_of(Shaft, options, f"shaft {name!r}", fixed=("name", "coefficients"))
        terms = tuple((n, as_fraction(c, f"shaft {name!r}: {n}")) for n, c in coefficients.items())
        self.shafts.append(Shaft(name, terms, **options))  # type: ignore[arg-type]
        return self

    def spring(self, spring: Spring) -> Builder:
        """A spring and damper between two points."""
        if not isinstance(spring, Spring):
            raise MechlabError(f"{self.name}: expected a Spring(name, body_a, body_b, ...), got {spring!r}.")
        self.springs.append(spring)
        return self

    @explained
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
            "curves": tuple(self.curves),
        }

    def _relations(self, bodies: Sequence[Body]) -> list[LinearRelation]:
        """The relations of all meshes, in their order."""
        meshes = [x for x in self.meshes if isinstance(x, GearMesh)]
        if not meshes:
            return [x for x in self.meshes if not isinstance(x, GearMesh)]
        bare = OpenMechanism(**{**self._parts(bodies, ()), "loops": (), "curves": ()})  # type: ignore[arg-type]
        found = iter(relations(meshes, bare))
        return [next(found) if isinstance(x, GearMesh) else x for x in self.meshes]

    def _open(self, bodies: Sequence[Body]) -> Mechanism:
        return OpenMechanism(**self._parts(bodies, self._relations(bodies)))  # type: ignore[arg-type]

    def balls_for_tilt(self) -> Builder:
        """Give one binary link of every planar loop with a tilted axis a ball joint (see `mechlab.mechanism.tilt`).

        Call it when all parts are there. Raises MechlabError when a tilted loop has no link that could take one.
        """
        named = {d.on for d in self.drives} | {n for s in self.shafts for n, _ in s.coefficients}
        named |= {n for x in self.curves for n in (x.output, x.input)}
        for mesh in self.meshes:
            named |= {n for n, _ in mesh.coefficients} if isinstance(mesh, LinearRelation) else {mesh.a, mesh.b}
        self.bodies = list(with_balls(self.bodies, self.loops, frozenset(named))[0])
        return self

    def opened(self) -> Mechanism:
        """The mechanism as it stands, its loops closed or not: for tools that close it. Its coordinates are 0 there."""
        return self._open(self.bodies)

    def build(self) -> Mechanism:
        """The Mechanism; raises MechlabError when a part is not valid or the reference pose does not close."""
        return Mechanism(**self._parts(self.bodies, self._relations(self.bodies)))  # type: ignore[arg-type]

    def assemble(self, guess: Mapping[str, Number] | None = None, hold: Sequence[str] | str | None = ()) -> Mechanism:
        """The Mechanism, closed by Newton from `guess` (joint name -> change from the placements as given).

        Joints in `hold`, one name or several, keep their guess exactly. Warns of angles that look like degrees. The closed
        pose becomes the reference pose: placements absorb it, and it is added to the `zero` of each joint and shaft. Raises
        MechlabError that names the loop that stays open.
        """
        m = self._open(self.bodies)
        start = {n: si(x, f"{self.name}: guess of {n!r}", "m" if n in m.slides else "rad") for n, x in (guess or {}).items()}
        for text in (many_turns(n, x) for n, x in (guess or {}).items() if n not in m.slides):
            if text:
                warn(f"{self.name}: guess {text}")
        q = assembled_pose(m, start, (hold,) if isinstance(hold, str) else hold or ())
        self.bodies = [rebased(b, m, q) for b in depth_first(self.bodies)]
        self.shafts = [replace(s, zero=float(m.value(s.name, q))) for s in self.shafts]
        return self.build()
