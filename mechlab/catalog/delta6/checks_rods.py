"""Check A16: what the closed forms tell of rods and shafts beside the drives, against where the parts stand."""

from __future__ import annotations

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.parameters import Delta6Parameters
from mechlab.catalog.delta6.poses import coordinates
from mechlab.catalog.delta6.probes import ANGLES, ROTARY, SLIDERS, random_poses
from mechlab.catalog.delta6.witnesses import Witness, witnesses
from mechlab.experiment.entry import Check, CheckResult
from mechlab.mechanism.geometry import Array

LEGS = (1, 2, 3)
ABOUT_Z = np.array([-1.0, -1.0, 1.0])
"""Drives 1 and 2 turn about -Z."""


def _told(p: Delta6Parameters, centre: Array, angles: Array) -> Array:
    """Every number beside the six drives that the closed forms give for a pose."""
    g, tool = p.geometry, centre + p.head_offset * closed.output_axis(angles)
    there = closed.inverse(g, tool, *angles)
    back = closed.forward(g, there.drives[:3], there.drives[3:])
    shafts = closed.cardan_angles(g, centre, ABOUT_Z * there.drives[3:])
    rows, sides = closed.implicit_matrices(g, centre)
    translation = back.translation
    return np.concatenate([
        there.head_centre, there.angles, there.translation.drives, there.translation.h2, translation.position,
        translation.heights, [translation.discriminant], shafts.bend, shafts.upper_shaft, shafts.lower_shaft,
        closed.cardan_bend(g, centre), rows.ravel(), sides.ravel(),
    ])  # fmt: skip


def _seen(w: Witness) -> Array:
    """The same from where the ends of the shafts and the platform of the full mechanism stand."""
    centre = w.pose("platform")[1]
    upper, lower = (np.array([w.pose(f"{end}_{i}")[1] for i in LEGS]) for end in ("stub", "shaft"))
    rods = lower - upper
    heights = -rods[:, 2]
    bend = np.arctan2(np.hypot(rods[:, 0], rods[:, 1]), heights)
    # O is as far from these three points as a rod is long; the circle through them has the radius abc / (4 area).
    a, b, c = upper - (lower - centre)
    sides = [float(np.linalg.norm(x)) for x in (b - a, c - b, a - c)]
    radius = float(np.prod(sides)) / (2.0 * float(np.linalg.norm(np.cross(b - a, c - a))))
    turned = ABOUT_Z * [w.value(n) for n in ROTARY]
    turned_below = ABOUT_Z * [w.value(f"{n}_lower") for n in ROTARY]
    return np.concatenate([
        centre, [w.value(n) for n in ANGLES], [w.value(n) for n in SLIDERS], heights**2, centre, heights,
        [float(rods[0] @ rods[0]) - radius**2], bend, turned, turned_below, bend, (2.0 * rods).ravel(),
        (2.0 * np.diag(heights)).ravel(),
    ])  # fmt: skip


def a16(p: Delta6Parameters) -> CheckResult:
    """A few poses of the full mechanism."""
    centre, angles = random_poses(p, 3, seed=23)
    angles = 0.7 * angles
    said = {"analytic": np.array([_told(p, *pose) for pose in zip(centre, angles, strict=True)])}
    for w in witnesses(build(p, "full")):
        said[w.name] = np.array([_seen(w.at(q)) for q in coordinates(p, "full", centre, angles)])
    # Rounding of numbers of the size of 1; a circle through guides that nearly stand in line loses some digits.
    return CheckResult(
        said, 1e-10, note="head centre, angles, sliders, heights, discriminant, bends, shafts, matrices A and B"
    )


CHECKS = (
    Check(
        "A16",
        "rods and shafts where the parts stand: heights, bends, discriminant",
        a16,
        "points of the full mechanism",
    ),
)
