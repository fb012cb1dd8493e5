"""Time per pose of the delta's closed-form inverse; run it: python tests/benchmarks/bench_delta6.py. No limits are asserted."""

from __future__ import annotations

import time

import numpy as np

from mechlab.analytic import delta6


def seconds(position: np.ndarray) -> float:
    """CPU time of one call for positions of shape (..., 3) [s]."""
    start = time.process_time()
    delta6.inverse_position(delta6.Delta6(), position)
    return time.process_time() - start


def main() -> None:
    """Print one line: all poses in one array against one pose a call."""
    count = 200_000
    position = np.random.default_rng(11).uniform((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1), (count, 3))
    bulk = min(seconds(position) for _ in range(5)) / count
    single = min(seconds(position[k]) for k in range(200))
    print(
        f"inverse position: {1e6 * bulk:.3f} us a pose of {count}, {1e6 * single:.1f} us alone, {single / bulk:.0f} times"
    )


if __name__ == "__main__":
    main()
