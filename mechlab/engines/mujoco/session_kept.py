"""What a session keeps of its motion, as the parts that integrate and record it see it."""

from __future__ import annotations

from typing import Protocol

import mujoco

from mechlab.engines.mujoco.findings import LoopWatch
from mechlab.engines.mujoco.model import MujocoMap
from mechlab.engines.mujoco.session_drives import SessionDrives
from mechlab.engines.mujoco.stepping import SteppingEnd
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism


class Kept(Protocol):
    """A session. rows (n, size): states after each action, with the command that was held, up to number `count`; fed and
    called (n,) [J]: energy that drives less dampers, and laws called by the engine, have fed up to each of them."""

    mechanism: Mechanism
    scene: Scene
    settings: Settings
    substeps: int
    hold: float
    model: mujoco.MjModel
    data: mujoco.MjData
    map: MujocoMap
    drives: SessionDrives
    rows: Array
    count: int
    fed: Array
    called: Array
    allowance: float
    loops: LoopWatch
    end: SteppingEnd | None
