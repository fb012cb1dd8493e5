"""Frames that a page draws in a second of CPU; run it: python tests/benchmarks/bench_frames.py [PAGE.html ...]

Without pages: a 4 s run of the full delta. The page plays, and is turned by the mouse, in Chromium with software GL at
1280x800; counted are the frames it renders, and the CPU time of all processes of the browser. No limits are asserted.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from bench_page import ARGUMENTS, cpu_of_children

from mechlab import api
from mechlab.viewer import write_page

SECONDS = 8.0
COUNT = """() => { const v = lab.viewer, draw = v.render; window.frames_drawn = 0;
  v.render = function (...given) { window.frames_drawn += 1; return draw.apply(this, given); }; }"""


def frames_per_second(tab: Any, act: Any) -> tuple[float, float]:
    """Frames in a second of CPU, and in a second, while `act` keeps the page moving."""
    before, count, start = cpu_of_children(), tab.evaluate("window.frames_drawn"), time.perf_counter()
    while time.perf_counter() - start < SECONDS:
        act()
    frames = tab.evaluate("window.frames_drawn") - count
    return frames / (cpu_of_children() - before), frames / (time.perf_counter() - start)


def measure(browser: Any, page: Path) -> None:
    """Prints the rates of one page: playing, turned, and its CPU time at rest."""
    context = browser.new_context(offline=True, viewport={"width": 1280, "height": 800})
    tab = context.new_page()
    tab.goto(page.absolute().as_uri())
    while not tab.evaluate("!!(window.lab && window.lab.ready)"):
        tab.wait_for_timeout(20)
    tab.evaluate(COUNT)
    tab.evaluate("lab.play()")
    tab.wait_for_timeout(3000)  # what adapts to the machine has adapted
    playing = frames_per_second(tab, lambda: tab.wait_for_timeout(200))
    tab.evaluate("lab.pause()")
    tab.wait_for_timeout(2000)
    tab.mouse.move(400, 400)
    tab.mouse.down()
    turn = iter(range(100000))
    turned = frames_per_second(tab, lambda: tab.mouse.move(400 + (next(turn) % 200), 400))
    tab.mouse.up()
    tab.wait_for_timeout(3000)
    before, count = cpu_of_children(), tab.evaluate("window.frames_drawn")
    tab.wait_for_timeout(4000)
    rest, count = (cpu_of_children() - before) / 4.0, tab.evaluate("window.frames_drawn") - count
    context.close()
    print(
        f"{page.name}: playing {playing[0]:.2f} frames per CPU second ({playing[1]:.1f} per second), turned {turned[0]:.2f} "
        f"({turned[1]:.1f} per second), at rest {count} frames and {100 * rest:.0f} % of a core (load "
        f"{os.getloadavg()[0]:.1f} on {os.cpu_count()} cores)"
    )


if __name__ == "__main__":
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as scratch, sync_playwright() as playwright:
        pages = [Path(x) for x in sys.argv[1:]]
        if not pages:
            pages = [write_page(api.story(api.simulate("delta6", duration=4.0)), Path(scratch) / "delta6.html")]
        chromium = os.environ.get("CHROMIUM") or shutil.which("chromium")
        running = playwright.chromium.launch(executable_path=chromium, args=ARGUMENTS.split())
        for one in pages:
            measure(running, one)
        running.close()
