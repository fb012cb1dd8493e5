"""Lagrange's equations in transition matrices for trees of revolute and prismatic, also elastic, links.

    T = 1/2 sum of tr(dG_i/dt H_i dG_i^T/dt),   dG_i/dq_j = W_j G_i,   M(q) a + h(q, v) = Q(q, v)

One formulation for planar (3 x 3) and spatial (4 x 4) homogeneous matrices. A reference to check engines against: it
forms the equations from matrix products, without recursions over velocities, and costs a thousand times more.
"""

from mechlab.analytic.transition_matrices.lagrange import (
    accelerations,
    bias_force,
    elastic_force,
    energy,
    gravity_force,
    mass_matrix,
)
from mechlab.analytic.transition_matrices.tree import (
    Tree,
    TreeLink,
    first_derivative,
    joint_motion,
    placement,
    planar_inertia,
    prismatic,
    revolute,
    second_derivative,
    spatial_inertia,
    transitions,
)

__all__ = [
    "TreeLink",
    "Tree",
    "accelerations",
    "bias_force",
    "elastic_force",
    "energy",
    "first_derivative",
    "gravity_force",
    "joint_motion",
    "mass_matrix",
    "placement",
    "planar_inertia",
    "prismatic",
    "revolute",
    "second_derivative",
    "spatial_inertia",
    "transitions",
]
