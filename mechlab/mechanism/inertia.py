"""Mass, centre of mass and inertia tensor of a rigid part, with constructors for common parts."""

from __future__ import annotations

import math

import numpy as np

from mechlab.errors import MechlabError, explained
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array, Vector, skew, unit, vector
from mechlab.mechanism.given import Number, si


@explained
@dataclass(frozen=True)
class Inertia:
    """Mass [kg], centre of mass `com` [m] and `tensor` (xx, yy, zz, xy, xz, yz) [kg m2] about it, in body axes. Numbers of the
    constructors may be text with a unit ("200g", "30mm").

    Raises MechlabError for a negative or non-finite mass, a tensor that is not positive semidefinite, or one that
    breaks the triangle inequality of principal moments (no mass distribution has it).
    """

    mass: float = 0.0
    com: Vector = (0.0, 0.0, 0.0)
    tensor: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        mass = si(self.mass, "mass", "kg", low=0.0)
        try:
            tensor = tuple(float(x) for x in self.tensor)
        except (TypeError, ValueError):
            tensor = ()
        if len(tensor) != 6 or not all(math.isfinite(x) for x in tensor):
            raise MechlabError(
                f"inertia tensor: expected six finite numbers (xx, yy, zz, xy, xz, yz), got {self.tensor!r}."
            )
        object.__setattr__(self, "mass", mass)
        object.__setattr__(self, "com", vector(self.com, "centre of mass"))
        object.__setattr__(self, "tensor", tensor)
        a, b, c = np.linalg.eigvalsh(self.matrix()) if any(tensor[3:]) else sorted(tensor[:3])
        scale = max(abs(a), abs(c), 1e-300)
        if a < -1e-12 * scale:
            raise MechlabError(f"inertia tensor {tensor}: its smallest principal moment {a:g} kg m2 is negative.")
        if a + b < c * (1.0 - 1e-9):
            raise MechlabError(
                f"inertia tensor {tensor}: principal moments {a:g}, {b:g}, {c:g} kg m2 break the triangle inequality "
                f"({a:g} + {b:g} < {c:g}); no body has such an inertia."
            )
        if mass == 0.0 and c > 0.0:
            raise MechlabError(f"inertia tensor {tensor}: a body without mass cannot have an inertia.")

    def matrix(self) -> Array:
        """(3, 3) tensor about the centre of mass, in body axes."""
        xx, yy, zz, xy, xz, yz = self.tensor
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    def __add__(self, other: Inertia) -> Inertia:
        """Both parts as one rigid part (parallel-axis theorem)."""
        mass = self.mass + other.mass
        if mass == 0.0:
            return Inertia()
        com = (self.mass * np.array(self.com) + other.mass * np.array(other.com)) / mass
        total = np.zeros((3, 3))
        for part in (self, other):
            s = skew(np.array(part.com) - com)
            total += part.matrix() - part.mass * s @ s
        return _from_matrix(mass, com, total)

    def at(self, position: Vector, rotation: Array | None = None) -> Inertia:
        """The inertia in another frame, in which the frame of the part stands at `position` [m] with `rotation` (3,
        3)."""
        r = np.eye(3) if rotation is None else np.asarray(rotation)
        return _from_matrix(self.mass, r @ np.array(self.com) + np.array(position), r @ self.matrix() @ r.T)

    @staticmethod
    def point(mass: Number, com: Vector = (0.0, 0.0, 0.0)) -> Inertia:
        """A point mass."""
        return Inertia(si(mass, "mass", "kg", low=0.0), com)

    @staticmethod
    def rod(mass: Number, start: Vector, end: Vector, radius: Number = 0.0) -> Inertia:
        """A uniform slender round rod from `start` to `end`; `radius` > 0 gives it a spin inertia m r^2 / 2."""
        mass, radius = si(mass, "mass", "kg", low=0.0), si(radius, "radius", "m", low=0.0)
        a, b = np.array(vector(start, "rod start")), np.array(vector(end, "rod end"))
        length = float(np.linalg.norm(b - a))
        z = np.array(unit(b - a, "rod direction"))
        across = mass * (length**2 / 12.0 + radius**2 / 4.0)
        along = mass * radius**2 / 2.0
        return _from_matrix(mass, (a + b) / 2.0, across * (np.eye(3) - np.outer(z, z)) + along * np.outer(z, z))

    @staticmethod
    def cylinder(
        mass: Number, radius: Number, length: Number, axis: Vector = (0.0, 0.0, 1.0), com: Vector = (0.0, 0.0, 0.0)
    ) -> Inertia:
        """A uniform solid cylinder about `com`."""
        mass, radius, length = si(mass, "mass", "kg", low=0.0), si(radius, "radius", "m", low=0.0), si(length, "length", "m", low=0.0)
        across = mass * (3.0 * radius**2 + length**2) / 12.0
        return Inertia.axial(mass, mass * radius**2 / 2.0, across, axis, com)

    @staticmethod
    def axial(
        mass: Number, along: Number, across: Number, axis: Vector = (0.0, 0.0, 1.0), com: Vector = (0.0, 0.0, 0.0)
    ) -> Inertia:
        """A part of revolution given by its moments `along` and `across` the axis [kg m2], about `com`."""
        mass, along, across = si(mass, "mass", "kg", low=0.0), si(along, "along", "kg m2"), si(across, "across", "kg m2")
        z = np.array(unit(axis, "axis of revolution"))
        return _from_matrix(mass, np.array(com), across * (np.eye(3) - np.outer(z, z)) + along * np.outer(z, z))

    @staticmethod
    def box(mass: Number, x: Number, y: Number, z: Number, com: Vector = (0.0, 0.0, 0.0)) -> Inertia:
        """A uniform box with the given edge lengths."""
        mass = si(mass, "mass", "kg", low=0.0)
        x, y, z = (si(edge, f"edge {n}", "m", low=0.0) for n, edge in zip("xyz", (x, y, z), strict=True))
        k = mass / 12.0
        return Inertia(mass, com, (k * (y * y + z * z), k * (x * x + z * z), k * (x * x + y * y), 0.0, 0.0, 0.0))


def _from_matrix(mass: float, com: Array, m: Array) -> Inertia:
    c = np.asarray(com, dtype=float).tolist()
    t = (m[0, 0], m[1, 1], m[2, 2], m[0, 1], m[0, 2], m[1, 2])
    xx, yy, zz, xy, xz, yz = (float(x) for x in t)
    return Inertia(mass, (c[0], c[1], c[2]), (xx, yy, zz, xy, xz, yz))
