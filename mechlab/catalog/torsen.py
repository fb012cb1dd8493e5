"""The Torsen differential, type 1: worms on the shafts, worm wheels in pairs that spur gears join."""

from __future__ import annotations

from mechlab.kit.in_world import InWorld
from mechlab.kit.short import Motion, PlotRecipe, builder_entry, parameter, value_at
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, revolute


@dataclass(frozen=True)
class Parameters:
    """Worms left and right on the shafts, of one hand; the axes of the wheels are in the cage, across the shafts."""

    worm: int = parameter(6, "", "threads of each worm", low=1)
    wheel: int = parameter(7, "", "teeth of each worm wheel", low=5)
    left_share: float = parameter(0.25, "", "turn of the left shaft over that of the cage on the path")


def build(p: Parameters) -> Mechanism:
    """One pair of wheels stands for all. The slip of crossed helical teeth leaves one rolling condition for each mesh: a relation."""
    w, r = InWorld("torsen", 0.008, (0, 0, 0), "Torsen differential"), 0.02
    w.link("cage", revolute("cage", "z"), at=(0, 0, 0), to=[(0, 2 * r, r), (0, 2 * r, -r), (0, -2 * r, r), (0, -2 * r, -r)])
    for side, z in (("left", r), ("right", -r)):
        w.link(side, revolute(side, "z"), at=(0, 0, z), to=[(0, 0, 3 * z)], wheel=(r, 1.6 * r, 4 * p.worm))
        w.link(f"wheel_{side}", revolute(f"wheel_{side}", "x"), at=(0, 2 * r, z), to=[(1.5 * r, 2 * r, z), (-1.5 * r, 2 * r, z)],
               parent="cage", wheel=(r, 1.2 * r, 4 * p.wheel))
        w.relation(f"worm_{side}", **{f"wheel_{side}": p.wheel, side: -p.worm, "cage": p.worm})
    w.relation("spur", wheel_left=1, wheel_right=1)
    return w.drive("cage", stiffness=20.0, damping=0.2).drive("left", stiffness=20.0, damping=0.2).build()


def closed(p: Parameters, given: Motion) -> Motion:
    """Willis in the cage: wheel teeth wheel = worm threads (shaft - cage), and the wheels turn against each other."""
    turn = p.worm / p.wheel * (given["left"] - given["cage"])
    return {"wheel_left": turn, "wheel_right": -turn, "right": 2.0 * given["cage"] - given["left"]}


ENTRY = builder_entry(
    "torsen", "Torsen differential", "gear-train",
    summary="Worms and worm wheels in a cage: both shafts share the turn, and friction of the worms holds a spinning wheel back.",
    use="Limited slip in axles and between axles; here without losses, as relations.", origin="Vernon Gleasman, 1958",
    parameters=Parameters, build=build, path=lambda p: {"cage": (0.0, 2.0), "left": (0.0, 2.0 * p.left_share)}, closed=closed,
    plots=(PlotRecipe("shafts", ("left_rate", "right_rate")),),
    outside=(
        value_at("right", lambda p: 2.0 * (2.0 - p.left_share), "left + right = 2 cage", unit="rad"),
        value_at("wheel_left", lambda p: 2.0 * (p.left_share - 1.0) * p.worm / p.wheel, "worm drive in the cage", unit="rad"),
    ),
    chain="cage, 2 worm drives, spur gears", formulas="left + right = 2 cage.",
    sources=("Gleasman, US patent 2859641, Differential mechanism, 1958", "Merritt, Gear Trains, 1947"),
)  # fmt: skip
