"""Why a mechanism does not close with given values: how far its loops stay open with the values held.

    min over q of |r(q)|^2,     r: all rows of loops and relations,     values of the given joints and shafts held exactly

The minimum is looked for by least squares (scipy, trust region) from given poses and from RANDOM others. Where it is not zero no pose
near them closes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mechlab.clock import spent_on
from mechlab.experiment.findings import row_kinds
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, TreeKinematics
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import integrate
from mechlab.mechanism.structure import null_space

CLOSED = 1e-9
"""Largest row [rad, or of the length scale] of a pose that is closed."""
RANDOM = 3
"""Number of random poses, a radian or the length scale away in each coordinate that is not held."""
MOST = 200
"""Most evaluations from one start."""
FLAT = 1e-6
"""Largest slope of |r|^2 / 2 at a minimum, relative to |r|."""


@dataclass(frozen=True)
class Opening:
    """How far a pose stays open: largest gap of a loop [m], angle between its sides [rad], and residual of a relation [rad or m]; the
    names of the worst of each. closed: all are rounding; least: the pose is a minimum of the sum of their squares."""

    gap: float
    angle: float
    relation: float
    names: tuple[str, str, str]
    closed: bool
    least: bool

    def text(self, unit: float = 1.0) -> str:
        """What stays open, in words; unit: length [m] in which the mechanism is measured."""
        if self.gap > CLOSED:
            return f"loop {self.names[0]} stays open by {self.gap * unit:.3g} m"
        if self.angle > CLOSED:
            return f"the sides of loop {self.names[1]} stay tilted by {self.angle:.3g} rad"
        return f"{self.names[2]} is off by {self.relation:.3g} rad or m"


def opening(m: Mechanism, q: Array, least: bool = False) -> Opening:
    """The Opening at a pose q (nq,)."""
    constraints = ConstraintSet(m)
    residual = np.abs(constraints.residual(TreeKinematics(m, q)))
    kinds = [set(rows) for rows in row_kinds(m, constraints)]
    worst, names = [0.0, 0.0, 0.0], ["", "", ""]
    for item in constraints.items:
        rows = constraints.slices[item.name]
        for k, kind in enumerate(kinds):
            size = float(np.linalg.norm(residual[[i for i in range(rows.start, rows.stop) if i in kind]]))
            if size > worst[k]:
                worst[k], names[k] = size, item.name
    closed = float(np.max(residual, initial=0.0)) < CLOSED
    return Opening(worst[0], worst[1], worst[2], (names[0], names[1], names[2]), closed, least)


def least_opening(m: Mechanism, held: Mapping[str, float], starts: Sequence[Array]) -> Opening:
    """The smallest Opening that is found with the values of joints and shafts held, from the starts (nq,) and random poses about the
    last of them."""
    with spent_on("imports"):
        from scipy.optimize import least_squares

    constraints = ConstraintSet(m)
    rows = np.array([m.row(n) for n in held]).reshape(len(held), m.nv)
    free = null_space(rows) if len(held) else np.eye(m.nv)
    found: list[tuple[float, Opening]] = []
    rng = np.random.default_rng(0)
    first = [np.zeros(free.shape[1])] * len(starts) + [rng.standard_normal(free.shape[1]) for _ in range(RANDOM)]
    for start, x0 in zip([*starts, *[starts[-1]] * RANDOM], first, strict=True):
        off = np.array([value - float(m.value(n, start)) for n, value in held.items()])
        begin = integrate(m, start, np.linalg.pinv(rows) @ off) if len(held) else start

        def residual(x: Array, begin: Array = begin) -> Array:
            return np.asarray(constraints.residual(TreeKinematics(m, integrate(m, begin, free @ x))))

        def slopes(x: Array, begin: Array = begin) -> Array:
            return np.asarray(constraints.jacobian(TreeKinematics(m, integrate(m, begin, free @ x))) @ free)

        jacobian = slopes if m.nq == m.nv else "2-point"  # ball joints do not add up
        best = least_squares(residual, x0, jacobian, xtol=1e-15, ftol=1e-15, gtol=1e-12, max_nfev=MOST)
        size = float(np.linalg.norm(best.fun))
        pose = opening(m, integrate(m, begin, free @ best.x), bool(best.optimality <= FLAT * size))
        found.append((size, pose))
        if pose.closed:
            break
    return min(found, key=lambda x: x[0])[1]
