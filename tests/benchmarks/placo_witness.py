"""placo follows a path through closed loops, as a witness of `track`. It knows nothing of mechlab.

    python placo_witness.py JOB.json ANSWER.json

It runs in an environment of its own with `pip install placo` (placo 0.10 needs an older Pinocchio than mechlab does).

JOB: urdf (text), start {joint: coordinate}, loops [[frame a, frame b, axes]], frame, path (n x 4 x 4 poses, or n x 3 points),
axes of the points, iterations a pose. ANSWER: joints, q (n, joints), step_s (mean time of a pose [s]), version.
"""

import json
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np
import placo


def main(job_file: str, answer_file: str) -> None:
    job = json.loads(Path(job_file).read_text())
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "robot.urdf").write_text(job["urdf"])
        robot = placo.RobotWrapper(str(Path(folder) / "robot.urdf"), placo.Flags.ignore_collisions)
    joints = list(robot.joint_names())
    for name, value in job["start"].items():
        robot.set_joint(name, value)
    robot.update_kinematics()
    solver = placo.KinematicsSolver(robot)
    solver.mask_fbase(True)
    for k, (a, b, axes) in enumerate(job["loops"]):
        closing = solver.add_relative_position_task(a, b, np.zeros(3))
        closing.mask.set_axises(axes)
        closing.configure(f"loop {k}", "hard", 1.0)
    path = np.array(job["path"])
    if path.shape[1:] == (4, 4):
        task = solver.add_frame_task(job["frame"], path[0])
        task.configure("path", "soft", 1.0, 1.0)
    else:
        task = solver.add_position_task(job["frame"], path[0])
        task.mask.set_axises(job["axes"])
        task.configure("path", "soft", 1.0)
    solver.add_regularization_task(1e-9)
    q, spent = [], 0.0
    for k, target in enumerate(path):
        began = time.perf_counter()
        if path.shape[1:] == (4, 4):
            task.T_world_frame = target
        else:
            task.target_world = target
        for _ in range(job["iterations"] if k else 200):
            solver.solve(True)
            robot.update_kinematics()
        spent += time.perf_counter() - began if k else 0.0
        q.append([robot.get_joint(n) for n in joints])
    answer = {"joints": joints, "q": q, "step_s": spent / max(1, len(path) - 1), "version": version("placo")}
    Path(answer_file).write_text(json.dumps(answer))


if __name__ == "__main__":
    main(*sys.argv[1:])
