"""Strangers' MJCF files run as they are: exit codes, times, and the difference from a bare loop of mj_step on the same file.

    python -m tests.benchmarks.files_as_they_are FOLDER_OR_FILE... [--duration 0.5] [--most 40] [--page DIR]

Of each folder the files that MuJoCo compiles and in which something moves, evenly spread where there are more than --most.
"""

from __future__ import annotations

import argparse
import time
import warnings
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import mechlab as ml
from mechlab.engines.mujoco.control import compiling, engine
from mechlab.engines.mujoco.model_file.coordinates import FileCoordinates
from mechlab.errors import MechlabError
from mechlab.experiment.recording import Recording
from mechlab.lab.run import run_scene


def compiled(path: Path) -> mujoco.MjModel | None:
    """The model of a file; None where MuJoCo refuses it or nothing moves."""
    try:
        with compiling():
            model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError:
        return None
    return model if model.nv else None


def files(places: list[str], most: int) -> list[tuple[Path, mujoco.MjModel]]:
    """The files of all places, at most `most`."""
    paths = [f for p in map(Path, places) for f in (sorted(p.rglob("*.xml")) if p.is_dir() else [p])]
    found = [(p, m) for p in paths if (m := compiled(p)) is not None]
    some = np.unique(np.linspace(0, len(found) - 1, min(most, len(found))).round().astype(int))
    return [found[k] for k in some]


def bare(model: mujoco.MjModel, duration: float) -> tuple[np.ndarray, np.ndarray, float]:
    """States after every step of a bare loop from the first keyframe or qpos0, and its CPU time [s]."""
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    steps = round(duration / model.opt.timestep)
    qpos, qvel = np.empty((steps + 1, model.nq)), np.empty((steps + 1, model.nv))
    qpos[0], qvel[0] = data.qpos, data.qvel
    began = time.process_time()
    for k in range(steps):
        mujoco.mj_step(model, data)
        qpos[k + 1], qvel[k + 1] = data.qpos, data.qvel
    return qpos, qvel, time.process_time() - began


def difference(run: Recording, states: FileCoordinates, qpos: np.ndarray, qvel: np.ndarray, h: float) -> float:
    """Largest difference of coordinates and rates at the sample times that are whole steps."""
    k = np.rint(run.t / h).astype(int)
    whole = (np.abs(run.t - k * h) < 1e-9) & (k < len(qpos))
    q, v = states.coordinates(qpos[k[whole]]), states.rates(qvel[k[whole]])
    return float(max(np.max(np.abs(run.q[whole] - q), initial=0.0), np.max(np.abs(run.v[whole] - v), initial=0.0)))


def row(path: Path, model: mujoco.MjModel, duration: float, page: Path | None) -> dict[str, Any]:
    """What became of one file."""
    steps = max(1, round(duration / model.opt.timestep))
    duration = steps * float(model.opt.timestep)
    out: dict[str, Any] = {"file": f"{path.parent.name}/{path.name}", "nv": model.nv, "h": float(model.opt.timestep)}
    try:
        began = time.process_time()
        design = ml.load(path)
        out["read_s"] = time.process_time() - began
        began = time.process_time()
        alone = run_scene(design, duration=duration, estimate=False)
        out["run_s"] = time.process_time() - began
        began = time.process_time()
        run = run_scene(design, duration=duration)
        out["all_s"] = time.process_time() - began
    except MechlabError as error:
        return out | {"exit": error.exit_code, "why": str(error)[:150]}
    with engine():
        qpos, qvel, out["bare_s"] = bare(model, duration)
    file = design.entry.file
    if run.settings.engine == "file" and file is not None:
        out["difference"] = difference(alone, FileCoordinates(file, model), qpos, qvel, float(model.opt.timestep))
    wrong = [f.name for f in run.health.findings if f.severity == "error"]
    if page is not None:
        ml.view(run, html=page / f"{path.parent.name}_{path.stem}.html", open=False)
    return out | {"exit": run.exit_code, "engine": run.settings.engine, "why": ", ".join(wrong)}


def main() -> None:
    """The table."""
    warnings.simplefilter("ignore")
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("places", nargs="+")
    parser.add_argument("--duration", type=float, default=0.5)
    parser.add_argument("--most", type=int, default=40)
    parser.add_argument("--page", type=Path, default=None)
    given = parser.parse_args()
    heads = ("file", "nv", "h", "exit", "read_s", "bare_s", "run_s", "all_s", "difference", "why")
    print(" | ".join(heads))
    rows = [row(path, model, given.duration, given.page) for path, model in files(given.places, given.most)]
    for one in rows:
        cells = [one.get(h, "") for h in heads]
        print(" | ".join(f"{c:.3g}" if isinstance(c, float) else str(c) for c in cells), flush=True)
    codes = [one["exit"] for one in rows]
    print(f"{len(rows)} files; exit codes:", {c: codes.count(c) for c in sorted(set(codes))})


if __name__ == "__main__":
    main()
