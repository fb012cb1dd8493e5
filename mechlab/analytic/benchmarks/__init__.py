"""Equations of motion of multibody benchmark problems: plain functions (t, state) -> rate, independent of the engine
and its joint-coordinate trees. Problems: A01 to A05 of the IFToMM library (Gonzalez et al.), and a slider-crank."""

from mechlab.analytic.benchmarks.andrews import Squeezer
from mechlab.analytic.benchmarks.planar import FourbarCrank, ParallelogramChain, Pendulum, SliderCrank
from mechlab.analytic.benchmarks.spatial import Bricard, Governor

__all__ = ["Bricard", "FourbarCrank", "Governor", "ParallelogramChain", "Pendulum", "SliderCrank", "Squeezer"]
