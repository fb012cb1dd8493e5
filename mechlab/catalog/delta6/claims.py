"""Claims (being written)."""

from mechlab.experiment.check import Claim

CLAIMS: tuple[Claim, ...] = ()
