"""The ledger of the thesis abstract: its printed numbers and statements, each computed anew."""

from __future__ import annotations

from mechlab.catalog.delta6 import (
    claims_dynamics,
    claims_friction,
    claims_kinematics,
    claims_structure,
    claims_velocity,
)
from mechlab.experiment.check import Claim

_PARTS = (claims_structure, claims_kinematics, claims_velocity, claims_dynamics, claims_friction)

CLAIMS: tuple[Claim, ...] = tuple(c for part in _PARTS for c in part.CLAIMS)
