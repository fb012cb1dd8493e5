"""A planar linkage composed of Assur groups, in the order in which they follow from each other; no equations to write.

    rocker = (
        Linkage("rocker").pivot("O", 0.0, 0.0).pivot("D", 0.3, 0.0)
        .crank("crank", "O", "A", 0.1)
        .rrr("B", ("coupler", "rocker"), ("A", "D"), (0.3, 0.25))
        .point("P", "coupler", 0.2, 0.5)
    )
    motion = rocker.solve(crank=(angle, rate, accel))     # numbers or arrays
    motion.points["P"].p, motion.turns["rocker"].v, motion.dyads["B"].quality

Links are named; a link's direction runs from its first pin to its last. Modes are chosen group by group.
"""

from mechlab.analytic.linkage.description import Motion, Step
from mechlab.analytic.linkage.linkage import BLOCK, Input, Linkage

__all__ = ["BLOCK", "Input", "Linkage", "Motion", "Step"]
