"""Phase portraits, exact curves, Poincare map and bifurcation of the transmission."""

from mechlab.catalog.impulse_transmission.portraits.constant_speed import bifurcation, exact, poincare
from mechlab.catalog.impulse_transmission.portraits.with_motor import phase

PORTRAITS = {"phase": phase, "poincare": poincare, "exact": exact, "bifurcation": bifurcation}

__all__ = ["PORTRAITS", "bifurcation", "exact", "phase", "poincare"]
