"""Explore mode: closed poses solved beforehand, so densely that the poses blended between them are closed too."""

from mechlab.viewer.explore.drives import cycle_loads, explore
from mechlab.viewer.explore.sweep import BorderSurface, Exploration, Load, Sweep, blend_weights, border

__all__ = ["Exploration", "Load", "BorderSurface", "Sweep", "blend_weights", "border", "cycle_loads", "explore"]
