"""The bevel differential of a car: the cage turns with the mean of both wheels."""

from __future__ import annotations

from mechlab.kit.short import Outside, PlotRecipe, builder_entry, parameter
from mechlab.kit.train import Train
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.shapes import pitch_angles


@dataclass(frozen=True)
class Parameters:
    """Side gears left and right on the axis z, a pinion across it in the cage."""

    side: int = parameter(24, "", "teeth of the side gears", low=12)
    pinion: int = parameter(16, "", "teeth of the pinion; they cancel", low=12)
    left_share: float = parameter(0.25, "", "turn of the left wheel over that of the cage on the path")


def build(p: Parameters) -> Mechanism:
    """One pinion stands for all."""
    t = Train("bevel_differential", 0.004, "bevel differential").carrier("cage", [0.06])
    slope, steep = pitch_angles(p.side, p.pinion)
    t.bevel("left", p.side, (0, 0, 1), slope).bevel("right", p.side, (0, 0, -1), slope).bevel("pinion", p.pinion, (1, 0, 0), steep,
            "cage")
    t.mesh_of("left", "pinion", "cage", bevel=True).mesh_of("right", "pinion", "cage", bevel=True)
    return t.drive("cage", stiffness=20.0, damping=0.2).drive("left", stiffness=20.0, damping=0.2).build()


ENTRY = builder_entry(
    "bevel_differential", "Bevel differential", "gear-train",
    summary="Two side gears and a pinion in a cage: two freedoms, the cage has the mean of the wheels.",
    use="Axles of cars; adding of two turns in instruments.", origin="Onesiphore Pecqueur, 1827", parameters=Parameters, build=build,
    path=lambda p: {"cage": (0.0, 2.0), "left": (0.0, 2.0 * p.left_share)}, sliders=(),
    plots=(PlotRecipe("wheels", ("left_rate", "right_rate")),),
    outside=(
        # the right axis points the other way: its angle about -z
        Outside("turn of the right wheel about +z at the end", "rad", lambda p: 2.0 * (2.0 - p.left_share),
                lambda p, m: -float(m["right"][-1]), 1e-9, "left + right = 2 cage"),
        Outside("turn of the pinion in the cage", "rad", lambda p: abs(2.0 * (p.left_share - 1.0)) * p.side / p.pinion,
                lambda p, m: abs(float(m["pinion"][-1])), 1e-9, "(left - cage) side / pinion"),
    ),
    chain="cage, 3 bevel gears", formulas="left + right = 2 cage.", sources=("Norton, Design of Machinery, 9.11",),
)  # fmt: skip
