"""The Roberval balance: a parallelogram with pans, where it does not matter how far out a weight lies."""

from __future__ import annotations

import math

import numpy as np

from mechlab.kit.in_world import DENSITY, InWorld
from mechlab.kit.short import Motion, PlotRecipe, alike, builder_entry, parameter, value_at
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, revolute


@dataclass(frozen=True)
class Parameters:
    """Two equal beams on a post, an upright on both sides, each with an arm outwards and a weight at its end."""

    beam: float = parameter(0.2, "m", "half of a beam", low=0, strict=True)
    post: float = parameter(0.15, "m", "distance of the beams", low=0, strict=True)
    left: float = parameter(0.05, "m", "arm outwards, left", low=0, strict=True)
    right: float = parameter(0.15, "m", "arm outwards, right", low=0, strict=True)
    load: float = parameter(1.0, "kg", "weight on each arm", low=0, strict=True)
    tilt: float = parameter(0.4, "rad", "tilt of the beams on the path, right side down", low=-0.6, high=0.6)


def torque(p: Parameters) -> float:
    """That holds the beam at the end: uprights rise and fall without turning, so each side counts with its weight alone, wherever it lies;
    here the longer arm is heavier: g (right - left) DENSITY beam cos(tilt)."""
    return -9.81 * (p.right - p.left) * DENSITY * p.beam * math.cos(p.tilt)


def build(p: Parameters) -> Mechanism:
    """The upper beam carries both uprights, the lower one closes two loops; tilt about y takes the right side down."""
    w, low = InWorld("roberval", 0.015, summary="Roberval balance").stand((0, 0, 0), (0, 0, -p.post)), np.array([0.0, 0.0, -p.post])
    ends = {"left": np.array([-p.beam, 0.0, 0.0]), "right": np.array([p.beam, 0.0, 0.0])}
    w.link("upper", revolute("tilt", "y"), at=(0, 0, 0), to=list(ends.values()))
    w.link("lower", revolute("lower_tilt", "y"), at=low, to=[x + low for x in ends.values()])
    for (side, pin), out in zip(ends.items(), (-p.left, p.right), strict=True):
        tip = pin + 0.5 * low + [out, 0, 0]
        w.link(side, revolute(f"{side}_pin", "y"), at=pin, to=[pin + low], parent="upper")
        w.link(f"{side}_arm", at=pin + 0.5 * low, to=[tip], parent=side, ball=p.load)
        w.close(f"{side}_low", side, "lower", pin + low).mark(f"{side}_load", f"{side}_arm", tip)
    return w.drive("tilt", stiffness=20.0, damping=0.2).build()


def closed(p: Parameters, given: Motion) -> Motion:
    """Both beams tilt alike, the uprights stay upright."""
    t = given["tilt"]
    return {"lower_tilt": t, "left_pin": -t, "right_pin": -t, "right_load_z": -0.5 * p.post - p.beam * np.sin(t)}


ENTRY = builder_entry(
    "roberval", "Roberval balance", "balance", summary="Two beams and two uprights: equal weights balance wherever they lie on their pans.",
    use="Shop scales with pans on top.", origin="Gilles Personne de Roberval, 1669", parameters=Parameters, build=build, closed=closed,
    path=lambda p: {"tilt": (0.0, p.tilt)}, sliders=("left", "right"), plots=(PlotRecipe("pans", ("left_load_z", "right_load_z")),),
    outside=(value_at("tilt_force", torque, "virtual work", text="torque that holds the beam at the end", unit="N m"),
             alike("left_pin", "tilt", "parallelogram", -1.0)),
    chain="R, 2 RR, R", formulas="torque = g beam cos(tilt) (difference of the weights).", sources=("Roberval, Journal des Scavans, 1670",),
)  # fmt: skip
