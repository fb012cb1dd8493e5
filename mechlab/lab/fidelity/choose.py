"""Which fidelity answers what a scene needs, and the cheapest of them whose error is within the tolerance.

A reaction can be read where the Mechanism has a row or a part for it. A fidelity is exact where its accelerations are those of
the richest one; otherwise the error is measured by running both.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

from mechlab.errors import MechlabError, unknown
from mechlab.experiment.recording import Finding
from mechlab.experiment.scene import NEEDS, Scene
from mechlab.lab.design import AUTO, Design
from mechlab.lab.fidelity.measure import Agreement, FidelityError, agreement, error_against
from mechlab.lab.single_run import single_run
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.model import Mechanism

CLOSED_FORM = "kinematic"


def levels(design: Design) -> tuple[str, ...]:
    """The fidelities that have a Mechanism, cheapest first."""
    return tuple(f for f in design.entry.fidelities if f != CLOSED_FORM)


def checked_needs(needs: Sequence[str]) -> tuple[str, ...]:
    """The needs, each of `NEEDS`; raises MechlabError that lists them."""
    for need in needs:
        if need not in NEEDS:
            raise unknown("need", need, NEEDS)
    return tuple(needs)


def missing_answers(m: Mechanism, richest: Mechanism) -> dict[str, str]:
    """Need -> why this mechanism cannot answer it; it answers every need that is not a key.

    poses, drive_forces: every Mechanism answers them. tooth_loads: needs a row for the gears. reactions: needs every
    loop, gear row and part of the richest fidelity under its name; lumped parts have no reactions between them.
    """
    out: dict[str, str] = {}
    if not m.relations:
        out["tooth_loads"] = (
            "its gears are shafts without rows" if richest.relations else "no fidelity has rows of gears"
        )
    for what, mine, all_of in (
        ("loop", {x.name for x in m.loops}, {x.name for x in richest.loops}),
        ("gear row", {x.name for x in m.relations}, {x.name for x in richest.relations}),
        ("part", {x.name for x in m.bodies}, {x.name for x in richest.bodies}),
    ):
        lost = sorted(all_of - mine)
        if lost:
            names = ", ".join(lost[:3]) + (", ..." if len(lost) > 3 else "")
            out["reactions"] = f"it has no {what} {names}"
            break
    return out


FORCE_SHARE = 0.01
"""Largest error of drive forces and tooth loads where they are needed: root mean square, over that of the load."""
STEPS = 1000
"""Steps of the comparison run: a number of steps and not of seconds of CPU, so that a choice can be repeated."""


@dataclass(frozen=True)
class Choice:
    """The fidelity, why in words, its error against the richest [m or rad] (0: exact) and the tolerance."""

    chosen: str
    sentence: str
    error: float
    tolerance: float

    def finding(self) -> Finding:
        """The choice for a health record."""
        return Finding("fidelity", self.error, self.tolerance, "m or rad", "ok", self.sentence)


def choose(
    design: Design,
    scene: str | None = None,
    needs: Sequence[str] | None = None,
    duration: float | None = None,
    extra: Mapping[str, float] | None = None,
) -> Choice:
    """The cheapest fidelity, in the order of the entry, that answers `needs` (default: the scene's) within the tolerance.

    A fidelity is taken as exact when its accelerations agree with those of the richest (`agreement`); otherwise both run the
    scene, or its first STEPS steps. The answer is kept for the process. Raises MechlabError when no fidelity can answer.
    """
    key = tuple(sorted(dict(extra or {}).items()))
    try:
        return _kept(_Hashed(design), scene, None if needs is None else tuple(needs), duration, key)
    except TypeError:  # a parameter that cannot be hashed
        return _choose(design, scene, needs, duration, dict(key))


class _Hashed:
    """A design as a cache key: entry, parameters, and which of them the user gave, since these outrank a scene's."""

    def __init__(self, design: Design) -> None:
        self.design = design
        self.key = (design.entry.name, id(design.entry), repr(design.parameters), repr(sorted(design.given)))

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Hashed) and self.key == other.key


@lru_cache(maxsize=64)
def _kept(design: _Hashed, scene: str | None, needs: Any, duration: float | None, extra: Any) -> Choice:
    return _choose(design.design, scene, needs, duration, dict(extra))


