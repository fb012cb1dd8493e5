"""Sweeps: many designs, initial states or questions at once, on all cores or on a cluster; one labelled dataset."""

from mechlab.studies.sweep.plan import plan
from mechlab.studies.sweep.request import Request
from mechlab.studies.sweep.result import SweepResult
from mechlab.studies.sweep.work import Interrupted, sweep

__all__ = ["Interrupted", "Request", "SweepResult", "plan", "sweep"]
