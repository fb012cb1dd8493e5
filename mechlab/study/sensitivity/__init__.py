"""First-order sensitivity of answers to parameters, and the tolerances that follow from it."""

from mechlab.study.sensitivity.result import Cell, Sensitivity, Spread
from mechlab.study.sensitivity.study import sensitivity
from mechlab.study.sensitivity.tolerance import Tolerances

__all__ = ["Cell", "Sensitivity", "Spread", "Tolerances", "sensitivity"]
