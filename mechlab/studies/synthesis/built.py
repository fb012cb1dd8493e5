"""What a synthesis found, as an entry of the catalog with parameters: built, and led along its path by an engine."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np

from mechlab.engines.protocol import WITNESSES, available
from mechlab.errors import NoSolution
from mechlab.experiment.entry import Entry
from mechlab.kit.path_motion import EngineMotion
from mechlab.lab.design import design
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

STEP = math.radians(10.0)
"""Largest turn of the crank from one closed pose of the engine to the next."""
DIGITS = 13
"""Significant digits of the parameters of what was found."""


@dataclass(frozen=True)
class Built:
    """An entry and its parameters; facts: numbers that are shown. angles: crank angles (n,) [rad] at which the engine reads it."""

    entry: str
    parameters: Mapping[str, float | int]
    angles: Array
    facts: Mapping[str, Any] = field(default_factory=dict)

    @property
    def command(self) -> str:
        """The command line that runs it."""
        return " ".join(["mechlab run", self.entry, *(f"{k}={v!r}" for k, v in self.parameters.items())])

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {"entry": self.entry, "parameters": dict(self.parameters), "command": self.command, **self.facts}


def rounded(parameters: Mapping[str, float | int]) -> dict[str, float | int]:
    """Numbers of DIGITS significant digits, short to write."""
    return {k: v if isinstance(v, int) else float(f"{v:.{DIGITS}g}") for k, v in parameters.items()}


def led(find: Callable[[str], Entry], built: Built, names: Sequence[str]) -> tuple[str, dict[str, Array]] | None:
    """The engine and the quantities (n,) at the crank angles, each pose closed from the one before; None where it does not close.

    The crank goes from its first angle on by small steps, so that another mode is never met by chance.
    """
    witness = next((w for w in WITNESSES if not available(w)), "")
    if not witness:
        return "", {}
    m = design(find(built.entry), built.parameters).mechanism()
    first, last = float(built.angles[0]), float(built.angles[-1])
    shares = (built.angles - first) / (last - first)
    motion = EngineMotion(witness, m, {"crank_angle": (first, last)}, 1 + math.ceil(abs(last - first) / STEP))
    motion.places = np.union1d(motion.places, shares)
    try:
        at = np.searchsorted(motion.places, shares)
        return witness, {n: motion[n][at] for n in names}
    except NoSolution:
        return None
