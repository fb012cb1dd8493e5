"""Parameters that a browser sends to the live page: the mechanism is built anew, or the one clear message comes back."""

from __future__ import annotations

import asyncio
import json
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
from mechlab.viewer.streaming import Rebuilder, controls


@pytest.fixture
def server() -> Iterator[Server]:
    design = api.load("fourbar")
    with serve(pages.still_story(design), quiet=True) as running:
        Rebuilder(running, design, pages.still_story, pages.run_story)
        yield running


def talk(server: Server, conversation: Callable[[Any], Awaitable[None]], **headers: str) -> None:
    """Runs a conversation over a websocket of the server."""

    async def work() -> None:
        request = httpclient.HTTPRequest(f"ws://127.0.0.1:{server.port}/live", headers=headers)
        socket = await websocket.websocket_connect(request)
        await asyncio.wait_for(conversation(socket), 300.0)
        socket.close()
        while await socket.read_message() is not None:  # until the other side has closed too
            pass

    # in a thread of its own: a browser test of the same process may have left its event loop running in this one
    with ThreadPoolExecutor(1) as thread:
        thread.submit(asyncio.run, work()).result()


async def until(socket: Any, kind: str) -> dict[str, Any]:
    """The next message of a kind."""
    while True:
        said = json.loads(await socket.read_message())
        if said["type"] == kind:
            return dict(said)


def crank_length(server: Server) -> float:
    """Of the crank that is drawn: the origin of the coupler from that of the crank."""
    story = server.story
    at = story.poses[0, [story.bodies.index(n) for n in ("crank", "coupler")], :3, 3]
    return float(np.linalg.norm(at[1] - at[0]))


def test_parameters_rebuild_the_mechanism_and_it_runs_on(server: Server) -> None:
    async def conversation(socket: Any) -> None:
        await socket.write_message(json.dumps({"type": "values", "values": {"crank": "120mm"}}))
        await until(socket, "story")
        assert crank_length(server) == pytest.approx(0.12, abs=1e-12)
        assert {c.key: c.value for c in server.controls}["crank"] == "0.12"
        first = (await until(socket, "poses"))["position"]
        assert (await until(socket, "poses"))["position"] != first  # the new mechanism moves
        await socket.write_message(json.dumps({"type": "values", "values": {"coupler": "0.28"}}))
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


def test_nonsense_is_ignored(server: Server) -> None:
    async def conversation(socket: Any) -> None:
        for nonsense in (
            "",
            "{",
            "[]",
            "7",
            '{"type": "values"}',
            '{"type": "values", "values": {"crank": [1]}}',
            b"\xff\x00",
        ):
            await socket.write_message(nonsense, binary=isinstance(nonsense, bytes))
        await until(socket, "poses")

    talk(server, conversation)
    assert crank_length(server) == pytest.approx(0.1, abs=1e-12)


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
