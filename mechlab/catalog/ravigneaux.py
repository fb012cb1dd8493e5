"""The Ravigneaux set: two suns, long and short planets on one carrier, one ring."""

from __future__ import annotations

import math

from mechlab.kit.short import Outside, PlotRecipe, builder_entry, parameter, ratio
from mechlab.kit.train import Train
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism


@dataclass(frozen=True)
class Parameters:
    """Small sun with the short planet, large sun and ring with the long one; the carrier stands (gear 1) or the large sun (gear 2)."""

    gear: int = parameter(1, "", "1: carrier held, 2: large sun held", low=1, high=2)
    teeth: tuple[int, int, int] = parameter((30, 36, 78), "", "small sun, large sun, ring", low=12)


def build(p: Parameters) -> Mechanism:
    """The small sun drives, the ring is the output."""
    t, (small, large, ring) = Train("ravigneaux", 0.002, "Ravigneaux set"), p.teeth
    long = (ring - large) // 2
    far, near = t.centres(large, long), t.centres(small, long)
    t.wheel("small_sun", small, -1).wheel("large_sun", large, 0).wheel("ring", ring, 0, ring=True)
    t.carrier("arm", [far, near], 1.2).planet("long", "arm", long, far).planet("short", "arm", long, near, 0.9, -1)
    t.mesh_of("large_sun", "long", "arm").mesh_of("ring", "long", "arm").mesh_of("small_sun", "short", "arm").mesh_of("short", "long",
            "arm")
    t.relation("brake", **({"arm": 1} if p.gear == 1 else {"large_sun": 1}))
    return t.drive("small_sun", stiffness=20.0, damping=0.2).build()


def willis(p: Parameters) -> float:
    """Carrier held: ring / small sun, same sense. Large sun held: the carrier has the
    share (ring / large) / (1 + ring / large) of the ring."""
    small, large, ring = p.teeth
    if p.gear == 1:
        return ring / small
    share = (ring / large) / (1 + ring / large)  # carrier over ring
    return share + ring / small * (1 - share)


ENTRY = builder_entry(
    "ravigneaux", "Ravigneaux set", "gear-train",
    summary="Two suns, two planets in series, one carrier and one ring: four members to drive or hold.",
    use="Automatic gearboxes, hub gears, the rear set of Lepelletier's.", origin="Pol Ravigneaux, 1933", parameters=Parameters,
    build=build, path=lambda p: {"small_sun": (0.0, 2 * math.pi)}, plots=(PlotRecipe("ring", ("ring_rate",)),),
    outside=(Outside("ratio of small sun to ring", "", willis, lambda p, m: ratio(m, "small_sun", "ring"), 1e-9, "Willis 1841"),),
    chain="planetary, 4 meshes",
    formulas="w_small - w_arm = ring / small (w_ring - w_arm); w_large - w_arm = -ring / large (w_ring - w_arm).",
    sources=("Ravigneaux, US patent 1761355, 1930",),
)  # fmt: skip
