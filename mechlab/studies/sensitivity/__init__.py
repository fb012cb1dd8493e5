"""First-order sensitivity of answers to parameters, and the tolerances that follow from it."""

from mechlab.studies.sensitivity.derivatives import Tolerances
from mechlab.studies.sensitivity.result import Cell, Sensitivity, Spread
from mechlab.studies.sensitivity.study import sensitivity

__all__ = ["Cell", "Sensitivity", "Spread", "Tolerances", "sensitivity"]
