"""URDF files of other people: what is read, do the loops close, move and run?

    python -m tests.benchmarks.read_urdf FOLDER|FILE.urdf ... [--loops]

A line for each file: freedoms, loops, largest gap of the assembled pose [m or rad]; the largest gap after Pinocchio closed the
loops from the reference pose with the independent joints at a random reachable pose; the largest gap in 0.5 s of MuJoCo with
the motors (else all independent joints) held by servos of 5 Hz, and the timestep [s], halved from 5e-4 until the gap is below
1e-6 at all steps; the difference in freedoms of the Extended URDF, read back. Ranges that the closed pose of a file breaks are
left out of the run and counted (`out`): the stops would shoot the joint back in one step.
`--loops`: only files with loops. Counts of files read, refused, and the refusals follow.
"""

from __future__ import annotations

import sys
import tempfile
import time
import warnings
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from mechlab.api.finding import read_file
from mechlab.engines.pinocchio.closer import Closer
from mechlab.engines.protocol import engine
from mechlab.errors import MechlabError
from mechlab.experiment.laws import Servo
from mechlab.experiment.model_file import ModelFile
from mechlab.experiment.motion import Hold
from mechlab.experiment.scene import Scene, Settings
from mechlab.formats.exports import to_extended_urdf
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics, integrate
from mechlab.mechanism.newton import newton
from mechlab.mechanism.structure import sample_poses, structure

DURATION, FREQUENCY = 0.5, 5.0
TIMESTEPS = (5e-4, 2.5e-4, 1.25e-4, 6.25e-5, 3.125e-5)
DRIFT = 1e-6
HEADER = f"{'file':48} {'free':>4} {'loops':>5} {'gap':>8} {'IK':>8} {'drift':>8} {'step':>8} {'out':>3} {'again':>8} {'s':>6}"


def main(arguments: list[str]) -> None:
    """Print the table."""
    only_loops = "--loops" in arguments
    places = [Path(a) for a in arguments if not a.startswith("--")]
    files = [f for p in places for f in ([p] if p.suffix == ".urdf" else sorted(p.rglob("*.urdf")))]
    print(HEADER)
    refused = []
    for file in files:
        begin = time.process_time()
        try:
            read = read_file(file)
        except MechlabError as error:
            refused.append(f"{short(file)}: {str(error).partition(': ')[2][:200]}")
            continue
        if read.mechanism.loops or not only_loops:
            print(line(file, read, begin), flush=True)
    print(f"{len(files) - len(refused)} of {len(files)} read")
    print(*refused, sep="\n")


def short(file: Path) -> str:
    """The last two folders and the name."""
    return "/".join(file.parts[-3:])[-48:]


def line(file: Path, read: ModelFile, begin: float) -> str:
    """The line of one file."""
    m = read.mechanism
    cells = [
        f"{short(file):48} {structure(m).freedoms:4d} {len(m.loops):5d} {gap(m, m.reference()):8.1e}",
        attempt(inverse_kinematics, m),
        *driven(m),
        attempt(again, m),
    ]
    return " ".join(cells) + f" {time.process_time() - begin:6.1f}"


def attempt(measure: object, m: Mechanism) -> str:
    """The number of a measure, or the kind of error."""
    try:
        return f"{measure(m):8.1e}"  # type: ignore[operator]
    except (MechlabError, ValueError, np.linalg.LinAlgError) as error:
        return f"{type(error).__name__[:8]:>8}"


def gap(m: Mechanism, q: np.ndarray) -> float:
    """Largest residual of loops and relations."""
    return float(np.max(np.abs(ConstraintSet(m).residual(TreeKinematics(m, q))), initial=0.0))


def inverse_kinematics(m: Mechanism) -> float:
    """Residual in Pinocchio, with the independent joints where they are at a random reachable pose."""
    there = sample_poses(m, count=1, spread=0.2, seed=3)[-1]
    names = [n for n in structure(m).independent if n in m.scalar_names]
    closer = Closer(m, names)
    targets = [float(m.value(n, there)) for n in names]
    found = newton(lambda q: closer.evaluate(q, targets), lambda q, dv: integrate(m, q, dv), m.reference())
    return max(found.residual, gap(m, found.q))


def driven(m: Mechanism) -> tuple[str, str, str]:
    """Cells of the run: largest gap, timestep, ranges left out."""
    free, out = without_broken_ranges(m)
    for step in TIMESTEPS:
        cell = attempt(partial(drift, timestep=step), free)
        if not above(cell, DRIFT):
            break
    return cell, f"{step:8.1e}", f"{out:3d}"


def above(cell: str, limit: float) -> bool:
    """True where a cell is a number above the limit, not the kind of an error."""
    try:
        return float(cell) > limit
    except ValueError:
        return False


def without_broken_ranges(m: Mechanism) -> tuple[Mechanism, int]:
    """The mechanism without the ranges that its reference pose breaks, and how many these are."""
    names = [j.name for j in m.joints if j.range is not None and not j.range[0] <= m.zero(j.name) <= j.range[1]]
    bodies = [
        replace(b, joints=tuple(replace(j, range=None) if j.name in names else j for j in b.joints)) for b in m.bodies
    ]
    return replace(m, bodies=tuple(bodies)), len(names)


def drift(m: Mechanism, timestep: float) -> float:
    """Largest gap of the loops at the steps of a run with held motors; infinite where the run ends early."""
    motors = [d.on for d in m.drives] or [n for n in structure(m).independent if n in m.scalar_names]
    mass = np.diag(TreeKinematics(m).mass_matrix())
    laws = []
    for name in motors:
        inertia = float(np.abs(m.row(name)) @ mass) + 1e-6
        stiffness = inertia * (2.0 * np.pi * FREQUENCY) ** 2
        laws.append(Servo(name, Hold(m.zero(name)), stiffness, 2.0 * np.sqrt(stiffness * inertia)))
    times = np.linspace(0.0, DURATION, 51)
    recording = engine("mujoco").run(m, Scene(duration=DURATION, laws=tuple(laws)), Settings(timestep=timestep), times)
    if recording.t[-1] < DURATION - 1e-6:
        return np.inf
    return max(gap(m, q) for q in recording.q)


def again(m: Mechanism) -> float:
    """Difference of the freedoms of the mechanism and of its Extended URDF, read back: 0 where it was kept."""
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        to_extended_urdf(m).save(folder)
        back = read_file(Path(folder) / "robot.urdf").mechanism
    return abs(structure(back).freedoms - structure(m).freedoms) + abs(len(back.loops) - len(m.loops))


if __name__ == "__main__":
    main(sys.argv[1:])
