"""Helpers for the pictures of all studies: figures without a window, plain axes, cell borders, complete files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mechlab.files import unfinished
from mechlab.mechanism.geometry import Array


def new_figure(width: float, height: float, dpi: int = 130, **options: Any) -> Any:
    """A white matplotlib figure of width and height [inch] that draws without a window."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=dpi, facecolor="white", **options)
    FigureCanvasAgg(figure)
    return figure


def open_frame(axes: Any) -> None:
    """Hides the top and right sides of the frame of the axes."""
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def cell_borders(values: Sequence[float] | Array, log: bool = False) -> Array:
    """(n + 1,) borders of the cells of a map, halfway between the values (n,), or between their logarithms."""
    x = np.log(values) if log else np.asarray(values, dtype=float)
    if len(x) == 1:
        return np.array([x[0] - 0.5, x[0] + 0.5])
    middle = 0.5 * (x[1:] + x[:-1])
    out = np.concatenate([[2 * x[0] - middle[0]], middle, [2 * x[-1] - middle[-1]]])
    return np.asarray(np.exp(out) if log else out)


def fewer_colors(picture: Path, colors: int = 256) -> None:
    """The PNG picture in so many colors: 256 make it a quarter of its size."""
    from PIL import Image

    with Image.open(picture) as image:
        few = image.convert("RGB").quantize(colors)
    few.save(picture, format="PNG", optimize=True)


def save_figure(figure: Any, path: Path, **options: Any) -> Path:
    """Writes a figure in the format of the suffix. An error leaves no incomplete file."""
    with unfinished(path) as temporary:
        figure.savefig(temporary, **options)
    return path
