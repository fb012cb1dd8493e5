"""Fixed questions and short runs of every engine, printed as JSON: the same numbers on every processor, but for rounding.

`python -m tests.machine_numbers` prints {name: [numbers]} with all digits.
"""

import json
import sys
from collections.abc import Iterator

import numpy as np

import mechlab as ml
from mechlab.values import Range

QUESTIONS = (
    ("fourbar", {"crank_angle": 0.7, "crank_rate": 3.0}),
    ("slider_crank", {"crank_angle": 0.7, "crank_angle_rate": 3.0}),
    ("class4_linkage", {"crank_angle": -2.0}),
    ("gear_linkage", {"crank_angle": 0.4}),
    ("planetary_stage", {"carrier_rate": 3.0, "ring_rate": 1.0}),
    ("closed_differential", {"w_H1": 5.0, "w_H2": 2.0}),
    ("delta6", {"x": 0.02, "y": -0.01, "z": -0.05, "alpha": 0.1, "beta": 0.2, "gamma": -0.3}),
)
RUNS = (
    ("pendulum", "swing", "full", ("mujoco", "pinocchio", "analytic")),
    ("fourbar", "free-run", "minimal", ("mujoco", "pinocchio", "analytic", "one_freedom")),
    ("fourbar", "driven-crank", "minimal", ("mujoco", "pinocchio")),
    ("delta6", "head-tracking", "minimal", ("mujoco", "pinocchio")),
    ("delta6", "pose-sweep", "minimal", ("mujoco", "pinocchio")),
    ("delta6", "pure-rotation", "parts", ("mujoco",)),
    ("prosthetic_leg", "swing", "parts", ("mujoco", "pinocchio", "analytic")),
    ("planetary_stage", "constant-torques", "full", ("mujoco", "pinocchio", "analytic")),
    ("impulse_transmission", "fig4", "minimal", ("mujoco", "pinocchio", "hybrid", "analytic")),
    ("n_fourbar", "fall", "full", ("mujoco", "pinocchio")),
)
DURATION = 0.02
"""Seconds: long enough for every law and row to act, short enough that nothing grows but rounding."""


def numbers() -> Iterator[tuple[str, list[float]]]:
    """(name, numbers) of each answer of each witness, and the final state of each run."""
    for source, given in QUESTIONS:
        for witness, answer in ml.solve(source, **given).answers.items():
            yield f"solve {source}, {witness}", [float(np.sum(x)) for x in answer.values.values()]
    for source, scene, fidelity, engines in RUNS:
        for engine in engines:
            run = ml.simulate(source, scene=scene, duration=DURATION, engine=engine, fidelity=fidelity)
            yield f"simulate {source} {scene} {fidelity}, {engine}: q", run.q[-1].tolist()
            yield f"simulate {source} {scene} {fidelity}, {engine}: v", run.v[-1].tolist()
    swept = ml.sweep("fourbar", {"crank_angle": Range(0.0, 6.0, 25)}, quantities="rocker_angle")
    yield "sweep fourbar", swept.flat.ravel().tolist()


if __name__ == "__main__":
    json.dump(dict(numbers()), sys.stdout)
