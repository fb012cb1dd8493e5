"""What a synthesis task answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.newton import Status
from mechlab.results import Shown


@dataclass(frozen=True, repr=False)
class SynthesisResult(Shown):
    """The result of a task: `data` is its JSON form, `headers` and `rows` its table, `message` one sentence, `commands` lines that
    run what was found."""

    task: str
    status: Status
    message: str
    data: Mapping[str, Any] = field(default_factory=dict)
    headers: tuple[str, ...] = ()
    rows: tuple[tuple[Any, ...], ...] = ()
    commands: tuple[str, ...] = ()

    @property
    def exit_code(self) -> int:
        """0 when dimensions were found, 4 when the wanted properties are out of reach."""
        return self.status.exit_code

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return {"task": self.task, "status": self.status.value, "message": self.message, **self.data}


def found_rows(task: str, message: str, data: Mapping[str, Any], solutions: list[dict[str, Any]]) -> SynthesisResult:
    """A solved task whose table has a row for each solution."""
    base = SynthesisResult(task, Status.SOLVED, message, data)
    if not solutions:
        return base
    return replace(base, headers=tuple(solutions[0]), rows=tuple(tuple(s.values()) for s in solutions))
