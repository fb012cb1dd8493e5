"""Building a spatial mechanism from points and axes of the world in its reference pose.

    w = InWorld("bennett")
    w.link("first", revolute("theta", axis), at=p0, to=[p1])              # hinge at p0, rod to p1
    w.link("second", revolute("hinge", axis_1), at=p1, to=[p2], parent="first")
    w.close("last", "second", GROUND, at=p2, kind="revolute", axis=axis_2)
    m = w.build()

In the reference pose all bodies have the axes of the world, so that every axis and point is given as one sees it there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from mechlab.kit.palette import BLUE, BRASS, DARK, GOLD, ORANGE, ROSE, SLATE, STEEL, TEAL
from mechlab.mechanism import Builder, Inertia, Placement, revolute, shape
from mechlab.mechanism.geometry import Array, Vector
from mechlab.mechanism.parts import GROUND, Color, Joint, Shape

COLORS = (BLUE, ORANGE, TEAL, ROSE, GOLD, STEEL)
DENSITY, STEEL_DENSITY = 1.0, 7800.0
"""Mass per length of rods [kg/m]; density of wheels and balls [kg/m3]."""


class InWorld(Builder):
    """A Builder whose links are given by world points of the reference pose. thick [m]: diameter of rods and size of joints."""

    def __init__(self, name: str, thick: float = 0.01, gravity: Vector = (0.0, 0.0, -9.81), summary: str = "") -> None:
        super().__init__(name, gravity=gravity, summary=summary)
        self.thick = thick
        self.origins: dict[str, Array] = {GROUND: np.zeros(3)}

    def link(
        self, name: str, *joints: Joint, at: ArrayLike, to: Sequence[ArrayLike] = (), parent: str = GROUND,
        mass_per_length: float = DENSITY, more: Inertia | None = None, color: Color | None = None,
        shapes: Sequence[Shape] = (), wheel: tuple[float, float, int] | None = None, ball: float = 0.0,
    ) -> InWorld:  # fmt: skip
        """A body whose joints act at the world point `at` (3,) [m]: uniform round rods from there to each point of `to`. more: an
        inertia in its axes beside that of the rods; shapes: drawn beside the rods, in its axes. wheel: radius, width [m] and teeth of a
        wheel about its last joint; ball: mass [kg] of a steel ball at the first point of `to`."""
        origin = np.asarray(at, dtype=float)
        tint = color or COLORS[len(self.bodies) % len(COLORS)]
        solid, looks = more or Inertia(), list(shapes)
        for k, point in enumerate(to):
            tip = np.asarray(point, dtype=float) - origin
            rod = Inertia.rod(mass_per_length * float(np.linalg.norm(tip)), (0.0, 0.0, 0.0), _v(tip), 0.5 * self.thick)
            solid = solid + rod
            looks.append(between((0, 0, 0), tip, 0.5 * self.thick, tint, f"rod_{k}"))
        if wheel:
            radius, width, teeth = wheel
            solid = solid + Inertia.cylinder(STEEL_DENSITY * math.pi * radius**2 * width, radius, width, joints[-1].axis)
            turn = Placement.of(_across(np.asarray(joints[-1].axis)), (0.0, 0.0, 0.0))
            size = {"teeth": teeth, "module": 2 * radius / teeth, "width": width, "bore": 0.3 * radius}
            looks.append(shape("spur_gear", turn, BRASS, "teeth", **size))
        if ball:
            tip, radius = _v(np.asarray(to[0], dtype=float) - origin), (0.75 * ball / (math.pi * STEEL_DENSITY)) ** (1 / 3)
            solid = solid + Inertia.axial(ball, 0.4 * ball * radius**2, 0.4 * ball * radius**2).at(tip)
            looks.append(shape("sphere", Placement(tip), STEEL, "ball", radius=radius))
        looks += [self._pin(j) for j in joints]
        self.origins[name] = origin
        self.body(name, *joints, parent=parent, at=_v(origin - self.origins[parent]), inertia=solid, shapes=looks)
        return self

    def close(
        self, name: str, a: str, b: str, at: ArrayLike, kind: str = "spherical", axis: ArrayLike = (0.0, 0.0, 1.0)
    ) -> InWorld:
        """A loop between two bodies at a world point, its axis in the world."""
        point, direction = np.asarray(at, dtype=float), _v(np.asarray(axis, dtype=float))
        self.loop(name, a, b, _v(point - self.origins[a]), _v(point - self.origins[b]), kind, direction)
        return self

    def mark(self, name: str, body: str, at: ArrayLike) -> InWorld:
        """A named point of a body, at a world point."""
        self.frame(name, body, _v(np.asarray(at, dtype=float) - self.origins[body]))
        return self

    def ring(self, steps: Sequence[tuple[float, float, float, float]], middle: int = 0, stiffness: float = 0.0) -> InWorld:
        """A closed loop of hinges by Denavit-Hartenberg steps as of `hinges`, the last link the ground. Joints theta_1, theta_2, ... have
        the angles of the steps; the loop is closed at hinge `middle`, by default the one before half of them, which has no angle.
        stiffness [N m/rad] of a spring in every hinge, at rest as it is built; then that hinge has an angle too."""
        n = len(steps)
        middle, (points, axes) = middle or (n + 1) // 2, hinges(steps)
        reach = 4.0 * self.thick

        def ends(a: int, b: int) -> list[Array]:
            """A rod from hinge a to hinge b, or where they meet a corner along both axes."""
            straight = np.linalg.norm(points[b] - points[a]) > 1e-9
            return [points[b]] if straight else [points[a] + reach * axes[a], points[b] + reach * axes[b]]

        def hinge(k: int, axis: Array) -> Joint:
            angle = steps[k][3]
            return revolute(f"theta_{k + 1}", axis.tolist(), zero=angle, stiffness=stiffness, spring_rest=angle if stiffness else 0.0)

        for point in ends(n - 1, 0):
            self.stand(points[-1], point)
        for k in range(middle - 1):  # links that hang on hinge 1
            self.link(f"link_{k + 1}", hinge(k, axes[k]), at=points[k], to=ends(k, k + 1), parent=f"link_{k}" if k else GROUND)
        for k in range(n - 1, middle - 1, -1):  # links that hang on the last hinge, where the link before turns backwards
            self.link(f"link_{k}", hinge(k, -axes[k]), at=points[k], to=ends(k, k - 1), parent=f"link_{k + 1}" if k < n - 1 else GROUND)
        last, place, axis = f"link_{middle - 1}", points[middle - 1], axes[middle - 1]
        if stiffness:  # the end of the next link as a part of its own, in a hinge with a spring
            self.link("end", hinge(middle - 1, axis), at=place, to=[0.9 * place + 0.1 * points[middle]], parent=last)
        self._draw(f"link_{middle}", self._pin(revolute("closing", axis.tolist())), place)
        self.close("hinge", "end" if stiffness else last, f"link_{middle}", place, "fixed" if stiffness else "revolute", axis)
        return self.drive("theta_1", stiffness=20.0, damping=0.2)  # type: ignore[return-value]

    def stand(self, a: ArrayLike, b: ArrayLike) -> InWorld:
        """A rod of the ground between two world points, to be seen."""
        self.ground(between(a, b, 0.6 * self.thick, SLATE, "stand"))
        return self

    def _draw(self, body: str, looks: Shape, at: Array) -> None:
        """A part of a body that is seen at a world point."""
        k = next(i for i, b in enumerate(self.bodies) if b.name == body)
        there = Placement(_v(at - self.origins[body])) @ looks.placement
        self.bodies[k] = replace(self.bodies[k], shapes=(*self.bodies[k].shapes, replace(looks, placement=there)))

    def _pin(self, joint: Joint) -> Shape:
        if joint.kind == "spherical":
            return shape("sphere", color=DARK, name="ball", radius=0.9 * self.thick)
        turn = _across(np.asarray(joint.axis))
        wide = self.thick if joint.kind == "revolute" else 0.7 * self.thick
        return shape("cylinder", Placement.of(turn, (0.0, 0.0, 0.0)), DARK, f"pin_{joint.name}", radius=0.7 * wide, length=3 * wide)


def hinges(steps: Sequence[tuple[float, float, float, float]]) -> tuple[list[Array], list[Array]]:
    """Points (3,) and axes (3,) of the hinges of a chain by Denavit-Hartenberg steps (length, twist, offset, angle) from the origin,
    its first axis z: turn by the angle and shift by the offset along z, then shift by the length and turn by the twist about x."""
    frame, points, axes = np.eye(4), list[Array](), list[Array]()
    for length, twist, offset, turn in steps:
        points.append(frame[:3, 3])
        axes.append(frame[:3, 2])
        c, s, ct, st = math.cos(turn), math.sin(turn), math.cos(twist), math.sin(twist)
        frame = frame @ np.array(
            [[c, -s * ct, s * st, length * c], [s, c * ct, -c * st, length * s], [0.0, st, ct, offset], [0.0, 0.0, 0.0, 1.0]]
        )
    return points, axes


def between(a: ArrayLike, b: ArrayLike, radius: float, color: Color, name: str) -> Shape:
    """A round rod from a to b (3,) [m]."""
    p, q = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    length = float(np.linalg.norm(q - p))
    place = Placement.of(_across((q - p) / length), _v(0.5 * (p + q)))
    return shape("cylinder", place, color, name, radius=radius, length=length)


def across(direction: ArrayLike, hint: ArrayLike = (0.0, 0.0, 1.0)) -> tuple[Vector, Vector]:
    """Two unit vectors at right angles to a direction and to each other, the first at right angles to the hint as well."""
    d = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    first = np.cross(np.asarray(hint, dtype=float), d)
    if np.linalg.norm(first) < 1e-6:
        first = np.cross((1.0, 0.0, 0.0), d)
    first = first / np.linalg.norm(first)
    return _v(first), _v(np.cross(d, first))


def _across(direction: Array) -> Array:
    """(3, 3) axes of a round part whose z is the direction: the same ones whatever its last bits are on this processor."""
    z = np.where(np.abs(direction) < 1e-12, 0.0, direction)
    z = z / np.linalg.norm(z)
    x = np.cross(np.eye(3)[int(np.argmin(np.round(np.abs(z), 9)))], z)
    x /= np.linalg.norm(x)
    out = np.column_stack([x, np.cross(z, x), z])
    return np.where(np.abs(out) < 1e-14, 0.0, out)


def _v(x: Array) -> Vector:
    return float(x[0]), float(x[1]), float(x[2])
