"""The live page: ours alone, and complete for everybody who comes late."""

from __future__ import annotations

import gc
import http.client
import os
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mechlab.api import load
from mechlab.errors import MechlabError
from mechlab.mechanism.assembly import close
from mechlab.viewer import Story, from_poses
from mechlab.viewer.from_recording import mechanism_story, placed
from mechlab.viewer.live import Control, Server, serve


@pytest.fixture
def server(story: Story) -> Iterator[Server]:
    with serve(story, quiet=True) as running:
        yield running


def status(server: Server, host: str, path: str = "/", **headers: str) -> int:
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)
    connection.request("GET", path, headers={"Host": host, **headers})
    answer = connection.getresponse().status
    connection.close()
    return answer


def test_only_this_computer_can_reach_it(server: Server) -> None:
    assert server.url == f"http://127.0.0.1:{server.port}/"
    assert server._socket.getsockname()[0] == "127.0.0.1"


def test_a_foreign_name_is_refused(server: Server) -> None:
    upgrade = {
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
        "Sec-WebSocket-Version": "13",
    }
    for host in ("evil.example", f"evil.example:{server.port}", "127.0.0.1.evil.example", "192.0.2.2"):
        assert status(server, host) == 421, host
        assert status(server, host, "/live", **upgrade) == 421, host
    for host in (f"127.0.0.1:{server.port}", f"localhost:{server.port}", f"[::1]:{server.port}"):
        assert status(server, host) == 200, host
    ours = f"127.0.0.1:{server.port}"
    assert status(server, ours, "/live", Origin="http://evil.example", **upgrade) == 403
    assert status(server, ours, "/live", Origin=f"http://{ours}", **upgrade) == 101
    assert status(server, ours, "/../etc/passwd") == 404


@pytest.mark.browser
def test_a_part_is_moved_by_hand_from_what_the_server_shows(look: Callable[..., Any], until: Callable[..., None]) -> None:
    m = load("fourbar").mechanism()
    q = close(m, targets={"crank_angle": float(m.value("crank_angle", m.reference())) + 0.3}, steps=5).q
    with serve(mechanism_story(m), quiet=True) as server:
        with pytest.raises(MechlabError, match="q: expected shape"):
            server.update(placed(m, q[None])[1][0], q[:-1])
        page = look(server.url, offline=False)
        server.update(placed(m, q[None])[1][0], q)
        until(page, "document.getElementById('notice').textContent === 'live'")
        moved = page.evaluate("(lab.explorer.takeOver(), Array.from(lab.explorer.solver.q))")
        np.testing.assert_allclose(moved, q, atol=1e-12)


def test_the_address_is_printed(story: Story, capsys: pytest.CaptureFixture[str]) -> None:
    with serve(story) as running:
        printed = capsys.readouterr()
    assert printed.out == running.url + "\n"
    assert printed.err == ""


def test_a_host_that_others_can_reach_is_warned_about(story: Story, capsys: pytest.CaptureFixture[str]) -> None:
    with serve(story, host="0.0.0.0", quiet=True) as running:
        assert status(running, f"192.0.2.2:{running.port}") == 200
        assert status(running, "evil.example") == 421
    assert "can be reached by other computers" in capsys.readouterr().err


def test_after_close_the_port_is_free_and_updates_are_refused(story: Story) -> None:
    running = serve(story, quiet=True)
    running.close()
    running.close()
    with pytest.raises(MechlabError, match="is closed"):
        running.update(story.poses[0])
    with socket.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", running.port)) != 0


def test_a_taken_port_is_named(server: Server, story: Story) -> None:
    with pytest.raises(MechlabError, match=f"port {server.port}.*Try port 0"):
        serve(story, port=server.port, quiet=True)


@pytest.mark.parametrize(
    ("poses", "message"),
    [
        (np.eye(4), r"expected shape \(3, 4, 4\), one for each of ground, wheel, .*got \(4, 4\)"),
        (np.full((3, 4, 4), np.nan), "must be finite"),
    ],
)
def test_poses_are_checked(server: Server, poses: np.ndarray, message: str) -> None:
    with pytest.raises(MechlabError, match=message):
        server.update(poses)


