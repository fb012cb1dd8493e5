"""The inertial-impulse transmission: unbalanced planets on a floating carrier between an input and an output shaft.

Equations of motion (order 5 with the motor, and at constant input speed), the exact first integral, the regime of
one-way rotation under dry friction with its existence limit, small-parameter harmonics, periodic orbits by shooting;
the equations with dry friction as problems for an integration with events.
"""

from __future__ import annotations

from mechlab.analytic.impulse.clutch import ClutchedCycle, clutched
from mechlab.analytic.impulse.clutch import simulated as simulated_clutch
from mechlab.analytic.impulse.dry_friction import ConstantSpeed, WithMotor
from mechlab.analytic.impulse.model import (
    Impulse,
    OutputConstants,
    accelerations,
    angles,
    coefficients,
    constant_speed_acceleration,
    constant_speed_torque,
    first_integral,
    harmonic_amplitudes,
    harmonic_motion,
    load,
    motor_rate,
    motor_torque_at,
    resonances,
    shape,
    slip_speed,
    slope,
)
from mechlab.analytic.impulse.motor_orbit import MotorOrbit, after_turns, motor_orbit
from mechlab.analytic.impulse.regime import (
    OneWayLimits,
    OneWayRegime,
    Orbit,
    frictionless_mean_speed,
    limits,
    periodic_orbit,
    section_points,
    unidirectional,
)

__all__ = [
    "ClutchedCycle", "ConstantSpeed", "Impulse", "MotorOrbit", "OneWayLimits", "OneWayRegime", "Orbit", "OutputConstants", "WithMotor",
    "accelerations", "after_turns", "angles", "clutched",
    "coefficients", "constant_speed_acceleration", "constant_speed_torque", "first_integral",
    "frictionless_mean_speed", "harmonic_amplitudes", "harmonic_motion", "limits", "load", "motor_rate",
    "motor_orbit", "motor_torque_at", "periodic_orbit", "resonances", "section_points", "shape", "simulated_clutch", "slip_speed", "slope",
    "unidirectional",
]  # fmt: skip
