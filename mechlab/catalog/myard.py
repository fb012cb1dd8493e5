"""Myard's linkage: five bars with a plane of symmetry, the difference of two Bennett linkages with a right twist."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic.bennett import Bar, five_bar
from mechlab.kit.in_world import InWorld
from mechlab.kit.short import Motion, PlotRecipe, alike, always, builder_entry, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism


@dataclass(frozen=True)
class Parameters:
    """Bars (a, 90 degrees), (a sin(alpha), alpha), (a sin(alpha), pi - alpha), (a, 90 degrees); the ground has only a twist."""

    a: float = parameter(0.15, "m", "the bars beside the ground", low=0, strict=True)
    alpha: float = parameter(0.7, "rad", "twist of the next ones", low=0, high=1.5, strict=True)


def bars(p: Parameters) -> tuple[Bar, Bar, Bar]:
    """Length and twist of the shared bar and of those of both linkages."""
    return (p.a, 0.5 * math.pi), (p.a * math.sin(p.alpha), p.alpha), (p.a * math.sin(p.alpha), math.pi - p.alpha)


def build(p: Parameters) -> Mechanism:
    """The pose theta_1 = 1.7; both hinges of the ground go through one point."""
    shared, one, two = bars(p)
    lengths = shared, one, two, shared, (one[0] - two[0], one[1] - two[1])
    steps = [(*bar, 0.0, float(x)) for bar, x in zip(lengths, five_bar(shared, one, two, 1.7, -1), strict=True)]
    return InWorld("myard", 0.06 * p.a, summary="Myard's linkage").ring(steps).build()


def closed(p: Parameters, given: Motion) -> Motion:
    """All hinges but that at which the loop is closed."""
    return {f"theta_{k}": x for k, x in enumerate(five_bar(*bars(p), given["theta_1"], -1), 1) if k != 3}


def factor(p: Parameters) -> float:
    """tan(theta_1 / 2) tan(theta_2 / 2) = -tan(pi / 4 + alpha / 2): Bennett's ratio for the twists 90 degrees and alpha."""
    return -math.tan(0.25 * math.pi + 0.5 * p.alpha)


ENTRY = builder_entry(
    "myard", "Myard's linkage", "spatial-loop", summary="Five bars with a plane of symmetry; both hinges of the ground meet in a point.",
    use="Deployable frames and umbrellas: several of them joined open as one.", origin="Francis Myard, 1931", parameters=Parameters,
    build=build, path=lambda p: {"theta_1": (1.7, 2.9)}, closed=closed, sliders=("alpha",),
    plots=(PlotRecipe("hinges", ("theta_2", "theta_5")),),
    outside=(
        always("tan(theta_1 / 2) tan(theta_2 / 2)", "", lambda p, m: np.tan(0.5 * m["theta_1"]) * np.tan(0.5 * m["theta_2"]), factor,
               "Bennett 1903"),
        alike("theta_2", "theta_4", "plane of symmetry, Myard 1931", -1.0),
    ),
    chain="RRRRR, skew", formulas="theta_5 = pi + theta_1.",
    sources=("Myard, Contribution a la geometrie des systemes articules, Bull. Soc. Math. France 59, 1931",),
)  # fmt: skip
