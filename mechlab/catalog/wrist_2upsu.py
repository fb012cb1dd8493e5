"""A parallel wrist or ankle 2-UPS+U: two linear drives tilt a platform on a universal joint."""

from __future__ import annotations

from functools import partial

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import telescope, turned
from mechlab.kit.short import PlotRecipe, builder_entry, parameter, value_at
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Inertia, Mechanism, revolute


@dataclass(frozen=True)
class Parameters:
    """The foot tilts about x and y on the shin; both legs stand behind."""

    back: float = parameter(0.06, "m", "joints of the legs behind the axis", low=0, strict=True)
    side: float = parameter(0.05, "m", "and to the sides", low=0, strict=True)
    shin: float = parameter(0.3, "m", "upper joints above the wrist", low=0, strict=True)


def points(p: Parameters, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Upper and lower joint of leg k (1 left, 2 right)."""
    y = p.side if k == 1 else -p.side
    return np.array([-0.5 * p.back, y, p.shin]), np.array([-p.back, y, 0.0])


def build(p: Parameters) -> Mechanism:
    """Shin fixed, foot on two pins."""
    w = InWorld("wrist_2upsu", 0.01, summary="wrist 2-UPS+U").stand((0, 0, 0), (0, 0, p.shin))
    foot = [revolute("roll", "x"), revolute("pitch", "y")]
    w.link("foot", *foot, at=(0, 0, 0), to=[points(p, 1)[1], points(p, 2)[1], (0.1, 0, 0)],
           more=Inertia.box(0.8, 0.2, 0.08, 0.03, (0.04, 0, -0.03)))
    for k in (1, 2):
        telescope(w, k, *points(p, k), "foot")
    return w.mark("toe", "foot", (0.1, 0, 0)).build()


def length(p: Parameters, k: int) -> float:
    """Leg k at the end: |Rx(roll) Ry(pitch) b - a|."""
    a, b = points(p, k)
    return float(np.linalg.norm(turned(END["roll"], END["pitch"]) @ b - a))


END = {"roll": 0.2, "pitch": 0.35}
ENTRY = builder_entry(
    "wrist_2upsu", "Parallel ankle 2-UPS+U", "parallel-robot", summary="Two linear drives side by side tilt a foot on a universal joint.",
    use="Ankles and wrists of humanoid robots.", origin="humanoid robots since about 2000", parameters=Parameters, build=build,
    path=lambda p: {n: (0.0, x) for n, x in END.items()}, drives=("length_1", "length_2"), sliders=("back", "side"),
    plots=(PlotRecipe("legs", ("length_1", "length_2")),),
    outside=tuple(value_at(f"length_{k}", partial(length, k=k), "distance of its joints") for k in (1, 2)), chain="2 U P S + U",
    formulas="leg = |R b - a|.",
    sources=("Zhou, Tsagarakis, On the comprehensive kinematics analysis of a humanoid parallel ankle, 2018",),
)  # fmt: skip
