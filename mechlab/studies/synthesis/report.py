"""How the result of a synthesis is printed: a sentence, a table, the command lines of what was found."""

from __future__ import annotations

from mechlab.results import line_of, text_of
from mechlab.studies.synthesis.result import SynthesisResult
from mechlab.tables import number, table

SHOWN = 20


@line_of.register
def _line(result: SynthesisResult) -> str:
    return f"Synthesis of {result.task}: {result.message}"


@text_of.register
def _text(result: SynthesisResult) -> str:
    """The sentence and a table of the first SHOWN rows."""
    parts = [f"{result.message}."]
    if result.rows:
        cells = [[number(x, 10) for x in row] for row in result.rows[:SHOWN]]
        parts.append(table(result.headers, cells))
    if len(result.rows) > SHOWN:
        parts.append(f"the first {SHOWN} of {len(result.rows)} are shown; --json has more.")
    return "\n".join([*parts, *result.commands])
