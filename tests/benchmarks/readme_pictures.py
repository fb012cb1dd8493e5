"""Pictures of the page for the README, as a reader sees them; run it: python tests/benchmarks/readme_pictures.py [FOLDER].

The page of a run, two runs compared, a mechanism moved by hand, and a short animation of the six-freedom delta whose
platform is dragged by the mouse. Needs Chromium and playwright; FOLDER is assets where none is given.
"""

from __future__ import annotations

import io
import math
import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bench_page import ARGUMENTS
from PIL import Image, ImageDraw

from mechlab import api
from mechlab.viewer import Story, write_page

LAPTOP, SMALL = (1280, 800), (1120, 680)
SHARE = 0.8  # of the size of the page in the animation
FRAMES, REACH = 36, 46.0  # pictures of the animation; radius of the way of the mouse [px]
CURSOR = ((0, 0), (0, 17), (4, 13), (7, 20), (10, 19), (7, 12), (12, 12))
FULL = "lab.quality.judge = () => {}; lab.quality.level = 0"
"""No detail is left out, however slow this machine is."""


def opened(browser: Any, story: Story, size: tuple[int, int], folder: Path) -> Any:
    """A tab with the page of a story, ready."""
    page = write_page(story, folder / "page.html")
    tab = browser.new_context(offline=True, viewport={"width": size[0], "height": size[1]}).new_page()
    tab.goto(page.absolute().as_uri())
    while not tab.evaluate("!!(window.lab && window.lab.ready)"):
        tab.wait_for_timeout(50)
    tab.evaluate(FULL)
    return tab


def still(tab: Any, path: Path, prepare: str = "") -> None:
    """Saves what a tab shows after a script."""
    if prepare:
        tab.evaluate(prepare)
    tab.wait_for_timeout(1500)
    tab.screenshot(path=path)
    Image.open(path).convert("RGB").quantize(256, dither=Image.Dither.NONE).save(path, optimize=True)
    print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")


def dragged(tab: Any, body: str, path: Path) -> None:
    """Saves the animation of a body that the mouse leads around."""
    x, y = tab.evaluate("(name) => lab.onScreen(lab.pose(name).slice(0, 3).map((row) => row[3]))", body)
    tab.mouse.move(x, y)
    tab.mouse.down()
    pictures = []
    for k in range(FRAMES):
        angle = 2.0 * math.pi * k / FRAMES
        at = x + REACH * math.sin(angle), y - 0.7 * REACH * (1.0 - math.cos(angle))
        tab.mouse.move(*at)
        tab.wait_for_timeout(250)
        picture = Image.open(io.BytesIO(tab.screenshot())).convert("RGB")
        pen = ImageDraw.Draw(picture)  # a screenshot has no cursor
        pen.polygon([(at[0] + dx, at[1] + dy) for dx, dy in CURSOR], fill="black", outline="white")
        pictures.append(picture.resize([round(SHARE * side) for side in SMALL], Image.Resampling.LANCZOS))
    tab.mouse.up()
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=90, loop=0, quality=72, method=6)
    print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB, {len(pictures)} pictures")


def main(out: Path) -> None:
    """Writes all of them."""
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as scratch, sync_playwright() as playwright:
        chromium = os.environ.get("CHROMIUM") or shutil.which("chromium")
        browser = playwright.chromium.launch(executable_path=chromium, args=ARGUMENTS.split())
        show: Callable[[Story, tuple[int, int]], Any] = lambda story, size: opened(browser, story, size, Path(scratch))  # noqa: E731
        moved = api.explore("delta6", vary={})
        dragged(show(moved, SMALL), "platform", out / "page_dragged.webp")
        still(show(moved, LAPTOP), out / "page_explore_delta6.png")
        still(show(api.story(api.simulate("delta6")), LAPTOP), out / "delta6_page.png", "lab.seek(1.3)")
        first, second = api.simulate("fourbar"), api.simulate("fourbar", crank=0.09)
        still(show(api.story(first, against=second), LAPTOP), out / "page_fourbar_against.png", "lab.seek(0.7)")
        browser.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[2] / "assets")