def _choose(
    design: Design, scene: str | None, needs: Sequence[str] | None, duration: float | None, extra: dict[str, float]
) -> Choice:
    of_scene, names = design.for_scene(scene), levels(design)
    top = names[-1]
    made = {top: of_scene.scene(scene, top, duration, extra)}
    wanted = checked_needs(made[top].needs if needs is None else needs)
    tolerance = made[top].tolerance
    lost = missing_answers(of_scene.mechanism(top), of_scene.mechanism(top))
    nobody = [n for n in wanted if n in lost]
    if nobody:
        raise MechlabError(
            f"{design.name}: no fidelity answers {nobody[0]}: {lost[nobody[0]]}. Fidelities: {', '.join(names)}."
        )
    passed: list[str] = []
    for level in names[:-1]:
        gaps = missing_answers(of_scene.mechanism(level), of_scene.mechanism(top))
        cannot = [n for n in wanted if n in gaps]
        if cannot:
            passed.append(f"{level} cannot give {cannot[0].replace('_', ' ')} ({gaps[cannot[0]]})")
            continue
        made[level] = of_scene.scene(scene, level, duration, extra)
        same = agreement(of_scene.mechanism(level), of_scene.mechanism(top), made[level], made[top])
        if same.exact:
            return Choice(level, sentence(level, wanted, passed, exact_words(same, top)), 0.0, tolerance)
        window, error = short_error(design, scene, level, top, made[top], extra)
        why = too_far(error, wanted, tolerance)
        if not why:
            text = f"over the first {window:.3g} s it is within {error.poses:.2g} m or rad of {top} (tolerance {tolerance:g})"
            return Choice(level, sentence(level, wanted, passed, text), error.poses, tolerance)
        passed.append(f"{level} is too far off ({why})")
    text = "the only one" if len(names) == 1 else "the richest"
    return Choice(top, sentence(top, wanted, passed, text), 0.0, tolerance)


def sentence(level: str, needs: Sequence[str], passed: Sequence[str], why: str) -> str:
    """Why a fidelity was taken, in words."""
    refused = f"; {'; '.join(passed)}" if passed else ""
    return f"fidelity {level} answers {', '.join(n.replace('_', ' ') for n in needs)}: {why}{refused}"


def exact_words(same: Agreement, top: str) -> str:
    """The proof of exactness in words."""
    return f"an exact reduction of {top} (accelerations agree to {same.difference:.1g} in {same.states} states)"


def too_far(error: FidelityError, needs: Sequence[str], tolerance: float) -> str:
    """Why an error is not tolerated; empty when it is."""
    if not error.poses + error.slip <= tolerance:
        slip = f", its rows give way by {error.slip:.2g}" if error.slip > 0.1 * error.poses else ""
        return f"{error.worst} by {error.poses:.2g} m or rad{slip}, tolerance {tolerance:g}"
    for need, share in (("drive_forces", error.forces), ("tooth_loads", error.loads)):
        if need in needs and share is not None and not share <= FORCE_SHARE:
            return f"{need.replace('_', ' ')} by {100 * share:.2g} %, tolerated {100 * FORCE_SHARE:g} %"
    return ""


def short_error(
    design: Design, scene: str | None, level: str, top: str, made: Scene, extra: Mapping[str, float]
) -> tuple[float, FidelityError]:
    """Length [s] of the comparison, and the error over it."""
    window = min(made.duration, STEPS * made.settings.timestep)
    runs = [single_run(design, scene, f, window, extra) for f in (level, top)]
    return window, error_against(*runs)


def chosen_scene(
    design: Design,
    scene: str | None = None,
    fidelity: str | None = None,
    duration: float | None = None,
    extra: Mapping[str, float] | None = None,
) -> Scene:
    """`Design.scene`, where the fidelity may also be "auto": the cheapest that answers what the scene needs."""
    if is_auto(design, scene, fidelity):
        fidelity = choose(design, scene, None, duration, extra).chosen
    return design.scene(scene, fidelity, duration, extra)


def is_auto(design: Design, scene: str | None, fidelity: str | None) -> bool:
    """Whether the fidelity of a run is to be chosen: asked for, or left open by the scene."""
    return (fidelity or design.recipe(scene).fidelity) == AUTO
