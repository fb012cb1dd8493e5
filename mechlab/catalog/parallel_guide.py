"""A compliant parallel guide by its pseudo-rigid-body model: flexures as pins with torsion springs."""

from __future__ import annotations

from mechlab.kit.in_world import InWorld
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, revolute

GAMMA, K_THETA = 0.8517, 2.65
"""Howell's characteristic radius factor and stiffness coefficient for fixed-guided beams."""


@dataclass(frozen=True)
class Parameters:
    """Two flexures side by side; a stage between their ends stays parallel."""

    flexure: float = parameter(0.1, "m", "length of the flexures", low=0, strict=True)
    width: float = parameter(0.06, "m", "their distance", low=0, strict=True)
    bending: float = parameter(0.002, "N m2", "E I of a flexure", low=0, strict=True)
    bend: float = parameter(0.3, "rad", "turn of the pseudo-rigid bars on the path", low=0, high=0.8, strict=True)


def spring(p: Parameters) -> float:
    """Torsion spring of each of the four pins [N m/rad]: a fixed-guided beam has one at both ends, 2 gamma K E I / length."""
    return 2.0 * GAMMA * K_THETA * p.bending / p.flexure


def build(p: Parameters) -> Mechanism:
    """Bars of gamma length upright; the angle counts from the upright."""
    r, w, k = GAMMA * p.flexure, InWorld("parallel_guide", 0.003, (0, 0, 0), "compliant parallel guide"), spring(p)
    left, right = (-0.5 * p.width, 0, 0), (0.5 * p.width, 0, 0)
    up = lambda q: (q[0], 0, r)  # noqa: E731
    w.link("left", revolute("bend", "y", stiffness=k), at=left, to=[up(left)])
    w.link("stage", revolute("stage_pin", "y", stiffness=k), at=up(left), to=[up(right)], parent="left")
    w.link("right", revolute("right_bend", "y", stiffness=k), at=right, to=[up(right)])
    w.link("end", revolute("end_pin", "y", stiffness=k), at=up(right), to=[(right[0], 0, 1.05 * r)], parent="right")
    w.close("weld", "end", "stage", up(right), "revolute", (1, 0, 0)).mark("P", "stage", (0, 0, r))
    return w.drive("bend", stiffness=2.0, damping=0.01).build()


ENTRY = builder_entry(
    "parallel_guide", "Compliant parallel guide", "compliant",
    summary="Two flexures as pinned bars with torsion springs: a stage that shifts without turning.",
    use="Precision stages, microsystems, watch parts.", origin="pseudo-rigid-body model: Larry Howell and Ashok Midha, 1994",
    parameters=Parameters, build=build, timestep=8e-4, path=lambda p: {"bend": (0.0, p.bend)}, sliders=("flexure",),
    plots=(PlotRecipe("stage", ("P_x", "P_z")),),
    outside=(
        # four springs turn by the same angle: torque 4 k t; force on the stage = torque / (gamma length cos t)
        Outside("torque on the left bar at the end", "N m", lambda p: 4 * spring(p) * p.bend, lambda p, m: float(m["bend_force"][-1]),
                1e-9, "virtual work: 4 k t"),
        # two fixed-guided beams: 2 x 12 E I / L^3; the model has 4 k / (gamma L)^2 = 8 K E I / (gamma L^3), 3.7 % more
        Outside("initial stiffness of the stage over 24 E I / L^3", "", lambda p: 1.0,
                lambda p, m: float(m["bend_force"][1] / m["bend"][1] / (GAMMA * p.flexure) ** 2 / (24 * p.bending / p.flexure**3)), 0.04,
                "Euler-Bernoulli beams; Howell states the model to some per cent"),
    ),
    chain="RRRR with springs", formulas="k = 2 gamma K E I / L.", sources=("Howell, Compliant Mechanisms, 2001, chapter 5",),
)  # fmt: skip
