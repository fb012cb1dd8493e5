"""An engine as a witness: it assembles the mechanism, then computes rates and accelerations by its own kinematics.

Quantities are named as in `mechlab.kit.quantities`. Only quantities that the given ones determine are answered.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.engines.closer import confirmed
from mechlab.engines.motions import Motions
from mechlab.engines.protocol import Engine, engine
from mechlab.errors import EngineMissing, NoSolution, unknown
from mechlab.experiment.question import Answer
from mechlab.kit.determined import Determined, determined, with_nothing_open
from mechlab.kit.open_loops import CLOSED, least_opening, opening
from mechlab.kit.quantities import level, quantities, split
from mechlab.kit.regular import kept_regularity
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism, Status, TreeKinematics, singularity
from mechlab.mechanism.closing import ManyClosed, close_many
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kept import LastKept
from mechlab.mechanism.length_unit import coordinate_units, in_unit_of_length, is_length
from mechlab.mechanism.many_rows import ManyRows
from mechlab.mechanism.named_rows import LETTERS

FROM_REFERENCE = 10
"""Least number of steps of the path that a search takes from the reference pose."""


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
    return engine_answers(witness, m, given, wanted, 1, None if start is None else [np.asarray(start, dtype=float)], steps, output)[0]


def engine_answers(
    witness: str,
    m: Mechanism,
    given: Mapping[str, Any],
    wanted: Sequence[str],
    count: int,
    starts: Sequence[Array | None] | None = None,
    steps: int = 10,
    output: str | None = None,
    unit: float = 1.0,
) -> list[Answer]:
    """`engine_answer` at `count` poses, given as numbers or arrays (count,); starts: a pose (nq,) or None for each; steps: least number
    of those of the path that a search takes from a given start; unit: length [m] in which m is measured, for what the notes say.

    All poses are closed together, from where the engine closes each by its own kinematics (`mechlab.engines.closer.confirmed`); what is
    not surely regular there, or does not close on this way, is searched pose by pose.
    """
    if m.length_scale != 1.0:
        return _in_own_unit(witness, m, given, wanted, count, starts, steps, output)
    try:
        r = engine(witness)
        found = _together(r, m, given, wanted, count, starts, output)
        for k in (k for k in range(count) if k not in found):
            start = None if starts is None else starts[k]
            asked = at_pose(given, k, count)
            found[k] = _searched(r, m, asked, wanted, start, FROM_REFERENCE if start is None else steps, output, unit)
    except EngineMissing as missing:
        return [Answer(cannot=str(missing))] * count
    return [found[k] for k in range(count)]


def at_pose(given: Mapping[str, Any], k: int, count: int) -> dict[str, Any]:
    """The values at pose k of `count`; one value, or a (3, 3) rotation, is that of all poses."""
    out: dict[str, Any] = {}
    for name, value in given.items():
        array = np.asarray(value)
        several = array.ndim == 1 or (array.ndim == 3 and len(array) == count)
        one = array[k] if several else value
        out[name] = float(one) if array.ndim == 1 else one
    return out


@dataclass(frozen=True)
class _Prepared:
    """What all engines start from: targets (names, each (n,) or (n, 3, 3)) and poses closed by numpy; `at` (k,), the poses that
    are regular; given rates and accelerations, those set to 0 included; what is determined there."""

    targets: tuple[Array, ...]
    led: ManyClosed
    at: NDArray[np.int_]
    rate: dict[str, Any]
    accel: dict[str, Any]
    what: Determined


def _prepared(
    m: Mechanism, given: Mapping[str, Any], wanted: Sequence[str], count: int, starts: Sequence[Array | None] | None,
    output: str | None,
) -> _Prepared:  # fmt: skip
    position, rate, accel = split(m, given)
    rows = kept_rows(m, tuple(position))
    reference = m.reference()
    start = reference if starts is None else np.array([reference if x is None else x for x in starts])
    targets = rows.targets(position, count)
    led = close_many(rows, start, targets, count)
    at, moving, what = np.flatnonzero(led.closed), bool(rate or accel), Determined()
    if len(at):
        look = kept_regularity(m).set(led.q[at])
        fine = ~look.singular(output) & look.fixed(tuple(position))
        if moving:
            fine &= look.fixed(tuple(rate))
        if fine.any():
            first = int(at[np.argmax(fine)])
            what = with_nothing_open(m, led.q[first], at_pose(given, first, count), wanted)
            accel |= dict.fromkeys((level(m, key)[0] for key in what.assumed), 0.0)
        if moving:
            fine &= look.fixed(tuple(accel))
        at = at[fine]
    return _Prepared(targets, led, at, rate, accel, what)


class _LastPrepared(threading.local):
    """The last question of a thread, which one engine after the other is asked."""

    def __init__(self) -> None:
        self._kept: tuple[Mechanism, tuple[Any, ...], _Prepared] | None = None

    def get(self, m: Mechanism, given: Mapping[str, Any], *rest: Any) -> _Prepared:
        """`_prepared`, or what it gave for the same question."""
        wanted, count, starts, output = rest
        values = tuple((k, np.asarray(x, dtype=float).tobytes()) for k, x in given.items())
        begin = None if starts is None else tuple(None if x is None else np.asarray(x, dtype=float).tobytes() for x in starts)
        key = values, tuple(wanted), count, begin, output
        if self._kept is None or self._kept[0] is not m or self._kept[1] != key:
            self._kept = m, key, _prepared(m, given, *rest)
        return self._kept[2]


_LAST = _LastPrepared()


def _together(
    r: Engine, m: Mechanism, given: Mapping[str, Any], wanted: Sequence[str], count: int, starts: Sequence[Array | None] | None,
    output: str | None,
) -> dict[int, Answer]:  # fmt: skip
    """Answers at the poses that close on the straight way and are regular, by the number of the pose."""
    common = _LAST.get(m, given, wanted, count, starts, output)
    at, what = common.at, common.what
    if not len(at):
        return {}
    names = tuple(split(m, given)[0])
    q, _, sure = confirmed(r.pose_equations(m, names), common.led.at(at), [t[at] for t in common.targets])
    answered = [key for key in wanted if key not in what.unfixed]
    motion = r.motions(m).at(q, _those(common.rate, at), _those(common.accel, at), _frames(m, answered), bool(common.rate or common.accel))
    values = {key: _value(m, key, q, motion) for key in answered}
    values |= {key: np.zeros(len(at)) for key in what.assumed if key in values}  # exactly, not as the engine rounds it
    columns = list(zip(*(x.tolist() for x in values.values()), strict=True)) if values else [()] * len(at)
    assumed = dict.fromkeys(what.assumed, 0.0)
    return {
        int(k): Answer(dict(zip(values, numbers, strict=True)), idle=what.idle, assumed=assumed)
        for k, numbers, solved in zip(at, columns, sure & motion.solved, strict=True)
        if solved
    }


def _frames(m: Mechanism, keys: Iterable[str]) -> list[str]:
    """Frames of which a key is a coordinate."""
    return [f.name for f in m.frames if any(k.startswith(f"{f.name}_") and k not in m.scalar_names for k in keys)]


def _those(given: Mapping[str, Any], at: Any) -> dict[str, Any]:
    """The values at some of the poses."""
    return {n: x[at] if np.ndim(x) else x for n, x in given.items()}


_ROWS = LastKept()


def kept_rows(m: Mechanism, names: tuple[str, ...]) -> ManyRows:
    """The equations of a mechanism with the names; the last few of each thread are kept."""
    return _ROWS.get(ManyRows, m, names)


def _searched(
    r: Engine, m: Mechanism, given: Mapping[str, Any], wanted: Sequence[str], start: ArrayLike | None, steps: int, output: str | None,
    unit: float,
) -> Answer:  # fmt: skip
    """The answer at one pose by the engine's own search; unit: length [m] in which m is measured."""
    position, rate, accel = split(m, given)
    found = r.assemble(m, position, start=start, steps=steps)
    if not found.closed and not found.status.exit_code == 0:
        return _failed(m, position, found, unit)
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
    count: int,
    starts: Sequence[Array | None] | None,
    steps: int,
    output: str | None,
) -> list[Answer]:
    """`engine_answers` with the length scale of the mechanism as unit of length, for which its tolerances are made.

    Given and answered lengths are in metres.
    """
    unit = m.length_scale

    def length(key: str) -> float:
        return unit if is_length(m, key.removesuffix("_rate").removesuffix("_accel")) else 1.0

    units = coordinate_units(m, unit)
    begin = None if starts is None else [None if x is None else x / units for x in starts]
    scaled = {k: np.asarray(x) / length(k) if length(k) != 1.0 else x for k, x in given.items()}
    lengths = {k: length(k) for k in wanted}
    out = []
    for answer in engine_answers(witness, in_unit_of_length(m, unit), scaled, wanted, count, begin, steps, output, unit):
        own = answer.status is Status.BOUNDARY
        notes = tuple(f"{n} (lengths in units of {unit:g} m)" if own and " by " in n else n for n in answer.notes)
        out.append(replace(answer, values={k: x * lengths[k] for k, x in answer.values.items()}, notes=notes))
    return out


