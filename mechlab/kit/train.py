"""Gear trains about a main axis z: wheels, carriers, planets, bevel wheels; each a body, each mesh a row.

    t = Train("stage").wheel("sun", 24).wheel("ring", 84, ring=True)
    t.carrier("arm").planet("planet", "arm", 30, orbit=t.centres("sun", 30))
    t.mesh_of("sun", "planet", "arm").mesh_of("ring", "planet", "arm")

Joints have the names of their bodies; the angle of a planet is that relative to its carrier. One planet of each circle stands for all.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Self

from mechlab.kit.palette import BLUE, BRASS, DARK, GOLD, ORANGE, RED, STEEL, TEAL
from mechlab.mechanism import Builder, Inertia, Placement, revolute, shape
from mechlab.mechanism.geometry import Array, frame_along
from mechlab.mechanism.parts import GROUND, Shape
from mechlab.shapes import bevel_phase, external_phase, internal_phase

COLORS = (BRASS, BLUE, TEAL, ORANGE, GOLD, STEEL)
DENSITY = 7800.0
"""Density of the wheels [kg/m3]."""


class Train(Builder):
    """A Builder of wheels on parallel or crossing axes; module [m] of all gears; no gravity."""

    def __init__(self, name: str, module: float = 0.002, summary: str = "") -> None:
        super().__init__(name, gravity=(0.0, 0.0, 0.0), summary=summary)
        self.module = module
        self.teeth: dict[str, int] = {}
        self.rings: set[str] = set()
        self.places: dict[str, complex] = {}
        self.turns: dict[str, Array] = {}
        self.phases: dict[str, float] = {}

    def radius(self, teeth: int) -> float:
        """Pitch radius [m]."""
        return 0.5 * self.module * teeth

    def centres(self, a: str | int, b: str | int, internal: bool = False) -> float:
        """Distance [m] of the axes of two wheels, by name or number of teeth."""
        za, zb = (self.teeth[x] if isinstance(x, str) else x for x in (a, b))
        return self.radius(abs(za - zb) if internal else za + zb)

    def wheel(self, name: str, teeth: int, level: float = 0.0, ring: bool = False) -> Self:
        """A wheel on the main axis; level: height of its middle in widths of a gear."""
        self.body(name, revolute(name, "z"), inertia=self._disc(teeth, ring), shapes=self._gear(name, teeth, level, ring))
        return self._noted(name, teeth, ring, 0j)

    def carrier(self, name: str, orbits: Sequence[float] = (), level: float = -1.2) -> Self:
        """A carrier on the main axis with an arm to each orbit [m]."""
        width = 8 * self.module
        hub = Placement((0, 0, level * width))
        arms: list[Shape] = [shape("disc", hub, RED, f"{name}_hub", radius=2 * width / 3, thickness=0.4 * width)]
        for k, r in enumerate(orbits):
            arms.append(shape("box", Placement((0.5 * r, 0, level * width)), RED, f"{name}_arm_{k}", x=r, y=0.6 * width, z=0.3 * width))
        inertia = Inertia.cylinder(0.2, max((*orbits, 2 * width)), 0.4 * width)
        self.body(name, revolute(name, "z"), inertia=inertia, shapes=arms)
        return self

    def planet(self, name: str, carrier: str, teeth: int, orbit: float, angle: float = 0.0, level: float = 0.0, fixed_to: str = "") -> Self:
        """A planet on a carrier at a distance `orbit` [m] and an angle [rad] of its arm. fixed_to: the planet of which it is a part."""
        looks, place = self._gear(name, teeth, level, False), cmath.rect(orbit, angle)
        if fixed_to:
            self.body(name, parent=fixed_to, inertia=self._disc(teeth, False), shapes=looks)
        else:
            at = (place.real, place.imag, 0.0)
            self.body(name, revolute(name, "z"), parent=carrier, at=at, inertia=self._disc(teeth, False), shapes=looks)
        return self._noted(name, teeth, False, self.places[fixed_to] if fixed_to else place)

    def bevel(self, name: str, teeth: int, direction: Sequence[float], slope: float, parent: str = GROUND) -> Self:
        """A bevel wheel whose cone has its apex in the origin; it stands in the `direction` (3,) from there, its pitch angle is `slope`."""
        turn = frame_along(direction)
        looks = shape("bevel_gear", Placement.of(turn, (0.0, 0.0, 0.0)), COLORS[len(self.bodies) % len(COLORS)], name, teeth=teeth,
                      module=self.module, pitch_angle=slope, width=5 * self.module)  # fmt: skip
        along = self.radius(teeth) / math.tan(slope)
        solid = self._disc(teeth, False).at(tuple(float(along * x) for x in direction), turn)  # type: ignore[arg-type]
        axis = tuple(float(x) for x in direction)
        self.body(name, revolute(name, axis), parent=parent, inertia=solid, shapes=[looks])
        self.turns[name] = turn
        return self._noted(name, teeth, False, 0j)

    def mesh_of(self, a: str, b: str, carrier: str = GROUND, bevel: bool = False, side: int = 1) -> Self:
        """The mesh of two wheels, their axes held by `carrier`; a ring and a wheel mesh inside."""
        kind = "bevel" if bevel else "internal" if {a, b} & self.rings else "external"
        first, second = (b, a) if b in self.rings else (a, b)
        joints = [self._turning(x) for x in (first, second)]
        self._phase(first, second, bevel)
        self.gears(f"{a}_{b}", joints[0], joints[1], (self.teeth[first], self.teeth[second]), carrier, kind, side)
        return self

    def _phase(self, a: str, b: str, bevel: bool) -> None:
        """Turns the teeth of the wheel that meshes for the first time into the gaps of the other; of the second if both do."""
        if b in self.phases and a not in self.phases:
            a, b = b, a
        phase, (za, zb) = self.phases.setdefault(a, 0.0), (self.teeth[a], self.teeth[b])
        if b in self.phases:
            return
        if bevel:
            found = bevel_phase(za, phase, self.turns[a], zb, self.turns[b])
        else:
            ring = next((x for x in (a, b) if x in self.rings), a)
            way = self.places[b if ring == a else a] - self.places[ring]
            found = (internal_phase if ring in self.rings else external_phase)(za, phase, zb, cmath.phase(way))
        self.phases[b] = found
        k = next(i for i, body in enumerate(self.bodies) if body.name == b)
        first, *rest = self.bodies[k].shapes
        size = tuple(sorted({**first.parameters, "phase": found}.items()))
        self.bodies[k] = replace(self.bodies[k], shapes=(replace(first, size=size), *rest))

    def _turning(self, wheel: str) -> str:
        """The joint that turns a wheel: its own, or that of the planet of which it is a part."""
        body = next(b for b in self.bodies if b.name == wheel)
        return wheel if body.joints else self._turning(body.parent)

    def _noted(self, name: str, teeth: int, ring: bool, place: complex) -> Self:
        self.teeth[name], self.places[name] = teeth, place
        if ring:
            self.rings.add(name)
        return self

    def _disc(self, teeth: int, ring: bool) -> Inertia:
        r, width = self.radius(teeth), 8 * self.module
        if ring:
            mass = DENSITY * math.pi * width * ((r + 4 * self.module) ** 2 - r**2)
            return Inertia.axial(mass, mass * (r + 2 * self.module) ** 2, 0.5 * mass * (r + 2 * self.module) ** 2)
        return Inertia.cylinder(DENSITY * math.pi * r * r * width, r, width)

    def _gear(self, name: str, teeth: int, level: float, ring: bool) -> list[Shape]:
        width = 8 * self.module
        place, color = Placement((0.0, 0.0, level * width)), COLORS[len(self.bodies) % len(COLORS)]
        if ring:
            return [shape("internal_gear", place, color, name, teeth=teeth, module=self.module, width=0.9 * width)]
        bore = 0.1 * self.module * teeth
        pin = shape("cylinder", place, DARK, f"{name}_pin", radius=bore, length=1.4 * width)
        return [shape("spur_gear", place, color, name, teeth=teeth, module=self.module, width=0.9 * width, bore=bore), pin]
