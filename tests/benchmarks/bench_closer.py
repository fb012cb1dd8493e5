"""The kept closer: CPU microseconds a pose on a path of 360 poses, for each engine, one pose after the other and as an array.

    python -m tests.benchmarks.bench_closer

The four-bar turns its crank once; a delta with the size of Gepetto's (14 joints of one coordinate, three loops of 6 rows) moves its
two motors about their reference. `solve` answers with all witnesses, arrays of 360. Beside them stands placo 0.10.2, which closes loops
by a QP of tasks: its numbers were measured on another day (2026-11-22, loaded machine: +-40 %); the ratios to the search of one pose
(`close` along a path of at least 10 steps) are of one process.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import mechlab as ml
from mechlab.engines.closer import Closer
from mechlab.engines.protocol import IMPLEMENTATIONS, available, engine
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, revolute
from tests.benchmarks.rows import Row

POSES = 360
PLACO = {"four-bar": 42.0, "delta": 63.0}
"""placo 0.10.2, us a pose, 2026-11-22."""
ASKED = {"four-bar": "value <= 100", "delta": "value <= 150"}


def cost(work: Callable[[], object], repeats: int = 3) -> float:
    """Least CPU time of a few runs [us] a pose."""
    best = np.inf
    for _ in range(repeats):
        start = time.process_time()
        work()
        best = min(best, time.process_time() - start)
    return best / POSES * 1e6


def loops_of_six_rows() -> Mechanism:
    """Three planar legs that carry a plate in their plane: 14 joints, three fixed loops of 6 rows, as many rows redundant as in
    Gepetto's delta (example-parallel-robots), two motors."""
    b = Builder("three_legs", gravity=(0.0, -9.81, 0.0))
    part = Inertia.box(0.2, 0.1, 0.02, 0.02)
    feet, ends = (-0.3, 0.0, 0.3), (-0.1, 0.0, 0.1)
    for k, x in enumerate(feet):
        b.body(f"thigh_{k}", revolute(f"hip_{k}"), at=(x, 0.0, 0.0), inertia=part)
        b.body(f"shank_{k}", revolute(f"knee_{k}"), parent=f"thigh_{k}", at=(0.12, 0.28, 0.0), inertia=part)
        b.body(f"foot_{k}", revolute(f"ankle_{k}"), parent=f"shank_{k}", at=(ends[k] - x - 0.12, 0.32, 0.0), inertia=part)
    b.body("x", ml.prismatic("plate_x", "x"), inertia=part)
    b.body("y", ml.prismatic("plate_y", "y"), parent="x", inertia=part)
    b.body("plate", revolute("plate_turn"), parent="y", at=(0.0, 0.6, 0.0), inertia=part)
    b.body("wheel", revolute("wheel"), parent="plate", inertia=part)
    b.body("handle", revolute("handle"), parent="wheel", at=(0.05, 0.0, 0.0), inertia=part)
    for k, x in enumerate(ends):
        b.close_here(ml.Loop(f"end_{k}", "fixed", f"foot_{k}", "plate", Placement(), Placement((x, 0.0, 0.0))))
    b.drive("hip_0").drive("hip_2").drive("knee_0").drive("wheel").drive("handle")
    return b.build()


def paths() -> dict[str, tuple[Mechanism, dict[str, np.ndarray]]]:
    """Name -> mechanism and given values (360,) along a closed path from the reference."""
    t = np.linspace(0.0, 2.0 * np.pi, POSES)
    four, legs = ml.load("fourbar").mechanism(), loops_of_six_rows()
    swing = {d.on: 0.1 * (np.sin(t + k) - np.sin(k)) for k, d in enumerate(legs.drives)}
    return {
        "four-bar": (four, {"crank_angle": four.zero("crank_angle") + t}),
        "delta": (legs, {n: legs.zero(n) + x for n, x in swing.items()}),
    }


def searched(m: Mechanism, given: dict[str, np.ndarray], name: str) -> float:
    """us a pose of the robust search along the path, each pose from the reference, at every 12th pose."""
    picked = range(0, POSES, 12)
    asked = [{n: float(x[k]) for n, x in given.items()} for k in picked]
    start = time.process_time()
    for values in asked:
        engine(name).assemble(m, values)
    return (time.process_time() - start) / len(asked) * 1e6


def rows() -> list[Row]:
    """A row for each path, engine and way of asking; `solve` with its witnesses last."""
    out = []
    for path, (m, given) in paths().items():
        for name in IMPLEMENTATIONS:
            if available(name):
                continue
            one, many = Closer(m, [*given], name), Closer(m, [*given], name)
            poses = many(given)
            if not np.all(poses.closed) or not np.max(poses.residual) <= 1e-12:
                raise ValueError(f"{path}, {name}: not closed to 1e-12")
            asked = [{n: float(x[k]) for n, x in given.items()} for k in range(POSES)]
            single = cost(lambda one=one, asked=asked: [one(x) for x in asked])  # type: ignore[misc]
            bulk = cost(lambda many=many, given=given: many(given))  # type: ignore[misc]
            moving = given | {f"{n}_rate": 1.0 for n in given}
            with_rates = cost(lambda many=many, moving=moving: many(moving))  # type: ignore[misc]
            reference = searched(m, given, name)
            out += [
                Row(f"{path}, {name}: a pose after the other", single, "us", "robust search", reference, ASKED[path]),
                Row(f"{path}, {name}: array of {POSES}", bulk, "us", "robust search", reference, ASKED[path]),
                Row(f"{path}, {name}: array, with rates and accelerations", with_rates, "us"),
            ]
            if name == "mujoco":
                out.append(Row(f"{path}, {name} beside placo of 2026-11-22", single, "us", "placo 0.10.2, stored", PLACO[path]))
    design, phi = ml.load("fourbar"), np.linspace(0.0, 2.0 * np.pi, POSES)
    ml.solve(design, crank_angle=phi)
    pose_after_pose = [float(x) for x in phi[:: POSES // 12]]
    start = time.process_time()
    for x in pose_after_pose:
        ml.solve(design, crank_angle=x)
    singles = (time.process_time() - start) / len(pose_after_pose) * 1e6
    for what, more in (("", {}), (", with rates and accelerations", {"crank_rate": 1.0})):
        turned = iter(phi + 0.001 * k for k in range(1, 9))  # another question each time: the start of the last one is kept
        spent = cost(lambda more=more, turned=turned: ml.solve(design, crank_angle=next(turned), **more))  # type: ignore[misc]
        out.append(Row(f"solve fourbar{what}: array of {POSES}", spent, "us", "one call a pose", singles))
    return out


if __name__ == "__main__":
    for row in rows():
        beside = f"   {row.beside} {row.reference:.1f}, ratio {row.ratio:.3f}" if row.beside else ""
        print(f"{row.name:55} {row.value:9.1f} {row.unit}{beside}")
