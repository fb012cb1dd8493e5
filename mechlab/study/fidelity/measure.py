"""How far a run of one fidelity is from that of the richest: the same scene, what both name, at the same times.

Engines hold loops and gears by soft rows, and a richer model has more of them. What the model itself gets wrong is had by
closing every sample again first (the smallest correction in the sense of the kinetic energy). What was corrected is told:
below it (`resolution`) an error cannot be told from the softness of the engine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mechlab.experiment.recording import Recording, basic_channels
from mechlab.mechanism import integrate
from mechlab.mechanism.geometry import Array
from mechlab.study.witness import room

SAMPLES = 100


@dataclass(frozen=True)
class Error:
    """poses: largest difference of a joint, shaft or frame coordinate [rad or m], at `worst`; slip: what the rows of the
    engine gave way in this run [rad or m], resolution: in both together.

    forces: of a drive force, root mean square over the run, as a share of that of the force; loads: of a tooth load likewise,
    None where the rows are not the same. Mean squares, because a start out of balance makes a first instant that means nothing.
    """

    poses: float
    worst: str
    forces: float | None
    loads: float | None = None
    slip: float = 0.0
    resolution: float = 0.0


def measure(run: Recording, richest: Recording) -> Error:
    """The error of a run against the richest, over the time that both cover."""
    names = [n for n in run.mechanism.scalar_names if n in richest.mechanism.scalar_names]
    frames = {f.name for f in run.mechanism.frames} & {f.name for f in richest.mechanism.frames}
    names += [f"{f}_{a}" for f in sorted(frames) for a in "xyz"]
    end = min(float(run.t[-1]), float(richest.t[-1]))
    times = run.t[run.t <= end * (1.0 + 1e-12)]
    (mine, slip), (theirs, other_slip) = closed(thinned(run)), closed(thinned(richest))
    few = mine.t[mine.t <= end * (1.0 + 1e-12)]
    gaps = {n: float(np.max(np.abs(_at(mine, n, few) - _at(theirs, n, few)))) for n in names}
    worst = max(gaps, key=lambda n: gaps[n]) if gaps else ""
    forces = [n for n in run.channels if n.endswith("_force") and n in richest.channels]
    rows, other_rows = ({r.name for r in x.mechanism.relations} for x in (run, richest))
    loads = [f"{n}_load" for n in sorted(rows)] if rows == other_rows else []
    shares = [_share(run, richest, channels, times) for channels in (forces, loads)]
    return Error(gaps.get(worst, 0.0), worst, shares[0], shares[1], slip, slip + other_slip)


def thinned(run: Recording) -> Recording:
    """The run at about SAMPLES of its samples, the first and the last among them."""
    stride = max(1, (len(run.t) - 1) // SAMPLES)
    keep = np.unique(np.append(np.arange(0, len(run.t), stride), len(run.t) - 1))
    channels = {n: x[keep] for n, x in run.channels.items()}
    return replace(run, t=run.t[keep], q=run.q[keep], v=run.v[keep], channels=channels)


def closed(run: Recording) -> tuple[Recording, float]:
    """The run with every pose closed again, its basic channels from them; and the largest correction [rad or m]."""
    m = run.mechanism
    plant = room("pinocchio").PinPlant(m)
    if not len(plant.constraints):
        return run, 0.0
    q, slip = run.q.copy(), 0.0
    for k in range(len(q)):
        moved = np.zeros(m.nv)
        for _ in range(4):
            residual = plant.set(q[k]).residual()
            if np.max(np.abs(residual)) < 1e-13:
                break
            step = plant.correction(residual)
            moved += step
            q[k] = integrate(m, q[k], step)
        slip = max(slip, float(np.max(np.abs(moved))))
    channels, _ = basic_channels(m, q, run.v)
    return run.with_channels(channels, {}), slip


def _at(run: Recording, name: str, times: Array) -> Array:
    if len(run.t) >= len(times) and np.array_equal(run.t[: len(times)], times):
        return run.channel(name)[: len(times)]
    return np.array([run.at(name, min(t, float(run.t[-1]))) for t in times])


def _share(run: Recording, richest: Recording, names: Sequence[str], times: Array) -> float | None:
    """Largest root mean square difference of any of the channels, as a share of that of the channel; None without any."""
    out = []
    for n in names:
        if n in run.channels and n in richest.channels:
            a, b = _at(run, n, times), _at(richest, n, times)
            off, size = float(np.sqrt(np.mean((a - b) ** 2))), float(np.sqrt(np.mean(b**2)))
            out.append(off / size if size > 1e-12 else off)
    return max(out) if out else None
