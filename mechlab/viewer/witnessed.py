"""One sentence on a design that a page has asked for: do all witnesses agree about its poses?"""

from __future__ import annotations

import numpy as np

from mechlab.experiment.recording import frame_positions
from mechlab.lab.ask import asked_mechanism, generic_question
from mechlab.lab.design import Design
from mechlab.mechanism import Mechanism, structure
from mechlab.mechanism.assembly import close
from mechlab.mechanism.length_unit import is_length
from mechlab.viewer.story import Severity

MOVED = 0.05
"""How far a drive is moved for the comparison [rad, sizes of the mechanism]."""
AGREE = 1e-9
"""Largest difference of answers of witnesses that agree [m, rad]: each solves its closure to 1e-12."""
NAMES = {"pinocchio": "Pinocchio", "mujoco": "MuJoCo"}


def witnessed(d: Design) -> tuple[Severity, str] | None:
    """Joints, shafts and points at a pose near the reference, solved by numpy, Pinocchio and MuJoCo, each with its own
    kinematics; None for a mechanism in which nothing can be moved."""
    m = asked_mechanism(d)
    free = [n for n in structure(m).independent if n in m.scalar_names]
    if not free:
        return None
    step = {n: MOVED * (m.size if is_length(m, n) else 1.0) for n in free}
    given = {n: float(m.value(n, m.reference())) + (step[n] if n == free[0] else 0.0) for n in free}
    own = close(m, targets=given, steps=4)
    if not own.closed:
        given = {n: float(m.value(n, m.reference())) for n in free}
        own = close(m, targets=given)
    found = {"numpy": _values(m, own.q)}
    question = generic_question(d, given)
    for name, witness in question.witnesses.items():
        answer = witness(d.parameters, given)
        if not answer.values:
            return "warning", f"not checked: {NAMES[name]} has no answer near this pose ({answer.cannot or answer.status.value})"
        found[NAMES[name]] = {k: float(np.asarray(v)) for k, v in answer.values.items()}
    keys = set.intersection(*(set(x) for x in found.values()))
    worst = max((_apart(k in question.angles, [x[k] for x in found.values()]) for k in keys), default=0.0)
    words = f"checked by {', '.join(found)}: largest difference {worst:.1g}"
    return ("ok" if worst < AGREE else "error"), words


def _values(m: Mechanism, q: np.ndarray) -> dict[str, float]:
    values = {n: float(m.value(n, q)) for n in m.scalar_names}
    points = frame_positions(m, q[None])[0] if m.frames else []
    return values | {f"{f.name}_{a}": float(x) for f, p in zip(m.frames, points, strict=True) for a, x in zip("xyz", p, strict=True)}


def _apart(angle: bool, values: list[float]) -> float:
    """Largest difference; of angles within half a turn."""
    away = [x - values[0] for x in values]
    if angle:
        away = [float(np.angle(np.exp(1j * x))) if abs(x) > 1.0 else x for x in away]
    return max(abs(x - y) for x in away for y in away)
