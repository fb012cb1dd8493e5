"""The check of masses, momenta, energy and power: particles moved by a closed form against the models of the engines.

state = State(values, rates, solid(mass, centre, ...) + rod(...), points, gravity, freedoms)
compare([(mechanism, state)])  # CheckResult
"""

from mechlab.kit.mass_check.compare import SOURCE, TEXT, compare
from mechlab.kit.mass_check.particles import NOTHING, Pair, Particles, State, rod, solid, spread_of

__all__ = ["NOTHING", "SOURCE", "TEXT", "Pair", "Particles", "State", "compare", "rod", "solid", "spread_of"]
