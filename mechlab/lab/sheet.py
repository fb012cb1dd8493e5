"""What a design is, in sentences and tables: parameters, structure, bodies, fidelities, scenes, questions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import Any

from mechlab.experiment.parameters import describe
from mechlab.experiment.question import Question
from mechlab.lab.design import Design, initial_keys
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.report import Rows, freedom_sentences, part_tables
from mechlab.mechanism.structure import structure
from mechlab.results import Shown
from mechlab.tables import counted


@dataclass(frozen=True, repr=False)
class Description(Shown):
    """Sentences and tables on a design at a fidelity, or on a question."""

    title: str
    sentences: tuple[str, ...]
    tables: dict[str, Rows]
    data: dict[str, Any] = field(default_factory=dict)
    exit_code: int = 0

    def to_dict(self) -> dict[str, Any]:
        """JSON-able form."""
        return self.data


def parameter_rows(design: Design) -> Rows:
    """Name, value, unit, range, meaning, source of each parameter."""
    rows = []
    for info in describe(design.entry.parameters):
        value = getattr(design.parameters, info.name)
        shown = (
            ", ".join(_shown(x) for x in value)
            if isinstance(value, tuple)
            else "none"
            if value is None
            else _shown(value)
        )
        rows.append((info.name, shown, info.unit, info.range_text, info.text, info.source))
    return ("parameter", "value", "unit", "range", "meaning", "source"), tuple(rows)


def _shown(value: Any) -> str:
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def describe_design(design: Design, fidelity: str | None = None) -> Description:
    """Parameters, structure, bodies, fidelities, scenes and questions of a design."""
    entry = design.entry
    level = design.fidelity(fidelity)
    sentences = [entry.summary]
    if entry.chain:
        sentences.append(f"Chain: {entry.chain}.")
    remarks = entry.remarks(design.parameters) if entry.remarks else ()
    sentences += remarks
    tables: dict[str, Rows] = {"Parameters": parameter_rows(design)} if describe(entry.parameters) else {}
    data: dict[str, Any] = {
        "name": entry.name, "title": entry.title, "summary": entry.summary, "chain": entry.chain, "fidelity": level, "remarks": remarks,
        "parameters": {i.name: getattr(design.parameters, i.name) for i in describe(entry.parameters)},
        "fidelities": dict(entry.fidelities), "scenes": {n: r.text for n, r in entry.scenes.items()},
        "questions": [_question_data(q) for q in entry.questions],
        "parameter_info": [
            {"name": i.name, "unit": i.unit, "range": i.range_text, "text": i.text, "source": i.source} for i in describe(entry.parameters)
        ],
        "warnings": design.warnings, "sources": list(entry.sources),
    }  # fmt: skip
    if level == "kinematic":
        sentences.append("Fidelity kinematic: closed form only, no bodies.")
    else:
        m = design.mechanism(level)
        found = structure(m)
        sentences.append(f"Fidelity {level}: {counted(len(m.bodies), 'body', 'bodies')}, {found.sentence}.")
        sentences += freedom_sentences(found)
        tables |= part_tables(m, found)
        data["structure"] = {
            "bodies": len(m.bodies), "nq": m.nq, "nv": m.nv, "rows": found.rows, "rank": found.rank, "freedoms": found.freedoms,
            "mobility": found.mobility, "idle": found.idle, "independent": found.independent, "driven": found.driven,
            "redundant": [r.sentence for r in found.redundant], "sentence": found.sentence,
        }  # fmt: skip
        data["joints"] = [{"name": j.name, "kind": j.kind, "zero": j.zero, "range": j.range} for j in m.joints]
        data["bodies"] = [
            {"name": b.name, "parent": b.parent, "joints": [j.name for j in b.joints], "mass": b.inertia.mass}
            for b in m.bodies
        ]
        data["initial"] = initial_keys(m)
    sentences += [f"Warning: {w}" for w in design.warnings]
    tables["Fidelities"] = (("fidelity", "what it is"), tuple(entry.fidelities.items()))
    tables["Scenes"] = (
        ("scene", "what happens"),
        tuple((n + (" (default)" if n == design.default_scene else ""), r.text) for n, r in entry.scenes.items()),
    )
    headers, asked = question_rows(entry.questions)
    if level != "kinematic" and not design.mechanism(level).loops:
        from mechlab.lab.gear_trains.train import train_mechanism  # a linkage does without

        if train_mechanism(design) is not None:
            asked += TRAIN_QUESTIONS
    if asked:
        tables["Questions"] = (headers, asked)
    if entry.sources:
        tables["Sources"] = (("source",), tuple((s,) for s in entry.sources))
    return Description(entry.title, tuple(sentences), tables, data)


def question_rows(questions: Sequence[Question]) -> Rows:
    """What each question asks, its keys, its answers and who answers."""
    rows = [
        (
            q.text or q.name,
            " ".join([*q.given, *([f"[{' '.join(q.optional)}]"] if q.optional else [])]) or "nothing",
            " ".join(q.answers),
            ", ".join(q.witnesses),
        )
        for q in questions
    ]
    return ("question", "given [optional]", "answers", "witnesses"), tuple(rows)


TRAIN_QUESTIONS = (
    (
        "speeds, torques, power through every mesh and carrier, efficiency both ways",
        "X_rate X_force [efficiency MESH_efficiency]", "X_rate X_force", "analytic, pinocchio, mujoco",
    ),
    (
        "how far soft gear rows lag under load, and the loads of the rows",
        "X_force [row_timeconst row_impedance]", "MESH_lag MESH_load", "analytic, pinocchio, mujoco",
    ),
)  # fmt: skip
"""What every train of gears can be asked, as rows; X: a joint or shaft, MESH: a relation."""


def _question_data(q: Question) -> dict[str, Any]:
    return {
        "name": q.name, "text": q.text, "given": q.given, "optional": dict(q.optional), "answers": q.answers,
        "units": dict(q.units), "witnesses": list(q.witnesses),
    }  # fmt: skip


def describe_question(name: str, question: Question) -> Description:
    """A question that is asked of no mechanism."""
    data = {"name": name, "questions": [_question_data(question)]}
    return Description(name, (f"{question.text}.",), {"Questions": question_rows((question,))}, data)
