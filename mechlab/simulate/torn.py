"""Watches the loops of a MuJoCo run: soft constraints give way silently where nothing can close."""

from __future__ import annotations

import mujoco
import numpy as np

from mechlab.experiment.health import Finding
from mechlab.experiment.torn import TORN, smallest_link, torn_finding
from mechlab.simulate.model import MujocoMap


class LoopWatch:
    """Tells after each evaluated sample whether a loop is torn: open by more than 1e-3 of the smallest link."""

    def __init__(self, map_: MujocoMap) -> None:
        self.map = map_
        self.limit = TORN * smallest_link(map_.mechanism)
        self.names = [x.name for x in map_.mechanism.loops if x.kind != "distance"]
        self.worst: tuple[float, float, str] | None = None

    def torn(self, t: float, data: mujoco.MjData) -> bool:
        """True when the distance between the two sides of any loop is beyond the limit; remembers which and how far."""
        if not self.names or not np.isfinite(self.limit):
            return False
        gaps = {name: float(np.linalg.norm(data.efc_pos[self.map.rows(data, name)[:3]])) for name in self.names}
        name = max(gaps, key=lambda n: gaps[n])
        if not gaps[name] <= self.limit:
            self.worst = (t, gaps[name], name)
        return self.worst is not None

    def finding(self, duration: float) -> Finding | None:
        """The error finding "loop_open", or None when no loop was torn."""
        if self.worst is None:
            return None
        t, gap, name = self.worst
        return torn_finding(t, gap, self.limit, duration, name)
