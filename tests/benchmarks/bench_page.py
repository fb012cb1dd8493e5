"""How long pages take; run it: python tests/benchmarks/bench_page.py. No limits are asserted.

The page of a 4 s recording of the full delta: its size, and the time from opening it until the mechanism stands in the
picture (first frame drawn), in Chromium with software GL at 1280x720. Then CPU times of explore mode, mechanism by mechanism.
"""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

from mechlab import api, catalog
from mechlab.errors import MechlabError
from mechlab.viewer import write_page

ARGUMENTS = "--no-sandbox --disable-quic --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --ignore-gpu-blocklist"
REPEATS = 5


def cpu_of_children() -> float:
    """CPU time [s] of all processes that descend from this one (Linux); other work on the machine is left out of it."""
    parents, times = {}, {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        parents[int(folder.name)] = int(fields[1])
        times[int(folder.name)] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def ours(process: int) -> bool:
        return process != 0 and (process == os.getpid() or ours(parents.get(process, 0)))

    return sum(t for process, t in times.items() if process != os.getpid() and ours(process))


def ready(browser: Any, page: Path) -> tuple[float, float]:
    """Seconds from opening the page until it says that it is ready (its first frame is drawn), and the CPU time of that."""
    context = browser.new_context(offline=True, viewport={"width": 1280, "height": 720})
    tab = context.new_page()
    start, before = time.perf_counter(), cpu_of_children()
    tab.goto(page.as_uri())
    while not tab.evaluate("!!(window.lab && window.lab.ready)"):
        tab.wait_for_timeout(10)
    took = time.perf_counter() - start, cpu_of_children() - before
    context.close()
    return took


def page_of_the_delta(folder: Path) -> None:
    """Prints size and times of the page."""
    from playwright.sync_api import sync_playwright

    recording = api.simulate("delta6", duration=4.0)
    drawn = api.story(recording)
    start = time.process_time()
    page = write_page(drawn, folder / "delta6.html")
    wrote = time.process_time() - start
    with sync_playwright() as playwright:
        chromium = os.environ.get("CHROMIUM") or shutil.which("chromium")
        browser = playwright.chromium.launch(executable_path=chromium, args=ARGUMENTS.split())
        times = sorted(ready(browser, page) for _ in range(REPEATS))
        print(
            f"page of a {recording.t[-1]:g} s recording of the full delta ({len(drawn.bodies)} bodies, {len(drawn.t)} frames): "
            f"{page.stat().st_size / 1e6:.2f} MB, written in {wrote:.2f} s CPU; ready after {times[0][0]:.2f} s, {times[0][1]:.2f} s CPU "
            f"(best of {REPEATS}; middle {times[REPEATS // 2][0]:.2f} s, {times[REPEATS // 2][1]:.2f} s CPU; load {os.getloadavg()[0]:.1f} "
            f"on {os.cpu_count()} cores) in Chromium {browser.version}, software GL"
        )
        browser.close()


def explore_mode(folder: Path) -> None:
    """Prints CPU time, samples and size of explore mode of every mechanism."""
    for name in catalog.NAMES:
        start = time.process_time()
        try:
            told = api.explore(name)
        except MechlabError as error:
            print(f"{name:22s} {error}")
            continue
        solved = time.process_time() - start
        page = write_page(told, folder / f"{name}.html")
        assert told.explore is not None
        samples = [len(s.values) for s in told.explore.sweeps]
        worst = max(s.error for s in told.explore.sweeps)
        others = sum(len(v.values) - 1 for v in told.variants)
        print(
            f"{name:22s} {solved:5.1f} s, {len(samples)} drives with {sum(samples)} samples, {others} variants, "
            f"blend off by {worst:.1e}, {page.stat().st_size / 1e6:.2f} MB"
        )


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        page_of_the_delta(Path(scratch))
        explore_mode(Path(scratch))
