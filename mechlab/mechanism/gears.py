"""Gear meshes, belts, racks and screws as linear relations between joint coordinates.

One primitive: two bodies touch at a pitch point without sliding along a mesh direction; point and direction are fixed
in the carrier, the body that holds both axes. The row is

    direction . (J_a(point) - J_b(point)),

over every joint on the paths to the two gears, so that meshes on moving carriers come out right by construction. It
must be the same at random poses; a mesh whose row changes is not a linear relation and is refused.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache

import numpy as np

from mechlab.errors import MechlabError, explained, unknown
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array, cross
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Coefficients, Joint, LinearRelation, as_fraction

MESH_KINDS = ("external", "internal", "bevel", "rack")


@explained
@dataclass(frozen=True)
class GearMesh:
    """A mesh of the gears that turn with joints `a` and `b`, their axes held by body `carrier`.

    kind: "external", "internal" (a is the ring gear), "bevel" (intersecting axes) or "rack" (a: pinion, a revolute; b:
    rack, a prismatic). `teeth` = (z_a, z_b), or any two numbers in the ratio of the pitch radii; a rack is given by
    `pitch_radius` of the pinion [m]. For a bevel pair `side` = -1 chooses the mesh on the other side of the apex.
    """

    name: str
    a: str
    b: str
    carrier: str
    kind: str = "external"
    teeth: tuple[Fraction | int | float | str, Fraction | int | float | str] = (1, 1)
    pitch_radius: float | str | Fraction = 0
    side: int = 1


@explained
def relation(mesh: GearMesh, mechanism: Mechanism) -> LinearRelation:
    """The exact LinearRelation of a mesh in a mechanism (loops and relations of the mechanism do not matter).

    The coefficient of joint `a` is 1: the reaction is the torque on the gear of joint `a`, also for a rack.
    Raises MechlabError when a name is unknown, the axes do not fit the kind, or the row is not constant.
    """
    return relations([mesh], mechanism)[0]


def relations(meshes: Sequence[GearMesh], mechanism: Mechanism) -> list[LinearRelation]:
    """`relation` of each mesh, over one tree of which only the gears, their carriers and what carries them are moved."""
    gears = _Gears(mechanism, meshes)
    rng = np.random.default_rng(11)
    rows = [gears.rows(q) for q in (mechanism.reference(), *(gears.random_pose(rng) for _ in range(3)))]
    return [
        LinearRelation(mesh.name, _exact(mesh, mechanism, _constant(mesh, mechanism, np.array(found))), mesh.kind)
        for mesh, found in zip(meshes, zip(*rows, strict=True), strict=True)
    ]


class _Gears:
    """The joints and bodies of a mechanism that meshes need, and where the pitch point and the mesh direction stand in the carrier."""

    def __init__(self, mechanism: Mechanism, meshes: Sequence[GearMesh]) -> None:
        self.mechanism, self.meshes = mechanism, meshes
        self.tree = tree = TreeKinematics(mechanism)
        joints = {j.name: (j, b.name) for b in mechanism.bodies for j in b.joints}
        self.bodies: list[tuple[str, str]] = []
        self._pitches: list[tuple[Array, Array]] = []
        for mesh in meshes:
            if mesh.kind not in MESH_KINDS:
                raise unknown(f"mesh {mesh.name!r}: kind", mesh.kind, MESH_KINDS)
            for name in (mesh.a, mesh.b):
                if name not in joints:
                    raise unknown(f"mesh {mesh.name!r}: joint", name, joints)
            if mesh.carrier not in tree.index:
                raise unknown(f"mesh {mesh.name!r}: carrier body", mesh.carrier, tree.index)
            (joint_a, body_a), (joint_b, body_b) = joints[mesh.a], joints[mesh.b]
            rotation, origin = tree.pose(mesh.carrier)
            point, direction = _pitch(mesh, _Axis.of(tree, joint_a), _Axis.of(tree, joint_b))
            self.bodies.append((body_a, body_b))
            self._pitches.append((rotation.T @ (point - origin), rotation.T @ direction))
        self._moved = self._carried([*(mesh.carrier for mesh in meshes), *(x for both in self.bodies for x in both)])

    def rows(self, q: Array) -> list[Array]:
        """(nv,) row of each mesh at a pose q (nq,), 1 at its joint a."""
        tree, out = self.tree.set(q, only=self._moved), []
        for mesh, (a, b), (point, direction) in zip(self.meshes, self.bodies, self._pitches, strict=True):
            r, p = tree.pose(mesh.carrier)
            at, along = p + r @ point, r @ direction
            out.append(self._scaled(mesh, along @ (tree.jacobian(a, at) - tree.jacobian(b, at))[:3]))
        return out

    def _carried(self, bodies: Sequence[str]) -> list[int]:
        """Indices of the bodies and of all that carry them, in rising order."""
        parents = {b.name: b.parent for b in self.mechanism.bodies}
        out: set[int] = set()
        for body in bodies:
            while body != GROUND and self.tree.index[body] not in out:
                out.add(self.tree.index[body])
                body = parents[body]
        return sorted(out)

    def _scaled(self, mesh: GearMesh, row: Array) -> Array:
        k = self.mechanism.v_slice[mesh.a].start
        if abs(row[k]) < 1e-12:
            raise MechlabError(
                f"mesh {mesh.name!r}: joint {mesh.a!r} does not move its pitch point; is the carrier right?"
            )
        return np.asarray(row / row[k])

    def random_pose(self, rng: np.random.Generator) -> Array:
        """(nq,) coordinates anywhere, open or not."""
        q = rng.uniform(-1.0, 1.0, self.mechanism.nq)
        for joint in self.mechanism.joints:
            if joint.kind == "spherical":
                s = self.mechanism.q_slice[joint.name]
                q[s] /= np.linalg.norm(q[s])
        return q


def _constant(mesh: GearMesh, mechanism: Mechanism, rows: Array) -> Array:
    """The first of the rows (poses, nv) of a mesh; raises MechlabError where they differ."""
    change = np.abs(rows - rows[0])
    if change.max() > 1e-9 * np.abs(rows[0]).max():
        worst = mechanism.rate_names[int(np.argmax(change.max(axis=0)))]
        raise MechlabError(
            f"mesh {mesh.name!r}: its ratio is not constant, it changes with joint {worst!r}. "
            f"Do both axes ({mesh.a!r}, {mesh.b!r}) stand fixed in carrier {mesh.carrier!r}?"
        )
    return np.asarray(rows[0])


@dataclass(frozen=True)
class _Axis:
    point: Array
    direction: Array

    @staticmethod
    def of(tree: TreeKinematics, joint: Joint) -> _Axis:
        if joint.kind == "spherical":
            raise MechlabError(f"joint {joint.name!r} is spherical and cannot carry a gear.")
        k = tree.mechanism.v_slice[joint.name].start
        return _Axis(tree.anchors[k].copy(), tree.axes[k].copy())


def _pitch(mesh: GearMesh, a: _Axis, b: _Axis) -> tuple[Array, Array]:
    """Pitch point and mesh direction, in world axes at the reference pose."""
    if mesh.kind == "rack":
        radius = float(as_fraction(mesh.pitch_radius, f"mesh {mesh.name!r}: pitch_radius"))
        if radius <= 0:
            raise MechlabError(f"mesh {mesh.name!r}: a rack needs pitch_radius > 0 of its pinion.")
        side = cross(a.direction, b.direction)
        if abs(np.linalg.norm(side) - 1.0) > 1e-9:
            raise MechlabError(f"mesh {mesh.name!r}: a rack must slide at right angles to the axis of its pinion.")
        return a.point - mesh.side * radius * side, b.direction
    za, zb = (float(as_fraction(z, f"mesh {mesh.name!r}: teeth")) for z in mesh.teeth)
    if za <= 0 or zb <= 0:
        raise MechlabError(f"mesh {mesh.name!r}: tooth counts must be positive, got {mesh.teeth!r}.")
    parallel = float(np.linalg.norm(cross(a.direction, b.direction))) < 1e-9
    if mesh.kind == "bevel":
        if parallel:
            raise MechlabError(f"mesh {mesh.name!r}: the axes of a bevel pair must intersect; these are parallel.")
        return _bevel_pitch(mesh, a, b, za, zb)
    if not parallel:
        raise MechlabError(
            f"mesh {mesh.name!r}: the axes of an {mesh.kind} pair must be parallel (kind 'bevel' is for others)."
        )
    centres = b.point - a.point
    centres = centres - (centres @ a.direction) * a.direction
    distance = float(np.linalg.norm(centres))
    if distance < 1e-12:
        raise MechlabError(f"mesh {mesh.name!r}: the axes of {mesh.a!r} and {mesh.b!r} coincide.")
    if mesh.kind == "internal":
        if za <= zb:
            raise MechlabError(
                f"mesh {mesh.name!r}: the ring gear is joint a and needs more teeth than b, got {mesh.teeth!r}."
            )
        share = za / (za - zb)
    else:
        share = za / (za + zb)
    return a.point + share * centres, cross(a.direction, centres / distance)


def _bevel_pitch(mesh: GearMesh, a: _Axis, b: _Axis, za: float, zb: float) -> tuple[Array, Array]:
    normal = cross(a.direction, b.direction)
    between = b.point - a.point
    sine = float(np.linalg.norm(normal))
    if abs(between @ normal) / sine > 1e-9 * max(1.0, float(np.linalg.norm(between))):
        raise MechlabError(f"mesh {mesh.name!r}: the axes of {mesh.a!r} and {mesh.b!r} do not intersect.")
    s = float(cross(between, b.direction) @ normal) / sine**2
    apex = a.point + s * a.direction
    # The pitch line lies between +a and side * b, at angles whose sines are as the tooth counts.
    along_b = mesh.side * b.direction
    cosine = float(a.direction @ along_b)
    angle = math.atan2(sine, cosine)
    delta = math.atan2(math.sin(angle), zb / za + math.cos(angle))
    across = along_b - cosine * a.direction
    across /= np.linalg.norm(across)
    return apex + math.cos(delta) * a.direction + math.sin(delta) * across, normal / sine


@lru_cache(maxsize=256)
def _candidates(ratio: Fraction) -> tuple[tuple[int, ...], Array]:
    """The numbers i + j x ratio with |i|, |j| <= 3, the small ones first: numerators over the denominator of the ratio, and as floats."""
    over, under = ratio.numerator, ratio.denominator
    exact = tuple(sorted((i * under + j * over for i in range(-3, 4) for j in range(-3, 4)), key=abs))
    return exact, np.array([n / under for n in exact])


def _exact(mesh: GearMesh, mechanism: Mechanism, row: Array) -> Coefficients:
    """The row as fractions: each coefficient is a combination i + j r of the exact ratio r, |i|, |j| <= 3."""
    if mesh.kind == "rack":
        ratio = 1 / as_fraction(mesh.pitch_radius, f"mesh {mesh.name!r}: pitch_radius")
    else:
        za, zb = (as_fraction(z, f"mesh {mesh.name!r}: teeth") for z in mesh.teeth)
        ratio = zb / za
    scale = float(np.max(np.abs(row)))
    candidates, numbers = _candidates(ratio)
    out = []
    for k in np.flatnonzero(np.abs(row) >= 1e-9 * scale).tolist():
        joint, value = mechanism.joint_of_rate[k], float(row[k])
        if joint.kind == "spherical":
            raise MechlabError(f"mesh {mesh.name!r}: the spherical joint {joint.name!r} lies between its gears.")
        best = int(np.argmin(np.abs(numbers - value)))
        if abs(numbers[best] - value) > 1e-8 * scale:
            raise MechlabError(
                f"mesh {mesh.name!r}: the coefficient {value:.9g} of joint {joint.name!r} is no combination of the ratio {ratio}."
            )
        out.append((joint.name, Fraction(candidates[best], ratio.denominator)))
    return tuple(out)


@explained
def belt(name: str, a: str, b: str, radius_a: object, radius_b: object, crossed: bool = False) -> LinearRelation:
    """A belt or chain between two pulleys whose axes stand in the same body: r_a q_a = r_b q_b (crossed: opposite)."""
    ra, rb = as_fraction(radius_a, f"belt {name!r}: radius_a"), as_fraction(radius_b, f"belt {name!r}: radius_b")
    return LinearRelation(name, ((a, Fraction(1)), (b, (1 if crossed else -1) * rb / ra)), "belt")


@explained
def screw(name: str, turn: str, slide: str, pitch: object) -> LinearRelation:
    """A screw: slide = pitch x turn / (2 pi); `pitch` [m per revolution], positive for a right-hand thread.

    The lead per radian is the decimal nearest to pitch / (2 pi).
    """
    lead = Fraction(str(float(as_fraction(pitch, f"screw {name!r}: pitch")) / (2.0 * math.pi)))
    return LinearRelation(name, ((slide, Fraction(1)), (turn, -lead)), "screw")


@explained
def mimic(name: str, follower: str, leader: str, ratio: object) -> LinearRelation:
    """follower = ratio x leader, as URDF's mimic."""
    return LinearRelation(
        name, ((follower, Fraction(1)), (leader, -as_fraction(ratio, f"mimic {name!r}: ratio"))), "mimic"
    )
