"""Ferguson's paradox: three wheels of nearly equal size on one planet: one stands, one turns forward, one backward."""

from __future__ import annotations

import math

from mechlab.kit.short import Outside, PlotRecipe, builder_entry, parameter, ratio
from mechlab.kit.train import Train
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism


@dataclass(frozen=True)
class Parameters:
    """A thick planet on an arm meshes with three wheels on the main axis, the middle one of them fixed."""

    fixed: int = parameter(50, "", "teeth of the fixed wheel", low=20)
    more: int = parameter(51, "", "teeth of the upper wheel", low=20)
    less: int = parameter(49, "", "teeth of the lower wheel", low=20)
    planet: int = parameter(20, "", "teeth of the planet; they cancel", low=12)


def build(p: Parameters) -> Mechanism:
    """All axes at the distance of the fixed wheel; profile shift takes up the tooth more or less."""
    t = Train("ferguson", 0.002, "Ferguson's paradox")
    orbit = t.centres(p.fixed, p.planet)
    t.wheel("held", p.fixed).wheel("upper", p.more, 1.1).wheel("lower", p.less, -1.1).carrier("arm", [orbit], 2.4).planet("planet",
            "arm", p.planet, orbit)
    for wheel in ("held", "upper", "lower"):
        t.mesh_of(wheel, "planet", "arm")
    return t.relation("fixed", held=1).drive("arm", stiffness=20.0, damping=0.2).build()


ENTRY = builder_entry(
    "ferguson", "Ferguson's paradox", "gear-train",
    summary="Wheels of 49, 50 and 51 teeth on one planet: they turn backward, not at all, and forward.",
    use="Orreries; the idea behind Wolfrom and other high reductions.", origin="James Ferguson, 1764", parameters=Parameters, build=build,
    path=lambda p: {"arm": (0.0, 2 * math.pi)}, plots=(PlotRecipe("wheels", ("upper_rate", "lower_rate")),),
    outside=(
        Outside("turn of the upper wheel in one of the arm", "", lambda p: 1 - p.fixed / p.more, lambda p, m: ratio(m, "upper", "arm"),
                1e-12, "Ferguson 1764: 1 / 51 forward (his wheels: 99, 100, 101)"),
        Outside("turn of the lower wheel in one of the arm", "", lambda p: 1 - p.fixed / p.less, lambda p, m: ratio(m, "lower", "arm"),
                1e-12, "Ferguson 1764: 1 / 49 backward"),
    ),
    chain="planetary, 3 meshes", formulas="w / w_arm = 1 - fixed / teeth.",
    sources=("Ferguson, The Description and Use of a New Machine called the Mechanical Paradox, 1764",),
)  # fmt: skip
