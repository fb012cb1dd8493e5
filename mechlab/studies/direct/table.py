"""The direct questions by name, as `solve` and `show` know them beside the mechanisms."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from mechlab.experiment.question import Answers, Question
from mechlab.lazy_dataclass import dataclass
from mechlab.studies.direct import assur, bspline, regions, toolpath


@dataclass(frozen=True)
class DirectQuestion:
    """A question of no mechanism, and the function that answers it for the given keys."""

    question: Question
    solve: Callable[[Mapping[str, Any]], Answers]


DIRECT: Mapping[str, DirectQuestion] = {
    q.question.name: q
    for q in (
        DirectQuestion(toolpath.QUESTION, toolpath.solve_toolpath),
        DirectQuestion(bspline.QUESTION, bspline.solve_bspline),
        DirectQuestion(regions.QUESTION, regions.solve_regions),
        DirectQuestion(assur.QUESTION, assur.solve_assur),
    )
}
