"""A parallel-axis differential (Torsen type 2): pairs of planets in mesh between two suns."""

from __future__ import annotations

from mechlab.kit.short import Outside, PlotRecipe, builder_entry, parameter
from mechlab.kit.train import Train
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism


@dataclass(frozen=True)
class Parameters:
    """Each planet meshes with its sun and with the planet of the other side."""

    sun: int = parameter(24, "", "teeth of both suns", low=12)
    planet: int = parameter(14, "", "teeth of the planets; they cancel", low=12)


def build(p: Parameters) -> Mechanism:
    """One pair stands for all; the planets stand so far apart that they mesh."""
    t = Train("spur_differential", 0.003, "parallel-axis differential")
    orbit = t.centres(p.sun, p.planet)
    half = p.planet / (p.sun + p.planet)  # sine of half the angle of the pair: planets touch
    apart = 2.0 * half  # small-angle value; the mesh is a relation, its exact place only looks
    t.wheel("left", p.sun, 0.6).wheel("right", p.sun, -0.6).carrier("cage", [orbit], -2)
    t.planet("planet_left", "cage", p.planet, orbit, 0.0, 0.4).planet("planet_right", "cage", p.planet, orbit, apart, -0.4)
    t.mesh_of("left", "planet_left", "cage").mesh_of("right", "planet_right", "cage").mesh_of("planet_left", "planet_right", "cage")
    return t.drive("cage", stiffness=20.0, damping=0.2).drive("left", stiffness=20.0, damping=0.2).build()


ENTRY = builder_entry(
    "spur_differential", "Parallel-axis differential", "gear-train",
    summary="Spur gears only: planets in pairs between two suns, the cage has the mean of both.",
    use="Limited-slip differentials (with helical teeth), synchronized hoists.",
    origin="Vernon Gleasman's Torsen, 1958; type 2 about 1990", parameters=Parameters, build=build,
    path=lambda p: {"cage": (0.0, 2.0), "left": (0.0, 0.5)}, plots=(PlotRecipe("wheels", ("left_rate", "right_rate")),),
    outside=(
        Outside("turn of the right wheel at the end", "rad", lambda p: 3.5, lambda p, m: float(m["right"][-1]), 1e-9,
                "left + right = 2 cage"),
        Outside("turn of the left planet in the cage", "rad", lambda p: 1.5 * p.sun / p.planet, lambda p, m: float(m["planet_left"][-1]),
                1e-9, "-(left - cage) sun / planet"),
    ),
    chain="cage, 3 external meshes", formulas="left + right = 2 cage.", sources=("Merritt, Gear Trains, 1947",),
)  # fmt: skip
