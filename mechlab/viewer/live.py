"""The live page: a small web server on this computer only, which sends stories and poses to every browser that shows it."""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import json
import secrets
import socket
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import cached_property
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from tornado import httpserver, web, websocket

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.viewer.html_page import packed_story, page_of
from mechlab.viewer.messages import LARGEST_MESSAGE, read_message, wanted_values
from mechlab.viewer.pack import quaternions
from mechlab.viewer.story import Story, frozen

_STARTUP_SECONDS = 10.0


@dataclass(frozen=True)
class Control:
    """A parameter in the form of a live page: its name, value as text, unit, and description."""

    key: str
    value: str
    unit: str
    text: str


Reply = Callable[[str | None], None]
"""Answers a browser: None where its parameters are built, else why not."""


@dataclass(frozen=True, eq=False)
class _Shown:
    """What the page shows: the number of the story, the story, and the parameters that can be changed."""

    number: int
    story: Story
    controls: tuple[Control, ...]

    @cached_property
    def packed(self) -> tuple[dict[str, Any], str]:
        """Document and block of the story."""
        return packed_story(self.story, effort=1)


def serve(story: Story, host: str = "127.0.0.1", port: int = 0, *, quiet: bool = False) -> Server:
    """Serves the page of `story` until the Server is closed or the process ends, and prints its address
    unless `quiet`.

    port: 0 takes a free one. A host that other computers can reach is allowed, with a warning on stderr.
    Raises MechlabError where the address cannot be used.
    """
    server = Server(story, host, port)
    if not server.loopback:
        print(
            f"warning: {host} can be reached by other computers; everybody on the network can see this page "
            "and change its parameters.",
            file=sys.stderr,
        )
    if not quiet:
        print(server.url, flush=True)
    return server


class Server:
    """A running live page; made by `serve`. A context manager; every method may be called from any thread."""

    def __init__(self, story: Story, host: str, port: int) -> None:
        self.host = host
        self.loopback = _is_loopback(host)
        self.on_values: Callable[[Mapping[str, str], Reply], None] | None = None
        """Called with the parameters that a browser sends, and the function that answers it."""
        self.on_model: Callable[[str, Reply], None] | None = None
        """Called with the JSON of a model that a browser sends, and the function that answers it."""
        self._session = secrets.token_hex(8)
        self._shown = _Shown(0, story, ())
        self._last: str | None = None
        self._clients: set[_Live] = set()
        self._showing = threading.Lock()
        self._closed = False
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        try:
            self._socket = socket.create_server((host, port), family=family)
        except OSError as error:
            raise MechlabError(
                f"Cannot listen on {host}, port {port}: {error}. Try port 0, which takes a free one."
            ) from error
        self._socket.setblocking(False)
        self.port: int = self._socket.getsockname()[1]
        shown = f"[{host}]" if ":" in host else host
        self.url = f"http://{shown}:{self.port}/"
        self._loop = asyncio.new_event_loop()
        self._started = threading.Event()
        self._thread = threading.Thread(target=self._work, name="mechlab-live", daemon=True)
        self._thread.start()
        if not self._started.wait(_STARTUP_SECONDS):
            raise MechlabError(f"The server on {self.url} did not start within {_STARTUP_SECONDS:.0f} s.")

    @property
    def story(self) -> Story:
        """What the page shows."""
        return self._shown.story

    @property
    def controls(self) -> tuple[Control, ...]:
        """The parameters that the page can change."""
        return self._shown.controls

    def update(self, poses: ArrayLike, q: ArrayLike | None = None) -> None:
        """Shows `poses`, (len(bodies), 4, 4) in the order of `story.bodies`, in every browser, also in those
        that come later. q: coordinates (nq,) of the story's model there, from which a part is then moved by hand.

        Raises MechlabError for a wrong shape or numbers that are not finite, and after `close`.
        """
        matrices = np.asarray(poses, dtype=np.float64)
        shown = self._shown
        expected = (len(shown.story.bodies), 4, 4)
        if matrices.shape != expected:
            raise MechlabError(
                f"poses: expected shape {expected}, one for each of {', '.join(shown.story.bodies)}; "
                f"got {matrices.shape}."
            )
        if not np.all(np.isfinite(matrices)):
            raise MechlabError("poses: every number must be finite.")
        model = shown.story.model
        coordinates = None if q is None or model is None else frozen(q, "q", (model.nq,)).tolist()
        message = json.dumps(
            {
                "type": "poses",
                "number": shown.number,
                "position": matrices[:, :3, 3].tolist(),
                "quaternion": quaternions(matrices[:, :3, :3]).tolist(),
                "q": coordinates,
            }
        )

        def send() -> None:
            self._last = message
            for client in list(self._clients):
                client.push_pose(message)

        self._call(send)

    def show(self, story: Story, controls: Sequence[Control] | None = None) -> None:
        """Replaces the story, and the parameters that can be changed; every browser takes it into its open page, without
        loading it anew. Raises MechlabError after `close`."""
        with self._showing:
            shown = _Shown(self._shown.number + 1, story, self.controls if controls is None else tuple(controls))
            shown.packed  # noqa: B018  packed here, so that the thread that answers the browsers does not wait for it
            self._shown = shown

            def announce() -> None:
                self._last = None
                for client in list(self._clients):
                    client.push(self._announcement)

            self._call(announce)

    @property
    def _announcement(self) -> str:
        return json.dumps({"type": "story", "session": self._session, "number": self._shown.number})

    def document(self) -> dict[str, Any]:
        """What a page needs to show the present story: its document and its block of bytes."""
        shown = self._shown
        document, block = shown.packed
        live = {"session": self._session, "number": shown.number}
        return {
            "document": document | {"live": live, "controls": [asdict(c) for c in shown.controls]},
            "block": block,
        }

    @property
    def closed(self) -> bool:
        """True after `close`."""
        return self._closed

    def wait(self) -> None:
        """Blocks until the server is closed (Ctrl-C interrupts it as usual)."""
        while self._thread.is_alive():
            self._thread.join(0.2)

    def close(self) -> None:
        """Stops listening and ends every connection; a second call does nothing."""
        if not self._closed:
            self._closed = True
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()

    def __enter__(self) -> Server:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def accepts(self, host_header: str) -> bool:
        """True when a Host header names this server: a foreign page whose name points to this computer must not
        read ours."""
        name = _host_name(host_header)
        if name in ("localhost", self.host):
            return True
        try:
            address = ipaddress.ip_address(name)
        except ValueError:
            return not self.loopback and name == socket.gethostname().lower()
        return address.is_loopback or not self.loopback

    def _call(self, action: Callable[[], None]) -> None:
        if self._closed:
            raise MechlabError(f"The server on {self.url} is closed.")
        self._loop.call_soon_threadsafe(action)

    def _work(self) -> None:
        asyncio.set_event_loop(self._loop)
        arguments = {"server": self}
        application = web.Application(
            [("/", _Page, arguments), ("/live", _Live, arguments)],
            websocket_max_message_size=LARGEST_MESSAGE,
        )
        server = httpserver.HTTPServer(application)
        self._loop.call_soon(server.add_sockets, [self._socket])
        self._loop.call_soon(self._started.set)
        try:
            self._loop.run_forever()
        finally:
            server.stop()
            for client in list(self._clients):
                client.close()
            self._loop.run_until_complete(server.close_all_connections())
            pending = asyncio.all_tasks(self._loop)
            for task in pending:
                task.cancel()
            self._loop.run_until_complete(asyncio.gather(*pending, return_exceptions=True))
            self._loop.close()


