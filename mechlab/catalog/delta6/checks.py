"""Checks of the delta (being written)."""

from mechlab.experiment.check import Check

CHECKS: tuple[Check, ...] = ()
