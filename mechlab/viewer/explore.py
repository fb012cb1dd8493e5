"""What a page needs to be moved by hand, beside the model that it solves itself: rates for its forces, space for its camera."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, structure
from mechlab.mechanism.assembly import close
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.length_unit import is_length
from mechlab.viewer.reach import BorderSurface

MOST_DRIVES, STEPS = 8, 10
"""Drives moved to find the space that the camera shows, and steps of each either way."""


@dataclass(frozen=True, eq=False)
class Exploration:
    """drives: joints and shafts that the page moves by sliders; rates: of them, at which their forces are computed (default 1);
    poses: (n, bodies, 4, 4) some over the reach of the drives, for the camera; reach: surface of the region that a point can reach."""

    drives: tuple[str, ...]
    rates: Mapping[str, float]
    poses: Array
    reach: BorderSurface | None = None


def explore(
    mechanism: Mechanism,
    poses_of: Callable[[Array], Array],
    size: float,
    rates: Mapping[str, float] | None = None,
    reach: BorderSurface | None = None,
) -> Exploration:
    """The drives of a mechanism of `size` [m], else its independent joints and shafts. poses_of(q (n, nq)) -> (n, bodies, 4, 4).
    Raises MechlabError when nothing can be moved."""
    free = structure(mechanism).independent
    drives = tuple(n for n in dict.fromkeys(d.on for d in mechanism.drives) if n in free)
    drives = drives or tuple(n for n in free if n in mechanism.scalar_names)
    if not drives:
        raise MechlabError(f"{mechanism.name}: it has no drive, joint or shaft that could be moved in the page.")
    given = {n: abs(rates[n]) for n in drives if rates and rates.get(n)}
    return Exploration(drives, given, poses_of(reached_poses(mechanism, drives, size)), reach)


def reached_poses(mechanism: Mechanism, drives: tuple[str, ...], size: float) -> Array:
    """(n, nq) closed coordinates: each drive moved half a turn (or half of `size`) either way, as far as it goes."""
    home = mechanism.reference()
    values = {n: float(mechanism.value(n, home)) for n in drives}
    limits = {j.name: j.range for j in mechanism.joints}
    found = [home]
    for name in drives[:MOST_DRIVES]:
        half = 0.5 * size if is_length(mechanism, name) else math.pi
        low, high = limits.get(name) or (values[name] - half, values[name] + half)
        for end in (low, high):
            q = home
            for x in np.linspace(values[name], end, STEPS + 1)[1:]:
                step = close(mechanism, q, values | {name: float(x)}, steps=2)
                if not step.closed:
                    break
                q = step.q
                found.append(q)
    return np.array(found)
