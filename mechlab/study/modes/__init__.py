"""Equilibrium, linearisation on the constraint manifold, eigenfrequencies, damping and mode shapes, from each engine on its own."""

from mechlab.study.modes.eigen import Mode
from mechlab.study.modes.find import find_modes
from mechlab.study.modes.motion import mode_motion
from mechlab.study.modes.result import ModesResult, Witness

__all__ = ["Mode", "ModesResult", "Witness", "find_modes", "mode_motion"]
