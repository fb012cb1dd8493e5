"""Equilibrium, linearisation on the constraint manifold, eigenfrequencies, damping and mode shapes, from each engine on its own."""

from mechlab.studies.modes.eigen import Mode
from mechlab.studies.modes.find import find_modes, mode_motion
from mechlab.studies.modes.result import ModesResult, Witness

__all__ = ["Mode", "ModesResult", "Witness", "find_modes", "mode_motion"]
