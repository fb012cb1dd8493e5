"""The platform as a Mechanism: three cranks, three legs, the platform."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from mechlab.analytic import assur
from mechlab.analytic.linkage import Linkage
from mechlab.catalog.platform_3rrr.geometry import DRIVES, elbows, group, home, linkage, order
from mechlab.catalog.platform_3rrr.parameters import PlatformParameters
from mechlab.kit.planar_build import Style, mechanism_of
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array


def style(p: PlatformParameters) -> Style:
    """Masses and looks; the platform's angle is `alpha`, the cranks' angles the drives."""
    names = {f"arm_{k + 1}": DRIVES[k] for k in range(3)} | {"platform": "alpha"}
    return Style(p.mass_per_length, gravity=p.gravity, width=0.08 * p.leg, names=names)


def linkage_at(p: PlatformParameters, drives: Array) -> Linkage:
    """The chain in the compositor's mode that is the nearest to the home pose at these drive angles (3,)."""
    pins = elbows(p, drives)
    modes = assur.all_modes(group(p, pins))
    k = int(order(p, pins, modes)[0])
    sign = 1 if modes.det[k] > 0 else -1
    return linkage(p, sign * int(np.count_nonzero(np.sign(modes.det[: k + 1]) == sign)))


@lru_cache(maxsize=32)
def build(p: PlatformParameters, fidelity: str) -> Mechanism:
    """Seven parts, two loops, three freedoms; the home pose is the reference."""
    inputs = {f"arm_{k + 1}": a for k, a in enumerate(home(p))}
    return mechanism_of(
        linkage_at(p, np.array(home(p))), inputs, style(p), "planar parallel platform 3-RRR (class III)"
    )
