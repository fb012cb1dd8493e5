"""Cardan circles (Tusi couple): a wheel rolls in a ring twice its size; its rim goes straight, its inner points on ellipses."""

from __future__ import annotations

import math

from mechlab.kit.short import Outside, PlotRecipe, builder_entry, farthest, parameter
from mechlab.kit.train import Train
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism


@dataclass(frozen=True)
class Parameters:
    """The ring stands; the arm carries the wheel at half the radius of the ring."""

    wheel: int = parameter(30, "", "teeth of the wheel; the ring has twice as many", low=12)
    inside: float = parameter(0.5, "", "place of the point E, in radii of the wheel from its axis", low=0)


def build(p: Parameters) -> Mechanism:
    """P on the pitch circle and E inside it both start on the x axis."""
    t = Train("cardan_circles", 0.004, "Cardan circles")
    r = t.radius(p.wheel)
    t.wheel("ring", 2 * p.wheel, ring=True).carrier("arm", [r]).planet("wheel", "arm", p.wheel, r).mesh_of("ring", "wheel", "arm")
    t.relation("held", ring=1).frame("P", "wheel", (r, 0, 0)).frame("E", "wheel", (p.inside * r, 0, 0))
    return t.drive("arm", stiffness=20.0, damping=0.2).build()


def radius(p: Parameters) -> float:
    """Pitch radius of the wheel [m]."""
    return 0.002 * p.wheel


ENTRY = builder_entry(
    "cardan_circles", "Cardan circles", "straight-line",
    summary="A wheel in a ring of twice its size: its rim goes exactly straight, all other points on ellipses.",
    use="Printing presses and engines without a connecting rod (White, Parsons), ellipsographs.",
    origin="Nasir al-Din al-Tusi, 1247; Girolamo Cardano, 1570", parameters=Parameters, build=build,
    path=lambda p: {"arm": (0.0, 2 * math.pi)}, plots=(PlotRecipe("points", ("P_x", "E_x", "E_y")),),
    outside=(
        Outside("P stays on the diameter", "m", lambda p: 0.0, lambda p, m: farthest(m["P_y"], 0.0), 1e-9,
                "Tusi couple: x = 2 r cos t, y = 0"),
        Outside("half the stroke of P", "m", lambda p: 2 * radius(p), lambda p, m: float(max(m["P_x"])), 1e-9, "x = 2 r cos t"),
        # E = ((1 + k) r cos t, (1 - k) r sin t)
        Outside("x2 / (1 + k)2 + y2 / (1 - k)2 over r2, on the path of E", "", lambda p: 1.0,
                lambda p, m: farthest(((m["E_x"] / (1 + p.inside)) ** 2 + (m["E_y"] / (1 - p.inside)) ** 2) / radius(p) ** 2, 1.0), 1e-9,
                "ellipse with axes (1 + k) r, (1 - k) r"),
    ),
    chain="arm, internal mesh", formulas="P = (2 r cos t, 0).", sources=("Reuleaux, Theoretische Kinematik, 1875",),
)  # fmt: skip
