"""Equations of motion of multibody benchmark problems: plain functions (t, state) -> rate, independent of the engine
and its joint-coordinate trees. Problems: A01 to A05 of the IFToMM library (Gonzalez et al.), and a slider-crank."""
