"""The four-bar as a Mechanism. The reference pose is any assembled one; the closed form gives it."""

from __future__ import annotations

import math
from functools import lru_cache

from mechlab.analytic import fourbar as closed_form
from mechlab.catalog.fourbar.parameters import Parameters
from mechlab.kit.palette import BLUE, ORANGE, SLATE, TEAL
from mechlab.mechanism import Builder, Mechanism, Placement, revolute, shape
from mechlab.mechanism.geometry import axis_rotation

AXIS = "-y"


def start_angle(p: Parameters) -> float:
    """A crank angle in the middle of those at which the four-bar assembles, 1 rad when it turns fully."""
    limits = closed_form.crank_limits(*p.lengths)
    low, high = limits.ranges[0] if limits.ranges else (1.0, 1.0)
    return 1.0 if limits.full_turn else 0.5 * (low + high)


def width(p: Parameters, length: float) -> float:
    """How wide a bar is drawn [m]."""
    return 0.03 * max(p.lengths) + 0.05 * length


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """Three bars and one loop: 3 coordinates, 3 rows (one of them void), one freedom."""
    phi = start_angle(p)
    pose = closed_form.solve(*p.lengths, phi, mode=p.mode)
    psi, chi = float(pose.coupler_angle), float(pose.rocker_angle)
    b = Builder("fourbar", gravity=(0.0, 0.0, -p.gravity), summary="planar four-bar linkage")
    layer = 0.045 * max(p.lengths)
    for name, length, color, lift in (
        ("crank", p.crank, BLUE, 0.0),
        ("coupler", p.coupler, ORANGE, 1.0),
        ("rocker", p.rocker, TEAL, 0.0),
    ):
        joint = {"crank": "crank_angle", "coupler": "coupler_joint", "rocker": "rocker_angle"}[name]
        parent, at = (
            ("crank", (p.crank, 0.0, 0.0))
            if name == "coupler"
            else ("ground", (0.0 if name == "crank" else p.ground, 0.0, 0.0))
        )
        b.bar(name, revolute(joint, AXIS), length, parent=parent, at=at, mass=p.mass_per_length * length,
              width=width(p, length), color=color, layer=layer * lift)  # fmt: skip
    b.loop("pin", "coupler", "rocker", (p.coupler, 0.0, 0.0), (p.rocker, 0.0, 0.0))
    b.shaft("coupler_angle", {"crank_angle": 1, "coupler_joint": 1})
    b.frame("B", "crank", (p.crank, 0.0, 0.0)).frame("C", "rocker", (p.rocker, 0.0, 0.0))
    b.frame("middle", "coupler", (0.5 * p.coupler, 0.0, 0.0))
    b.drive("crank_angle", stiffness=200.0, damping=2.0)
    turned = axis_rotation((1.0, 0.0, 0.0), math.pi / 2)
    for x in (0.0, p.ground):
        b.ground(shape("bracket", Placement.of(turned, (x, 0.9 * layer, 0.0)), SLATE,
                       height=0.6 * p.crank + 0.1 * p.ground, width=1.1 * layer, thickness=0.6 * layer))  # fmt: skip
    return b.assemble({"crank_angle": phi, "coupler_joint": psi - phi, "rocker_angle": chi}, hold=["crank_angle"])
