"""Closed forms of the three-gear four-bar: motion, regimes and dwell, synthesis, reduced inertia."""

from mechlab.analytic.gear_linkage.knife import (
    Knife,
    best_mount,
    clutch_pace,
    clutch_torque,
    crank_inertia,
    cutting_torque,
    engagement,
    pin_angle,
    torque_factor,
)
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
    "TARGETS", "CrankForTarget", "GearLinkage", "Knife", "LinkageMasses", "LinkageMotion", "OutputRegime", "RegimeReport", "acceleration",
    "angles", "best_mount", "clutch_pace", "clutch_torque", "crank_for", "crank_inertia", "cutting_torque", "engagement", "longest_crank",
    "momentary_crank", "motion", "pin_angle", "rate", "reduced_inertia", "regime", "rolling_rates", "slowest", "torque_factor",
    "transfer", "with_play",
]  # fmt: skip
