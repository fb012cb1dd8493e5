"""Whether an error is met and believed, and the sentence that says so."""

from __future__ import annotations

from mechlab.study.error_control.check_method import Checked
from mechlab.study.error_control.measure import Measure

LOW = 1e-7
"""Below this error, what rounding does to the motion is looked at and told [m or rad]."""


ROUNDING = "double precision does not allow it"
CAPTURE = "it is the time in which the law captures held rates; a smaller `time` of the law makes it less"


def verdict(
    estimate: float, max_error: float, measure: Measure, chosen: str, checked: Checked | None, size: float,
    part: str = "", cause: str = "",
) -> tuple[bool, str]:  # fmt: skip
    """Whether the error is met and believed, and the sentence; `part`: what makes it up most, `cause`: why it cannot be less,
    where these are known; `size`: of the tracked quantities."""
    unit = measure.unit
    told = f"error of {measure.what} estimated at {estimate:.2g} {unit}"
    told += f" ({max_error:g} {unit} asked for{', of which ' + part if part else ''})"
    says = checked.sentence if checked is not None else "no other method could check it"
    against = checked is not None and checked.contradicts(estimate, size)
    ok = estimate <= max_error and not against
    text = f"{told}; {chosen}; {says}"
    if against:
        text += "; the two contradict each other: do not trust this run"
    elif not ok:
        text += f"; the error asked for cannot be reached: {cause or 'this is the best that was found'}"
    return ok, text
