"""The class IV linkage as a Mechanism: five bars, two loops, one freedom."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from mechlab.catalog.class4_linkage.geometry import at, motion_at, start_angle
from mechlab.catalog.class4_linkage.parameters import Class4Parameters
from mechlab.kit.planar_build import Style, mechanism_of
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array

NAMES = {f"link{k}": f"theta{k}" for k in (2, 3, 4, 5)}
START_OFFSET = 1e-3
"""The engines start this far off the closed form in every coordinate: near enough for the mode, not an answer."""


def style(p: Class4Parameters) -> Style:
    """Masses and looks. The drive of the files: a soft servo."""
    return Style(
        p.mass_per_length, gravity=p.gravity, width=0.05, names=NAMES, drive_stiffness=2000.0, drive_damping=200.0
    )


@lru_cache(maxsize=32)
def build(p: Class4Parameters, fidelity: str) -> Mechanism:
    """Five bars and two pins, assembled at the start angle in the chosen mode. Raises NoSolution when it never closes."""
    angle = start_angle(p)
    chain, motion = motion_at(p, angle)
    summary = "class IV linkage (Stephenson chain, driven in its five-bar side)"
    return mechanism_of(chain, {"crank": angle}, style(p), summary, motion)


def pose(p: Class4Parameters, m: Mechanism, angle: float) -> Array:
    """(nq,) coordinates of the chosen mode at a crank angle, from the closed form."""
    theta = {k: float(v.x) for k, v in at(p, angle).angles.items()}
    value = {
        "crank_angle": angle, "link2_joint": theta["theta2"] - angle, "link3_joint": theta["theta3"] - theta["theta2"],
        "link4_joint": theta["theta4"] - theta["theta2"], "theta5": theta["theta5"],
    }  # fmt: skip
    return np.array([value[j.name] - j.zero for j in m.joints])
