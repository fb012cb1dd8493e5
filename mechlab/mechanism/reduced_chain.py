"""The nested bodies of a reduced train: which independent joints stand on one path, and what their coordinates mean."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism.angle_basis import AngleBasis, Row
from mechlab.mechanism.coefficients import Coefficients
from mechlab.mechanism.geometry import Array, cross
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Body


@dataclass(frozen=True)
class Link:
    """One independent joint in the reduced tree. `under`: the body it is nested in; `joint`: the name of the coordinate,
    which is that of the original joint where the coordinate means the same, else JOINT_on_OTHER."""

    body: Body
    original: str
    under: str
    joint: str

    @property
    def nested(self) -> bool:
        """True for a part that turned on another part of the chain in the original too."""
        return self.body.parent != GROUND


@dataclass(frozen=True)
class Chain:
    """All links, depth-first. `turn[i][j]`: the original joint of link i = sum over j of turn[i][j] x coordinate of link j."""

    links: tuple[Link, ...]
    order: tuple[int, ...]
    turn: tuple[tuple[Fraction, ...], ...]

    def row(self, row: Row) -> tuple[Fraction, ...]:
        """A row over the independent joints as one over the coordinates of the reduced tree."""
        out = [Fraction(0)] * len(self.links)
        for i, link_row in enumerate(self.turn):
            c = row[self.order[i]]
            out = [o + c * t for o, t in zip(out, link_row, strict=True)]
        return tuple(out)

    def coefficients(self, row: Row) -> Coefficients:
        """The same as coefficients of joints of the reduced mechanism."""
        return tuple((k.joint, c) for k, c in zip(self.links, self.row(row), strict=True) if c)

    @property
    def to_independent(self) -> Array:
        """(f, f) y = S x: the independent joints (in the order of the basis) from the coordinates of the tree."""
        out = np.zeros((len(self.links), len(self.links)))
        for i, link_row in enumerate(self.turn):
            out[self.order[i]] = [float(x) for x in link_row]
        return out


def coaxial(m: Mechanism, a: Body, b: Body) -> bool:
    """True when the joints of two bodies on the ground turn about one line (either sense)."""
    tree = TreeKinematics(m)
    i, j = (m.v_slice[x.joints[0].name].start for x in (a, b))
    u, w, arm = tree.axes[i], tree.axes[j], tree.anchors[j] - tree.anchors[i]
    size = 1.0 + float(np.linalg.norm(arm))
    return float(np.linalg.norm(cross(u, w))) < 1e-12 and float(np.linalg.norm(cross(u, arm))) < 1e-12 * size


def chains(m: Mechanism, basis: AngleBasis, coupled: Iterable[Row]) -> Chain:
    """The reduced tree: independent joints that share a row of inertia or damping nested on one path.

    Raises MechlabError that names two joints which are coupled but cannot be put on one path.
    """
    home = {b.joints[0].name: b for b in m.bodies}
    groups = _groups(len(basis.independent), coupled)
    links: list[Link] = []
    order: list[int] = []
    turn: list[dict[int, Fraction]] = []
    tree = TreeKinematics(m)
    for group in groups:
        members = [(i, home[basis.independent[i]]) for i in group]
        grounded = [x for x in members if x[1].parent == GROUND]
        nested = [x for x in members if x[1].parent != GROUND]
        carriers = {x[1].parent for x in nested}
        grounded.sort(key=lambda x: x[1].name in carriers)  # a carrier of an independent part stands last
        previous: tuple[Body, int] | None = None
        for i, body in grounded:
            joint = body.joints[0].name
            if previous is None:
                links.append(Link(body, joint, GROUND, joint))
                turn.append({len(links) - 1: Fraction(1)})
            else:
                above, at = previous
                if not coaxial(m, above, body):
                    raise _no_path(m, above, body)
                u, w = (tree.axes[m.v_slice[x.joints[0].name].start] for x in (above, body))
                sign = Fraction(1 if float(u @ w) > 0 else -1)
                links.append(Link(body, joint, above.name, f"{joint}_on_{above.joints[0].name}"))
                turn.append({k: sign * c for k, c in turn[at].items()} | {len(links) - 1: Fraction(1)})
            order.append(i)
            previous = (body, len(links) - 1)
        for i, body in nested:
            if previous is None or body.parent != previous[0].name:
                raise _no_path(m, previous[0] if previous else m.body(body.parent), body)
            links.append(Link(body, body.joints[0].name, body.parent, body.joints[0].name))
            turn.append({len(links) - 1: Fraction(1)})
            order.append(i)
            previous = (body, len(links) - 1)
    n = len(links)
    rows = tuple(tuple(t.get(k, Fraction(0)) for k in range(n)) for t in turn)
    return Chain(tuple(links), tuple(order), rows)


def _groups(n: int, coupled: Iterable[Row]) -> list[list[int]]:
    """Indices of independent joints, together where a row couples them."""
    label = list(range(n))
    for row in coupled:
        inside = [i for i, c in enumerate(row) if c]
        for i in inside[1:]:
            old, new = label[i], label[inside[0]]
            label = [new if x == old else x for x in label]
    return [[i for i in range(n) if label[i] == g] for g in dict.fromkeys(label)]


def _no_path(m: Mechanism, a: Body, b: Body) -> MechlabError:
    return MechlabError(
        f"{m.name}: the independent joints {a.joints[0].name!r} and {b.joints[0].name!r} are coupled by inertia or damping "
        "but do not turn about one line, so they cannot be put on one path; the coupling would be lost. Choose others with "
        f"independent=, among {', '.join(j.name for j in m.joints)}, or keep the fidelity with bodies."
    )
