"""Large models and start-up in user CPU seconds, each beside a quarter of its size or a bare interpreter: ratios of one run.

    python -m tests.benchmarks.bench_large

A cost that is linear in the size has the ratio 4. Numbers of a loaded machine move by a half; ratios hardly.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import mechlab as ml
from mechlab.catalog import entry
from mechlab.mechanism import Builder, Inertia, Mechanism, revolute, structure

VERBS = ("list", "show fourbar", "show delta6", "solve fourbar crank_angle=1.2")


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
    """User CPU seconds of this process."""
    start = time.process_time()
    work()
    return time.process_time() - start


def started(command: list[str]) -> float:
    """Least user CPU seconds of three runs of a command."""
    spent = []
    for _ in range(3):
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        subprocess.run([sys.executable, *command], check=True, capture_output=True)
        spent.append(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)
    return min(spent)


def main() -> None:
    """Print both tables."""
    generated(train(5))  # imports
    ml.simulate(train(5), duration=0.01)
    print(f"{'what':24}{'size':>6}{'build':>9}{'structure':>11}{'generate':>10}{'run 50 steps':>14}")
    for name, make, sizes in (("gears in a row", train, (75, 300)), ("four-bars in a row", four_bars, (50, 200))):
        rows = []
        for n in sizes:
            build = cost(lambda make=make, n=n: make(n))  # type: ignore[misc]
            m = make(n)
            run = {"duration": 0.05, "timestep": 1e-3}
            rows.append([build, *(cost(f) for f in (
                lambda m=m: structure(m), lambda m=m: generated(m), lambda m=m, run=run: ml.simulate(m, **run),
            ))])  # type: ignore[misc]  # fmt: skip
            print(f"{name:24}{n:6}{rows[-1][0]:9.3f}{rows[-1][1]:11.3f}{rows[-1][2]:10.2f}{rows[-1][3]:14.2f}", flush=True)
        ratio = [b / a for a, b in zip(*rows, strict=True)]
        print(f"{'  ratio (linear: 4)':30}{ratio[0]:9.1f}{ratio[1]:11.1f}{ratio[2]:10.1f}{ratio[3]:14.1f}")
    bare = started(["-c", "import numpy"])
    print(f"\n{'command':36}{'user s':>8}{'/ import numpy':>16}\n{'import numpy':36}{bare:8.2f}{1.0:16.1f}")
    for verb in VERBS:
        spent = started(["-m", "mechlab", *verb.split()])
        print(f"{verb:36}{spent:8.2f}{spent / bare:16.1f}")


if __name__ == "__main__":
    main()
