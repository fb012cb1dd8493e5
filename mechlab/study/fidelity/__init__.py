"""No more model than the scene needs: what each fidelity answers, how wrong it is, what it costs, and which one to take."""

from mechlab.study.fidelity.answers import missing_answers
from mechlab.study.fidelity.choose import Choice, choose
from mechlab.study.fidelity.compare import compare
from mechlab.study.fidelity.exactness import Agreement, agreement
from mechlab.study.fidelity.measure import Error, measure
from mechlab.study.fidelity.result import Fidelities, Level

__all__ = [
    "Agreement", "Choice", "Error", "Fidelities", "Level", "agreement", "choose", "compare", "measure", "missing_answers",
]  # fmt: skip
