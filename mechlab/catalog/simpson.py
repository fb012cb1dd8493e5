"""The Simpson train: two stages on one sun, three forward gears and reverse."""

from __future__ import annotations

import math

from mechlab.kit.short import Outside, PlotRecipe, builder_entry, parameter, ratio
from mechlab.kit.train import Train
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism

ROWS = {"1": {"arm_2": 1}, "2": {"sun": 1}, "R": {"arm_2": 1}}
"""What stands in each gear; in reverse the input is the sun, else the front ring."""


@dataclass(frozen=True)
class Parameters:
    """Both stages alike; the front carrier and the rear ring are the output."""

    gear: str = parameter("1", "", "1, 2 or R")
    teeth: tuple[int, int] = parameter((30, 66), "", "sun and rings", low=12)


def build(p: Parameters) -> Mechanism:
    """Front ring or sun drives; the common sun or the rear carrier stands."""
    t, (s, r) = Train("simpson", 0.002, "Simpson three-speed train"), p.teeth
    planet, orbit = (r - s) // 2, Train("size").centres(s, (r - s) // 2)
    t.wheel("sun", s, 0).wheel("ring_1", r, 0, ring=True).carrier("arm_1", [orbit]).planet("planet_1", "arm_1", planet, orbit)
    t.wheel("ring_2", r, 2.5, ring=True).carrier("arm_2", [orbit], 3.7).planet("planet_2", "arm_2", planet, orbit, level=2.5)
    for k in (1, 2):
        t.mesh_of("sun", f"planet_{k}", f"arm_{k}").mesh_of(f"ring_{k}", f"planet_{k}", f"arm_{k}")
    t.relation("output", arm_1=1, ring_2=-1).relation("brake", **ROWS.get(p.gear, ROWS["1"]))
    return t.drive("sun" if p.gear == "R" else "ring_1", stiffness=20.0, damping=0.2).build()


def willis(p: Parameters) -> float:
    """Input over output with e = sun / ring: 2 + e in first, 1 + e in second, -1 / e in reverse."""
    e = p.teeth[0] / p.teeth[1]
    return {"1": 2 + e, "2": 1 + e, "R": -1 / e}[p.gear if p.gear in ROWS else "1"]


ENTRY = builder_entry(
    "simpson", "Simpson train", "gear-train",
    summary="Two equal stages share a sun: three forward gears and reverse from two clutches and two brakes.",
    use="The automatic gearbox of most cars from 1955 to 1985.", origin="Howard Simpson, 1950", parameters=Parameters, build=build,
    path=lambda p: {"sun" if p.gear == "R" else "ring_1": (0.0, 2 * math.pi)}, plots=(PlotRecipe("output", ("arm_1_rate",)),),
    outside=(Outside("ratio of the engaged gear", "", willis, lambda p, m: ratio(m, "sun" if p.gear == "R" else "ring_1", "arm_1"), 1e-9,
                     "Willis 1841; 2 + e, 1 + e, -1 / e"),),
    chain="planetary, 2 meshes each", formulas="w_sun - w_arm = -(ring / sun) (w_ring - w_arm) in both stages.",
    sources=("Simpson, US patent 2518825, 1950",),
)  # fmt: skip
