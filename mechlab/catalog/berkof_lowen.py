"""A fully force-balanced four-bar (Berkof and Lowen): counterweights keep the common centre of mass at rest."""

from __future__ import annotations

import cmath
import math

import numpy as np

from mechlab.kit.compass import meet
from mechlab.kit.in_world import InWorld
from mechlab.kit.short import Motion, PlotRecipe, always, builder_entry, parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Inertia, Mechanism, revolute


@dataclass(frozen=True)
class Parameters:
    """Crank O-A, coupler A-B, rocker D-B; the coupler is uniform, crank and rocker are light with a counterweight each."""

    crank: float = parameter(0.1, "m", "crank", low=0, strict=True)
    coupler: float = parameter(0.3, "m", "coupler", low=0, strict=True)
    rocker: float = parameter(0.25, "m", "rocker", low=0, strict=True)
    ground: float = parameter(0.3, "m", "ground", low=0, strict=True)
    mass: float = parameter(0.6, "kg", "mass of the coupler", low=0, strict=True)
    counter: float = parameter(1.2, "kg", "mass of each counterweight", low=0, strict=True)


def build(p: Parameters) -> Mechanism:
    """m1 r1 = m2 (l2 - r2) l1 / l2 and m3 r3 = m2 r2 l3 / l2, opposite to the pins; here r2 = l2 / 2."""
    d, t, at = complex(p.ground, 0), cmath.rect(p.crank, 1.0), lambda z: np.array([z.real, z.imag, 0.0])
    w, b = InWorld("berkof_lowen", 0.01, (0, -9.81, 0), "balanced four-bar"), meet(t, p.coupler, d, p.rocker, 1)
    for name, pivot, pin in (("crank", 0j, t), ("rocker", d, b)):
        back = -0.5 * p.mass / p.counter * (pin - pivot)
        weight = Inertia.cylinder(p.counter, 0.3 * abs(pin - pivot), 0.02).at((back.real, back.imag, 0.0))
        joint, ends = revolute(f"{name}_angle", "z", zero=cmath.phase(pin - pivot)), [at(pin), at(pivot + back)]
        w.link(name, joint, at=at(pivot), to=ends, mass_per_length=1e-9, more=weight).mark(f"G_{name}", name, ends[1])
    rod = Inertia.rod(p.mass, (0, 0, 0), tuple(at(b - t).tolist()), 0.005)
    w.link("coupler", revolute("coupler_joint", "z"), at=at(t), to=[at(b)], parent="crank", mass_per_length=1e-9, more=rod)
    w.close("pin", "coupler", "rocker", at(b)).mark("G_coupler", "coupler", at(0.5 * (t + b)))
    return w.drive("crank_angle", stiffness=50.0, damping=0.5).build()


def centre(p: Parameters, m: Motion, x: str) -> np.ndarray:
    """A coordinate of the common centre of mass along the path."""
    return (p.counter * (m[f"G_crank_{x}"] + m[f"G_rocker_{x}"]) + p.mass * m[f"G_coupler_{x}"]) / (2 * p.counter + p.mass)


ENTRY = builder_entry(
    "berkof_lowen", "Balanced four-bar", "balance",
    summary="Counterweights on crank and rocker balance the coupler too: no shaking force at any speed.", use="High-speed machinery.",
    origin="R. S. Berkof and G. G. Lowen, 1969", parameters=Parameters, build=build,
    path=lambda p: {"crank_angle": (1.0, 1.0 + 2 * math.pi)}, sliders=("coupler",), plots=(PlotRecipe("rocker", ("rocker_angle",)),),
    outside=(always("motion of the common centre of mass over a turn", "m",
                    lambda p, m: np.hypot(*(centre(p, m, x) - centre(p, m, x)[0] for x in "xy")), lambda p: 0.0, "Berkof, Lowen 1969"),
             always("torque that holds the crank against gravity", "N m", lambda p, m: m["crank_angle_force"], lambda p: 0.0,
                    "the centre of mass stands still; rods of 1e-9 kg/m left out", 1e-7)),
    chain="RRRR", formulas="m1 r1 = m2 l1 / 2, m3 r3 = m2 l3 / 2.", sources=("Berkof, Lowen, J. Eng. Ind. 91, 1969",),
)  # fmt: skip
