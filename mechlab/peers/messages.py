"""Messages between this process and that of a peer: 8 bytes of length and that many bytes of pickle."""

from __future__ import annotations

import pickle
from typing import Any, BinaryIO

LENGTH = 8


def write_message(stream: BinaryIO, content: Any) -> None:
    """Send one message."""
    data = pickle.dumps(content)
    stream.write(len(data).to_bytes(LENGTH, "little") + data)
    stream.flush()


def read_message(stream: BinaryIO) -> Any:
    """Receive one message; None at the end of the stream."""
    head = stream.read(LENGTH)
    if len(head) < LENGTH:
        return None
    data = stream.read(int.from_bytes(head, "little"))
    return pickle.loads(data)
