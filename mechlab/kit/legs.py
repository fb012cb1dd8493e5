"""Platforms of parallel robots and their legs, from points of the world in the reference pose."""

from __future__ import annotations

from collections.abc import Sequence

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
