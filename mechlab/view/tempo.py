"""How fast to play a story: slow enough to see it, and slow enough that teeth do not seem to run backwards."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mechlab.view.story import Story

SPEEDS = (0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)
SCREEN_RATE = 60.0
"""Pictures a second that a common screen shows [1/s]."""
STEP_LIMIT = 0.3
"""Tooth pitches that a gear may advance from one picture to the next; above 0.5 it seems to run backwards."""


@dataclass(frozen=True)
class Tempo:
    """speed: seconds of the story in a second of the player. limit: the largest speed at which teeth are still seen to
    run the right way (infinite: no teeth). sentence: why it is not 1, or "" when it is."""

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
