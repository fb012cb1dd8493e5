"""What the parts of the three-gear four-bar look like: involute gears in phase, rods in layers above them."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic.gear_linkage import GearLinkage
from mechlab.kit.palette import BLUE, BRASS, DARK, ORANGE, RED, SLATE, STEEL, TEAL
from mechlab.mechanism import Placement, Shape, shape
from mechlab.mechanism.parts import Color

FEWEST, MOST = 24, 120


def tooth_counts(g: GearLinkage) -> tuple[int, int, int]:
    """Teeth of a, idler and output whose ratios are nearest to those of the radii, the fewest where they are exact.

    All three lie between 24 and 120, or reach beyond 120 where the largest needs it when the smallest has 24.
    """
    radii = np.array(g.radii)
    relative = radii / radii.min()
    best, error = (0, 0, 0), math.inf
    for fewest in range(FEWEST, max(FEWEST, int(MOST / relative.max())) + 1):
        counts = np.round(fewest * relative)
        off = float(np.max(np.abs(counts / (fewest * relative) - 1.0)))
        if off < error - 1e-12:
            best, error = (int(counts[0]), int(counts[1]), int(counts[2])), off
        if error < 1e-12:
            break
    return best


def _sizes(g: GearLinkage) -> tuple[float, float]:
    """Width of the rods and of the gears."""
    rod = 0.06 * min(*g.radii, max(g.crank, 0.2 * g.frame)) + 0.02 * g.frame
    return rod, 0.8 * rod


def _gear(
    g: GearLinkage,
    radius: float,
    teeth: int,
    phase: float,
    color: Color,
    name: str,
    at: tuple[float, float, float],
    planes: int,
) -> Shape:
    rod, width = _sizes(g)
    return shape(
        "spur_gear", Placement(at), color, name,
        teeth=teeth, module=2.0 * radius / teeth, width=planes * width, bore=min(0.3 * rod, 0.2 * radius), phase=phase,
    )  # fmt: skip


def _link(g: GearLinkage, length: float, layer: float, color: Color, name: str) -> Shape:
    rod, _ = _sizes(g)
    return shape("link", Placement((0.0, 0.0, layer * rod)), color, name, length=length, width=rod, thickness=0.5 * rod)


def _pin(g: GearLinkage, x: float, low: float, high: float, name: str) -> Shape:
    """A pin from one layer to another, in widths of a rod."""
    rod, _ = _sizes(g)
    middle = Placement((x, 0.0, 0.5 * (low + high) * rod))
    return shape("cylinder", middle, DARK, name, radius=0.24 * rod, length=(high - low) * rod)


def crank_looks(g: GearLinkage, teeth: int, phase: float) -> list[Shape]:
    """Crank below the gears; gear a on its pin, in the lower plane, so that it passes under the output gear."""
    _, width = _sizes(g)
    gear = _gear(g, g.radii[0], teeth, phase, BRASS, "gear_a", (g.crank, 0.0, -0.55 * width), 1)
    return [_link(g, g.crank, -1.2, BLUE, "crank"), _pin(g, g.crank, -1.45, 1.7, "pin_B"), gear]


def rod_looks(g: GearLinkage, name: str) -> list[Shape]:
    """Coupler just above the gears, rocker above the coupler, with the pin at C."""
    if name == "coupler":
        return [_link(g, g.coupler, 1.4, ORANGE, name)]
    return [_link(g, g.rocker, 2.0, TEAL, name), _pin(g, g.rocker, -1.0, 2.3, "pin_C")]


def gear_looks(g: GearLinkage, name: str, teeth: int, phase: float) -> list[Shape]:
    """The wide idler, or the output gear in the upper plane with a mark that shows its angle."""
    rod, width = _sizes(g)
    if name == "idler":
        return [_gear(g, g.radii[1], teeth, phase, STEEL, name, (0.0, 0.0, 0.0), 2)]
    mark = Placement((0.0, 0.0, 1.05 * width + 0.1 * rod))
    return [
        _gear(g, g.radii[2], teeth, phase, RED, name, (0.0, 0.0, 0.55 * width), 1),
        shape("pointer", mark, DARK, "mark", length=0.9 * g.radii[2], width=0.6 * rod, thickness=0.2 * rod),
    ]


def ground_looks(g: GearLinkage) -> list[Shape]:
    """Pins at A and D, and the frame."""
    rod, _ = _sizes(g)
    base = Placement((0.0, 0.0, -2.0 * rod))
    frame = shape("link", base, SLATE, "frame", length=g.frame, width=1.4 * rod, thickness=0.4 * rod)
    return [_pin(g, 0.0, -2.2, -0.92, "pin_A"), _pin(g, g.frame, -2.2, 2.3, "pin_D"), frame]
