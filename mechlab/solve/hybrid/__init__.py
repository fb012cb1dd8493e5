"""Engine `hybrid`: equations from Pinocchio, dry friction of joints and shafts integrated as it is, with events."""

from mechlab.integrate import Ending
from mechlab.solve.hybrid.equations import RoughEquations
from mechlab.solve.hybrid.runner import run

__all__ = ["Ending", "RoughEquations", "run"]
