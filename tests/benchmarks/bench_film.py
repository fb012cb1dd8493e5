"""What a film costs; run it: python tests/benchmarks/bench_film.py [NAME] [SECONDS]. No limits are asserted.

CPU time of all frames with paths and feature edges, encoding included, against that of rendering as many frames without
them: the price of drawing the parts alone. Single frames along the film show whether the price of a frame grows.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from mechlab import api
from mechlab.viewer.film import FPS, MOST_EDGES, SAMPLES, write_mp4
from mechlab.viewer.picture import Drawing

SIZE = (960, 720)
PROBES = 11


def cpu() -> float:
    """CPU time [s] of this process and of its children that have ended."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def main(name: str, seconds: float) -> None:
    """Prints the costs for a run of `seconds`, filmed at its own pace."""
    story = api.story(api.simulate(name, duration=seconds))
    bare = replace(story, traces={})
    count = 1 + int(seconds * FPS)
    with Drawing(bare, SIZE, most_edges=0) as drawing:
        drawing.draw(0, SAMPLES, sun=0.0)
        before = cpu()
        for k in range(PROBES):
            drawing.draw(k * (len(story.t) - 1) // (PROBES - 1), SAMPLES, sun=0.0)
        frame = (cpu() - before) / PROBES
    prices = []
    with Drawing(story, SIZE, most_edges=MOST_EDGES) as drawing:
        drawing.draw(0, SAMPLES, sun=0.0)
        for k in range(PROBES):
            at, before = k * (len(story.t) - 1) // (PROBES - 1), cpu()
            drawing.draw(at, SAMPLES, upto=at, sun=0.0)
            prices.append(cpu() - before)
    print(f"{name}: a frame of the parts alone {frame:.2f} s; with paths and edges: {', '.join(f'{p:.2f}' for p in prices)} s")
    with tempfile.TemporaryDirectory() as scratch:
        before, start = cpu(), time.perf_counter()
        path = write_mp4(story, Path(scratch) / "film.mp4", SIZE, speed=1.0)
        took = cpu() - before
        wall = time.perf_counter() - start
        print(
            f"film of {seconds:g} s, {count} frames: {took:.0f} s CPU ({wall:.0f} s), {took / (count * frame):.2f} times its frames, "
            f"{path.stat().st_size / 1e6:.2f} MB"
        )


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "fourbar", float(sys.argv[2]) if len(sys.argv) > 2 else 10.0)
