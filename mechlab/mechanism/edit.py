"""Changing, renaming and removing the parts that a Builder holds, whoever made them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from mechlab.errors import MechlabError, unknown
from mechlab.mechanism.curve import CurveRelation
from mechlab.mechanism.gears import GearMesh
from mechlab.mechanism.geometry import vector
from mechlab.mechanism.given import options_of
from mechlab.mechanism.parts import GROUND, Body, Drive, Frame, Joint, LinearRelation, Loop, Shaft, Shape, Spring

Part = Body | Joint | Loop | GearMesh | LinearRelation | CurveRelation | Shaft | Spring | Drive | Frame
LISTS = {
    "body": "bodies", "loop": "loops", "relation": "meshes", "shaft": "shafts", "spring": "springs", "drive": "drives",
    "frame": "frames", "curve": "curves",
}  # fmt: skip
"""Kind of part -> the list of the Builder that holds it; joints stand in their bodies."""
KINDS = ("body", "joint", *list(LISTS)[1:])


class Parts:
    """Lists of parts in any order: what is edited."""

    def __init__(self, name: str, gravity: Sequence[float] = (0.0, 0.0, -9.81), summary: str = "") -> None:
        self.name = name
        self.gravity = vector(gravity, "gravity")
        self.summary = summary
        self.bodies: list[Body] = []
        self.loops: list[Loop] = []
        self.meshes: list[GearMesh | LinearRelation] = []
        self.shafts: list[Shaft] = []
        self.springs: list[Spring] = []
        self.drives: list[Drive] = []
        self.frames: list[Frame] = []
        self.curves: list[CurveRelation] = []
        self.ground_shapes: list[Shape] = []


def parts_of(b: Parts) -> Iterator[tuple[str, Part]]:
    """(kind, part) of everything but shapes."""
    for body in b.bodies:
        yield "body", body
        yield from (("joint", j) for j in body.joints)
    for kind in KINDS[2:]:
        yield from ((kind, part) for part in getattr(b, LISTS[kind]))


def find(b: Parts, name: str, kind: str | None = None) -> tuple[str, Part]:
    """The kind and the part of a name. Raises MechlabError where there is none, listing what exists, or more than one."""
    if kind is not None and kind not in KINDS:
        raise unknown("kind of part", kind, KINDS)
    found = [(k, p) for k, p in parts_of(b) if p.name == name and kind in (None, k)]
    if not found:
        existing = [p.name for k, p in parts_of(b) if kind in (None, k)]
        raise unknown(f"{b.name}: {kind or 'part'}", name, existing)
    if len({k for k, _ in found}) > 1:
        kinds = [k for k, _ in found]
        raise MechlabError(f"{b.name}: {name!r} is the name of a {' and of a '.join(kinds)}: say kind={kinds[0]!r}.")
    return found[0]


def change(b: Parts, name: str, kind: str | None, fields: Mapping[str, object]) -> None:
    """Replace fields of a part, as of its dataclass. Raises MechlabError for a field that it has not, or for its name."""
    kind, part = find(b, name, kind)
    options_of(type(part), fields, f"{b.name}: {kind} {name!r}", fixed=("name",))
    changed: Any = replace(part, **fields)  # type: ignore[arg-type]
    if kind == "joint":
        b.bodies[:] = [replace(x, joints=tuple(changed if j is part else j for j in x.joints)) for x in b.bodies]
        return
    held: list[Any] = getattr(b, LISTS[kind])
    held[:] = [changed if x is part else x for x in held]


def references(part: Part) -> Iterator[tuple[str, str]]:
    """(kind, name) of the parts that a part stands on; kind "scalar": a joint or a shaft."""
    if isinstance(part, Body):
        yield "body", part.parent
    elif isinstance(part, Loop | Spring):
        yield from (("body", part.body_a), ("body", part.body_b))
    elif isinstance(part, GearMesh):
        yield from (("scalar", part.a), ("scalar", part.b), ("body", part.carrier))
    elif isinstance(part, LinearRelation):
        yield from (("scalar", n) for n, _ in part.coefficients)
    elif isinstance(part, CurveRelation):
        yield from (("scalar", part.output), ("scalar", part.input))
    elif isinstance(part, Shaft):
        yield from (("scalar", n) for n, _ in part.coefficients)
        if part.shapes:
            yield "body", part.body
    elif isinstance(part, Drive):
        yield "scalar", part.on
    elif isinstance(part, Frame):
        yield "body", part.body


def standing_on(b: Parts, kind: str, name: str) -> list[tuple[str, Part]]:
    """The parts that refer to a part."""
    wanted = {("scalar" if kind in ("joint", "shaft") else kind, name)}
    if kind == "body":
        wanted |= {("scalar", j.name) for x in b.bodies if x.name == name for j in x.joints}
    return [(k, p) for k, p in parts_of(b) if wanted & set(references(p))]


def remove(b: Parts, name: str, kind: str | None, with_dependents: bool) -> None:
    """Take a part away. Raises MechlabError that lists what stands on it, unless this goes too."""
    kind, part = find(b, name, kind)
    dependents = standing_on(b, kind, name)
    if dependents and not with_dependents:
        listed = ", ".join(f"{k} {p.name!r}" for k, p in dependents)
        raise MechlabError(
            f"{b.name}: {kind} {name!r} carries {listed}: remove these first, or all of it with "
            f"remove({name!r}, with_dependents=True)."
        )
    for k, p in dependents:
        if any(x is p for _, x in parts_of(b)):  # a part that stands on two removed ones is gone already
            remove(b, p.name, k, True)
    if kind == "joint":
        b.bodies[:] = [replace(x, joints=tuple(j for j in x.joints if j is not part)) for x in b.bodies]
        return
    held: list[Any] = getattr(b, LISTS[kind])
    held[:] = [x for x in held if x is not part]


Rename = Callable[[str], str]


def renamed(part: Part, own: Rename, body: Rename, scalar: Rename) -> Part:
    """The part under other names: `own` for it and its joints, `body` for bodies, `scalar` for joints and shafts."""
    out: Any = replace(part, name=own(part.name))
    if isinstance(part, Body):
        joints = tuple(replace(j, name=scalar(j.name)) for j in part.joints)
        return replace(out, name=body(part.name), parent=body(part.parent), joints=joints)
    if isinstance(part, Loop | Spring):
        return replace(out, body_a=body(part.body_a), body_b=body(part.body_b))
    if isinstance(part, GearMesh):
        return replace(out, a=scalar(part.a), b=scalar(part.b), carrier=body(part.carrier))
    if isinstance(part, LinearRelation):
        return replace(out, coefficients=tuple((scalar(n), c) for n, c in part.coefficients))
    if isinstance(part, CurveRelation):
        return replace(out, output=scalar(part.output), input=scalar(part.input))
    if isinstance(part, Shaft):
        terms = tuple((scalar(n), c) for n, c in part.coefficients)
        return replace(out, name=scalar(part.name), coefficients=terms, body=body(part.body))
    if isinstance(part, Drive):
        return replace(out, on=scalar(part.on))
    if isinstance(part, Frame):
        return replace(out, body=body(part.body))
    return out


def rename(b: Parts, old: str, new: str, kind: str | None) -> None:
    """Give a part another name, everywhere. Raises MechlabError for a name that is taken."""
    kind, part = find(b, old, kind)
    if old == GROUND or new == GROUND:
        raise MechlabError(f"{b.name}: {GROUND!r} is the name of the fixed body.")
    like = ("joint", "shaft") if kind in ("joint", "shaft") else (kind,)
    if any(k in like and p.name == new for k, p in parts_of(b)):
        raise MechlabError(f"{b.name}: there is a {' or '.join(like)} {new!r} already.")

    def swap(name: str) -> str:
        return new if name == old else name

    def keep(name: str) -> str:
        return name

    body, scalar = (swap if kind == "body" else keep), (swap if kind in ("joint", "shaft") else keep)
    for k, attribute in LISTS.items():
        held: list[Any] = getattr(b, attribute)
        held[:] = [renamed(p, swap if p is part and k == kind else keep, body, scalar) for p in held]
