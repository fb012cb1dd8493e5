"""The workspace of the head centre O: the source's grid, its test, and the limits that the source leaves out."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.analytic.regions import Region
from mechlab.catalog.delta6.parameters import Delta6Parameters
from mechlab.experiment.entry import Coordinates, WorkspaceLimit, WorkspaceMap, WorkspaceRecipe
from mechlab.mechanism.geometry import Array
from mechlab.values import Range


def limits_of(p: Delta6Parameters, limits: Mapping[str, float]) -> closed.WorkspaceLimits:
    """The limits of a design and those that were given."""
    return closed.WorkspaceLimits(p.slider_min, p.slider_max, p.bend_limit, **limits)


def region(p: Delta6Parameters, limits: Mapping[str, float]) -> Region:
    """See `mechlab.analytic.delta6.workspace`."""
    return closed.workspace_region(p.geometry, limits_of(p, limits), p.rod_spacing)


def _plane(points: Coordinates) -> Array:
    x, y = np.broadcast_arrays(points["x"], points["y"])
    return np.stack([x, y, np.zeros(x.shape)], axis=-1)


def maps(p: Delta6Parameters) -> dict[str, WorkspaceMap]:
    """Dexterity, reach and clearance over (x, y)."""
    g = p.geometry

    def bend(points: Coordinates) -> Array:
        reach = g.rod_length - closed.reach_margin(g, _plane(points))
        return np.asarray(np.arcsin(np.minimum(reach / g.rod_length, 1.0)))

    plane = ("x", "y")
    return {
        "inverse_condition": WorkspaceMap(
            lambda q: closed.inverse_condition(g, _plane(q)), plane, "",
            "dexterity: smallest singular value of the slider Jacobian over its largest",
        ),
        "reach_margin": WorkspaceMap(
            lambda q: closed.reach_margin(g, _plane(q)), plane, "m", "horizontal distance to a rod that lies horizontal"
        ),
        "largest_bend": WorkspaceMap(bend, plane, "rad", "largest bend of a cardan"),
        "clearance": WorkspaceMap(
            lambda q: closed.clearance(g, _plane(q), p.rod_spacing), plane, "m",
            "distance of centre lines of rods of different legs, and of rods and the guides of other legs",
        ),
    }  # fmt: skip


WORKSPACE = WorkspaceRecipe(
    make=region,
    grid=dict.fromkeys("xyz", Range(-1.0, 1.0, 201)),
    units=dict.fromkeys("xyz", "m"),
    limits={
        "least_condition": WorkspaceLimit("", "smallest inverse condition of the slider Jacobian that is allowed"),
        "least_clearance": WorkspaceLimit("m", "smallest distance of centre lines that is allowed"),
    },
    maps=maps,
    text="positions of the head centre O",
)
