"""The closed gear differential ("gear CVT"): speeds, moments, mass matrix, steady states, exact motions."""

from mechlab.analytic.differential.converter import Converter, ConverterState, converter_state, shares
from mechlab.analytic.differential.motion import Contact, DifferentialMotion, motion, predicted_lag, reactions
from mechlab.analytic.differential.statics import (
    Inertias,
    MeshMoments,
    SteadyState,
    backstop,
    block_torques,
    carrier_mass_matrix,
    drag_ratio,
    drag_stall,
    held_output_moment,
    housing_drag,
    internal_moment,
    mass_matrix,
    mesh_moments,
    mobility,
    momentum_row,
    power_rate,
    printed_z4,
    start_moment,
    start_ratio,
)
from mechlab.analytic.differential.train import (
    Speeds,
    Train,
    braked_ratios,
    conditions,
    printed_speeds,
    speeds,
)

__all__ = [
    "Contact", "Converter", "ConverterState", "Inertias", "MeshMoments", "DifferentialMotion", "Speeds", "SteadyState", "Train",
    "backstop", "block_torques", "braked_ratios", "carrier_mass_matrix", "conditions", "converter_state", "drag_ratio", "drag_stall",
    "held_output_moment", "housing_drag", "internal_moment", "mass_matrix", "mesh_moments", "mobility", "momentum_row",
    "motion", "power_rate", "predicted_lag", "printed_speeds", "printed_z4", "reactions", "shares", "speeds",
    "start_moment", "start_ratio",
]  # fmt: skip
