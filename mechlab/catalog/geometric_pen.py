"""The epicyclic straight line (Suardi's pen): a planet behind an idler turns back once for each turn of the arm."""

from __future__ import annotations

import math

from mechlab.kit.short import Outside, PlotRecipe, builder_entry, farthest, parameter
from mechlab.kit.train import Train
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism


@dataclass(frozen=True)
class Parameters:
    """Fixed sun with twice the teeth of the planet; the pen stands as far from the planet's axis as that from the sun's."""

    planet: int = parameter(20, "", "teeth of the planet; the sun has twice as many", low=12)
    idler: int = parameter(18, "", "teeth of the idler; they cancel", low=12)


def build(p: Parameters) -> Mechanism:
    """External gears only; pen P at the end of a bar on the planet, which starts in line with the arm."""
    t = Train("geometric_pen", 0.002, "epicyclic straight line")
    near = t.centres(2 * p.planet, p.idler)
    far = near + t.centres(p.idler, p.planet)
    t.wheel("sun", 2 * p.planet).carrier("arm", [far]).planet("idler", "arm", p.idler, near).planet("planet", "arm", p.planet, far)
    t.mesh_of("sun", "idler", "arm").mesh_of("idler", "planet", "arm").relation("held", sun=1).frame("P", "planet", (far, 0, 0))
    return t.drive("arm", stiffness=20.0, damping=0.2).build()


def reach(p: Parameters) -> float:
    """Arm [m]: half of sun, the idler, half of planet."""
    return 0.001 * (2 * p.planet + 2 * p.idler + p.planet)


ENTRY = builder_entry(
    "geometric_pen", "Epicyclic straight line", "straight-line",
    summary="Sun, idler and planet 2 : 1: the planet turns back as fast as the arm goes, its end goes straight.",
    use="Geometric pens; engines without a ring gear.", origin="Giambattista Suardi, 1752", parameters=Parameters, build=build,
    path=lambda p: {"arm": (0.0, 2 * math.pi)}, plots=(PlotRecipe("pen", ("P_x", "P_y")),),
    outside=(
        Outside("the pen stays on the line", "m", lambda p: 0.0, lambda p, m: farthest(m["P_y"], 0.0), 1e-9,
                "planet turns -1 for each turn of the arm"),
        Outside("half the stroke", "m", lambda p: 2 * reach(p), lambda p, m: float(max(m["P_x"])), 1e-9, "twice the arm"),
    ),
    chain="arm, 2 external meshes", formulas="P = arm (cos t + cos(-t), sin t + sin(-t)).",
    sources=("Adams, Geometrical and Graphical Essays, 1791",),
)  # fmt: skip