def _failed(m: Mechanism, given: Mapping[str, Any], found: Any, unit: float) -> Answer:
    """The answer where an engine found no pose: what stays open in words, the same for the same fact, whichever way it was met.

    With joints and shafts alone given, the loops are closed as far as they go with these values held; where that leaves them open, no pose
    closes, be it that the engine's path ended where two modes meet. unit: length [m] in which m is measured."""
    status, held = found.status, [n for n in given if n in m.scalar_names]
    if status is not Status.WRONG_MODE and held and len(held) == len(given):
        least = least_opening(m, {n: float(given[n]) for n in held}, [np.asarray(found.q), m.reference()])
        if least.least and not least.closed:
            unreachable = Status.NO_ASSEMBLY if set(held) <= {d.on for d in m.drives} else Status.OUT_OF_REACH
            text = f"{unreachable.value}; with {', '.join(held)} held, {least.text(unit)}"
            return Answer(status=unreachable, notes=(text,))
    here = opening(m, found.q)
    if not here.closed:
        return Answer(status=status, notes=(f"{status.value}; at the pose that came nearest {here.text(unit)}",))
    missed = {n: abs(float(m.value(n, found.q)) - float(given[n])) for n in held}
    worst = max(missed, key=lambda n: missed[n], default="")
    if not worst or missed[worst] < CLOSED:
        return Answer(status=status, notes=(status.value,))
    size = unit if is_length(m, worst) else 1.0
    reached = f"{float(m.value(worst, found.q)) * size:.4g} {'m' if is_length(m, worst) else 'rad'}"
    return Answer(status=status, notes=(f"{status.value}; with closed loops {worst} came to {reached}",))


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
    frames = {}
    for name in _frames(m, wanted):
        pose, velocity, acceleration = r.frame_motion(m, name, q, v, a)
        frames[name] = pose[None], velocity[None], acceleration[None]
    motion = Motions(v[None], a[None], frames)
    return {key: float(_value(m, key, q[None], motion)[0]) for key in wanted}


def _value(m: Mechanism, key: str, q: Array, motion: Motions) -> Array:
    """(n,) a quantity at poses q (n, nq) and their motion."""
    for suffix, vectors in (("_rate", motion.v), ("_accel", motion.a)):
        name = key.removesuffix(suffix)
        if key.endswith(suffix) and name in m.scalar_names:
            return np.asarray(vectors @ m.row(name))
    if key in m.scalar_names:
        return np.asarray(m.value(key, q))
    for frame, (pose, velocity, acceleration) in motion.frames.items():
        rest = key.removeprefix(f"{frame}_")
        if rest == key:
            continue
        letter, _, order = rest.partition("_")
        if letter not in LETTERS or order not in ("", "rate", "accel"):
            continue
        k = LETTERS.index(letter)
        if k < 3:
            return {"": pose[:, k, 3], "rate": velocity[:, k], "accel": acceleration[:, k]}[order]
        if order != "accel":
            return velocity[:, k] if order == "" else acceleration[:, k]
    raise unknown(f"{m.name}: quantity", key, quantities(m))
