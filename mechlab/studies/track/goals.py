"""A task at one time: what is missing, and its rows over the rates. One class for each kind of target."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from mechlab.engines.protocol import StatePlant
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array, axis_rotation, rotation_log

CENTRE = "center_of_mass_of_"
"""Frames at the centres of mass of the bodies, for the task of the centre of mass."""


@dataclass(frozen=True, eq=False)
class Goal(ABC):
    """Something that shall have `samples` (n, ...) at the times of the path. Lengths in the unit of the `Closed`.

    name: as it is reported; unit: "m" or "rad"; tolerance in that unit (SI).
    """

    name: str
    samples: Array
    priority: int
    weight: float
    tolerance: float
    unit: str

    @abstractmethod
    def value(self, plant: StatePlant) -> Array:
        """The present value, shaped as one of the samples."""

    @abstractmethod
    def rows(self, plant: StatePlant) -> Array:
        """(k, nv) rate of what is missing, with opposite sign."""

    def missing(self, value: Array, target: Array) -> Array:
        """(k,) from the value to the target."""
        return np.atleast_1d(target - value)

    def blend(self, a: Array, b: Array, s: float) -> Array:
        """The target at the share s of the way from a to b."""
        return a + s * (b - a)


@dataclass(frozen=True, eq=False)
class PositionGoal(Goal):
    """Coordinates `axes` of the origin of a frame."""

    frame: str
    axes: tuple[int, ...]

    def value(self, plant: StatePlant) -> Array:
        """(axes,) of the origin."""
        return plant.point(self.frame)[list(self.axes)]

    def rows(self, plant: StatePlant) -> Array:
        """(axes, nv)."""
        return plant.point_jacobian(self.frame)[list(self.axes)]


@dataclass(frozen=True, eq=False)
class RotationGoal(Goal):
    """The rotation (3, 3) of a frame, its axes to the world; missing is the rotation vector in world axes."""

    frame: str

    def value(self, plant: StatePlant) -> Array:
        """(3, 3)."""
        place = plant.mechanism.frame(self.frame)
        return np.asarray(plant.pose(place.body)[0] @ place.placement.rotation)

    def rows(self, plant: StatePlant) -> Array:
        """(3, nv)."""
        return plant.point_jacobian(self.frame)[3:]

    def missing(self, value: Array, target: Array) -> Array:
        """(3,) rotation vector [rad]."""
        return rotation_log(target @ value.T)

    def blend(self, a: Array, b: Array, s: float) -> Array:
        """Turned by the share s about the one axis from a to b."""
        turn = rotation_log(b @ a.T)
        angle = float(np.linalg.norm(turn))
        return a if angle < 1e-15 else axis_rotation(turn / angle, s * angle) @ a


@dataclass(frozen=True, eq=False)
class ValueGoal(Goal):
    """The physical value of a joint or shaft."""

    of: str

    def value(self, plant: StatePlant) -> Array:
        """()."""
        return np.asarray(plant.value(self.of))

    def rows(self, plant: StatePlant) -> Array:
        """(1, nv)."""
        return plant.mechanism.row(self.of)[None]


@dataclass(frozen=True, eq=False)
class CenterGoal(Goal):
    """Coordinates `axes` of the centre of mass of all bodies; masses: body -> mass."""

    axes: tuple[int, ...]
    masses: tuple[tuple[str, float], ...]

    def value(self, plant: StatePlant) -> Array:
        """(axes,)."""
        total = sum(m for _, m in self.masses)
        centre = sum((m * plant.point(CENTRE + body) for body, m in self.masses), np.zeros(3)) / total
        return np.asarray(centre[list(self.axes)])

    def rows(self, plant: StatePlant) -> Array:
        """(axes, nv)."""
        total = sum(m for _, m in self.masses)
        parts = (m * plant.point_jacobian(CENTRE + body)[list(self.axes)] for body, m in self.masses)
        return np.asarray(sum(parts, np.zeros((len(self.axes), plant.mechanism.nv))) / total)
