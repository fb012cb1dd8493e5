"""A user's file with a bar on a hinge, for sweeps, and the comparison of two sweeps."""

import numpy as np

SWING = '''
from mechlab.mechanism import Builder, revolute

def swing(length=1.0, mass=2.0):
    """A bar on a hinge."""
    b = Builder("swing")
    b.bar("bar", revolute("hinge", "y"), length, mass=mass)
    return b.build()
'''


def same(a, b) -> bool:
    return (
        np.array_equal(a.flat, b.flat, equal_nan=True)
        and np.array_equal(a.outcomes, b.outcomes)
        and a.reasons == b.reasons
    )
