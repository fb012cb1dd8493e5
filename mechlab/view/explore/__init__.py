"""Explore mode: closed poses solved beforehand, so densely that what lies between them is closed too."""

from mechlab.view.explore.drives import explore
from mechlab.view.explore.loads import cycle_loads
from mechlab.view.explore.surface import Surface, border
from mechlab.view.explore.sweep import Exploration, Load, Sweep, blend_weights

__all__ = ["Exploration", "Load", "Surface", "Sweep", "blend_weights", "border", "cycle_loads", "explore"]
