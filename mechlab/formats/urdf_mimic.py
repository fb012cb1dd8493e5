"""Relations between two joints as mimics. Every follower names an independent leader: no chain can contradict."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from mechlab.mechanism.model import Mechanism


@dataclass(frozen=True)
class Follow:
    """follower = ratio x leader."""

    leader: str
    ratio: Fraction


def mimics(m: Mechanism) -> dict[str, Follow]:
    """Follower joint -> its leader and ratio, for the relations between exactly two joints.

    Chains are resolved to one leader: a driven joint if there is one, else the first in the order of coordinates.
    """
    order = {j.name: k for k, j in enumerate(m.joints)}
    driven = {d.on for d in m.drives}
    groups: dict[str, dict[str, Fraction]] = {}
    root: dict[str, str] = {}
    for relation in m.relations:
        if len(relation.coefficients) != 2:
            continue
        (a, ca), (b, cb) = relation.coefficients
        for name in (a, b):
            root.setdefault(name, name)
            groups.setdefault(root[name], {name: Fraction(1)})
        if root[a] == root[b]:
            continue
        # b in units of the root of a, from ca a + cb b = 0
        scale = -ca / cb * groups[root[a]][a] / groups[root[b]][b]
        moved = {name: ratio * scale for name, ratio in groups.pop(root[b]).items()}
        groups[root[a]] |= moved
        for name in moved:
            root[name] = root[a]
    out: dict[str, Follow] = {}
    for members in groups.values():
        leader = min(members, key=lambda n: (n not in driven, order[n]))
        for name, ratio in members.items():
            if name != leader:
                out[name] = Follow(leader, ratio / members[leader])
    return {n: out[n] for n in sorted(out, key=order.__getitem__)}