def _host_name(header: str) -> str:
    """The name in a Host header, without port and brackets, in lower case."""
    header = header.strip().lower()
    return header[1:].split("]")[0] if header.startswith("[") else header.split(":")[0]


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


class _Ours(web.RequestHandler):
    """A request that is answered only under this server's own name."""

    def initialize(self, server: Server) -> None:
        self.server = server

    def prepare(self) -> None:
        if not self.server.accepts(self.request.host):
            raise web.HTTPError(421)
        self.set_header("Cache-Control", "no-store")
        self.set_header("X-Content-Type-Options", "nosniff")


class _Page(_Ours):
    def get(self) -> None:
        self.set_header("X-Frame-Options", "DENY")
        connect = f"data: 'self' ws://{self.request.host}"
        self.finish(page_of(**self.server.document(), connect=connect))


class _Live(websocket.WebSocketHandler):
    def initialize(self, server: Server) -> None:
        self.server = server
        self._sending: asyncio.Future[None] | None = None
        self._telling: asyncio.Future[None] | None = None
        self._next_pose: str | None = None

    def prepare(self) -> None:
        if not self.server.accepts(self.request.host):
            raise web.HTTPError(421)

    def open(self, *args: Any, **kwargs: Any) -> None:
        self.server._clients.add(self)
        self.push(self.server._announcement)
        if self.server._last is not None:
            self.push_pose(self.server._last)

    def push(self, message: str) -> asyncio.Future[None] | None:
        """Sends a message, in their order; None where the browser has gone."""
        try:
            sent = asyncio.ensure_future(self.write_message(message))
        except websocket.WebSocketClosedError:
            self.server._clients.discard(self)
            return None
        sent.add_done_callback(_look_at)
        return sent

    def push_pose(self, message: str) -> None:
        """Sends poses, the newest only to a browser that is slower than they come."""
        if self._sending is not None and not self._sending.done():
            self._next_pose = message
            return
        self._next_pose = None
        self._sending = self.push(message)
        if self._sending is not None:
            self._sending.add_done_callback(self._send_next)

    def _send_next(self, _: object) -> None:
        if self._next_pose is not None:
            self.push_pose(self._next_pose)

    def on_message(self, message: str | bytes) -> None:
        """Parameters {"type": "values", "values": {key: text}} are passed to `on_values`, a model {"type": "model", "text": its
        JSON} to `on_model`, {"type": "show"} is answered with the story; anything else is ignored."""
        sent = read_message(message)
        if sent.get("type") == "show" and (self._telling is None or self._telling.done()):
            self._telling = self.push(json.dumps({"type": "document", **self.server.document()}, allow_nan=False))
        values = wanted_values(sent)
        if values is not None and self.server.on_values is not None:
            self.server.on_values(values, self.answer)
        if sent.get("type") == "model" and isinstance(sent.get("text"), str) and self.server.on_model is not None:
            self.server.on_model(sent["text"], self.answer)

    def answer(self, reason: str | None) -> None:
        """Tells this browser that its parameters are built, or why they are refused; from any thread."""
        told = {"type": "built"} if reason is None else {"type": "refused", "message": reason}
        message = json.dumps(told)
        with contextlib.suppress(MechlabError):
            self.server._call(lambda: _discard(self.push(message)))

    def on_close(self) -> None:
        self.server._clients.discard(self)


def _look_at(sent: asyncio.Future[None]) -> None:
    """A browser that goes while something is sent to it is no error."""
    if not sent.cancelled():
        sent.exception()


def _discard(_: object) -> None:
    return None
