"""Colours of drawn parts (red, green, blue, opacity), which colour-blind readers can distinguish."""

from __future__ import annotations

from mechlab.mechanism.parts import Color

STEEL: Color = (0.62, 0.66, 0.72, 1.0)
DARK: Color = (0.28, 0.31, 0.36, 1.0)
PALE: Color = (0.86, 0.88, 0.91, 1.0)
BLUE: Color = (0.16, 0.42, 0.75, 1.0)
RED: Color = (0.76, 0.27, 0.25, 1.0)
BRASS: Color = (0.83, 0.68, 0.29, 1.0)
TEAL: Color = (0.20, 0.58, 0.56, 1.0)
GREEN: Color = (0.25, 0.58, 0.42, 1.0)
ORANGE: Color = (0.90, 0.55, 0.13, 1.0)
SLATE: Color = (0.35, 0.38, 0.43, 1.0)
ROSE: Color = (0.74, 0.29, 0.36, 1.0)
GOLD: Color = (0.80, 0.64, 0.20, 1.0)
