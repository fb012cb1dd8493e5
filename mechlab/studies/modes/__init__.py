"""Equilibrium, linearization on the constraint manifold, eigenfrequencies, damping and mode shapes, from each engine on its own."""
