"""Platforms of class III with unequal base, platform and chains: poses closed by hand, three witnesses, bad shapes."""

from __future__ import annotations

import json

import numpy as np
import pytest

from mechlab.cli import main

PIVOTS, CORNERS = [0.5, 0.6, 0.45], [0.15, 0.105, 0.21]
CRANKS, LEGS = [0.3, 0.33, 0.27], [0.33, 0.36, 0.3]
AROUND_BASE, AROUND_PLATFORM = np.radians([-140.0, -20.0, 100.0]), np.radians([-160.0, -40.0, 80.0])
SHAPE = (
    "base_ratios=1,1.2,0.9", "base_azimuths=-140deg,-20deg,100deg", "platform_ratios=1,0.7,1.4",
    "platform_azimuths=-160deg,-40deg,80deg", "crank_ratios=1,1.1,0.9", "leg_ratios=1.1,1.2,1",
)  # fmt: skip
DRIVES = ("drive_1", "drive_2", "drive_3")


def asked(capsys, *keys, code=0):
    assert main(["solve", "platform_3rrr", *keys, "--json"]) == code
    return json.loads(capsys.readouterr().out)


def gaps(drives, pose):
    """How far the ends of the legs are from their lengths, from the definition of the mechanism."""
    elbows = PIVOTS * np.exp(1j * AROUND_BASE) + CRANKS * np.exp(1j * np.asarray(drives))
    corners = pose["x"] + 1j * pose["y"] + CORNERS * np.exp(1j * (AROUND_PLATFORM + pose["alpha"]))
    return np.abs(corners - elbows) - LEGS


def test_pose_to_drives_in_every_working_mode(capsys):
    pose = {"x": 0.02, "y": 0.01, "alpha": 0.1}
    document = asked(capsys, *SHAPE, *(f"{k}={v}" for k, v in pose.items()), "x_rate=0.3", "alpha_accel=1")
    assert document["max_difference"] < 1e-10
    modes = document["answers"]["analytic"]["modes"]
    assert len(modes) == 8
    for mode in modes:
        np.testing.assert_allclose(gaps([mode[n] for n in DRIVES], pose), 0.0, atol=1e-13)


@pytest.mark.parametrize("drives", [(1.7, -2.6, 0.1), (1.775424, -2.629826, 0.124918)])
def test_drives_to_every_pose(capsys, drives):
    given = [f"{n}={x}" for n, x in zip(DRIVES, drives, strict=True)]
    document = asked(capsys, *SHAPE, *given, "drive_1_rate=1", "drive_3_rate=-0.5")
    assert document["max_difference"] < 1e-10
    modes = document["answers"]["analytic"]["modes"]
    assert len(modes) in (2, 4, 6)
    for mode in modes:
        np.testing.assert_allclose(gaps(drives, mode), 0.0, atol=1e-12)
    # rates by central differences of the chosen mode
    h, ends = 1e-5, []
    for sign in (1, -1):
        moved = (drives[0] + sign * h, drives[1], drives[2] - sign * 0.5 * h)
        keys = [f"{n}={x}" for n, x in zip(DRIVES, moved, strict=True)]
        ends.append(asked(capsys, *SHAPE, *keys)["answers"]["analytic"])
    for k in ("x", "y", "alpha"):
        assert document["answers"]["mujoco"][f"{k}_rate"] == pytest.approx(
            (ends[0][k] - ends[1][k]) / (2 * h), abs=1e-7
        )


def test_home_pose_and_bad_shapes(capsys):
    turned = asked(capsys, "home_alpha=20deg", "platform_azimuths=-170deg,-50deg,70deg", "x=0", "y=0", "alpha=20deg")
    usual = asked(capsys, "x=0", "y=0", "alpha=0")
    for n in DRIVES:
        assert turned["answers"]["mujoco"][n] == pytest.approx(usual["answers"]["mujoco"][n], abs=1e-12)
    for key, code, said in (
        ("base_ratios=1,2", 1, "parameter 'base_ratios': expected 3 values, got 2"),
        ("leg_ratios=1,0,1", 1, "'leg_ratios': must be > 0"),
        ("crank_ratios=1,0.1,1", 4, "distance 0.35 m of chain 2"),
    ):
        assert main(["simulate", "platform_3rrr", key]) == code
        assert said in capsys.readouterr().err