def test_it_ends_with_the_process() -> None:
    code = (
        "from mechlab.viewer import from_poses; from mechlab.viewer.live import serve; serve(from_poses('x', {}, ()))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    port = int(done.stdout.strip().rstrip("/").rsplit(":", 1)[1])
    with socket.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", port)) != 0


@pytest.mark.browser
def test_every_browser_follows_also_a_late_one(
    server: Server, story: Story, look: Callable[..., Any], until: Callable[..., None]
) -> None:
    def assert_shows(page: Any, poses: np.ndarray) -> None:
        until(page, "document.getElementById('notice').textContent === 'live'")
        until(page, f"Math.abs(lab.pose('wheel')[0][0] - {poses[1, 0, 0]}) < 1e-6")
        seen = np.array(page.evaluate("names => names.map(name => lab.pose(name))", list(story.bodies)))
        np.testing.assert_allclose(seen, poses, atol=1e-6)

    early = look(server.url, offline=False)
    server.update(story.poses[40])
    assert_shows(early, story.poses[40])
    server.update(story.poses[90])
    late = look(server.url, offline=False)
    assert late.locator("h1").inner_text() == story.title
    assert_shows(early, story.poses[90])
    assert_shows(late, story.poses[90])
    late.evaluate("lab.seek(0)")
    assert late.locator("#notice").inner_text() == ""
    np.testing.assert_allclose(late.evaluate("lab.pose('wheel')"), story.poses[0, 1], atol=1e-6)


@pytest.mark.browser
def test_a_new_story_takes_its_place_in_the_open_page(
    server: Server, story: Story, look: Callable[..., Any], until: Callable[..., None]
) -> None:
    """Nothing is loaded anew, no frame is without picture, and what the reader has set stays."""
    server.show(story, [Control("length", "1", "m", "")])
    page = look(server.url, offline=False, width=900, height=400)
    page.evaluate(WATCH)
    page.evaluate("lab.seek(1.5); document.getElementById('panel').scrollTop = 120")
    page.locator("#show summary").click()
    page.locator("#show-traces").click()
    page.locator("#speed").select_option("0.25")
    page.mouse.move(300, 200)
    page.mouse.down()
    page.mouse.move(360, 230)
    page.mouse.up()
    page.wait_for_timeout(300)  # the view comes to rest
    view = page.evaluate(VIEW)
    server.show(replace(story, title="second"))
    until(page, "lab.ready && document.querySelector('h1').textContent === 'second'")
    assert page.title() == "second"
    assert page.evaluate("window.blank") == 0
    after = page.evaluate(VIEW)
    np.testing.assert_allclose(after.pop("camera"), view.pop("camera"), atol=1e-9)
    assert after == view
    assert view == {"time": 1.5, "scroll": 120, "traces": False, "speed": "0.25", "same": True}
    page.locator("#set-length").fill("2.5")
    server.show(from_poses("third", {"only": np.eye(4)}, ()), [Control("length", "1", "m", "")])
    until(page, "lab.ready && lab.bodies[0] === 'only'")
    assert page.locator("#set-length").input_value() == "2.5"
    assert page.evaluate("document.activeElement.id") == "set-length"
    assert [r for r in page.requests if r.endswith("/")] == [server.url]


WATCH = """() => { window.canvas = document.querySelector('canvas'); window.blank = 0;
  const check = () => { const c = document.querySelector('#viewport canvas');
    if (!c || !c.width || !document.querySelector('h1')) window.blank += 1; requestAnimationFrame(check); };
  check(); }"""
VIEW = """() => ({ camera: [...lab.viewer.camera.position.toArray(), ...lab.viewer.controls.target.toArray()], time: lab.time,
  scroll: document.getElementById('panel').scrollTop, traces: document.getElementById('show-traces').checked,
  speed: document.getElementById('speed').value, same: document.querySelector('#viewport canvas') === window.canvas })"""


@pytest.mark.browser
def test_the_page_goes_on_when_the_server_is_back(
    story: Story, look: Callable[..., Any], until: Callable[..., None]
) -> None:
    first = serve(story, quiet=True)
    page = look(first.url, offline=False)
    first.close()
    until(page, "document.getElementById('notice').className === 'stopped'")
    with serve(replace(story, title="the next run"), port=first.port, quiet=True) as second:
        until(page, "document.querySelector('h1').textContent === 'the next run'")
        second.update(story.poses[40])
        until(page, f"Math.abs(lab.pose('wheel')[0][0] - {story.poses[40, 1, 0, 0]}) < 1e-6")
    page.close()


def test_browsers_that_go_leave_no_complaint(server: Server, story: Story, caplog: pytest.LogCaptureFixture) -> None:
    """Connections that break off while poses are sent to them."""
    for _ in range(5):
        raw = socket.create_connection(("127.0.0.1", server.port))
        raw.sendall(UPGRADE.format(port=server.port).encode())
        raw.recv(4096)
        server.update(story.poses[0])
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\0\0\0\0\0\0\0")  # reset, not closed
        raw.close()
        for frame in story.poses[:50]:
            server.update(frame)
        server.show(story)
    assert status(server, f"127.0.0.1:{server.port}") == 200
    gc.collect()  # a task whose error nobody has seen says so when it is collected
    assert [r.getMessage() for r in caplog.records if r.levelname in ("ERROR", "WARNING")] == []


UPGRADE = (
    "GET /live HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)
