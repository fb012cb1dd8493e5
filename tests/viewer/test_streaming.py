"""Parameters that a browser sends to the live page: the mechanism is built anew, or the one clear message comes back."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
from tornado import httpclient, websocket

from mechlab import api
from mechlab.api import pages
from mechlab.viewer.live import Server, serve
from mechlab.viewer.streaming import Rebuilder, controls, stream


@pytest.fixture
def server() -> Iterator[Server]:
    design = api.load("fourbar")
    with serve(pages.still_story(design), quiet=True) as running:
        rebuilder = Rebuilder(running, design, pages.still_story, pages.run_story)
        yield running
        rebuilder.end()


def talk(server: Server, conversation: Callable[[Any], Awaitable[Any]], **headers: str) -> None:
    """Runs a conversation over a websocket of the server."""
    talk_at_once(server, conversation, **headers)


def talk_at_once(server: Server, *conversations: Callable[[Any], Awaitable[Any]], **headers: str) -> list[Any]:
    """Runs conversations, each over a websocket of its own, at the same time; what they return."""

    async def one(conversation: Callable[[Any], Awaitable[Any]]) -> Any:
        request = httpclient.HTTPRequest(f"ws://127.0.0.1:{server.port}/live", headers=headers)
        socket = await websocket.websocket_connect(request)
        said = await asyncio.wait_for(conversation(socket), 300.0)
        socket.close()
        while await socket.read_message() is not None:  # until the other side has closed too
            pass
        return said

    async def work() -> list[Any]:
        return await asyncio.gather(*(one(c) for c in conversations))

    # in a thread of its own: a browser test of the same process may have left its event loop running in this one
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, work()).result()


async def until(socket: Any, *kinds: str) -> dict[str, Any]:
    """The next message of some kinds."""
    while True:
        said = json.loads(await socket.read_message())
        if said["type"] in kinds:
            return dict(said)


def crank_length(server: Server) -> float:
    """Of the crank that is drawn: the origin of the coupler from that of the crank."""
    story = server.story
    at = story.poses[0, [story.bodies.index(n) for n in ("crank", "coupler")], :3, 3]
    return float(np.linalg.norm(at[1] - at[0]))


def test_parameters_rebuild_the_mechanism_and_it_runs_on(server: Server) -> None:
    async def conversation(socket: Any) -> None:
        await socket.write_message(json.dumps({"type": "values", "values": {"crank": "120mm"}}))
        await until(socket, "built")
        await until(socket, "story")
        assert crank_length(server) == pytest.approx(0.12, abs=1e-12)
        assert {c.key: c.value for c in server.controls}["crank"] == "0.12"
        first = (await until(socket, "poses"))["position"]
        assert (await until(socket, "poses"))["position"] != first  # the new mechanism moves
        await socket.write_message(json.dumps({"type": "values", "values": {"coupler": "0.28"}}))
        await until(socket, "built")
        await until(socket, "story")
        assert crank_length(server) == pytest.approx(0.12, abs=1e-12)  # what was set before is kept

    talk(server, conversation)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"crank": "-1"}, "crank"),
        ({"crank": "2"}, "the four-bar never closes"),
        ({"crank": "12 parsec"}, "parsec"),
        ({"crnk": "0.1"}, "crnk"),
    ],
)
def test_bad_values_come_back_as_one_message(server: Server, values: dict[str, str], message: str) -> None:
    async def conversation(socket: Any) -> None:
        await socket.write_message(json.dumps({"type": "values", "values": values}))
        assert message in (await until(socket, "refused"))["message"]
        assert (await until(socket, "poses"))["position"]  # the old one runs on

    talk(server, conversation)
    assert crank_length(server) == pytest.approx(0.1, abs=1e-12)


def test_nonsense_is_ignored(server: Server, caplog: pytest.LogCaptureFixture) -> None:
    async def conversation(socket: Any) -> None:
        for nonsense in (
            "",
            "{",
            "[]",
            "7",
            "[" * 60000,
            '{"a":' * 12000,
            "9" * 60000,
            '{"type": "values"}',
            '{"type": "values", "values": {}}',
            '{"type": "values", "values": {"crank": [1]}}',
            '{"type": ["values"], "values": {"crank": "1"}}',
            json.dumps({"type": "values", "values": {"crank": "1" * 5000}}),
            b"\xff\x00",
        ):
            await socket.write_message(nonsense, binary=isinstance(nonsense, bytes))
        await until(socket, "poses")

    async def flood(socket: Any) -> None:
        await socket.write_message(" " * 70000)  # more than is taken: the server ends the connection

    talk(server, conversation)
    talk(server, flood)
    talk(server, conversation)
    assert crank_length(server) == pytest.approx(0.1, abs=1e-12)
    assert [r.getMessage() for r in caplog.records if r.levelname == "ERROR"] == []


def ask(server: Server, **values: str) -> Callable[[Any], Awaitable[dict[str, Any]]]:
    """Sends parameters, and waits for the answer."""

    async def conversation(socket: Any) -> dict[str, Any]:
        await socket.write_message(json.dumps({"type": "values", "values": values}))
        answer = await until(socket, "built", "refused")
        if answer["type"] == "built":
            await until(socket, "story")
        return answer

    return conversation


def slowed(server: Server, monkeypatch: pytest.MonkeyPatch, seconds: float = 0.2) -> Rebuilder:
    """A rebuilder of the server whose builds take time."""
    rebuilder: Rebuilder = server.on_values.__self__  # type: ignore[union-attr]
    still = rebuilder.still

    def slow(design: Any) -> Any:
        time.sleep(seconds)
        return still(design)

    monkeypatch.setattr(rebuilder, "still", slow)
    return rebuilder


def test_the_latest_of_many_wishes_wins(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    rebuilder = slowed(server, monkeypatch)

    async def conversation(socket: Any) -> None:
        for k in range(1, 301):
            await socket.write_message(json.dumps({"type": "values", "values": {"crank": f"{0.1 + 1e-5 * k:.5f}"}}))
        while crank_length(server) != pytest.approx(0.103, abs=1e-12):
            await until(socket, "story")

    start = time.monotonic()
    talk(server, conversation)
    assert crank_length(server) == pytest.approx(0.103, abs=1e-12)
    assert rebuilder.built <= 3  # the one that ran, and what had come while it did
    assert time.monotonic() - start < 20.0


def test_two_browsers_at_once_lose_nothing(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    slowed(server, monkeypatch)

    async def first(socket: Any) -> dict[str, Any]:
        for k in range(20):
            await socket.write_message(json.dumps({"type": "values", "values": {"crank": f"{0.1 + 0.001 * k:.3f}"}}))
            await asyncio.sleep(0.03)
        return await ask(server, crank="0.12")(socket)

    second, bad = ask(server, coupler="0.28"), ask(server, rocker="-1")
    answers = talk_at_once(server, first, second, bad)
    assert [a["type"] for a in answers] == ["built", "built", "refused"]
    end = time.monotonic() + 60.0
    while {c.key: c.value for c in server.controls}["crank"] != "0.12" and time.monotonic() < end:
        time.sleep(0.05)  # the answer was to an earlier one of its wishes
    now = {c.key: c.value for c in server.controls}
    assert (now["crank"], now["coupler"]) == ("0.12", "0.28")
    assert now["rocker"] != "-1"


@pytest.mark.parametrize("error", [KeyError("x"), RecursionError("deep"), ZeroDivisionError(), MemoryError(), ValueError("a\nTraceback")])
def test_a_build_that_fails_in_any_way_is_one_sentence(
    server: Server, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    rebuilder: Rebuilder = server.on_values.__self__  # type: ignore[union-attr]

    def broken(design: Any) -> Any:
        raise error

    with monkeypatch.context() as patch:
        patch.setattr(rebuilder, "still", broken)
        (answer,) = talk_at_once(server, ask(server, crank="0.12"))
    assert answer["type"] == "refused"
    assert type(error).__name__ in answer["message"]
    assert "\n" not in answer["message"] and "Traceback" not in answer["message"] and ".py" not in answer["message"]
    (answer,) = talk_at_once(server, ask(server, crank="0.11"))
    assert answer["type"] == "built"
    assert crank_length(server) == pytest.approx(0.11, abs=1e-12)


def test_a_run_that_fails_in_any_way_says_so_on_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*given: Any) -> Any:
        raise IndexError("no such row")

    design = api.load("fourbar")
    monkeypatch.setattr("mechlab.viewer.streaming.run_scene", broken)
    with serve(pages.still_story(design), quiet=True) as server:
        stream(server, design, pages.run_story).join(60.0)
        severity, sentence = server.story.health[-1]
    assert severity == "error" and "IndexError" in sentence and "no such row" in sentence


def test_a_page_of_somebody_else_cannot_send_parameters(server: Server) -> None:
    async def conversation(socket: Any) -> None:
        raise AssertionError("a foreign page was let in")

    with pytest.raises(httpclient.HTTPClientError, match="403"):
        talk(server, conversation, Origin="http://evil.example")
    with pytest.raises(httpclient.HTTPClientError, match="421"):
        talk(server, conversation, Host="evil.example")


def test_the_form_shows_what_can_be_typed_again() -> None:
    shown = {c.key: c for c in controls(api.load("delta6", rod_length=0.4))}
    assert (shown["rod_length"].value, shown["rod_length"].unit) == ("0.4", "m")
    assert shown["k_spur"].value == "7/5"
    assert "bend_limit" not in shown
    again = api.load("delta6", **{k: typed(c.key, c.value) for k, c in shown.items() if c.value})
    expected = asdict(api.load("delta6", rod_length=0.4).parameters)
    for key, value in asdict(again.parameters).items():
        close = isinstance(value, float | tuple)  # the form shows 12 digits
        assert value == (pytest.approx(expected[key], rel=1e-11) if close else expected[key]), key


def typed(key: str, text: str) -> Any:
    from mechlab.values import parse_value

    return parse_value(key, text)


@pytest.mark.browser
def test_the_form_of_the_page(server: Server, look: Callable[..., Any], until: Callable[..., None]) -> None:
    page = look(server.url, offline=False)
    assert page.locator("#set-crank").input_value() == "0.1"
    page.locator("#set-crank").fill("2")
    page.locator("#set-crank").press("Enter")
    until(page, "document.querySelector('.said').textContent.includes('never closes')")
    page.locator("#set-crank").fill("120mm")
    page.locator("#controls button").click()
    until(page, "window.lab && lab.ready && document.getElementById('set-crank').value === '0.12'")
    assert crank_length(server) == pytest.approx(0.12, abs=1e-12)
