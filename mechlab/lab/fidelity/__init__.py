"""No more model than the scene needs: what each fidelity answers, how wrong it is, what it costs, and which one to take."""

from mechlab.lab.fidelity.choose import Choice, choose, missing_answers
from mechlab.lab.fidelity.compare import compare
from mechlab.lab.fidelity.measure import Agreement, Error, agreement, measure
from mechlab.lab.fidelity.result import Fidelities, Level

__all__ = [
    "Agreement", "Choice", "Error", "Fidelities", "Level", "agreement", "choose", "compare", "measure", "missing_answers",
]  # fmt: skip
