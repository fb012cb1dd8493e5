"""An engine as a witness: it assembles the mechanism, then computes rates and accelerations by its own kinematics.

Quantities are named as in `mechlab.kit.quantities`. Only quantities that the given ones determine are answered.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.protocol import Engine, engine
from mechlab.errors import EngineMissing, NoSolution, unknown
from mechlab.experiment.question import Answer
from mechlab.kit.determined import determined
from mechlab.kit.quantities import level, quantities, split
from mechlab.mechanism import Mechanism, Status, TreeKinematics, singularity
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.length_unit import coordinate_units, in_unit_of_length, is_length
from mechlab.mechanism.named_rows import LETTERS


def engine_answer(
    witness: str,
    m: Mechanism,
    given: Mapping[str, Any],
    wanted: Sequence[str],
    start: ArrayLike | None = None,
    steps: int = 10,
    output: str | None = None,
) -> Answer:
    """The wanted quantities from the given ones, by one engine.

    start: pose from which the engine assembles (default: the reference pose); the answer is in its assembly mode.
    output: a frame whose singular positions are reported (kind serial). Where no pose closes, the answer has no values,
    but a status and a note. Wanted quantities that the given ones do not determine are listed in `Answer.open` and
    `Answer.idle`. A given coordinate without a given acceleration gets the acceleration 0 (`Answer.assumed`).
    """
    if m.length_scale != 1.0:
        return _in_own_unit(witness, m, given, wanted, start, steps, output)
    position, rate, accel = split(m, given)
    try:
        r = engine(witness)
        found = r.assemble(m, position, start=start, steps=steps)
    except EngineMissing as missing:
        return Answer(cannot=str(missing))
    if not found.closed and not found.status.exit_code == 0:
        return Answer(status=found.status, notes=(_why(m, position, found),))
    what = determined(m, found.q, given, wanted)
    answered = [key for key in wanted if key not in what.unfixed]
    accel |= dict.fromkeys((level(m, key)[0] for key in what.assumed), 0.0)
    try:
        values = _motion(r, m, found.q, rate, accel, answered)
    except NoSolution as cause:
        return Answer(status=Status.BOUNDARY, notes=(str(cause),))
    kinds = singularity(m, found.q, _output_rows(m, found.q, output))
    values |= {key: 0.0 for key in what.assumed if key in values}  # exactly, not as the engine rounds it
    answer = Answer(values, open=what.open, idle=what.idle, assumed=dict.fromkeys(what.assumed, 0.0))
    if kinds:
        sentence = f"singular position ({', '.join(kinds)})"
        return replace(answer, status=Status.BOUNDARY, notes=(sentence,), details={"singular": list(kinds)})
    return answer


def _in_own_unit(
    witness: str,
    m: Mechanism,
    given: Mapping[str, Any],
    wanted: Sequence[str],
    start: ArrayLike | None,
    steps: int,
    output: str | None,
) -> Answer:
    """`engine_answer` with the length scale of the mechanism as unit of length, for which its tolerances are made.

    Given and answered lengths are in metres.
    """
    unit = m.length_scale

    def length(key: str) -> float:
        return unit if is_length(m, key.removesuffix("_rate").removesuffix("_accel")) else 1.0

    begin = None if start is None else np.asarray(start, dtype=float) / coordinate_units(m, unit)
    scaled = {k: np.asarray(x) / length(k) if length(k) != 1.0 else x for k, x in given.items()}
    answer = engine_answer(witness, in_unit_of_length(m, unit), scaled, wanted, begin, steps, output)
    notes = tuple(f"{n} (lengths in units of {unit:g} m)" if " by " in n else n for n in answer.notes)
    return replace(answer, values={k: x * length(k) for k, x in answer.values.items()}, notes=notes)


def _why(m: Mechanism, given: Mapping[str, Any], found: Any) -> str:
    """A note on a failed assembly: its status, the given value that is missed most, the residual of the loops."""
    missed = {n: abs(float(m.value(n, found.q)) - float(given[n])) for n in given if n in m.scalar_names}
    worst = max(missed, key=lambda n: missed[n]) if missed else ""
    reached = f"; {worst} is missed by {missed[worst]:.4g}" if worst and missed[worst] > 1e-9 else ""
    gap = f"; the loops stay open by {found.residual:.3g}" if found.residual > 1e-9 else ""
    return found.status.value + reached + gap


def _output_rows(m: Mechanism, q: Array, output: str | None) -> Array | None:
    if output is None:
        return None

    frame = m.frame(output)
    tree = TreeKinematics(m, q)
    rotation, origin = tree.pose(frame.body)
    return tree.jacobian(frame.body, origin + rotation @ frame.placement.translation)


def _motion(
    r: Engine, m: Mechanism, q: Array, rate: Mapping[str, float], accel: Mapping[str, float], wanted: Iterable[str]
) -> dict[str, Any]:
    v = r.rates(m, q, rate) if rate else np.zeros(m.nv)
    a = r.accelerations_of(m, q, v, accel) if rate or accel else np.zeros(m.nv)
    frames: dict[str, tuple[Array, Array, Array]] = {}
    return {key: _quantity(r, m, key, q, v, a, frames) for key in wanted}


def _quantity(
    r: Engine, m: Mechanism, key: str, q: Array, v: Array, a: Array, frames: dict[str, tuple[Array, Array, Array]]
) -> float:
    for suffix, vector in (("_rate", v), ("_accel", a)):
        name = key.removesuffix(suffix)
        if key.endswith(suffix) and name in m.scalar_names:
            return float(m.row(name) @ vector)
    if key in m.scalar_names:
        return float(m.value(key, q))
    for frame in m.frames:
        rest = key.removeprefix(f"{frame.name}_")
        if rest == key:
            continue
        if frame.name not in frames:
            frames[frame.name] = r.frame_motion(m, frame.name, q, v, a)
        pose, velocity, acceleration = frames[frame.name]
        letter, _, order = rest.partition("_")
        if letter not in LETTERS or order not in ("", "rate", "accel"):
            continue
        k = LETTERS.index(letter)
        if k < 3:
            return float({"": pose[k, 3], "rate": velocity[k], "accel": acceleration[k]}[order])
        if order != "accel":
            return float(velocity[k] if order == "" else acceleration[k])
    raise unknown(f"{m.name}: quantity", key, quantities(m))
