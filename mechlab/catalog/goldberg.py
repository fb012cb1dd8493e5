"""Goldberg's five-bar: two Bennett linkages that share a bar, which is then left out."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic.bennett import Bar, five_bar, ratio
from mechlab.kit.in_world import InWorld
from mechlab.kit.short import Motion, PlotRecipe, always, builder_entry, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism


@dataclass(frozen=True)
class Parameters:
    """Both Bennett linkages have a bar (a, alpha) in common; the others have the twists beta and gamma, length / sin(twist) is the same."""

    a: float = parameter(0.1, "m", "the two bars like the shared one", low=0, strict=True)
    alpha: float = parameter(0.5, "rad", "their twist", low=0, high=1.5, strict=True)
    beta: float = parameter(1.0, "rad", "twist of the other bars of the first linkage", low=0, high=1.5, strict=True)
    gamma: float = parameter(1.3, "rad", "twist of the other bars of the second linkage", low=0, high=1.5, strict=True)


def bars(p: Parameters) -> tuple[Bar, Bar, Bar]:
    """Length and twist of the shared bar and of those of both linkages."""
    b, c = (p.a * math.sin(x) / math.sin(p.alpha) for x in (p.beta, p.gamma))
    return (p.a, p.alpha), (b, p.beta), (c, p.gamma)


def build(p: Parameters) -> Mechanism:
    """The pose theta_1 = 1; the last bar, on the ground, is as long and as twisted as both together."""
    shared, one, two = bars(p)
    lengths = shared, one, two, shared, (one[0] + two[0], one[1] + two[1])
    steps = [(*bar, 0.0, float(x)) for bar, x in zip(lengths, five_bar(shared, one, two, 1.0), strict=True)]
    return InWorld("goldberg", 0.08 * p.a, summary="Goldberg's five-bar").ring(steps).build()


def closed(p: Parameters, given: Motion) -> Motion:
    """All hinges but that at which the loop is closed."""
    shared, one, two = bars(p)
    return {f"theta_{k}": x for k, x in enumerate(five_bar(shared, one, two, given["theta_1"]), 1) if k != 3}


def product(p: Parameters) -> float:
    """tan(theta_1 / 2) tan(theta_5 / 2): both Bennett ratios, the angle between them is taken away by theta_2 + theta_4 = pi."""
    return -ratio(p.alpha, p.beta) * ratio(p.gamma, p.alpha)


ENTRY = builder_entry(
    "goldberg", "Goldberg's five-bar", "spatial-loop", summary="Two Bennett linkages without their common bar: five bars, one freedom.",
    use="Deployable structures; the pattern after which overconstrained linkages are composed.", origin="Michael Goldberg, 1943",
    parameters=Parameters, build=build, path=lambda p: {"theta_1": (1.0, 2.6)}, closed=closed, sliders=("alpha", "beta"),
    plots=(PlotRecipe("hinges", ("theta_2", "theta_5")),),
    outside=(always("tan(theta_1 / 2) tan(theta_5 / 2)", "", lambda p, m: np.tan(0.5 * m["theta_1"]) * np.tan(0.5 * m["theta_5"]), product,
                    "product of both Bennett ratios"),),
    chain="RRRRR, skew", formulas="theta_2 + theta_4 = pi.", sources=("Goldberg, New five-bar and six-bar linkages, Trans. ASME 65, 1943",),
)  # fmt: skip
