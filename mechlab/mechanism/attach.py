"""Another mechanism, attached to one under construction: its ground becomes a body of the host."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from mechlab.errors import MechlabError, unknown
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.edit import LISTS, Part, Parts, parts_of, renamed
from mechlab.mechanism.geometry import IDENTITY, Placement, Vector, vector
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Body, Frame, Loop, Shaft, Spring
from mechlab.tables import listed


class MakesMechanism(Protocol):
    """What makes a Mechanism, such as a Design."""

    def mechanism(self) -> Mechanism:
        """The mechanism."""
        ...


@dataclass(frozen=True)
class Seat:
    """Where the ground of the attached mechanism stands: in a body of the host."""

    body: str
    placement: Placement


def seat_of(b: Parts, at: str, turned: Placement) -> Seat:
    """The frame or body `at` of the host, a frame first; raises MechlabError that lists frames and bodies."""
    for frame in b.frames:
        if frame.name == at:
            return Seat(frame.body, frame.placement @ turned)
    bodies = [x.name for x in b.bodies]
    if at != GROUND and at not in bodies:
        frames = ", ".join(sorted(f.name for f in b.frames)) or "none"
        error = unknown(f"{b.name}: attach at: frame or body", at, [f.name for f in b.frames] + [GROUND, *bodies])
        raise MechlabError(f"{error} Frames: {frames}.")
    return Seat(at, turned)


def attach(b: Parts, other: object, at: str, prefix: str, turned: Placement) -> None:
    """Add all parts of another mechanism; see `Builder.attach`."""
    m = mechanism_of(other)
    seat = seat_of(b, at, turned)
    _refuse_clashes(b, m, prefix)

    def body(name: str) -> str:
        return seat.body if name == GROUND else prefix + name

    def own(name: str) -> str:
        return prefix + name

    for kind, items in _parts(m):
        held: list[Any] = getattr(b, LISTS[kind])
        held += [_seated(renamed(part, own, body, own), part, seat) for part in items]
    shapes = tuple(
        replace(s, placement=seat.placement @ s.placement, name=prefix + s.name if s.name else "")
        for s in m.ground_shapes
    )
    if seat.body == GROUND:
        b.ground_shapes += shapes
    else:
        b.bodies[:] = [replace(x, shapes=x.shapes + shapes) if x.name == seat.body else x for x in b.bodies]


def mechanism_of(other: object) -> Mechanism:
    """The Mechanism itself, or the one that a Design makes; raises MechlabError for anything else."""
    made = other.mechanism() if hasattr(other, "mechanism") else other
    if not isinstance(made, Mechanism):
        raise MechlabError(
            f"attach takes a Mechanism or a Design, got {type(other).__name__}: for a file or a name of the catalog "
            "write attach(ml.load(...))."
        )
    return made


def _parts(m: Mechanism) -> list[tuple[str, tuple[Part, ...]]]:
    """(kind, parts) of a mechanism, in the order of LISTS."""
    return [(kind, m.relations if kind == "relation" else getattr(m, name)) for kind, name in LISTS.items()]


def _refuse_clashes(b: Parts, m: Mechanism, prefix: str) -> None:
    """Raise MechlabError for names that both have; joints and shafts share one list of names, so do loops, relations,
    curves and springs."""
    group = {"joint": "joint or shaft", "shaft": "joint or shaft"} | dict.fromkeys(
        ("loop", "relation", "curve", "spring"), "constraint"
    )
    taken = {(group.get(k, k), p.name) for k, p in parts_of(b)}
    arriving = [(k, prefix + p.name) for k, items in _parts(m) for p in items]
    arriving += [("joint", prefix + j.name) for j in m.joints]
    clashes = sorted({name for k, name in arriving if (group.get(k, k), name) in taken})
    if clashes:
        hint = f"prefix={m.name + '_'!r}" if not prefix else f"another prefix than {prefix!r}"
        raise MechlabError(f"{b.name}: attach {m.name!r}: the names {listed(clashes, 5)} exist already: give {hint}.")


def _seated(part: Part, original: Part, seat: Seat) -> Part:
    """A renamed part whose places on the ground are now places in the seat."""
    at = seat.placement
    if isinstance(part, Body) and isinstance(original, Body):
        return replace(part, placement=at @ part.placement) if original.parent == GROUND else part
    if isinstance(part, Frame | Shaft) and isinstance(original, Frame | Shaft):
        return replace(part, placement=at @ part.placement) if original.body == GROUND else part
    if isinstance(part, Loop) and isinstance(original, Loop):
        if original.body_a == GROUND:
            part = replace(part, placement_a=at @ part.placement_a)
        if original.body_b == GROUND:
            part = replace(part, placement_b=at @ part.placement_b)
    if isinstance(part, Spring) and isinstance(original, Spring):
        if original.body_a == GROUND:
            part = replace(part, point_a=_moved(part.point_a, at))
        if original.body_b == GROUND:
            part = replace(part, point_b=_moved(part.point_b, at))
    return part


def _moved(p: Vector, by: Placement) -> Vector:
    return p if by == IDENTITY else vector(by.rotation @ np.array(p) + by.translation, "point")
