"""Sweeps: many designs, initial states or questions at once, on all cores or on a cluster; one labelled dataset."""

from mechlab.study.sweep.plan import plan
from mechlab.study.sweep.request import Request
from mechlab.study.sweep.result import SweepResult
from mechlab.study.sweep.work import Interrupted, sweep

__all__ = ["Interrupted", "Request", "SweepResult", "plan", "sweep"]
