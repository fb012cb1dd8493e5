"""Drive forces that hold the reference pose, within the limits of the drives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.statics import passive_force


@dataclass(frozen=True)
class Hold:
    """Forces of the drives that hold the reference pose, and what stays unbalanced.

    `forces`: drive -> N or N m, within its limit. `unbalanced` (nv,): the generalised force that neither drives nor
    constraints carry. `holds`: it is at rounding level.
    """

    forces: dict[str, float]
    unbalanced: Array
    holds: bool

    def sentence(self, m: Mechanism) -> str:
        """Whether the drives hold, in words."""
        if self.holds:
            return "the drives hold the reference pose"
        worst = int(np.argmax(np.abs(self.unbalanced)))
        return (
            f"the drives cannot hold the reference pose: {abs(self.unbalanced[worst]):.3g} N m or N "
            f"stay unbalanced at {m.rate_names[worst]}"
        )


def hold(m: Mechanism) -> Hold:
    """Solve B^T f + J^T r = h(q0, 0) - springs in the least-squares sense for drive forces f and reactions r.

    A drive that meets its limit stays there, and the others and the reactions are solved again.
    """
    tree, constraints = TreeKinematics(m), ConstraintSet(m)
    needed = tree.bias_force() - passive_force(tree)
    rows = np.array([m.row(d.on) for d in m.drives]).reshape(len(m.drives), m.nv)
    limits = np.array([np.inf if d.limit is None else d.limit for d in m.drives])
    reactions = constraints.jacobian(tree)
    force = np.zeros(len(m.drives))
    free = np.ones(len(m.drives), dtype=bool)
    rest = needed
    for _ in range(len(m.drives) + 1):
        both = np.vstack([rows[free], reactions]).T
        load = needed - rows[~free].T @ force[~free]
        found = np.linalg.lstsq(both, load, rcond=1e-11)[0] if both.shape[1] else np.zeros(0)
        rest = load - both @ found
        force[free] = found[: int(free.sum())]
        over = free & (np.abs(force) > limits)
        if not over.any():
            break
        force[over] = np.clip(force[over], -limits[over], limits[over])
        free &= ~over
    forces = {d.name: float(f) + 0.0 for d, f in zip(m.drives, force, strict=True)}
    scale = max(1e-9, float(np.max(np.abs(needed), initial=0.0)))
    return Hold(forces, rest, bool(np.max(np.abs(rest), initial=0.0) < 1e-8 * scale))
