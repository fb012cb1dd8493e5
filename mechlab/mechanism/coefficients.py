"""Exact coefficients of joints: what a shaft, a relation or a gear ratio is made of."""

from __future__ import annotations

from fractions import Fraction

from mechlab.errors import MechlabError

Coefficients = tuple[tuple[str, Fraction], ...]


def as_fraction(value: object, what: str) -> Fraction:
    """An exact ratio: of tooth counts, or of the decimal as written. Raises MechlabError that names `what`."""
    try:
        if isinstance(value, Fraction | int | str):
            return Fraction(value)
        return Fraction(str(float(value)))  # type: ignore[arg-type]
    except (TypeError, ValueError, ZeroDivisionError):
        raise MechlabError(f"{what}: expected a number or a ratio such as '17/22', got {value!r}.") from None
