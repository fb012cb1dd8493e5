"""All channels of a run for the page, which plots any of them: as many samples as a budget of bytes allows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

import numpy as np

from mechlab.experiment.recording import Recording
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

MOST_BYTES = 1_000_000
"""Of the channels of a page, before compression; a channel takes four bytes a sample."""
FEWEST = 201
"""Samples that every channel keeps."""


@dataclass(frozen=True, eq=False)
class Channels:
    """Channels of a run: times t (n,) [s], name -> values (n,), name -> unit, and how many times were recorded."""

    t: Array = field(default_factory=lambda: np.zeros(0))
    values: Mapping[str, Array] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    recorded: int = 0


def recorded_channels(recording: Recording) -> Channels:
    """Every k-th sample and the last of every channel of a recording; k = 1 where MOST_BYTES suffice."""
    count = max(FEWEST, MOST_BYTES // (4 * max(1, len(recording.channels))))
    stride = max(1, -(-len(recording.t) // count))
    keep = np.unique(np.append(np.arange(0, len(recording.t), stride), len(recording.t) - 1))
    values = {name: np.asarray(v, dtype=np.float64)[keep] for name, v in recording.channels.items()}
    return Channels(recording.t[keep], values, dict(recording.units), len(recording.t))
