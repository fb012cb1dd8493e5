"""A B-spline toolpath of the output link: its time law, so that speed, acceleration and jerk of every drive stay bounded.

The curve gives D (x, y, z) and, where it has six coordinates, alpha, beta, gamma. It is travelled from rest to rest by its
length s, in which a radian counts as METRES_PER_RADIAN, so that a turn on the spot has a length too. With drives Q(s)

    Q' s',  Q' s'' + Q'' s'^2,  Q' s''' + 3 Q'' s' s'' + Q''' s'^3

stay within the limits for the quickest of some S-curves s(t): not the fastest law there is, but one that keeps every limit.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.analytic.bspline import BSpline, SpeedRamp, Travel, arc_length
from mechlab.catalog.delta6.parameters import DRIVES, Delta6Parameters
from mechlab.errors import MechlabError, NoSolution
from mechlab.kit.curve_file import read_curve
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

METRES_PER_RADIAN = 0.05
"""Length that a turn of the head counts in the length of a path [m/rad]."""
SAMPLES = 1601
TABLE = 401
USED_SHARE = 0.95
"""Share of the limits that is used at the samples: between them the drives may exceed it a little."""
RAMP_RATIOS = (2.0, 4.0, 8.0, 16.0, 32.0)
"""Accelerations tried, in (top speed)^2 / length, and jerks, in (acceleration x top speed) / length."""
_RISE = tuple(np.linspace(0.0, 1.0, 6)[1:-1].tolist())
DEFAULT = BSpline(
    5, (*[0.0] * 6, *_RISE, *[1.0] * 6),
    (
        (0.00, 0.00, 0.00, 0.0, 0.0, 0.0), (0.00, 0.00, 0.02, 0.0, 0.0, 0.3), (0.05, 0.00, 0.05, 0.2, 0.1, 1.0),
        (0.05, 0.06, 0.05, 0.4, 0.3, 2.2), (-0.05, 0.06, 0.00, 0.2, 0.4, 3.6), (-0.06, -0.03, -0.05, -0.3, 0.2, 5.0),
        (0.00, -0.07, -0.04, -0.5, -0.2, 6.4), (0.05, -0.03, 0.00, -0.2, -0.3, 7.4), (0.04, 0.00, 0.01, 0.0, -0.1, 7.9),
        (0.04, 0.00, 0.01, 0.0, 0.0, 8.0)
    )
)  # fmt: skip
"""Round the centre with more than a whole turn of gamma."""


@dataclass(frozen=True)
class Toolpath:
    """Times (n,), positions of D (n, 3), angles (n, 3) of the chosen set, drives (n, 6); the law s(t) they follow.
    twin: True where the second set of angles, (alpha + pi, pi - beta, gamma + pi), is used."""

    t: Array
    tool: Array
    angles: Array
    drives: Array
    law: SpeedRamp
    twin: bool


def curve_of(p: Delta6Parameters) -> BSpline:
    """The curve of the parameter `curve`, or the default one; six coordinates, angles 0 where the file has none."""
    curve = read_curve(p.curve, coordinates=(3, 6)) if p.curve else DEFAULT
    if len(curve.points[0]) == 6:
        return curve
    return BSpline(curve.degree, curve.knots, tuple((*row, 0.0, 0.0, 0.0) for row in curve.points))


def toolpath(p: Delta6Parameters, count: int = TABLE) -> Toolpath:
    """The path at `count` times. Raises MechlabError where the curve stands still or has a corner, so that no law with bounded
    acceleration passes; NoSolution, naming the place, where it leaves the reach or a limit of the delta."""
    curve = curve_of(p)
    travel = Travel(_with_lengths(curve))
    _refuse_stops(p, curve)
    s = np.linspace(0.0, travel.length, SAMPLES)
    u = travel.parameter_at(s)
    pose = curve.at(u)
    angles, twin = _angle_set(p, pose[:, 3:])
    drives = _drives(p, u, pose[:, :3], angles)
    law = _quickest_ramp(p, s, drives)
    t = np.linspace(0.0, law.duration, count)
    u = travel.parameter_at(np.clip(law.at(t), 0.0, travel.length))
    pose = curve.at(u)
    chosen = _other(pose[:, 3:]) if twin else pose[:, 3:]
    chosen = chosen + (angles[0] - chosen[0])
    return Toolpath(t, pose[:, :3], chosen, _drives(p, u, pose[:, :3], chosen), law, twin)


def limits(p: Delta6Parameters) -> Array:
    """(3, 6) largest speed, acceleration and jerk of each drive."""
    linear = (p.slider_speed, p.slider_acceleration, p.slider_jerk)
    rotary = (p.shaft_speed, p.shaft_acceleration, p.shaft_jerk)
    return np.array([[a] * 3 + [b] * 3 for a, b in zip(linear, rotary, strict=True)])


def _with_lengths(curve: BSpline) -> BSpline:
    """The curve with angles as lengths."""
    return BSpline(
        curve.degree, curve.knots, tuple((*r[:3], *(METRES_PER_RADIAN * x for x in r[3:])) for r in curve.points)
    )


def _refuse_stops(p: Delta6Parameters, curve: BSpline) -> None:
    """A law with bounded acceleration needs a direction that does not jump."""
    name = p.curve or "the default curve"
    stops = arc_length(_with_lengths(curve)).cusps
    if stops:
        raise MechlabError(
            f"curve {name}: it stands still at u = {stops[0]:.6g}; a tool that passes there at any speed would need an infinite "
            "acceleration. Split the path there, or round the cusp."
        )
    inner, counts = np.unique(np.round(curve.knots, 12), return_counts=True)
    for knot, times in zip(inner, counts, strict=True):
        if curve.start < knot < curve.end and curve.degree - times < 2:
            raise MechlabError(
                f"curve {name}: at the knot {knot:g} its second derivative jumps (degree {curve.degree}, knot written {times} "
                "times), so that no law has a bounded jerk. Use degree 3 or more and single inner knots."
            )


def _other(angles: Array) -> Array:
    """The second set of angles, (alpha + pi, pi - beta, gamma + pi), not wrapped, so that it stays continuous."""
    return np.column_stack([angles[:, 0] + np.pi, np.pi - angles[:, 1], angles[:, 2] + np.pi])


def _angle_set(p: Delta6Parameters, angles: Array) -> tuple[Array, bool]:
    """Of both sets, each moved by whole turns, the one that takes the rotary drives least far from zero."""
    best: tuple[float, Array, bool] | None = None
    for twin, base in ((False, angles), (True, _other(angles))):
        near = -np.round(base.mean(axis=0) / (2.0 * np.pi))
        for first in near[0] + np.array([0, -1, 1]):
            for last in near[2] + np.array([0, -1, 1]):
                moved = base + 2.0 * np.pi * np.array([first, 0.0, last])
                reach = float(np.abs(closed.drives_from_angles(p.geometry, moved)).max())
                if best is None or reach < best[0] - 1e-9:
                    best = reach, moved, twin
    assert best is not None
    return best[1], best[2]


def _drives(p: Delta6Parameters, at: Array, tool: Array, angles: Array) -> Array:
    """(n, 6) drives; raises NoSolution where the path cannot be followed."""
    centre = tool - p.head_offset * closed.output_axis(angles)
    found = closed.inverse_position(p.geometry, centre)
    name = p.curve or "the default curve"
    if not found.reachable.all():
        k = int(np.argmin(found.h2.min(axis=-1)))
        miss = -float(closed.reach_margin(p.geometry, centre[k]))
        raise NoSolution(f"curve {name}: out of reach by {miss:.4g} m near u = {at[k]:.4g}. Scale or move the curve.")
    for k in range(3):
        q = found.drives[:, k]
        over = np.maximum(p.slider_min - q, q - p.slider_max)
        if over.max() > 0.0:
            i = int(np.argmax(over))
            raise NoSolution(
                f"curve {name}: q{k + 1} = {q[i]:.4g} m leaves {p.slider_min:g} to {p.slider_max:g} m near u = {at[i]:.4g}. "
                "Move the curve along z, or widen slider_min and slider_max."
            )
    if p.bend_limit is not None:
        bend = closed.cardan_bend(p.geometry, centre).max(axis=-1)
        if bend.max() > p.bend_limit:
            i = int(np.argmax(bend))
            raise NoSolution(
                f"curve {name}: a cardan bends {np.degrees(bend[i]):.4g} deg near u = {at[i]:.4g}, bend_limit is "
                f"{np.degrees(p.bend_limit):.4g} deg. Stay nearer to the centre."
            )
    return np.column_stack([found.drives, closed.drives_from_angles(p.geometry, angles)])


def _quickest_ramp(p: Delta6Parameters, s: Array, drives: Array) -> SpeedRamp:
    """The quickest of some S-curves, each stretched in time until one drive just reaches one of its limits.

    Stretching by c divides speeds by c, accelerations by c^2, jerks by c^3, all along the path, so the stretch is exact.
    """
    from scipy.interpolate import make_interp_spline

    spline = make_interp_spline(s, drives, k=5)
    slopes = [make_interp_spline(s, spline(s, nu=k), k=3) for k in (1, 2, 3)]
    one, two, three = (np.abs(f(s)).max(axis=0) + 1e-300 for f in slopes)
    bounds = USED_SHARE * limits(p)
    speed = float(
        min(np.min(bounds[0] / one), np.min(np.sqrt(bounds[1] / 2 / two)), np.min(np.cbrt(bounds[2] / 3 / three)))
    )
    laws = []
    for push in RAMP_RATIOS:
        for bend in RAMP_RATIOS:
            strong = push * speed**2 / float(s[-1])
            law = SpeedRamp(float(s[-1]), speed, strong, bend * strong * speed / float(s[-1]))
            c = _stretch(law, slopes, bounds)
            laws.append(SpeedRamp(law.length, law.speed / c, law.acceleration / c**2, law.jerk / c**3))
    return min(laws, key=lambda law: law.duration)


def _stretch(law: SpeedRamp, slopes: list[Any], bounds: Array) -> float:
    """How much longer the law must take for the drives to keep their limits (less than 1: it may be quicker)."""
    t = np.linspace(0.0, law.duration, SAMPLES)
    s, v, a, j = (law.at(t, k)[:, None] for k in range(4))
    one, two, three = (f(np.clip(s[:, 0], 0.0, law.length)) for f in slopes)
    used = (one * v, one * a + two * v**2, one * j + 3.0 * two * v * a + three * v**3)
    shares = [float(np.max(np.abs(x) / b)) for x, b in zip(used, bounds, strict=True)]
    return max(shares[0], shares[1] ** 0.5, shares[2] ** (1.0 / 3.0))


def table_of(path: Toolpath) -> dict[str, tuple[float, ...]]:
    """Values of each drive at the times of the path."""
    return {name: tuple(path.drives[:, k].tolist()) for k, name in enumerate(DRIVES)}
