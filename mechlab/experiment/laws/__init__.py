"""Force laws as data: what drives and loads a mechanism. A law is evaluated anew at every stage of a step."""

from mechlab.experiment.laws.control import ComputedTorque, Servo, drive_forces
from mechlab.experiment.laws.loads import (
    AppliedForce,
    Constant,
    ConstantPower,
    Harmonic,
    OneSidedStop,
    TableLaw,
    Viscous,
)
from mechlab.experiment.laws.motors import DcMotor, Motor
from mechlab.experiment.laws.protocol import LAWS, Law, LawStates, Plant, applied_force, law, register
from mechlab.experiment.laws.user import FunctionLaw, LawFunction, Laws, laws_of

__all__ = [
    "LAWS", "AppliedForce", "ComputedTorque", "Constant", "ConstantPower", "DcMotor", "FunctionLaw", "Harmonic", "Law",
    "LawFunction", "LawStates", "Laws", "Motor", "OneSidedStop", "Plant", "Servo", "TableLaw", "Viscous", "applied_force",
    "drive_forces", "law", "laws_of", "register",
]  # fmt: skip
