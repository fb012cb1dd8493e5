"""The ledger of the paper on the gear CVT: every statement tested anew."""

from __future__ import annotations

from mechlab.catalog.closed_differential import claims_example, claims_kinematics, claims_law
from mechlab.experiment.entry import Claim

CLAIMS: tuple[Claim, ...] = (*claims_example.CLAIMS, *claims_kinematics.CLAIMS, *claims_law.CLAIMS)
"""E: the numeric example. K: speeds, identities, starting, synthesis. L: the law on trial."""
