"""Whether an error is met and believed, and the sentence that says so."""

from __future__ import annotations

from mechlab.study.error_control.check_method import Checked

LOW = 1e-7
"""Below this error, what rounding does to the motion is looked at and told [m or rad]."""


def verdict(
    estimate: float, max_error: float, unit: str, chosen: str, checked: Checked | None, size: float, of: str
) -> tuple[bool, str]:
    """Whether the error is met and believed, and the sentence; `of`: what part of it rounding is; `size`: of the tracked
    quantities."""
    told = f"error estimated at {estimate:.2g} {unit} ({max_error:g} {unit} asked for{', ' + of if of and max_error < LOW else ''})"
    says = checked.sentence if checked is not None else "no other method could check it"
    against = checked is not None and checked.contradicts(estimate, size)
    ok = estimate <= max_error and not against
    text = f"{told}; {chosen}; {says}"
    if against:
        text += "; the two contradict each other: do not trust this run"
    elif not ok:
        text += "; the error asked for cannot be reached: " + (
            "double precision does not allow it" if of and max_error < LOW else "this is the best that was found"
        )
    return ok, text
