"""Bennett's linkage: four bars, four skew hinges, one freedom where counting finds minus two."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from mechlab.kit.in_world import InWorld, hinges
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, farthest, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, revolute


@dataclass(frozen=True)
class Parameters:
    """Opposite bars are alike; a / sin(alpha) = b / sin(beta)."""

    a: float = parameter(0.2, "m", "ground and coupler", low=0, strict=True)
    alpha: float = parameter(0.6, "rad", "twist of ground and coupler", low=0, high=1.5, strict=True)
    beta: float = parameter(1.2, "rad", "twist of the cranks", low=0, high=1.5, strict=True)


def half(p: Parameters) -> float:
    """tan(theta / 2) tan(phi / 2) of the angles at two hinges that are neighbours."""
    return math.sin(0.5 * (p.alpha + p.beta)) / math.sin(0.5 * (p.beta - p.alpha))


def build(p: Parameters) -> Mechanism:
    """Hinges and points by Denavit-Hartenberg steps around the loop from the pose theta = 1."""
    b, theta, phi = p.a * math.sin(p.beta) / math.sin(p.alpha), 1.0, 2.0 * math.atan(half(p) / math.tan(0.5))
    points, axes = hinges([(p.a, p.alpha, 0, theta), (b, p.beta, 0, phi), (p.a, p.alpha, 0, -theta), (b, p.beta, 0, -phi)])
    w = InWorld("bennett", 0.06 * p.a, summary="Bennett's linkage").stand(points[0], points[3])
    w.link("first", revolute("theta", axes[0].tolist(), zero=theta), at=points[0], to=[points[1]])
    w.link("second", revolute("phi", axes[1].tolist(), zero=phi), at=points[1], to=[points[2]], parent="first")
    w.link("third", revolute("gamma", axes[3].tolist()), at=points[3], to=[points[2]])
    w.close("hinge", "second", "third", points[2], "revolute", axes[2])
    w.mark("P", "second", points[2]).drive("theta", stiffness=20.0, damping=0.2)
    return w.assemble({}, hold=["theta"])


def halves(m: Mapping[str, np.ndarray]) -> np.ndarray:
    """tan(theta / 2) tan(phi / 2) along the path."""
    return np.tan(0.5 * m["theta"]) * np.tan(0.5 * m["phi"])


ENTRY = builder_entry(
    "bennett", "Bennett's linkage", "spatial-loop", summary="Four bars with skew hinges: movable though overconstrained.",
    use="Deployable frames; the smallest overconstrained linkage.", origin="Geoffrey Bennett, 1903", parameters=Parameters, build=build,
    path=lambda p: {"theta": (1.0, 2.9)}, sliders=("a", "alpha"), plots=(PlotRecipe("hinges", ("phi", "gamma")),),
    outside=(Outside("tan(theta / 2) tan(phi / 2)", "", half, lambda p, m: farthest(halves(m), half(p)), 1e-8,
                     "Bennett, A new mechanism, Engineering 76, 1903"),),
    chain="RRRR, skew", formulas="tan(theta/2) tan(phi/2) = sin((alpha+beta)/2) / sin((beta-alpha)/2).", sources=("Bennett 1903",),
)  # fmt: skip
