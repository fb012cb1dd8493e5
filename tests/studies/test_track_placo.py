"""`track` against placo on the same loops: its stored answers, and fresh ones where the environment names a Python with placo.

placo 0.10 needs an older Pinocchio than mechlab, so that it lives in an environment of its own:

    python -m venv placo && placo/bin/pip install placo
    MECHLAB_PLACO=placo/bin/python python -m pytest tests/studies/test_track_placo.py

`track_placo.json` holds its answers: placo 0.10.2 (libpinocchio 3.8.0), made by `python -m tests.studies.test_track_placo`, 2026-11-22.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mechlab as ml
from tests.studies.test_track import coupler_path, leg

HERE = Path(__file__).parent
WITNESS = HERE.parent / "benchmarks" / "placo_witness.py"
STORED = HERE / "track_placo.json"
ITERATIONS = 8
"""Solves of placo for one pose; after five nothing changes any more."""
APART = 1e-9
"""Both end at rounding; mechlab's loops are closed to 1e-13, and a joint may be a thousand times as sensitive."""


def poses(place, turns):
    out = np.tile(np.eye(4), (len(place), 1, 1))
    out[:, :3, :3], out[:, :3, 3] = turns, place
    return out


def cases(n: int = 13):
    """Name -> mechanism, frame, path, axes of the loops and of a path of points."""
    t = 2 * np.pi * np.linspace(0.0, 1.0, n)
    delta = ml.load("delta6").mechanism("minimal")
    place = np.array([0.05 * np.sin(t), 0.04 * np.sin(2 * t), 0.03 + 0.03 * np.sin(2 * t)]).T
    angles = np.array([0.4 * np.sin(t), 0.5 * np.sin(t), 0.6 * np.sin(t)]).T
    turns = Rotation.from_euler("ZYX", angles).as_matrix() @ delta.frame("D").placement.rotation
    walker = leg()
    start = ml.track(
        walker, hip=walker.joint("hip").zero + 0.3 * np.sin(t), knee=1.2 + 0.2 * np.sin(t), ankle=0.2 * np.sin(t)
    )
    turned = sum(start[j] for j in ("hip", "knee", "pin", "ankle"))
    soles = np.array([start[f"sole_{a}"] for a in "xyz"]).T
    return {
        "fourbar": (ml.load("fourbar").mechanism(), "middle", coupler_path(0.7 + t), "xz", "xz"),
        "delta6": (delta, "D", poses(place, turns), "xyz", "xyz"),
        "leg": (
            walker,
            "sole",
            poses(soles, Rotation.from_rotvec(np.outer(turned, [0, 0, 1])).as_matrix()),
            "xy",
            "xy",
        ),
    }


def job(m, frame, path, loop_axes, axes):
    """What the witness reads: the tree as URDF, with a frame at both ends of every loop."""
    ends = [(f"{x.name}_a", x.body_a, x.placement_a) for x in m.loops] + [
        (f"{x.name}_b", x.body_b, x.placement_b) for x in m.loops
    ]
    with_ends = replace(m, frames=m.frames + tuple(ml.Frame(*e) for e in ends))
    return {
        "urdf": ml.to_urdf(with_ends), "start": {}, "loops": [[f"{x.name}_a", f"{x.name}_b", loop_axes] for x in m.loops],
        "frame": frame, "path": np.asarray(path).tolist(), "axes": axes, "iterations": ITERATIONS,
    }  # fmt: skip


def placo(python: str, what) -> dict:
    """The witness's answer to a job, from another Python."""
    with tempfile.TemporaryDirectory() as folder:
        asked, answered = Path(folder) / "job.json", Path(folder) / "answer.json"
        asked.write_text(json.dumps(what))
        subprocess.run([python, str(WITNESS), str(asked), str(answered)], check=True, capture_output=True, timeout=300)
        return json.loads(answered.read_text())


def compare(name: str, answer: dict) -> float:
    m, frame, path, _, _ = cases()[name]
    found = ml.track(m, {frame: path})
    assert found.met
    columns = [answer["joints"].index(j.name) for j in m.joints]
    return float(np.max(np.abs(np.array(answer["q"])[:, columns] - found.q)))


@pytest.mark.parametrize("name", ["fourbar", "delta6", "leg"])
def test_the_joints_are_those_of_placo(name):
    assert compare(name, json.loads(STORED.read_text())[name]) < APART


@pytest.mark.skipif("MECHLAB_PLACO" not in os.environ, reason="MECHLAB_PLACO names no Python with placo")
@pytest.mark.parametrize("name", ["fourbar", "delta6", "leg"])
def test_placo_says_so_today(name):
    assert compare(name, placo(os.environ["MECHLAB_PLACO"], job(*cases()[name]))) < APART


if __name__ == "__main__":
    made = {name: placo(os.environ["MECHLAB_PLACO"], job(*case)) for name, case in cases().items()}
    STORED.write_text(json.dumps({n: {k: a[k] for k in ("version", "joints", "q")} for n, a in made.items()}))
    for name, answer in made.items():
        print(
            f"{name}: placo {1e6 * answer['step_s']:.0f} us a pose of {ITERATIONS} solves, apart {compare(name, answer):.1e}"
        )
