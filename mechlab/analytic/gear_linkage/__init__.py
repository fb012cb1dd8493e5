"""Closed forms of the three-gear four-bar: motion, regimes and dwell, synthesis, reduced inertia."""

from mechlab.analytic.gear_linkage.linkage import (
    GearLinkage,
    LinkageMotion,
    angles,
    longest_crank,
    motion,
    rolling_rates,
    transfer,
)
from mechlab.analytic.gear_linkage.regime import (
    TARGETS,
    CrankForTarget,
    LinkageMasses,
    OutputRegime,
    RegimeReport,
    acceleration,
    crank_for,
    momentary_crank,
    rate,
    reduced_inertia,
    regime,
    slowest,
    with_play,
)

__all__ = [
    "TARGETS", "CrankForTarget", "GearLinkage", "LinkageMasses", "LinkageMotion", "OutputRegime", "RegimeReport", "acceleration",
    "angles", "crank_for", "longest_crank", "momentary_crank", "motion", "rate", "reduced_inertia", "regime",
    "rolling_rates", "slowest", "transfer", "with_play",
]  # fmt: skip
