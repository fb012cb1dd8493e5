"""Parameters of the leg, and the segments that follow from them by anthropometric fractions."""

from __future__ import annotations

from dataclasses import dataclass

from mechlab.errors import MechlabError
from mechlab.experiment.parameters import parameter

CHOSEN = "chosen"


@dataclass(frozen=True)
class Parameters:
    """Body, springs of the slides, ankle."""

    body_mass: float = parameter(75.0, "kg", "mass of the person", low=0, strict=True, source=CHOSEN)
    body_height: float = parameter(1.75, "m", "height of the person", low=0.5, source=CHOSEN)
    C_hitch: float = parameter(2e4, "N/m", "spring of the hip hitch", low=0, source=CHOSEN)
    C_thigh: float = parameter(2e5, "N/m", "spring between the halves of the thigh", low=0, source=CHOSEN)
    C_shin: float = parameter(1.5e5, "N/m", "spring between the halves of the shin", low=0, source=CHOSEN)
    slider_damping: float = parameter(30.0, "N s/m", "damper of each of the three slides", low=0, source=CHOSEN)
    ankle_stiffness: float = parameter(20.0, "N m/rad", "spring of the ankle", low=0, source=CHOSEN)
    ankle_damping: float = parameter(0.5, "N m s/rad", "damper of the ankle", low=0, source=CHOSEN)
    gravity: float = parameter(9.81, "m/s2", "gravity, downwards")


@dataclass(frozen=True)
class Segment:
    """A segment as a bar: length [m], mass [kg], centre of mass from its upper end [m], inertia about it [kg m2]."""

    length: float
    mass: float
    com: float
    inertia: float

    @property
    def halves(self) -> tuple[Segment, Segment]:
        """Two parts of half the mass at com -+ length/4 that together have the mass, centre and inertia of the segment.

        Raises MechlabError when the inertia is too small for that (gyration below length/4).
        """
        rest = 0.5 * (self.inertia - self.mass * (0.25 * self.length) ** 2)
        if rest <= 0.0:
            raise MechlabError("the segment cannot be split: its radius of gyration is below a quarter of its length")
        first, second = (Segment(self.length, 0.5 * self.mass, self.com + x * self.length, rest) for x in (-0.25, 0.25))
        return first, second


@dataclass(frozen=True)
class Body:
    """Segments of the leg. The foot's centre of mass stands `foot_forward` [m] in front of the
    ankle and `foot_drop` [m] below it; the ankle stands `sole` [m] above the floor."""

    trunk: Segment
    thigh: Segment
    shin: Segment
    foot: Segment
    foot_forward: float
    foot_drop: float
    sole: float
    hitch_mass: float = 1.0
    hitch_inertia: float = 0.002


HEEL = 0.05
"""Distance of the heel behind the ankle [m]."""


def body(p: Parameters) -> Body:
    """Masses and centres by Winter's fractions: thigh .100/.433/.323, leg .0465/.433/.302, foot .0145/.500/.475, trunk
    (head, arms, trunk) .678/-/.496 with its centre .374 of its length above the hip; lengths .245, .246, .152, .288 of
    the height, the ankle .039 above the sole.
    """
    mass, height = p.body_mass, p.body_height

    def part(length: float, share: float, com: float, gyration: float) -> Segment:
        long = length * height
        return Segment(long, share * mass, com * long, share * mass * (gyration * long) ** 2)

    foot = part(0.152, 0.0145, 0.5, 0.475)
    return Body(
        trunk=part(0.288, 0.678, 0.374, 0.496),
        thigh=part(0.245, 0.100, 0.433, 0.323),
        shin=part(0.246, 0.0465, 0.433, 0.302),
        foot=foot,
        foot_forward=0.5 * foot.length - HEEL,
        foot_drop=0.0195 * height,
        sole=0.039 * height,
    )
