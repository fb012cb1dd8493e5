"""Workspaces that are kept for the next question of the same kind."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, TypeVar

from mechlab.mechanism.model import Mechanism

_Made = TypeVar("_Made")
MOST_KEPT = 8
"""Workspaces that a thread keeps of one kind."""


class LastKept(threading.local):
    """The last few workspaces of each thread, by identity of the mechanism."""

    def __init__(self, most: int = MOST_KEPT) -> None:
        self._most = most
        self._kept: list[tuple[Mechanism, tuple[Any, ...], Any]] = []

    def get(self, make: Callable[..., _Made], mechanism: Mechanism, *key: Any) -> _Made:
        """make(mechanism, *key), or what it gave before."""
        for place, (m, k, found) in enumerate(self._kept):
            if m is mechanism and k == key:
                if place:
                    self._kept.insert(0, self._kept.pop(place))
                made: _Made = found
                return made
        made = make(mechanism, *key)
        self._kept.insert(0, (mechanism, key, made))
        del self._kept[self._most :]
        return made
