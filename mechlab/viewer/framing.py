"""Framing of a picture or film: the space that a mechanism sweeps, a floor, a fitted camera, and the speed.

The speed is slow enough to see the motion, and slow enough that teeth do not seem to run backwards.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import GROUND
from mechlab.viewer.story import Story

Array = NDArray[np.float64]

_DIRECTIONS = np.array([d for d in itertools.product(range(-2, 3), repeat=3) if math.gcd(*d) == 1], dtype=np.float64)
_DIRECTIONS /= np.linalg.norm(_DIRECTIONS, axis=1)[:, None]
_MOST_FRAMES = 250
_BLOCK = 1024
"""Points that are looked at together: their distances stay in the processor's cache."""

THREE_QUARTER = np.array([0.6, -1.0, 0.72])
FIELD_OF_VIEW = math.radians(30.0)
MARGIN = 1.08
NEAR = 3.0


@dataclass(frozen=True, eq=False)
class Framing:
    """points: (k, 3) outermost points [m] that parts and traces ever reach; low, high: (3,) their box; floor:
    height [m] of the floor, just below all of them or where the story has one; step: grid step [m], 1, 2 or 5 times a power of ten;
    radius: half the diagonal of the box [m]."""

    points: Array
    low: Array
    high: Array
    floor: float
    step: float
    radius: float


def nice_step(length: float, count: int = 12) -> float:
    """The smallest number 1, 2 or 5 times a power of ten that divides `length` into at most `count` steps."""
    raw = length / count
    power = 10.0 ** math.floor(math.log10(raw))
    return next(k * power for k in (1.0, 2.0, 5.0, 10.0) if k * power >= raw * (1.0 - 1e-9))


def outermost(points: Array) -> Array:
    """The points of (n, 3) farthest out in each of 98 directions, (k, 3): no point lies farther outside of their hull than
    3 % of the radius, which MARGIN covers."""
    farthest, which = np.full(len(_DIRECTIONS), -np.inf), np.zeros(len(_DIRECTIONS), dtype=np.int64)
    for begin in range(0, len(points), _BLOCK):
        along = _DIRECTIONS @ points[begin : begin + _BLOCK].T
        best = along.argmax(axis=1)
        distance = np.take_along_axis(along, best[:, None], axis=1)[:, 0]
        better = distance > farthest
        farthest[better], which[better] = distance[better], begin + best[better]
    return points[np.unique(which)]


def frame_story(story: Story) -> Framing:
    """The space swept by every part and trace over the whole story; a metre cube for a story that draws
    nothing."""
    moving = story.poses
    if story.explore is not None:
        moving = np.concatenate([moving, story.explore.poses])
    poses = moving[:: max(1, math.ceil(len(moving) / _MOST_FRAMES / 2))]
    found = [outermost(trace) for trace in (*story.traces.values(), *story.ghost_traces.values())]
    drawn = [(part, poses) for part in story.parts]
    if story.ghost is not None:
        drawn += [(part, story.ghost[:: max(1, len(story.ghost) // _MOST_FRAMES)]) for part in story.ghost_parts]
    still: list[Array] = []
    for part, where in drawn:
        local = part.vertices[np.unique(part.faces)]
        in_body = outermost(local) @ part.placement[:3, :3].T + part.placement[:3, 3]
        moved = where[:, story.bodies.index(part.body)]
        if np.array_equal(moved[1:], moved[:-1]):  # it stands still
            moved = moved[:1]
        far_off = story.floors and part.body == GROUND
        (still if far_off else found).append(
            outermost((in_body @ moved[:, :3, :3].transpose(0, 2, 1) + moved[:, None, :3, 3]).reshape(-1, 3))
        )
    found += _near(still, found)
    points = outermost(np.concatenate(found)) if found else np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
    low, high = points.min(axis=0), points.max(axis=0)
    radius = max(float(np.linalg.norm(high - low)) / 2.0, 1e-6)
    levels = [floor.level for floor in story.floors if floor.level is not None]
    ground = levels[0] if levels else float(low[2]) - 0.02 * radius
    return Framing(points, low, high, ground, nice_step(2.0 * radius), radius)


def _near(still: list[Array], moving: list[Array]) -> list[Array]:
    """What stands still around the moving parts, without that which is farther off than NEAR times their radius: the scenery of a
    file with a floor of its own."""
    if not moving:
        return still
    points = np.concatenate(moving)
    middle, reach = 0.5 * (points.min(axis=0) + points.max(axis=0)), float(np.linalg.norm(np.ptp(points, axis=0))) / 2.0
    return [p for p in still if np.linalg.norm(p - middle, axis=1).max() <= NEAR * reach]


def fit_camera(
    points: Array, toward: Array, aspect: float, field_of_view: float = FIELD_OF_VIEW
) -> tuple[Array, float]:
    """Target (3,) and distance [m] at which a camera that stands in the direction `toward` sees all `points`
    (k, 3), centred.

    `aspect` = width / height; `field_of_view` [rad] is the vertical one; z is up in the picture.
    """
    back = np.asarray(toward, dtype=np.float64) / np.linalg.norm(toward)
    right = np.cross([0.0, 0.0, 1.0], back)
    right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-9 else np.array([1.0, 0.0, 0.0])
    basis = np.stack([right, np.cross(back, right), back])
    half = math.tan(field_of_view / 2.0) / MARGIN
    tangent = np.array([half * aspect, half])
    target = (points.min(axis=0) + points.max(axis=0)) / 2.0
    distance = 0.0
    for _ in range(4):
        seen = (points - target) @ basis.T
        distance = float((seen[:, 2] + (np.abs(seen[:, :2]) / tangent).max(axis=1)).max())
        angles = seen[:, :2] / (distance - seen[:, 2])[:, None]
        middle = (angles.min(axis=0) + angles.max(axis=0)) / 2.0
        target = target + distance * (middle @ basis[:2])
    seen = (points - target) @ basis.T
    return target, float((seen[:, 2] + (np.abs(seen[:, :2]) / tangent).max(axis=1)).max())


SPEEDS = (0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)
SCREEN_RATE = 60.0
"""Pictures a second that a common screen shows [1/s]."""
STEP_LIMIT = 0.3
"""Tooth pitches that a gear may advance from one picture to the next; above 0.5 it seems to run backwards."""


@dataclass(frozen=True)
class Tempo:
    """speed: seconds of the story in a second of the player. limit: the largest speed at which teeth do not seem to run
    backwards (infinite: no teeth). sentence: why it is not 1, or "" when it is."""

    speed: float
    limit: float
    sentence: str


def tempo(story: Story, rate: float = SCREEN_RATE) -> Tempo:
    """The Tempo of a story: a run of 0.4 to 90 s at its own pace, others so that they take about 4 s; slower where
    teeth pass faster than STEP_LIMIT pitches in a picture, `rate` [1/s] pictures a second."""
    duration = float(story.t[-1] - story.t[0])
    speed, sentence = 1.0, ""
    if duration > 0 and not 0.4 <= duration <= 90.0:
        speed = min(SPEEDS, key=lambda s: abs(math.log(duration / s / 4.0)))
        sentence = f"The run takes {duration:g} s; it is played at {speed:g}\u00d7."
    limit = STEP_LIMIT * rate / story.tooth_rate if story.tooth_rate > 0 else float("inf")
    if speed > limit:
        speed = max((s for s in SPEEDS if s <= limit), default=SPEEDS[0])
        sentence = (
            f"Up to {story.tooth_rate:.3g} teeth pass in a second: played at {speed:g}\u00d7, "
            "because faster they would seem to run backwards."
        )
    return Tempo(speed, limit, sentence)
