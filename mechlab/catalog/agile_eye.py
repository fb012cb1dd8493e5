"""The Agile Eye: a spherical 3-RRR whose nine axes meet in one point; it turns a camera faster than an eye."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from mechlab.kit.in_world import InWorld
from mechlab.kit.legs import turned
from mechlab.kit.short import PlotRecipe, builder_entry, parameter, value_at
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Inertia, Mechanism, revolute


@dataclass(frozen=True)
class Parameters:
    """All links span 90 degrees: drives along x, y, z; in the reference pose the platform axes are -y, -z, -x."""

    radius: float = parameter(0.1, "m", "radius of the links", low=0, strict=True)


DRIVE, ELBOW, TOP = np.eye(3), np.roll(np.eye(3), 2, axis=1), -np.roll(np.eye(3), 1, axis=1)
"""Axes of the drives, of the elbows and of the platform's hinges in the reference pose, a row each; neighbours at right angles."""


def build(p: Parameters) -> Mechanism:
    """The platform turns about three axes through the middle; each leg has two curved links, drawn as corners."""
    r, w = p.radius, InWorld("agile_eye", 0.06 * p.radius, (0, 0, 0), "spherical robot 3-RRR")
    turns = [revolute("platform_roll", "x"), revolute("platform_pitch", "y"), revolute("platform_yaw", "z")]
    w.link("platform", *turns, at=(0, 0, 0), to=list(0.6 * r * TOP), more=Inertia.cylinder(0.2, 0.4 * r, 0.2 * r))
    for k in range(3):
        a, e, v = DRIVE[k], ELBOW[k], TOP[k]
        w.link(f"arm_{k + 1}", revolute(f"drive_{k + 1}", a.tolist()), at=(0, 0, 0), to=[r * a, r * e])
        w.link(f"fore_{k + 1}", revolute(f"elbow_{k + 1}", e.tolist()), at=(0, 0, 0), to=[0.8 * r * e, 0.8 * r * v],
               parent=f"arm_{k + 1}")
        w.close(f"hinge_{k + 1}", f"fore_{k + 1}", "platform", (0, 0, 0), "revolute", v).drive(f"drive_{k + 1}", stiffness=20.0,
                damping=0.2)
    return w.build()


def drive(p: Parameters, k: int) -> float:
    """Drive k (0 to 2) at the end of the path: its elbow, turned by t about the drive, is at right angles to the platform's hinge v:
    cos t e.v + sin t (a x e).v = 0, so tan t = -e.v / (a x e).v."""
    v = turned(*END) @ TOP[k]
    return math.atan(-(ELBOW[k] @ v) / (np.cross(DRIVE[k], ELBOW[k]) @ v))


END, DRIVES = (0.3, -0.2, 0.25), ("drive_1", "drive_2", "drive_3")
ENTRY = builder_entry(
    "agile_eye", "Agile Eye", "parallel-robot",
    summary="Nine hinges through one point, all links of 90 degrees: three turns, simple equations.",
    use="Points cameras, lasers and solar panels.", origin="Clement Gosselin and Jean-Francois Hamel, 1994", parameters=Parameters,
    build=build, drives=DRIVES, plots=(PlotRecipe("drives", DRIVES),),
    path=lambda p: {f"platform_{n}": (0.0, x) for n, x in zip(("roll", "pitch", "yaw"), END, strict=True)},
    outside=tuple(value_at(f"drive_{k + 1}", partial(drive, k=k), "elbow at right angles to the hinge", unit="rad") for k in range(3)),
    chain="3 RRR, spherical", formulas="tan t = -e.v / (a x e).v.", sources=("Gosselin, Hamel, The Agile Eye, ICRA 1994",),
)  # fmt: skip
