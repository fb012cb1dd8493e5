"""How long portraits take. Reports, asserts nothing about time: `pytest tests/benchmarks -s`."""

import time

import numpy as np
import pytest

from mechlab.analytic.impulse import slope
from mechlab.catalog.impulse_transmission.scenes import of_scene
from mechlab.integrate import integrate_adaptive
from mechlab.kit.portrait import flow


@pytest.mark.slow
@pytest.mark.parametrize("count", [1000, 10000])
@pytest.mark.parametrize("step", [1e-3, 5e-4])
def test_portraits(count, step) -> None:
    p = of_scene("fig7").impulse
    rng = np.random.default_rng(4)
    start = np.column_stack([rng.uniform(*r, count) for r in ((0, 1), (-0.1, 0.1), (145, 155), (-20, 20), (5, 15))])

    def f(t, y):
        return slope(p, y)

    began = time.process_time()
    _, y = flow(f, start, 0.5, step, 2)
    spent = time.process_time() - began
    truth = np.array([integrate_adaptive(f, 0.0, start[k], 0.5, rtol=1e-12, atol=1e-12).y[-1] for k in range(3)])
    error = np.abs(y[-1, :3] - truth).max(axis=0)
    print(
        f"\n{count} portraits of 0.5 s, step {step:g} s: {spent:.2f} s of CPU; error beta {error[1]:.1e}, beta' {error[3]:.1e}"
    )
    assert error[1] < 1e-5
