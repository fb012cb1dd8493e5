"""Large models in CPU seconds, each beside a quarter of its size; steps beside Drake's where it is installed.

    python -m tests.benchmarks --only large

A cost that is linear in the size has the ratio 4. Numbers of a loaded machine move by a half; ratios hardly.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import mechlab as ml
from mechlab.catalog import entry
from mechlab.engines.protocol import available, engine
from mechlab.experiment.recording import Recording
from mechlab.mechanism import Builder, Inertia, Mechanism, revolute, structure
from tests.benchmarks.rows import Row


def train(wheels: int) -> Mechanism:
    """Wheels of 20 to 26 teeth in a row, the first one driven."""
    teeth = [20 + k % 7 for k in range(wheels + 1)]
    b, at = Builder(f"train_{wheels}"), 0.0
    for k in range(wheels):
        b.body(f"w{k}", revolute(f"w{k}", "z"), at=(at, 0.0, 0.0), inertia=Inertia.box(1.0, 0.1, 0.1, 0.01))
        at += 0.5e-3 * (teeth[k] + teeth[k + 1])
    for k in range(wheels - 1):
        b.gears(f"m{k}", f"w{k}", f"w{k + 1}", (teeth[k], teeth[k + 1]))
    return b.drive("w0").build()


def four_bars(count: int) -> Mechanism:
    """The row of four-bars of the catalog."""
    found = entry("n_fourbar")
    return found.build.__wrapped__(found.parameters(N=count), "full")  # type: ignore[attr-defined]  # not the kept one


def generated(m: Mechanism) -> None:
    """The verb `generate`."""
    with tempfile.TemporaryDirectory() as folder:
        ml.generate(m, out=folder)


def cost(work: Callable[[], object]) -> float:
    """CPU seconds of this process."""
    start = time.process_time()
    work()
    return time.process_time() - start


def solution(count: int) -> float:
    """Counted CPU seconds of two seconds of falling four-bars to an error of 1 um."""
    run = ml.simulate("n_fourbar", scene="fall", N=count, duration=2.0, max_error=1e-6)
    assert isinstance(run, Recording)
    return run.cost.cpu_s


def stages(make: Callable[[int], Mechanism], size: int) -> list[float]:
    """CPU seconds to build a mechanism, for its structure, its files, and 50 steps of it."""
    build = min(cost(lambda: make(size)) for _ in range(2))
    m = make(size)
    return [
        build,
        cost(lambda: structure(m)),
        cost(lambda: generated(m)),
        cost(lambda: ml.simulate(make(size), duration=0.05, timestep=1e-3)),
    ]


STAGES = ("built", "structure", "files, reloaded", "50 steps, recorded")


def grown(what: str, make: Callable[[int], Mechanism], size: int, asked: dict[str, str]) -> list[Row]:
    """The stages at a size beside those at a quarter of it."""
    small, large = stages(make, size // 4), stages(make, size)
    return [
        Row(f"{size} {what}: {name}", b, "s", f"{size // 4} {what}", a, asked.get(name, ""))
        for name, a, b in zip(STAGES, small, large, strict=True)
    ]


def steps(count: int) -> list[Row]:
    """Microseconds a step of falling four-bars at 1 ms, and what is left of the angle after half a second beside the one freedom."""
    found = entry("n_fourbar")
    p = found.parameters(N=count, duration=0.5)
    m, scene = found.build(p, "full"), found.scenes["fall"].make(p, "full")
    exact = float(np.abs(found.reference(p, scene).q[-1, 0]))
    sizes: dict[str, tuple[float, float]] = {}
    for name, of in (("drake", "SAP"), ("mujoco", "implicitfast"), ("mujoco", "RK4")):
        if available(name):
            continue
        run = engine(name).trace(m, scene, replace(scene.settings, engine=name, integrator=of, timestep=1e-3), 5)
        sizes[of] = 1e6 * run.cpu_s / run.steps, abs(float(np.abs(run.q[-1, 0])) - exact)
    drake, off = sizes.get("SAP", (np.nan, np.nan))
    out = []
    for of in ("implicitfast", "RK4"):
        name = f"{count} four-bars: a step of MuJoCo {of} ({sizes[of][1]:.0e} rad)"
        beside = f"Drake SAP ({off:.0e} rad)" if "SAP" in sizes else ""
        out.append(Row(name, sizes[of][0], "us", beside, drake, "ratio <= 1"))
    return out


def rows() -> list[Row]:
    """The section of the table."""
    generated(train(5))  # imports
    ml.simulate(train(5), duration=0.01)
    solution(2)
    out = grown("gears in a row", train, 300, {"built": "value <= 0.2", "files, reloaded": "value <= 2"})
    out += grown("four-bars", four_bars, 200, {})
    small, large = solution(50), solution(200)
    out.append(Row("200 four-bars: solved to 1 um over 2 s", large, "s", "50 four-bars", small, "ratio <= 6"))
    return [*out, *steps(40), *steps(160)]
