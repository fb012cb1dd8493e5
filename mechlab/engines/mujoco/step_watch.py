"""What a step loop on MuJoCo watches: blow-ups and loops once in BLOCK actions, the record of the motion, and what its end says.

A motion that has ended refuses to go on; closing warns of what must not be trusted.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from types import TracebackType
from typing import Self

import mujoco
import numpy as np

from mechlab.engines.mujoco.stepping import Coordinates, SteppingEnd, end_reason
from mechlab.engines.state import RATE_LIMIT
from mechlab.errors import MechlabError, Untrustworthy, warn
from mechlab.experiment.recording import Health, Recording
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

BLOCK = 128
"""Actions between two looks at loops, rates and warnings."""
KEPT = 16_384
"""Most states that are kept."""


class UntrustedSession(UserWarning):
    """A session was closed, or reset, after a motion that must not be trusted."""


class WatchedLoop(ABC):
    """See the module. rows (n, size): states after the actions, time, qpos and qvel first, up to number `count`; hold [s]: time of an
    action; `end`: why the motion ended, or None. complete: what makes of the engine's Recording that of the user."""

    mechanism: Mechanism
    data: mujoco.MjData
    hold: float
    rows: Array
    count: int

    def __init__(self, rows: Array, rates: slice) -> None:
        self.rows, self._rates = rows, rates
        self.complete: Callable[[Recording], Recording] = lambda made: made
        self._made: tuple[tuple[float, SteppingEnd | None], Recording] | None = None
        self._broken: list[str] = []
        self.end: SteppingEnd | None = None
        self._stopped = self._closed = False

    @property
    def time(self) -> float:
        """Time since the reset [s]."""
        return float(self.data.time)

    def _watch_anew(self) -> None:
        """A motion begins; in words it is remembered what ended the one before."""
        if self.end is not None:
            self._broken.append(f"t = {self.end.t:.4g} s: {self.end.reason}")
        self.end, self._stopped, self._made = None, self._closed, None
        self.count, self._next_look = 0, BLOCK

    def look(self) -> None:
        """Look at the states since the last look, as `step` does once in BLOCK actions. Raises Untrustworthy where a rate is beyond
        1e6 or a loop has opened; the motion ends there."""
        k = self.count
        self._next_look = min(k + BLOCK, KEPT)
        new = self.rows[max(0, k - BLOCK) : k + 1]
        fastest = np.abs(new[:, self._rates])
        if not (fastest.max(initial=0.0) < RATE_LIMIT and math.isfinite(sum(new[-1].tolist()))):
            good = np.isfinite(new).all(axis=1) & (fastest.max(axis=1, initial=0.0) < RATE_LIMIT)
            first = int(np.argmin(good))
            self.data.qvel[:] = new[first, self._rates]
            reason = end_reason(self.data, self._coordinates, new[max(0, first - 1), self._rates])
            self.count = max(0, k - len(new) + first)
            self._stop(SteppingEnd(float(new[max(0, first - 1), 0]) + self.hold, reason))
        opened = self._opened()
        if opened is not None:
            self._stop(opened)
        if k >= KEPT:
            self._make_room()

    @property
    @abstractmethod
    def _coordinates(self) -> Coordinates:
        """What says which rate of the mechanism ran away."""

    def _opened(self) -> SteppingEnd | None:
        """The end of a motion whose loops have opened."""
        return None

    @abstractmethod
    def _make_room(self) -> None:
        """Free rows for more states: KEPT are full."""

    @abstractmethod
    def _recorded(self) -> Recording:
        """The motion since the reset, by the engine."""

    def recording(self) -> Recording:
        """The motion since the reset: states, forces, commands, and the health record of a run."""
        reached = (self.time, self.end)
        if self._made is None or self._made[0] != reached:
            self._made = (reached, self.complete(self._recorded()))
        return self._made[1]

    @property
    def health(self) -> Health:
        """The health record of the motion since the reset."""
        return self.recording().health

    @property
    def trusted(self) -> bool:
        """Whether nothing in the health record says otherwise; True before the first step."""
        return self.time == 0.0 or self.health.trusted

    def _stop(self, end: SteppingEnd) -> None:
        self.end, self._stopped = end, True
        self._refuse()

    def _refuse(self) -> None:
        if self._closed:
            raise MechlabError(f"{self.mechanism.name}: this session is closed; its recording can still be read.")
        assert self.end is not None
        raise Untrustworthy(
            f"{self.mechanism.name}: the motion of this session ended at t = {self.end.t:.6g} s: {self.end.reason}. "
            "Its health says more; reset() begins anew."
        )

    def close(self) -> None:
        """End the session. Warns (UntrustedSession) when the motion, or one before a reset, must not be trusted; the recording
        and its health stay."""
        if self._closed:
            return
        self._closed = self._stopped = True
        texts = (
            [f"{len(self._broken)} motions before were stopped, the first at {self._broken[0]}"] if self._broken else []
        )
        if not self.trusted:
            texts.append(self.recording().message)
        if texts:
            what = f"{self.mechanism.name}: do not trust this session: {'; '.join(texts)}"
            warn(what, UntrustedSession)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:  # the error under way says more than a warning
            self._closed = self._stopped = True
        self.close()
