"""Parameters of the class IV linkage, as the source prints them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mechlab.experiment.parameters import parameter

SOURCE = "Zinchenko 2009, step 2"


@dataclass(frozen=True)
class Class4Parameters:
    """Crank OA, ternary links A-C-D and F-B-E, binary links C-B and D-E; pivots O = (0, 0) and F."""

    OA: float = parameter(0.279, "m", "crank (link 1)", source=SOURCE, low=0, strict=True)
    AC: float = parameter(0.985, "m", "link 2, A to C", source=SOURCE, low=0, strict=True)
    AD: float = parameter(0.251, "m", "link 2, A to D", source=SOURCE, low=0, strict=True)
    CAD: float = parameter(math.radians(37.3), "rad", "link 2, from AC to AD, counter-clockwise", source=SOURCE)
    BC: float = parameter(0.3, "m", "link 3, C to B", source=SOURCE, low=0, strict=True)
    DE: float = parameter(0.554, "m", "link 4, D to E", source=SOURCE, low=0, strict=True)
    EF: float = parameter(1.3, "m", "link 5, F to E", source=SOURCE + ", decimal point restored", low=0, strict=True)
    BF: float = parameter(2.06, "m", "link 5, F to B", source=SOURCE, low=0, strict=True)
    BFE: float = parameter(math.radians(28.1), "rad", "link 5, from FB to FE, counter-clockwise", source=SOURCE)
    F: tuple[float, float] = parameter(
        (0.0, -1.08), "m", "pivot of link 5: x, y", source=SOURCE + ", decimal point restored"
    )
    mode: int = parameter(
        1, "", "+1: both dyads of the source clockwise (K = +1), -1: both counter-clockwise", low=-1, high=1
    )
    mass_per_length: float = parameter(1.0, "kg/m", "mass of the uniform bars", low=0, strict=True)
    gravity: float = parameter(0.0, "m/s2", "gravity, downwards; the source gives none")
    speed: float = parameter(1.0, "rad/s", "crank speed of the scenes", source="Zinchenko 2009, step 3")
    start: float = parameter(-math.pi, "rad", "crank angle at which the scenes start", source="Zinchenko 2009, step 3")
