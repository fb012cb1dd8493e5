"""Findings on the ranges of joints and shafts: those that start beyond the end, and runs of engines that have no stops."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mechlab.experiment.recording import Finding, Health
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_poses import ManyPoses
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Joint, Shaft, Spring
from mechlab.tables import listed

BEYOND = 1e-6
"""Distance [rad or m] beyond the end of a range that counts."""


def excess(mechanism: Mechanism, q: Array) -> dict[str, Array]:
    """Distance (n,) [rad or m] beyond the end of the range, 0 inside, of each joint and shaft with a range; q is (n, nq)."""
    parts: list[Joint | Shaft] = [*(j for j in mechanism.joints if j.nv == 1), *mechanism.shafts]
    out = {}
    for part in parts:
        if part.range is not None:
            value = mechanism.value(part.name, q)
            out[part.name] = np.maximum(np.maximum(part.range[0] - value, value - part.range[1]), 0.0)
    return out


def outside_start_finding(mechanism: Mechanism, q: Array) -> Finding | None:
    """Finding "range_start": joints and shafts that start beyond the end of their range, for an engine with stops."""
    far = {n: float(x[0]) for n, x in excess(mechanism, q).items() if len(x) and x[0] > BEYOND}
    if not far:
        return None
    worst = max(far, key=lambda n: far[n])
    verb = "starts" if len(far) == 1 else "start"
    text = (
        f"{listed(far, 6)} {verb} beyond the end of the range ({worst} by {far[worst]:.3g} rad or m): "
        f"the soft stop throws it back. Give a start inside, such as {worst}_0=..."
    )
    return Finding("range_start", far[worst], 0.0, "rad or m", "warning", text)


def stop_advice(health: Health) -> str:
    """What to do about a large error where a stop throws back a joint that starts beyond it: no timestep mends that; "" elsewhere."""
    thrown = [f.sentence for f in health.findings if f.name in ("range_start", "start_range")]
    return f"that is the stop, not the timestep: {thrown[0]}" if thrown else ""


def limited_parts(mechanism: Mechanism) -> list[str]:
    """The joints of one coordinate, shafts and springs that have a range."""
    names = [j.name for j in mechanism.joints if j.range is not None and j.nv == 1]
    names += [s.name for s in mechanism.shafts if s.range is not None]
    return names + [s.name for s in mechanism.springs if s.range is not None]


def met_ends(mechanism: Mechanism, names: Sequence[str], t: Array, q: Array, v: Array) -> NDArray[np.bool_]:
    """(names, n - 1) whether a joint, shaft or spring met an end of its range, or may have, between a sample and the next."""
    step, ranges = np.diff(t), {j.name: j.range for j in mechanism.joints} | {s.name: s.range for s in mechanism.shafts}
    springs = {s.name: s for s in mechanism.springs}
    ranges |= {s.name: s.range for s in mechanism.springs if s.name in names and s.range is not None}
    out = np.zeros((len(names), max(len(t) - 1, 0)), dtype=bool)
    for k, name in enumerate(names):
        low, high = ranges[name] or (-math.inf, math.inf)
        if name in springs and springs[name].range is not None:
            value, speed = _lengths(mechanism, springs[name], q, v)
        else:
            value, speed = mechanism.value(name, q), np.abs(v @ mechanism.row(name))
        reach = np.maximum(speed[1:], speed[:-1]) * step
        least, most = np.minimum(value[1:], value[:-1]) - reach, np.maximum(value[1:], value[:-1]) + reach
        out[k] = (least <= low) | (most >= high)
    return out


def _lengths(mechanism: Mechanism, spring: Spring, q: Array, v: Array) -> tuple[Array, Array]:
    """(n,) lengths of a spring [m] and the sizes of their rates [m/s]."""
    length, rate = ManyPoses(mechanism).set(q).spring(spring, v)
    return length, np.abs(rate)


def unstopped_finding(mechanism: Mechanism, q: Array) -> Finding | None:
    """Finding "range": joints and shafts that went beyond the end of their range in an engine without stops."""
    far = {n: float(np.max(x, initial=0.0)) for n, x in excess(mechanism, q).items()}
    far = {n: x for n, x in far.items() if x > BEYOND and math.isfinite(x)}
    if not far:
        return None
    worst = max(far, key=lambda n: far[n])
    text = (
        f"{listed(far, 6)} went beyond the end of the range ({worst} by {far[worst]:.3g} rad or m): this engine has no stops, "
        "so that the motion from there on is not that of the mechanism. With stops: --engine mujoco, without --max-error"
    )
    return Finding("range", far[worst], BEYOND, "rad or m", "error", text)
