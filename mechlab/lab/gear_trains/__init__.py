"""Questions that every train of gears answers: its power flow, and how far soft gear rows lag under load."""

from __future__ import annotations

from mechlab.lab.design import Design
from mechlab.mechanism import Mechanism


def train_mechanism(design: Design) -> Mechanism | None:
    """The mechanism at the cheapest fidelity that consists of gear relations alone; None without one."""
    for level in design.entry.fidelities:
        if level != "kinematic":
            m = design.mechanism(level)
            if m.relations and not m.loops:
                return m
    return None
