"""The joints by name: revolute, prismatic, spherical, universal, floating."""

from __future__ import annotations

from collections.abc import Sequence

from mechlab.errors import unknown
from mechlab.mechanism.geometry import Vector, unit
from mechlab.mechanism.parts import Joint

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


def revolute(name: str, axis: AxisLike = "z", **options: object) -> Joint:
    """A revolute joint [rad]; options as of `Joint`: zero, range, damping, armature, friction, stiffness, spring_rest."""
    return Joint(name, "revolute", axis_vector(axis, f"joint {name!r}"), **options)  # type: ignore[arg-type]


def prismatic(name: str, axis: AxisLike = "z", **options: object) -> Joint:
    """A prismatic joint [m]; options as of `Joint`."""
    return Joint(name, "prismatic", axis_vector(axis, f"joint {name!r}"), **options)  # type: ignore[arg-type]


def spherical(name: str, **options: object) -> Joint:
    """A spherical joint (quaternion w, x, y, z)."""
    return Joint(name, "spherical", Z, **options)  # type: ignore[arg-type]


def universal(first: str, second: str, axis_1: AxisLike = "x", axis_2: AxisLike = "y") -> tuple[Joint, Joint]:
    """A universal joint: two revolutes with crossing axes in one body."""
    return revolute(first, axis_1), revolute(second, axis_2)


def floating(name: str) -> tuple[Joint, Joint, Joint, Joint]:
    """Six freedoms in one body: prismatics NAME_x, NAME_y, NAME_z and the spherical NAME_turn."""
    return prismatic(f"{name}_x", X), prismatic(f"{name}_y", Y), prismatic(f"{name}_z", Z), spherical(f"{name}_turn")
