"""A compliant four-bar by its pseudo-rigid-body model: short flexible necks as pins with torsion springs."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping

import numpy as np

from mechlab.kit.compass import at, meet
from mechlab.kit.in_world import InWorld
from mechlab.kit.short import Outside, PlotRecipe, builder_entry, each, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism


@dataclass(frozen=True)
class Parameters:
    """Four necks of one kind; it is cut from one piece with the crank at `start`, an angle to the ground link."""

    bars: tuple[float, float, float, float] = parameter((0.05, 0.09, 0.07, 0.1), "m", "crank, coupler, rocker, ground", low=0)
    start: float = parameter(1.6, "rad", "crank as it is made")
    turn: float = parameter(-0.4, "rad", "turn of the crank on the path", low=-0.6, high=0.6)
    stiffness: float = parameter(0.2, "N m/rad", "a neck: E I over its length", low=0, strict=True)


def angles(p: Parameters, given: Mapping[str, float]) -> dict[str, float]:
    """Turns at the four pins on the way around from that of the crank, by compasses; the crank stands at theta_1 + pi to the ground."""
    pin = at(p.bars[0], given["theta_1"] + math.pi)
    end = meet(pin, p.bars[1], complex(p.bars[3]), p.bars[2], 1)
    coupler, rocker = cmath.phase(end - pin), cmath.phase(end - p.bars[3])
    turns = given["theta_1"], coupler - given["theta_1"] - math.pi, rocker + math.pi - coupler, -rocker
    return {f"theta_{k}": x for k, x in enumerate(turns, 1)}


def torque(p: Parameters) -> float:
    """Virtual work: sum of k psi dpsi / dcrank over the necks, psi the turns against the piece as made; rates h3, h4 of coupler and rocker
    over that of the crank by the law of sines."""
    made, bent = (np.array([*angles(p, {"theta_1": t}).values()]) for t in (p.start - math.pi, p.start + p.turn - math.pi))
    h3, h4 = p.bars[0] / math.sin(bent[2]) * np.array([-math.sin(bent[1] + bent[2]) / p.bars[1], math.sin(bent[1]) / p.bars[2]])
    return p.stiffness * float((bent - made) @ [1.0, h3 - 1.0, h4 - h3, -h4])


def build(p: Parameters) -> Mechanism:
    """Pins along z, a spring in each."""
    made, w = angles(p, {"theta_1": p.start - math.pi}), InWorld("compliant_fourbar", 0.06 * p.bars[0], (0, 0, 0), "compliant four-bar")
    return w.ring([(bar, 0.0, 0.0, x) for bar, x in zip(p.bars, made.values(), strict=True)], stiffness=p.stiffness).build()


ENTRY = builder_entry(
    "compliant_fourbar", "Compliant four-bar", "compliant", summary="Four short necks bend as pins with springs: cut from one piece.",
    use="Tweezers, clips, microsystems, bistable switches.", origin="pseudo-rigid-body model: Larry Howell and Ashok Midha, 1994",
    parameters=Parameters, build=build, path=lambda p: {"theta_1": (p.start - math.pi, p.start + p.turn - math.pi)}, closed=each(angles),
    plots=(PlotRecipe("necks", ("theta_1", "theta_2", "theta_3", "theta_4")),), sliders=("stiffness",),
    outside=(Outside("torque that holds the crank at the end", "N m", torque, lambda p, m: float(m["theta_1_force"][-1]), 1e-8,
                     "Howell 2001, virtual work of the necks"),),
    chain="RRRR with springs", formulas="T = k sum psi dpsi / dcrank.", sources=("Howell, Compliant Mechanisms, 2001, chapter 6",),
)  # fmt: skip
