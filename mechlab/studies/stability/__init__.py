"""Stability maps: timestep against what may make a method fail, by measurement, with the boundaries of theory.

`study` makes the maps that the structure of a mechanism calls for; `KINDS` is the registry of them.
"""

from mechlab.studies.stability.data import Axis, Cell, Map, Outcome, Panel, Stability, Theory
from mechlab.studies.stability.study import BUDGET, KINDS, study

__all__ = ["BUDGET", "KINDS", "Axis", "Cell", "Map", "Outcome", "Panel", "Stability", "Theory", "study"]
