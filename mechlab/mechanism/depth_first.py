"""Bodies in the order of a tree, whatever order they were given in."""

from __future__ import annotations

from collections.abc import Sequence

from mechlab.errors import MechlabError, unknown
from mechlab.mechanism.parts import GROUND, Body


def depth_first(bodies: Sequence[Body]) -> tuple[Body, ...]:
    """The bodies sorted so that each follows its parent depth-first; siblings keep their order.

    Raises MechlabError for a parent that does not exist or a cycle.
    """
    names = {b.name for b in bodies}
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
        lost = sorted({b.name for b in bodies} - {b.name for b in out}) or ["a body used twice"]
        raise MechlabError(f"the parents of {', '.join(lost)} form a cycle, or a name is used twice.")
    return tuple(out)
