"""The check of masses, momenta, energy and power: a closed form carries particles along, the engines ask their models.

state = State(values, rates, solid(mass, centre, ...) + rod(...), points, gravity, freedoms)
compare([(mechanism, state)])  # Measured
"""

from mechlab.study.mass_check.compare import SOURCE, TEXT, compare
from mechlab.study.mass_check.particles import NOTHING, Particles, rod, solid, spread_of
from mechlab.study.mass_check.state import Pair, State

__all__ = ["NOTHING", "SOURCE", "TEXT", "Pair", "Particles", "State", "compare", "rod", "solid", "spread_of"]
