"""What a mechanism brings for its workspace: the region of poses that it can take, the grid it is counted on, maps over it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.analytic.regions import Region
from mechlab.values import Range

Coordinates = Mapping[str, NDArray[np.float64]]


@dataclass(frozen=True)
class Map:
    """A quantity over the workspace: function(points) of the coordinates `axes`, for example a dexterity."""

    function: Callable[[Coordinates], NDArray[np.float64]]
    axes: tuple[str, ...]
    unit: str = ""
    text: str = ""


@dataclass(frozen=True)
class Limit:
    """A limit that can be given beside the parameters."""

    unit: str
    text: str


@dataclass(frozen=True)
class WorkspaceRecipe:
    """make(parameters, limits) -> the region; `limits` are those of `limits` that were given, by name.

    grid: axis -> range that is used unless the user gives another; unit of the axes; maps(parameters) -> quantities to
    map over the region; text: what a node is.
    """

    make: Callable[[Any, Mapping[str, float]], Region]
    grid: Mapping[str, Range]
    units: Mapping[str, str]
    limits: Mapping[str, Limit] = field(default_factory=dict)
    maps: Callable[[Any], Mapping[str, Map]] = lambda p: {}
    text: str = ""
