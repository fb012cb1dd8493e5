"""Parameters of the planar platform 3-RRR."""

from __future__ import annotations

from dataclasses import dataclass

from mechlab.experiment.parameters import parameter


@dataclass(frozen=True)
class PlatformParameters:
    """Base pivots on a circle at -150, -30 and 90 deg, platform corners likewise; three equal chains crank, leg."""

    base: float = parameter(0.5, "m", "radius of the base pivots", low=0, strict=True)
    platform: float = parameter(0.15, "m", "radius of the platform corners", low=0, strict=True)
    crank: float = parameter(0.3, "m", "driven cranks", low=0, strict=True)
    leg: float = parameter(0.3, "m", "legs", low=0, strict=True)
    elbow: int = parameter(
        1, "", "+1: elbows left of the way from base pivot to platform corner, -1: right", low=-1, high=1
    )
    mode: int = parameter(
        1, "", "assembly mode: 1 is the nearest to the centre pose, 2 the next, up to 6", low=1, high=6
    )
    mass_per_length: float = parameter(1.0, "kg/m", "mass of the uniform bars", low=0, strict=True)
    gravity: float = parameter(9.81, "m/s2", "gravity, downwards")
    amplitude: float = parameter(0.25, "rad", "swing of the drives in the driven scene")
    frequency: float = parameter(3.0, "rad/s", "angular frequency of the swing", low=0, strict=True)
