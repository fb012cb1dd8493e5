"""Tasks by the name of the mechanism: what `mechlab optimize NAME` does without further words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from mechlab.study.optimize.problem import Goal
from mechlab.values import Range


@dataclass(frozen=True)
class Task:
    """Variables, what is fixed, goal, constraints, the second goal of its front; text: why so. evaluations: of the search."""

    text: str
    variables: Mapping[str, Range]
    goal: Goal
    subject: tuple[str, ...] = ()
    given: Mapping[str, float] = field(default_factory=dict)
    front: Goal | None = None
    evaluations: int = 600


TASKS: Mapping[str, Task] = {
    "delta6": Task(
        "the widest disc about the axis in which no cardan bends more than 45 deg and the dexterity stays at 0.3, with guides "
        "that stand no farther out than the source's",
        variables={"rod_length": Range(0.25, 0.6), "radial_offset": Range(0.1, 0.228)},
        goal=Goal("reach", 1),
        subject=("dexterity>=0.3", "reach>=0"),
        given={"bend_limit": math.pi / 4},
        front=Goal("dexterity", 1),
        evaluations=600,
    ),
    "gear_linkage": Task(
        "the longest stop of the output that a play of 2 deg allows (the gears only push, friction holds), with at least one "
        "turn of the output for a turn of the crank and a transmission angle of at least 30 deg",
        variables={
            "crank": Range(0.2, 0.8), "coupler": Range(0.7, 1.3), "rocker": Range(0.7, 1.3), "idler_radius": Range(0.2, 0.6),
        },
        goal=Goal("dwell_angle_one_sided", 1),
        subject=("reverse_angle<=2deg", "least_transmission_angle>=30deg", "mean_rate>=1", "dwell_angle_one_sided>=30deg"),
        front=Goal("least_transmission_angle", 1),
        evaluations=1500,
    ),
    "fourbar": Task(
        "the coupler that keeps the transmission angle farthest from 0 and 180 deg over a turn of the crank",
        variables={"coupler": Range(0.16, 0.4)},
        goal=Goal("cycle.least.pin_transmission_angle", 1),
        evaluations=40,
    ),
}  # fmt: skip
