"""A small story, and a browser to look at it with."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mechlab.viewer import Part, Plot, Story, from_poses, write_page

BROWSER_ARGUMENTS = (
    "--no-sandbox --disable-quic --no-first-run --disable-background-networking --use-gl=angle "
    "--use-angle=swiftshader --enable-unsafe-swiftshader --ignore-gpu-blocklist"
).split()

GONE = "WebSocket connection to 'ws://127.0.0.1"
"""A browser reports so that the server of a live page has ended; a page cannot prevent that."""

PATIENCE = 300.0
"""Seconds to wait for a browser: a net under a page that hangs, far above what a busy machine takes."""

BOX_FACES = np.array(
    [
        [0, 2, 1],
        [0, 3, 2],
        [4, 5, 6],
        [4, 6, 7],
        [0, 1, 5],
        [0, 5, 4],
        [1, 2, 6],
        [1, 6, 5],
        [2, 3, 7],
        [2, 7, 6],
        [3, 0, 4],
        [3, 4, 7],
    ]
)


def box(x: float, y: float, z: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a box with edges x, y, z about the origin."""
    corners = np.array(
        [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
    )
    return corners * np.array([x, y, z]) / 2.0, BOX_FACES


def turning(angles: np.ndarray, axis: int, offset: np.ndarray) -> np.ndarray:
    """Poses (n, 4, 4): a rotation by `angles` [rad] about coordinate axis `axis`, moved by `offset` (3,) or
    (n, 3)."""
    poses = np.tile(np.eye(4), (len(angles), 1, 1))
    a, b = [(1, 2), (2, 0), (0, 1)][axis]
    poses[:, a, a] = poses[:, b, b] = np.cos(angles)
    poses[:, b, a] = np.sin(angles)
    poses[:, a, b] = -np.sin(angles)
    poses[:, :3, 3] = offset
    return poses


@pytest.fixture(scope="session")
def story() -> Story:
    """Three bodies over 4 s: one stands, one turns more than once, one swings and travels."""
    t = np.linspace(0.0, 4.0, 201)
    path = np.stack([0.2 * np.cos(t), 0.2 * np.sin(t), 0.1 + 0.02 * t], axis=1)
    poses = {
        "ground": np.eye(4),
        "wheel": turning(7.3 * t, 2, np.array([0.0, 0.0, 0.05])),
        'arm </script> & "co"': turning(np.sin(3.0 * t), 0, path),
    }
    moved = np.eye(4)
    moved[:3, 3] = [0.1, 0.0, 0.0]
    parts = (
        Part("ground", "base", *box(0.3, 0.3, 0.02)),
        Part("wheel", "disc", *box(0.2, 0.1, 0.03), color=(0.1, 0.4, 0.8, 1.0)),
        Part("wheel", "knob", *box(0.02, 0.02, 0.06), color=(0.9, 0.3, 0.1, 1.0), placement=moved),
        Part('arm </script> & "co"', "arm", *box(0.02, 0.02, 0.06), color=(0.1, 0.6, 0.4, 0.4)),
    )
    return from_poses(
        "Test <b>rig</b> </script>",
        poses,
        parts,
        t=t,
        summary="Two <i>movers</i> & a base.",
        plots=(
            Plot("Angle", "rad", {"wheel": 7.3 * t, "arm": np.sin(3.0 * t)}),
            Plot("Gap", "m", {"gap": np.where(t > 3.0, np.nan, 2e-6 * t)}),
        ),
        facts={"Radius": "0.1 m <x>"},
        traces={"tip": np.where(t[:, None] < 0.5, path[25], path)},
        health=(("ok", "The loop is closed."), ("warning", "The step is coarse."), ("error", "Energy grows.")),
        reconstructed=("ground",),
    )


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Chromium, from the environment variable CHROMIUM or from the path."""
    sync_api = _required("playwright.sync_api")
    executable = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
    if executable is None:
        _give_up("no chromium was found on the path or in the environment variable CHROMIUM")
    with sync_api.sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=executable, args=BROWSER_ARGUMENTS)
        yield running
        running.close()


@pytest.fixture(scope="module")
def look(browser: Any) -> Iterator[Callable[..., Any]]:
    """A function that opens an address in a fresh tab and waits for the lab.

    The tab keeps its `requests` and its `errors`; a test module fails at its end for an error that no test
    has looked at.
    """
    pages = []

    def open_page(url: str, offline: bool = True, width: int = 400, height: int = 300) -> Any:
        page = browser.new_context(offline=offline, viewport={"width": width, "height": height}).new_page()
        page.set_default_timeout(1000.0 * PATIENCE)
        pages.append(page)
        page.errors, page.requests = [], []
        page.on("console", lambda message: page.errors.append(message.text) if is_error(message) else None)
        page.on("pageerror", lambda error: page.errors.append(str(error)))
        page.on("request", lambda request: page.requests.append(request.url))
        page.goto(url)
        wait_until(page, "window.lab && window.lab.ready")
        return page

    open_page.pages = pages  # type: ignore[attr-defined]
    yield open_page
    errors = [error for page in pages for error in page.errors]
    for page in pages:
        page.context.close()
    assert errors == []


@pytest.fixture(autouse=True)
def tidy(request: pytest.FixtureRequest) -> Iterator[None]:
    """The pages that a test itself opened are closed after it: an open page goes on drawing."""
    if "look" not in request.fixturenames:
        yield
        return
    pages = request.getfixturevalue("look").pages
    before = len(pages)
    yield
    for page in pages[before:]:
        page.context.close()


def is_error(message: Any) -> bool:
    """Whether a message of the console is an error of the page."""
    return message.type == "error" and not message.text.startswith(GONE)


def wait_until(page: Any, condition: str, seconds: float = PATIENCE) -> None:
    """Waits for a JavaScript condition, also while the page reloads. (The browser's own waiting needs `eval`, which the
    page's policy forbids.)"""
    end = time.monotonic() + seconds
    while not _holds(page, condition):
        assert time.monotonic() < end, f"{condition} did not come true within {seconds} s"
        page.wait_for_timeout(20)


def _holds(page: Any, condition: str) -> bool:
    try:
        return bool(page.evaluate(condition))
    except Exception as error:
        if "context was destroyed" in str(error):  # the page is reloading
            return False
        raise


@pytest.fixture(scope="session")
def until() -> Callable[..., None]:
    """`wait_until`."""
    return wait_until


@pytest.fixture(scope="session")
def page_file(story: Story, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of the story, written once."""
    return write_page(story, tmp_path_factory.mktemp("page") / "lab.html")


def _required(module: str) -> Any:
    if os.environ.get("CI"):
        return __import__(module, fromlist=["sync_api"])
    return pytest.importorskip(module)


def _give_up(reason: str) -> None:
    if os.environ.get("CI"):
        pytest.fail(reason)
    pytest.skip(reason)
