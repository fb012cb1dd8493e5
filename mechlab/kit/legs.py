"""Platforms of parallel robots and their legs, from points of the world in the reference pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from mechlab.kit.in_world import InWorld, across
from mechlab.mechanism import Inertia, prismatic, revolute
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.parts import GROUND, Joint

SLIDES = ("x", "y", "z")
TURNS = ("roll", "pitch", "yaw")


def free_joints(name: str, which: Sequence[str] = (*SLIDES, *TURNS)) -> list[Joint]:
    """Joints NAME_x, _y, _z [m] and NAME_roll, _pitch, _yaw [rad] of a platform in the world: slides first, then turns about the moved
    axes x, y, z in this order."""
    axes = dict(zip(TURNS, "xyz", strict=True))
    return [prismatic(f"{name}_{n}", n) if n in SLIDES else revolute(f"{name}_{n}", axes[n]) for n in which]


def platform(
    w: InWorld, name: str, at: ArrayLike, joints: Sequence[ArrayLike], mass: float = 1.0, free: Sequence[str] = (*SLIDES, *TURNS)
) -> None:
    """A platform with its origin at a world point, rods to its joints (world points), free in the named directions."""
    points = [np.asarray(p, dtype=float) for p in joints]
    size = max(float(np.linalg.norm(p - np.asarray(at))) for p in points)
    w.link(name, *free_joints(name, free), at=at, to=points, more=Inertia.cylinder(mass, size, 0.05 * size))


def rod(w: InWorld, name: str, a: ArrayLike, b: ArrayLike, parent: str, end: str) -> None:
    """A rod from a to b (world points): a universal joint at a on its parent, a ball at b on the body `end`."""
    first, second = across(np.asarray(b) - np.asarray(a))
    w.link(name, revolute(f"{name}_a", first), revolute(f"{name}_b", second), at=a, to=[b], parent=parent)
    w.close(f"{name}_ball", name, end, b)


def arm_to(pivot: ArrayLike, out: ArrayLike, joint: ArrayLike, arm: float, length: float, side: int = -1) -> tuple[float, Array]:
    """Angle t [rad] and elbow pivot + arm (cos t out + sin t z) of an arm whose rod of this length reaches the joint: the circle meets the
    sphere where d.out cos t + d.z sin t = (d2 + arm2 - length2) / (2 arm), d from pivot to joint; `side` -1 or +1 of the two."""
    start, way = np.asarray(pivot, dtype=float), np.asarray(out, dtype=float)
    d = np.asarray(joint, dtype=float) - start
    u, v = float(d @ way), float(d[2])
    t = float(np.arctan2(v, u) + side * np.arccos((d @ d + arm**2 - length**2) / (2.0 * arm * np.hypot(u, v))))
    return t, start + arm * (np.cos(t) * way + np.array([0.0, 0.0, np.sin(t)]))


def crank(w: InWorld, name: str, joint: str, pivot: ArrayLike, out: ArrayLike, angle: float, *to: ArrayLike) -> None:
    """A driven arm from its pivot to points, in the upright plane of the direction `out`, at an angle [rad] above it, as of `arm_to`."""
    x, y, _ = (float(v) for v in np.asarray(out, dtype=float))
    w.link(name, revolute(joint, (y, -x, 0.0), zero=angle), at=pivot, to=to).drive(joint, stiffness=200.0, damping=2.0)


def telescope(w: InWorld, k: int | str, a: ArrayLike, b: ArrayLike, end: str, parent: str = GROUND) -> None:
    """Leg UPS from a to b: universal joint, slide length_K (its value is the length), ball on the body `end`; driven."""
    begin, way = np.asarray(a, dtype=float), np.asarray(b, dtype=float) - np.asarray(a, dtype=float)
    length = float(np.linalg.norm(way))
    first, second = across(way)
    w.link(f"leg_{k}", revolute(f"leg_{k}_a", first), revolute(f"leg_{k}_b", second), at=begin, to=[begin + 0.55 * way], parent=parent)
    slide = prismatic(f"length_{k}", (way / length).tolist(), zero=length)
    w.link(f"rod_{k}", slide, at=begin + way, to=[begin + 0.5 * way], parent=f"leg_{k}")
    w.close(f"ball_{k}", f"rod_{k}", end, begin + way).drive(f"length_{k}", stiffness=2e4, damping=200.0)


def circle(radius: float, turns: Sequence[float], height: float = 0.0) -> list[Array]:
    """Points on a circle about z at the angles [rad]."""
    return [np.array([radius * np.cos(t), radius * np.sin(t), height]) for t in turns]


def thirds(offset: float = 0.0) -> tuple[float, float, float]:
    """Three angles a third of a turn apart."""
    return offset, offset + 2 * np.pi / 3, offset + 4 * np.pi / 3


def turned(roll: float, pitch: float, yaw: float = 0.0) -> Array:
    """(3, 3) Rx(roll) Ry(pitch) Rz(yaw): the rotation of a platform with these joints."""
    (a, b), (c, d), (e, f) = ((np.cos(t), np.sin(t)) for t in (roll, pitch, yaw))
    x, y = np.array([[1, 0, 0], [0, a, -b], [0, b, a]]), np.array([[c, 0, d], [0, 1, 0], [-d, 0, c]])
    return x @ y @ np.array([[e, -f, 0], [f, e, 0], [0, 0, 1]])


def to(name: str, *end: float) -> dict[str, tuple[float, float]]:
    """The path of a platform NAME from rest to x, y, z [m], roll, pitch, yaw [rad], or the first of them."""
    return {f"{name}_{n}": (0.0, x) for n, x in zip((*SLIDES, *TURNS), end, strict=False)}


def posed(name: str, at: Mapping[str, float], rest: ArrayLike = (0.0, 0.0, 0.0)) -> tuple[Array, Array]:
    """Place (3,) and rotation (3, 3) of a platform NAME with joints as of `free_joints` at these values, 0 for those that are not given."""
    x, y, z, roll, pitch, yaw = (at.get(f"{name}_{n}", 0.0) for n in (*SLIDES, *TURNS))
    return np.asarray(rest, dtype=float) + [x, y, z], turned(roll, pitch, yaw)
