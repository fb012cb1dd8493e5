"""Time per position of closed-form cycles; run it: python tests/benchmarks/bench_linkages.py. No limits are asserted.

Compares with pylinkage where it is installed (extra [peers]).
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from mechlab.analytic import assur
from mechlab.analytic.linkage import Linkage
from mechlab.catalog.class4_linkage import Class4Parameters
from mechlab.catalog.class4_linkage.geometry import family, solve_all


def best(work: Callable[[], object], repeats: int = 25) -> float:
    """Smallest CPU time of a few runs [s]: other work on the machine is left out."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def fourbar_cycle(count: int) -> None:
    """Positions, velocities and accelerations of a four-bar over `count` crank angles."""
    chain = (
        Linkage("fourbar").pivot("O", 0.0, 0.0).pivot("D", 0.3, 0.0).crank("crank", "O", "A", 0.1)
        .rrr("B", ("coupler", "rocker"), ("A", "D"), (0.3, 0.25))
    )  # fmt: skip
    phi = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    for _ in chain.blocks(count, crank=(phi, 1.0, 0.0)):
        pass


def peer(count: int) -> float | None:
    """Seconds of pylinkage (numba, warm) for positions, velocities and accelerations, or None where it is missing."""
    try:
        import pylinkage as pl
    except ModuleNotFoundError:
        return None
    ground, far = pl.Ground(0.0, 0.0), pl.Ground(0.3, 0.0)
    crank = pl.Crank(ground, 0.1, 2.0 * np.pi / count)
    pin = pl.RRRDyad(crank.output, far, 0.3, 0.25)
    linkage = pl.Linkage([ground, far, crank, pin])
    linkage.step_fast_with_kinematics(iterations=count)
    return best(lambda: linkage.step_fast_with_kinematics(iterations=count))


def main() -> None:
    """Print the table."""
    for count in (72, 720, 72000):
        mine = best(lambda count=count: fourbar_cycle(count))  # type: ignore[misc]
        other = peer(count)
        told = "pylinkage is not installed" if other is None else f"pylinkage {1e6 * other / count:.3f} us"
        print(
            f"four-bar, {count:6d} positions with rates and accelerations: {1e6 * mine / count:.3f} us a position; {told}"
        )
    p = Class4Parameters()
    for count in (72, 7200):
        angle = np.linspace(-np.pi, np.pi, count)
        roots = best(lambda angle=angle: assur.all_modes(family(p)(angle)))  # type: ignore[misc]
        labelled = best(lambda angle=angle: solve_all(p, angle))  # type: ignore[misc]
        print(
            f"class IV, {count:5d} positions, all modes: {1e3 * roots / count:.4f} ms a position, with labels {1e3 * labelled / count:.4f}"
        )


if __name__ == "__main__":
    main()
