"""Numbers of a mechanism by which a fault that changes nothing is told from one that does."""

from __future__ import annotations

import numpy as np

from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics, integrate
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.statics import passive_force


def marks(m: Mechanism) -> dict[str, Array]:
    """What a mechanism is at two fixed random states: poses, points, values, mass matrix, forces, residual of the rows."""
    out: dict[str, Array] = {"counts": np.array([len(m.loops), len(m.relations), len(m.springs), m.nv], dtype=float)}
    rng = np.random.default_rng(11)
    for k in range(2):
        q = integrate(m, m.reference(), 0.2 * rng.standard_normal(m.nv))
        tree, rows = TreeKinematics(m, q, rng.standard_normal(m.nv)), ConstraintSet(m)
        poses = {f.name: tree.pose(f.body) for f in m.frames}
        points = [poses[f.name][1] + poses[f.name][0] @ f.placement.translation for f in m.frames]
        out |= {
            f"points{k}": np.array(points), f"poses{k}": np.array([np.column_stack(tree.pose(b.name)) for b in m.bodies]),
            f"values{k}": np.array([np.asarray(m.value(n, q), dtype=float).ravel()[0] for n in m.scalar_names]),
            f"mass{k}": tree.mass_matrix(), f"forces{k}": tree.bias_force() - passive_force(tree), f"rows{k}": rows.residual(tree),
        }  # fmt: skip
    return out
