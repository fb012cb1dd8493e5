"""A chart of a comparison as SVG inside a page: its colours are those of the page, light or dark."""

from __future__ import annotations

import math
from html import escape

import numpy as np

from mechlab.mechanism.geometry import Array
from mechlab.studies.compare.result import Panel

WIDTH, HEIGHT = 720, 400
LEFT, RIGHT, TOP, BOTTOM = 62, 12, 10, 44
COLORS = 12
"""Colours of the page, --c0 to --c11; every other curve is dashed."""


def ticks(low: float, high: float, log: bool) -> list[float]:
    """Round numbers from low to high: powers of ten, or about six steps of 1, 2 or 5 times one."""
    if log:
        return [10.0**k for k in range(math.ceil(math.log10(low) - 1e-9), math.floor(math.log10(high) + 1e-9) + 1)]
    raw = (high - low) / 6.0
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(k * power for k in (1.0, 2.0, 5.0, 10.0) if k * power >= raw * (1.0 - 1e-9))
    return [step * k for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]


def svg(panel: Panel) -> str:
    """The chart with its legend, as HTML."""
    curves = {n: (np.asarray(x, float), np.asarray(y, float)) for n, (x, y) in panel.curves.items() if len(x)}
    both = [np.concatenate([c[k] for c in curves.values()]) for k in (0, 1)]
    logs = ["x" in panel.log, "y" in panel.log]
    ranges = [_range(values, log) for values, log in zip(both, logs, strict=True)]
    tall = HEIGHT
    if panel.equal:  # one scale for both axes: the height follows
        tall = round(TOP + BOTTOM + (WIDTH - LEFT - RIGHT) * (ranges[1][1] - ranges[1][0]) / (ranges[0][1] - ranges[0][0]))
    box = ((LEFT, WIDTH - RIGHT), (tall - BOTTOM, TOP))
    parts = []
    for k in (0, 1):
        for value in ticks(*ranges[k], logs[k]):
            parts.append(_tick(k, float(_placed(np.array([value]), ranges[k], logs[k], box[k])[0]), value, logs[k], tall))
    for i, (x, y) in enumerate(curves.values()):
        place = zip(_placed(x, ranges[0], logs[0], box[0]), _placed(y, ranges[1], logs[1], box[1]), strict=True)
        path = "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in place)
        parts.append(f'<path class="curve" d="{path}" style="stroke:var(--c{i % COLORS})"{_dash(i)}/>')
    parts.append(f'<text class="label" x="{(LEFT + WIDTH - RIGHT) / 2}" y="{tall - 8}" text-anchor="middle">{escape(panel.x)}</text>')
    middle = (TOP + tall - BOTTOM) / 2
    parts.append(
        f'<text class="label" transform="translate(14 {middle}) rotate(-90)" text-anchor="middle">{escape(panel.y)}</text>'
    )
    sample = '<svg viewBox="0 0 30 8" aria-hidden="true"><path class="curve" d="M1 4H29" style="stroke:var(--c'
    key = "".join(
        f'<li>{sample}{i % COLORS})"{_dash(i)}/></svg>{escape(name)}</li>'
        for i, name in enumerate(curves)
    )
    words = escape(f"{panel.title}: {panel.y} over {panel.x}", quote=True)
    drawing = f'<svg class="chart" viewBox="0 0 {WIDTH} {tall}" role="img" aria-label="{words}">{"".join(parts)}</svg>'
    return f'<figure><figcaption>{escape(panel.title)}</figcaption><div class="wide">{drawing}</div><ul class="key">{key}</ul></figure>'


def _range(values: Array, log: bool) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    if log:
        return low / 1.3, high * 1.3
    space = 0.04 * (high - low or 1.0)
    return (0.0 if 0.0 <= low < 0.3 * high else low - space), high + space


def _placed(values: Array, limits: tuple[float, float], log: bool, box: tuple[float, float]) -> Array:
    low, high = (math.log10(x) for x in limits) if log else limits
    at = np.log10(values) if log else values
    return np.asarray(box[0] + (box[1] - box[0]) * (at - low) / (high - low))


def _dash(i: int) -> str:
    return ' stroke-dasharray="7 3"' if i % 2 else ""


def _tick(axis: int, at: float, value: float, log: bool, tall: float) -> str:
    text = f"1e{round(math.log10(value))}" if log and not 0.01 <= value <= 100 else f"{value:.6g}"
    if axis == 0:
        return (
            f'<path class="grid" d="M{at:.1f} {TOP}V{tall - BOTTOM}"/>'
            f'<text x="{at:.1f}" y="{tall - BOTTOM + 16}" text-anchor="middle">{text}</text>'
        )
    return (
        f'<path class="grid" d="M{LEFT} {at:.1f}H{WIDTH - RIGHT}"/>'
        f'<text x="{LEFT - 6}" y="{at + 4:.1f}" text-anchor="end">{text}</text>'
    )
