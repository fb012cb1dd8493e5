"""Bodies in the order of a tree, whatever order they were given in."""

from __future__ import annotations

from collections.abc import Sequence

from mechlab.errors import MechlabError, unknown
from mechlab.mechanism.parts import GROUND, MAX_BODIES, Body


def too_many_bodies(name: str) -> MechlabError:
    """The error for a mechanism with more than MAX_BODIES bodies."""
    return MechlabError(
        f"mechanism {name!r} has more than {MAX_BODIES} bodies: mechlab computes with dense matrices, made for fewer. "
        "Weld parts that do not move against each other into one body."
    )


def depth_first(bodies: Sequence[Body]) -> tuple[Body, ...]:
    """The bodies sorted so that each follows its parent depth-first; siblings keep their order.

    Raises MechlabError for a name that is used twice or is the ground's, a parent that does not exist, or a cycle.
    """
    names: set[str] = set()
    for body in bodies:
        if body.name == GROUND:
            raise MechlabError(f"a body cannot be called {GROUND!r}: that is the fixed body. Give it another name.")
        if body.name in names:
            raise MechlabError(f"the body name {body.name!r} is used more than once; names must be unique.")
        names.add(body.name)
    children: dict[str, list[Body]] = {}
    for body in bodies:
        if body.parent != GROUND and body.parent not in names:
            raise unknown(f"parent of body {body.name!r}:", body.parent, names | {GROUND})
        children.setdefault(body.parent, []).append(body)
    out: list[Body] = []
    stack = list(reversed(children.get(GROUND, [])))
    while stack:
        body = stack.pop()
        out.append(body)
        stack += reversed(children.get(body.name, []))
    if len(out) != len(bodies):
        lost = sorted(names - {b.name for b in out})
        raise MechlabError(
            f"the parents of {', '.join(lost)} form a cycle: none of them hangs on {GROUND!r} in the end."
        )
    return tuple(out)
