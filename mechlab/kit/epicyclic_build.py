"""Bodies and shapes of epicyclic trains, all about the z axis: flat discs, planets on a circle, arms and pins of a carrier.

The fidelities of every train are FIDELITIES. `minimal` has its planets as shafts, `parts` one planet of each circle as a body
that stands for all, `full` every planet.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction

from mechlab.errors import unknown
from mechlab.kit.epicyclic_teeth import azimuths
from mechlab.kit.palette import BRASS, RED
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Inertia, Placement, revolute, shape
from mechlab.mechanism.geometry import Vector, axis_rotation
from mechlab.mechanism.parts import Color, Shape

FIDELITIES = ("minimal", "parts", "full")


def fidelity_texts(minimal: str, ray: str = "planet") -> dict[str, str]:
    """What each fidelity of an entry is. minimal: the text of that fidelity; ray: what stands for all others in `parts`."""
    return {
        "kinematic": "Willis equation",
        "minimal": minimal,
        "parts": f"one {ray} that stands for all, each mesh a row",
        "full": "every planet, redundant rows named",
    }


def planet_bodies(train: str, fidelity: str, planets: int) -> int:
    """How many planets of a circle are bodies. Raises MechlabError for a fidelity that the train does not have."""
    if fidelity not in FIDELITIES:
        raise unknown(f"{train}: fidelity", fidelity, FIDELITIES)
    return {"minimal": 0, "parts": 1, "full": planets}[fidelity]


def disc(inertia: float, radius: float) -> Inertia:
    """A flat disc of this radius [m] with the given moment about z [kg m2]."""
    return flat(2.0 * inertia / radius**2, inertia)


def flat(mass: float, inertia: float) -> Inertia:
    """A flat part of revolution: mass [kg], moment about z [kg m2]."""
    return Inertia.axial(mass, inertia, 0.5 * inertia)


def gear(
    name: str, color: Color, teeth: int, module: float, width: float, phase: float = 0.0, height: float = 0.0,
    kind: str = "spur_gear", **more: float,
) -> Shape:  # fmt: skip
    """A gear about its own axis. module, width and height of its middle plane [m]; phase [rad]; more: sizes as of the shape."""
    place = Placement((0.0, 0.0, height))
    return shape(kind, place, color, name, teeth=teeth, module=module, width=width, phase=phase, **more)


def sun_on_shaft(teeth: int, module: float, width: float, radius: float, middle: float) -> tuple[Shape, Shape]:
    """A sun and its shaft, which is 24 modules long: `radius` and height of its middle [m]."""
    shaft = shape("cylinder", Placement((0.0, 0.0, middle)), BRASS, "shaft", radius=radius, length=24 * module)
    return gear("sun", BRASS, teeth, module, width, bore=0.12 * module * teeth), shaft


def on_circle(radius: float, angle: float, height: float = 0.0) -> Vector:
    """A point [m] on a circle about the z axis."""
    return radius * math.cos(angle), radius * math.sin(angle), height


@dataclass(frozen=True)
class Planets:
    """Equal planets of a carrier, their axes on one circle about z.

    name: their bodies are NAME_1, NAME_2, ... mass [kg] and moment about its own axis [kg m2] of each; orbit: radius [m] of the
    circle; angles [rad]: where the axes stand on it.
    """

    name: str
    mass: float
    moment: float
    orbit: float
    angles: tuple[float, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the planets, as bodies or shafts."""
        return tuple(f"{self.name}_{k + 1}" for k in range(len(self.angles)))

    def axis(self, k: int, turn: float = 0.0) -> Vector:
        """Centre of planet k [m] when the carrier has turned by `turn` [rad]."""
        return on_circle(self.orbit, self.angles[k] + turn)

    def riding(self, bodies: int) -> float:
        """Moment about z [kg m2] of the planets that are no bodies: point masses on the carrier."""
        return (len(self.angles) - bodies) * self.mass * self.orbit**2

    def spin_moment(self, bodies: int) -> float:
        """Moment of a planet that is a body about its own axis [kg m2]: a single one has that of all."""
        return self.moment * (len(self.angles) if bodies == 1 else 1)

    def add_body(self, b: Builder, k: int, bodies: int, shapes: Sequence[Shape]) -> str:
        """Adds planet k of `bodies` to the builder, turning on the carrier; returns its name."""
        name, inertia = self.names[k], flat(self.mass, self.spin_moment(bodies))
        b.body(name, revolute(name), parent="carrier", at=self.axis(k), inertia=inertia, shapes=shapes)
        return name

    def add_shafts(self, b: Builder, k: int, relative: Mapping[str, Fraction], shapes: Sequence[Shape]) -> None:
        """Adds planet k to the builder as two shafts: NAME turns on the carrier by the coefficients `relative` (joint -> turns)
        and has the shapes; NAME_spin, its absolute turn, has the inertia."""
        name, place = self.names[k], Placement(self.axis(k))
        spin = {"carrier": 1 + relative.get("carrier", 0)} | {n: c for n, c in relative.items() if n != "carrier"}
        b.shaft(f"{name}_spin", spin, inertia=self.moment)
        b.shaft(name, relative, body="carrier", placement=place, shapes=shapes)


class OnePlanetCircle:
    """What the parameters of a train with one circle of planets have in common; `teeth` begin with sun and planet."""

    teeth: tuple[int, ...]
    module: float
    planets: int
    J_planet: float
    planet_mass: float

    @property
    def orbit(self) -> float:
        """Radius of the planet axes [m]."""
        return 0.5 * self.module * (self.teeth[0] + self.teeth[1])

    @property
    def planet_set(self) -> Planets:
        """The planets of the carrier."""
        return Planets("planet", self.planet_mass, self.J_planet, self.orbit, azimuths(self.planets))


def add_carrier(
    b: Builder, moment: float, radius: float, planets: Iterable[Planets], bodies: int, shapes: Sequence[Shape]
) -> None:
    """Adds the carrier to the builder, a flat disc of this moment [kg m2] on which the planets that are no bodies ride."""
    inertia = disc(sum((x.riding(bodies) for x in planets), moment), radius)
    b.body("carrier", revolute("carrier"), inertia=inertia, shapes=shapes)


@dataclass(frozen=True)
class Arm:
    """An arm of a carrier, from the radius `start` outwards at a height; all in m."""

    start: float
    length: float
    height: float
    width: float
    thickness: float
    bore: float


@dataclass(frozen=True)
class Pin:
    """A pin on which planets turn: radius of the circle of their axes, height of its middle, its own radius and length; all in
    m. suffix: of its name, where an arm has several."""

    orbit: float
    middle: float
    radius: float
    length: float
    suffix: str = ""


def arms_and_pins(angles: Iterable[float], arm: Arm, pins: Sequence[Pin]) -> tuple[Shape, ...]:
    """An arm with its pins at each angle [rad] of a carrier."""
    out = []
    for k, angle in enumerate(angles, 1):
        start = on_circle(arm.start, angle, arm.height) if arm.start else (0.0, 0.0, arm.height)
        place = Placement.of(axis_rotation((0.0, 0.0, 1.0), angle), start)
        out.append(shape("link", place, RED, f"arm_{k}", length=arm.length, width=arm.width,
                         thickness=arm.thickness, bore=arm.bore))  # fmt: skip
        for pin in pins:
            place = Placement(on_circle(pin.orbit, angle, pin.middle))
            name = f"pin_{k}{pin.suffix}"
            out.append(shape("cylinder", place, RED, name, radius=pin.radius, length=pin.length))
    return tuple(out)
