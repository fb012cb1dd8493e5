"""One row of the table of all benchmarks. A module `bench_NAME.py` with a function `rows() -> list[Row]` is a section of it:

    def rows() -> list[Row]:
        return [Row("n_fourbar fall: whole run", 0.12, "s", "bare mj_step loop", 0.05, "ratio <= 3")]

`python -m tests.benchmarks` collects the sections, each in a process of its own. Value and reference are measured in the same
process, alternating, in CPU seconds, so that their ratio holds on a loaded machine too.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

_ASKED = re.compile(r"(ratio|value) (<=|>=) ([0-9.eE+-]+)")


@dataclass(frozen=True)
class Row:
    """A measured number and the one beside it.

    name: what is measured, unique within the section; value: the number, in `unit`; beside: what the reference is ("bare
    mj_step loop", "direct numpy", "Exudyn generalized-alpha"); reference: its number in the same unit, nan where there is none;
    asked: the goal, "ratio <= 3", "value <= 100" or with >=, in `unit`; empty where none is set. Raises ValueError for another form.
    """

    name: str
    value: float
    unit: str
    beside: str = ""
    reference: float = math.nan
    asked: str = ""

    def __post_init__(self) -> None:
        if self.asked and not _ASKED.fullmatch(self.asked):
            raise ValueError(f'{self.name}: asked is "ratio <= NUMBER" or "value >= NUMBER", not {self.asked!r}')

    @property
    def ratio(self) -> float:
        """value / reference; nan without a reference."""
        return self.value / self.reference if self.reference else math.nan

    @property
    def met(self) -> bool | None:
        """Whether the goal is met; None where none is set or its number is missing."""
        found = _ASKED.fullmatch(self.asked)
        number = math.nan if found is None else self.ratio if found[1] == "ratio" else self.value
        if found is None or math.isnan(number):
            return None
        return number <= float(found[3]) if found[2] == "<=" else number >= float(found[3])
