"""The empty plane: a page in which a planar linkage is drawn with pointer or keys, with the solver that every page has.

The page needs no viewer in three dimensions: it is drawn as SVG, and opens from a file.
"""

from __future__ import annotations

import os
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from mechlab.errors import MechlabError
from mechlab.files import write
from mechlab.viewer.html_page import GEOMETRY, SOLVER, asset

STYLES = ("page.css", "hand.css", "draw/draw.css")
SCRIPTS = (
    *SOLVER, *GEOMETRY, "util.js", "quantity.js", "history.js", "edit/typed.js", "draw/sketch.js", "draw/built.js",
    "draw/plane_view.js", "draw/panel.js", "draw/drawing.js", "draw/start.js",
)  # fmt: skip
"""Scripts of the page, in their order there; those before `util.js` and `draw/sketch.js` also run in Node."""
LOCAL_NAMES = ("127.0.0.1", "localhost", "[::1]")


def drawing_page() -> str:
    """The page as text, complete in itself: no request, no server."""
    parts = {
        "style": "\n".join(asset(name) for name in STYLES),
        "script": "\n".join(asset(name) for name in SCRIPTS).replace("</script", "<\\/script"),
    }
    pieces = asset("draw/draw.html").split("@@")
    return "".join(parts[piece] if i % 2 else piece for i, piece in enumerate(pieces))


def write_drawing_page(path: str | os.PathLike[str]) -> Path:
    """Writes the page to `path`, whole or not at all, and returns the path. Raises CannotWrite."""
    return write(path, drawing_page())


class DrawingServer:
    """Serves the page on this computer alone until it is closed; a context manager. port: 0 takes a free one. Raises
    MechlabError where the port cannot be used."""

    def __init__(self, port: int = 0) -> None:
        text = drawing_page().encode("utf-8")

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                # A foreign page whose name points to this computer must not read ours.
                known = self.headers.get("Host", "").rsplit(":", 1)[0].lower() in LOCAL_NAMES
                self.send_response(200 if known and self.path == "/" else 404 if known else 421)
                self.send_header("Content-Type", "text/html; charset=utf-8")
                self.send_header("X-Frame-Options", "DENY")
                self.end_headers()
                if known and self.path == "/":
                    self.wfile.write(text)

            def log_message(self, format: str, *args: object) -> None:
                """Says nothing."""

        try:
            self._server = ThreadingHTTPServer(("127.0.0.1", port), Handler)
        except OSError as error:
            raise MechlabError(f"Cannot listen on 127.0.0.1, port {port}: {error}. Try port 0, which takes a free one.") from error
        self.url = f"http://127.0.0.1:{self._server.server_address[1]}/"
        self._thread = threading.Thread(target=self._server.serve_forever, name="mechlab-draw", daemon=True)
        self._thread.start()

    def wait(self) -> None:
        """Blocks until the server is closed (Ctrl-C interrupts it as usual)."""
        while self._thread.is_alive():
            self._thread.join(0.2)

    def close(self) -> None:
        """Stops serving."""
        self._server.shutdown()
        self._server.server_close()

    def __enter__(self) -> DrawingServer:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
