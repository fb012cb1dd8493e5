"""The linear actuator of an MJCF file, force = gain x control + bias, as a Drive that keeps the units of its control."""

from __future__ import annotations

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.parts import Control, Drive


@dataclass(frozen=True)
class LinearActuator:
    """force = gain u + push - stiffness x length - damping x rate, within force_range; u: the control, within `range`.

    length and rate are `gear` times those of the joint or tendon, and the joint gets `gear` times the force. drag: damping
    outside the force range.
    """

    gain: float = 1.0
    push: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0
    gear: float = 1.0
    range: tuple[float, float] | None = None
    force_range: tuple[float, float] | None = None

    @property
    def at_rest(self) -> float:
        """The control that MuJoCo uses for 0: 0, or the nearest end of a range without 0."""
        return 0.0 if self.range is None else min(max(0.0, self.range[0]), self.range[1])

    @property
    def pushes(self) -> bool:
        """True for an actuator without stiffness whose force at the control 0 and at rest is not zero."""
        return not self.stiffness and bool(self.gain * self.at_rest + self.push)


def drive_of(name: str, on: str, a: LinearActuator, zero: float) -> Drive:
    """The drive that an actuator is. zero: length of its joint or tendon in the reference pose, in the file and in the
    mechanism. The target of a servo is what it holds in MuJoCo at the control 0."""
    square = a.gear * a.gear
    target = None
    if a.stiffness:
        aim = (a.gain * a.at_rest + a.push) / a.stiffness / a.gear
        target = None if aim == zero else aim
    control = Control(a.gain, a.gear, a.push, a.range, _uneven(a.force_range))
    return Drive(name, on, a.stiffness * square, a.damping * square, _limit(a), target=target, control=control)


def _uneven(limits: tuple[float, float] | None) -> tuple[float, float] | None:
    """A force range that `limit` does not say."""
    return None if limits is None or limits[0] == -limits[1] else limits


def _limit(a: LinearActuator) -> float | None:
    """Largest force on the joint or tendon, of the force range, or of the control range of a motor."""
    if a.force_range is not None:
        return max(abs(a.force_range[0]), abs(a.force_range[1])) * abs(a.gear)
    if a.range is None or a.stiffness or a.damping:
        return None
    ends = [a.gain * x + a.push for x in a.range]
    return max(abs(x) for x in ends) * abs(a.gear) or None
