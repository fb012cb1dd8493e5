"""The checks A1 to A16 of the delta: each compares witnesses that do not share code, or holds them to a known number."""

from __future__ import annotations

from mechlab.catalog.delta6 import (
    checks_head,
    checks_orientation,
    checks_pose,
    checks_reach,
    checks_rods,
    checks_runs,
    checks_source,
    checks_train,
)
from mechlab.catalog.delta6 import (
    particles as moving,
)
from mechlab.experiment.entry import Check

_PARTS = (
    checks_source,
    checks_pose,
    checks_orientation,
    checks_reach,
    checks_train,
    checks_head,
    checks_runs,
    checks_rods,
    moving,
)

CHECKS: tuple[Check, ...] = tuple(sorted((c for part in _PARTS for c in part.CHECKS), key=lambda c: int(c.id[1:])))
