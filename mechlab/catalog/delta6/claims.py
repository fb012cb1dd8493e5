"""The ledger of the thesis abstract, and of two articles on toolpaths and regions: each statement is computed anew."""

from __future__ import annotations

from mechlab.catalog.delta6 import (
    claims_control,
    claims_decoupling,
    claims_drives,
    claims_dynamics,
    claims_freedoms,
    claims_mesh,
    claims_positions,
    claims_regions,
    claims_table,
    claims_toolpath,
    claims_velocity,
)
from mechlab.experiment.entry import Claim

_PARTS = (
    claims_freedoms, claims_decoupling, claims_positions, claims_drives, claims_velocity, claims_dynamics, claims_control,
    claims_mesh, claims_table, claims_toolpath, claims_regions
)  # fmt: skip

CLAIMS: tuple[Claim, ...] = tuple(c for part in _PARTS for c in part.CLAIMS)
