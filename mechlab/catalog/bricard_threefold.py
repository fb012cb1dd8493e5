"""The threefold-symmetric Bricard linkage: six equal bars whose ring turns inside out; with right twists a kaleidocycle."""

from __future__ import annotations

import math

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.short import Motion, PlotRecipe, alike, always, builder_entry, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism


@dataclass(frozen=True)
class Parameters:
    """Six bars of one length, twists alpha and -alpha in turn; hinges theta and phi in turn."""

    bar: float = parameter(0.15, "m", "bars", low=0, strict=True)
    alpha: float = parameter(1.2, "rad", "twist; pi / 2: a ring of six tetrahedra", low=0.6, high=1.5708)


def phi(p: Parameters, theta: np.ndarray) -> np.ndarray:
    """c2 + s2 (cos t + cos f) + (1 + c2) cos t cos f - 2 c sin t sin f = 0, c = cos(alpha): u cos f + v sin f = k, one of two solutions."""
    c, s2 = math.cos(p.alpha), math.sin(p.alpha) ** 2
    u, v = s2 + (1.0 + c * c) * np.cos(theta), -2.0 * c * np.sin(theta)
    return np.arctan2(v, u) + np.arccos(-(c * c + s2 * np.cos(theta)) / np.hypot(u, v))


def build(p: Parameters) -> Mechanism:
    """The pose theta = 0.3."""
    first, second = (p.bar, p.alpha, 0.0, 0.3), (p.bar, -p.alpha, 0.0, float(phi(p, np.array(0.3))))
    return InWorld("bricard_threefold", 0.06 * p.bar, summary="threefold-symmetric Bricard linkage").ring([first, second] * 3).build()


def closed(p: Parameters, given: Motion) -> Motion:
    """The hinges but that at which the loop is closed."""
    t, f = given["theta_1"], phi(p, given["theta_1"])
    return {"theta_2": f, "theta_4": f, "theta_5": t, "theta_6": f}


def gap(p: Parameters, m: Motion) -> np.ndarray:
    """The closure equation with the measured angles."""
    c, x, y = math.cos(p.alpha), np.cos(m["theta_1"]), np.cos(m["theta_2"])
    return c * c + (1 - c * c) * (x + y) + (1 + c * c) * x * y - 2 * c * np.sin(m["theta_1"]) * np.sin(m["theta_2"])


ENTRY = builder_entry(
    "bricard_threefold", "Threefold Bricard linkage", "spatial-loop",
    summary="Six equal bars with a threefold axis: a flat triangle that folds to a bundle, or a ring that turns inside out.",
    use="Deployable masts and booms; kaleidocycles.", origin="Raoul Bricard, 1927; Yan Chen, Zhong You, Tibor Tarnai, 2005",
    parameters=Parameters, build=build, path=lambda p: {"theta_1": (0.3, 1.5)}, closed=closed, sliders=("alpha",),
    plots=(PlotRecipe("hinges", ("theta_1", "theta_2")),),
    outside=(
        always("closure equation of the angles", "", gap, lambda p: 0.0, "Chen, You, Tarnai 2005"),
        alike("theta_5", "theta_1", "threefold symmetry"),
    ),
    chain="6 R", formulas="c2 + s2 (cos t + cos f) + (1 + c2) cos t cos f = 2 c sin t sin f.",
    sources=("Chen, You, Tarnai, Threefold-symmetric Bricard linkages for deployable structures, Int. J. Solids Struct. 42, 2005",),
)  # fmt: skip
