"""Parameters of the three-gear four-bar, and the parameter sets of its uses in printing machines."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from mechlab.analytic import gear_linkage as closed_form
from mechlab.errors import MechlabError
from mechlab.experiment.parameters import parameter

SOURCE = "Gear-lever mechanisms in printing machines"


@dataclass(frozen=True)
class Parameters:
    """Lengths, idler, assembly mode, play, masses and speed of the three-gear four-bar."""

    crank: float = parameter(
        0.4728822419, "m", "crank A-B, the eccentricity of gear a", low=0, strict=True, source=SOURCE
    )
    coupler: float = parameter(1.0, "m", "coupler B-C = ra + rc", low=0, strict=True, source=SOURCE)
    rocker: float = parameter(1.0, "m", "rocker D-C = rc + rd", low=0, strict=True, source=SOURCE)
    frame: float = parameter(1.0, "m", "frame A-D", low=0, strict=True, source=SOURCE)
    idler_radius: float = parameter(0.5, "m", "pitch radius of the idler at C", low=0, strict=True, source=SOURCE)
    mode: int = parameter(1, "", "+1: C left of the ray from B to D, -1: right", low=-1, high=1)
    backlash: float = parameter(0.0, "rad", "play of the gears, seen at the output", low=0, source=SOURCE)
    mass_per_length: float = parameter(1.0, "kg/m", "uniform bars", low=0, strict=True)
    mass_per_area: float = parameter(2.0, "kg/m2", "uniform discs of the gears", low=0, strict=True)
    speed: float = parameter(1.0, "rad/s", "crank speed of the scenes")

    def __post_init__(self) -> None:
        if self.mode not in (1, -1):
            raise MechlabError(f"gear_linkage: mode must be +1 or -1, got {self.mode}.")
        self.linkage  # noqa: B018  its own conditions are those of the parameters

    @property
    def play(self) -> float:
        """The backlash with a millionth more, so that a crank given to some digits for that play still fits [rad]."""
        return self.backlash * (1.0 + 1e-6)

    @property
    def linkage(self) -> closed_form.GearLinkage:
        """The same linkage for the closed form; raises what does not go together."""
        return closed_form.GearLinkage(self.crank, self.coupler, self.rocker, self.idler_radius, self.frame, self.mode)

    @property
    def masses(self) -> closed_form.LinkageMasses:
        """Masses for the closed form."""
        return closed_form.LinkageMasses(self.mass_per_length, self.mass_per_area)


PRESETS: Mapping[str, Mapping[str, float]] = {
    # One output turn a crank turn with an instantaneous stop: replaces a clutch that engages once a cycle.
    "knife-drive": {
        "crank": 0.4428909829, "coupler": 1.0, "rocker": 1.0, "idler_radius": 0.5, "frame": 1.0, "backlash": 0.0,
    },
    # Never stops; fastest (and, there, of constant speed) where the sheet is gripped, about a sixth of it at release.
    "sheet-delivery": {
        "crank": 0.35, "coupler": 1.0, "rocker": 0.8, "idler_radius": 0.4, "frame": 1.0, "backlash": 0.0,
    },
    # A play of 2 deg makes a stop of 51.7 deg, 73.5 deg when the gears only push: time to cut the glued strip.
    "glue-and-cut": {
        "crank": 0.548521886, "coupler": 0.9, "rocker": 0.9, "idler_radius": 0.3, "frame": 1.0,
        "backlash": math.radians(2.0),
    },
}  # fmt: skip
"""Parameter sets of the uses that the source names. It prints no dimensions: these are ours, of the kind it describes."""

NEAR_CHANGE_POINT: Mapping[str, float] = {
    "crank": 0.79999, "coupler": 0.9, "rocker": 0.9, "idler_radius": 0.3, "frame": 1.0,
}  # fmt: skip
"""A crank 1e-5 short of the change point: coupler and rocker come within 0.4 deg of one line."""


def warnings(p: Parameters) -> tuple[str, ...]:
    """Sentences on doubtful parameters: a bad transmission angle, a play that the reverse motion exceeds."""
    report = closed_form.regime(p.linkage) if not p.linkage.at_change_point else None
    if report is None:
        return ("crank: at this length coupler, rocker and frame come into one line: a change point, where modes meet",)
    out = []
    if report.least_transmission_angle < math.radians(20.0):
        out.append(
            f"the transmission angle falls to {math.degrees(report.least_transmission_angle):.3g} deg; "
            "below 20 deg the drive is poor, and near 0 another assembly mode is close"
        )
    if 0.0 < p.play < report.reverse_angle:
        out.append(
            f"backlash: the output runs back by {report.reverse_angle:.4g} rad, more than the play of {p.backlash:.4g} rad: "
            "it does not stand"
        )
    return tuple(out)
