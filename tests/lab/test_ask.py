"""Asking with arrays: each element is the answer to the numbers at its place."""

import numpy as np
import pytest

import mechlab as ml


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("prosthetic_leg", {"hip": (0.1, 0.2), "knee": 0.3, "hip_rate": (1.0, -2.0)}),
        ("impulse_transmission", {"limits_at_speed": (100.0, 200.0)}),
        ("platform_3rrr", {"drive_1": (1.39, 1.40), "drive_2": 1.5967418, "drive_3": -2.5313381}),
    ],
)
def test_arrays_beside_numbers_are_answered_pose_by_pose(name, given):
    together = ml.solve(name, **{k: np.array(v) if isinstance(v, tuple) else v for k, v in given.items()})
    for i in range(2):
        alone = ml.solve(name, **{k: v[i] if isinstance(v, tuple) else v for k, v in given.items()})
        compared = 0
        for witness, answer in together.answers.items():
            for key, values in answer.values.items():
                one = alone.answers[witness].values[key]
                # the same formulas and solvers; Newton's method ends within its own 1e-10 of each
                assert np.broadcast_to(values, (2,))[i] == pytest.approx(one, rel=1e-9, abs=1e-9)
                compared += 1
        assert compared >= 6
