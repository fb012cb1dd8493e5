"""Counting formulas for the freedoms of a chain.

n: moving links; p5, p4, p3: pairs with one, two, three freedoms. The formulas know nothing of dimensions: idle spins
are counted as freedoms, redundant constraints as if they acted.
"""

from __future__ import annotations

from mechlab.errors import MechlabError


def somov_malyshev(n: int, p5: int, p4: int = 0, p3: int = 0, p2: int = 0, p1: int = 0) -> int:
    """Spatial chain, W = 6 n - 5 p5 - 4 p4 - 3 p3 - 2 p2 - p1."""
    _counts(n=n, p5=p5, p4=p4, p3=p3, p2=p2, p1=p1)
    return 6 * n - 5 * p5 - 4 * p4 - 3 * p3 - 2 * p2 - p1


def chebyshev(n: int, p5: int, p4: int = 0) -> int:
    """Planar chain, W = 3 n - 2 p5 - p4; p4 counts higher pairs such as gear meshes."""
    _counts(n=n, p5=p5, p4=p4)
    return 3 * n - 2 * p5 - p4


def artobolevsky(n: int, p5: int, p4: int = 0) -> int:
    """Spherical chain, all axes through one point, W = 3 n - 2 p5 - p4; p4 counts bevel meshes."""
    _counts(n=n, p5=p5, p4=p4)
    return 3 * n - 2 * p5 - p4


def _counts(**counts: int) -> None:
    for name, value in counts.items():
        if value != int(value) or value < 0:
            raise MechlabError(f"{name} = {value!r}; expected a count, zero or more")
