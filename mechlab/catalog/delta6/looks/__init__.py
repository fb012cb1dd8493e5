"""What the parts of the delta look like."""

from mechlab.catalog.delta6.looks.gears import central, idler, idler_placement, platform, shaft_placement, spur
from mechlab.catalog.delta6.looks.head import bevel, carrier, output, planet, tee
from mechlab.catalog.delta6.looks.legs import cardan_rod, cross, ground, plain_rod, rods, slider, stub

__all__ = [
    "bevel", "cardan_rod", "carrier", "central", "cross", "ground", "idler", "idler_placement", "output", "plain_rod",
    "planet", "platform", "rods", "shaft_placement", "slider", "spur", "stub", "tee",
]  # fmt: skip
