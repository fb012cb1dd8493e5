"""Planar linkages as data: elements with names, sizes and modes, each built on those before it, and their motion.

`LinkageDescription` holds the elements, `Motion` their points, turns, slides and group results by name; `ACTIONS` has the
function of each kind of element that adds its part to the Motion.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field, replace
from fractions import Fraction
from typing import Any, Self

import numpy as np

from mechlab.analytic.assur.cycle import GroupMotion, mode_rates
from mechlab.analytic.assur.dyads import Dyad, prp, rpp, rpr, rrp, rrr
from mechlab.analytic.assur.plane import Guide, Point, Scalar, driver, fixed, rigid, scalar
from mechlab.analytic.assur.two_loops import TwoLoops, all_modes, class_four, class_three
from mechlab.errors import MechlabError, NoSolution, unknown
from mechlab.lazy_dataclass import dataclass


@dataclass(frozen=True)
class Step:
    """One element: kind, names that it uses and makes, sizes [m, rad], mode (0: it has none)."""

    kind: str
    name: str
    uses: tuple[str, ...] = ()
    makes: tuple[str, ...] = ()
    sizes: tuple[Any, ...] = ()
    mode: int = 0


@dataclass(frozen=True)
class LinkageDescription:
    """A chain of groups; every method returns a new one with one more. Raises MechlabError for names used twice."""

    name: str
    steps: tuple[Step, ...] = ()

    def pivot(self, name: str, x: float, y: float) -> Self:
        """A pin fixed to the ground at (x, y) [m]."""
        return self._with(Step("pivot", name, makes=(name,), sizes=(x, y)))

    def crank(self, name: str, pivot: str, pin: str, length: float) -> Self:
        """A driven link from `pivot` to the new `pin`: class I. Its input has the link's name."""
        return self._with(Step("crank", name, (pivot,), (name, pin), (length,)))

    def geared(
        self, name: str, pivot: str, pin: str, length: float, to: str, ratio: Fraction | int, phase: float = 0.0
    ) -> Self:
        """A link from `pivot` to the new `pin` that gears, belts or chains couple to the link `to`: its angle is
        phase + ratio x angle of `to`, both in the plane. ratio: of tooth counts, negative for an external mesh."""
        return self._with(Step("geared", name, (pivot, to), (name, pin), (length, Fraction(ratio), phase)))

    def point(self, name: str, link: str, distance: float, angle: float = 0.0) -> Self:
        """A point of a link, `distance` from its first pin at `angle` from its direction."""
        return self._with(Step("point", name, (link,), (name,), (distance, angle)))

    def guide(self, name: str, x: float, y: float, angle: float = 0.0, offset: float = 0.0) -> Self:
        """A straight guide of the ground through (x, y), in the direction of `angle`."""
        return self._with(Step("guide", name, makes=(name,), sizes=(x, y, angle, offset)))

    def guide_on(self, name: str, link: str, angle: float = 0.0, offset: float = 0.0) -> Self:
        """A straight guide on a moving link, through its first pin, at `angle` from its direction."""
        return self._with(Step("guide_on", name, (link,), (name,), (angle, offset)))

    def rrr(
        self, joint: str, links: tuple[str, str], pins: tuple[str, str], lengths: tuple[float, float], mode: int = 1
    ) -> Self:
        """Dyad RRR: links[k] from pins[k] to the new `joint`; mode +1: the joint lies left of the line pins[0] ->
        pins[1]."""
        return self._with(Step("RRR", joint, pins, (*links, joint), lengths, mode))

    def rrp(self, joint: str, link: str, pin: str, guide: str, length: float, mode: int = 1) -> Self:
        """Dyad RRP: a rod from `pin` to the new `joint`, which slides along `guide`; the slide has the joint's name."""
        return self._with(Step("RRP", joint, (pin, guide), (link, joint), (length,), mode))

    def rpr(self, link: str, pivot: str, pin: str, offset: float = 0.0, mode: int = 1) -> Self:
        """Dyad RPR: a slotted link about `pivot` that guides `pin`; the slide has the link's name."""
        return self._with(Step("RPR", link, (pivot, pin), (link,), (offset,), mode))

    def prp(self, joint: str, guides: tuple[str, str]) -> Self:
        """Dyad PRP: the new `joint` where two guides cross; slides JOINT_1 and JOINT_2."""
        return self._with(Step("PRP", joint, guides, (joint,)))

    def rpp(self, name: str, pin: str, guide: str, angle: float) -> Self:
        """Dyad RPP: a cross slide at `angle` to a guide carries `pin`; slides NAME_1 along the guide, NAME_2 along the cross."""
        return self._with(Step("RPP", name, (pin, guide), (name,), (angle,)))

    def class_three(
        self, name: str, links: tuple[str, str, str, str], pins: tuple[str, str, str], legs: tuple[float, float, float],
        platform: tuple[complex, complex], mode: int = 1, joints: tuple[str, ...] = (),
    ) -> Self:  # fmt: skip
        """A platform (links[3]) on three legs from `pins`; `platform`: its 2nd and 3rd corner seen from the 1st, in its axes.
        joints: names of the corners (default NAME_1 to NAME_3).
        mode +n or -n: of the modes with that sign of det J, the n-th in the order of the first leg's angle."""
        corners = joints or tuple(f"{name}_{k}" for k in (1, 2, 3))
        return self._with(Step("III", name, pins, (*links, *corners), (legs, platform), mode))

    def class_four(
        self, name: str, links: tuple[str, str, str, str], pins: tuple[str, str], first: tuple[complex, complex],
        second: tuple[complex, complex], lengths: tuple[float, float], mode: int = 1, joints: tuple[str, ...] = (),
    ) -> Self:  # fmt: skip
        """Two ternary links (links[0] on pins[0], links[1] on pins[1]) joined by links[2], links[3]; `first`, `second`: their
        two far joints in their own axes; `joints`: names of these four (default NAME_1 to NAME_4); mode as of `class_three`,
        in the order of the angle of links[0]."""
        four = joints or tuple(f"{name}_{k}" for k in (1, 2, 3, 4))
        return self._with(Step("IV", name, pins, (*links, *four), (first, second, lengths), mode))

    def _with(self, step: Step) -> Self:
        used = {n for s in self.steps for n in s.makes}
        for n in step.makes:
            if n in used:
                raise MechlabError(
                    f"linkage {self.name!r}: the name {n!r} is used twice; give every link and point its own."
                )
        if step.kind in ("RRR", "RRP", "RPR") and step.mode not in (1, -1):
            raise MechlabError(
                f"linkage {self.name!r}: {step.kind} {step.name!r}: mode must be +1 or -1, got {step.mode!r}."
            )
        return replace(self, steps=(*self.steps, step))

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the driven links."""
        return tuple(s.name for s in self.steps if s.kind == "crank")

    def with_modes(self, modes: Mapping[str, int]) -> Self:
        """The same linkage with other modes, by name of the group; raises MechlabError for an unknown group."""
        names = {s.name for s in self.steps if s.mode}
        for name in modes:
            if name not in names:
                raise unknown(f"linkage {self.name!r}: group with modes", name, names)
        return replace(
            self, steps=tuple(replace(s, mode=modes.get(s.name, s.mode)) if s.mode else s for s in self.steps)
        )


@dataclass
class Motion:
    """All points, turns of links (about their first pin), slides, guides, and the groups' own results, by name."""

    points: dict[str, Point] = field(default_factory=dict)
    turns: dict[str, Scalar] = field(default_factory=dict)
    bases: dict[str, Point] = field(default_factory=dict)
    slides: dict[str, Scalar] = field(default_factory=dict)
    guides: dict[str, Guide] = field(default_factory=dict)
    dyads: dict[str, Dyad] = field(default_factory=dict)
    groups: dict[str, GroupMotion] = field(default_factory=dict)

    def require(self) -> Motion:
        """The motion itself; raises NoSolution that names a group without assembly or at a dead centre."""
        for name, dyad in self.dyads.items():
            try:
                dyad.require()
            except NoSolution as cause:
                raise NoSolution(f"group {name!r}: {cause}") from None
        return self

    def find(self, what: str, name: str) -> Any:
        """A point, link or guide by name; raises MechlabError that lists them."""
        tables: dict[str, dict[str, Any]] = {"point": self.points, "link": self.turns, "guide": self.guides}
        table = tables[what]
        if name not in table:
            raise unknown(f"linkage: {what}", name, table)
        return table[name]


Action = Callable[[Step, Motion, Mapping[str, Scalar]], None]


def _pivot(s: Step, m: Motion, given: Mapping[str, Scalar]) -> None:
    m.points[s.name] = fixed(*s.sizes)


def _crank(s: Step, m: Motion, given: Mapping[str, Scalar]) -> None:
    base, turn = m.find("point", s.uses[0]), given[s.name]
    m.bases[s.name], m.turns[s.name] = base, turn
    m.points[s.makes[1]] = driver(base, s.sizes[0], turn.x, turn.v, turn.a)


def _geared(s: Step, m: Motion, given: Mapping[str, Scalar]) -> None:
    base, other = m.find("point", s.uses[0]), m.find("link", s.uses[1])
    ratio, phase = float(s.sizes[1]), s.sizes[2]
    turn = Scalar(phase + ratio * other.x, ratio * other.v, ratio * other.a)
    m.bases[s.name], m.turns[s.name] = base, turn
    m.points[s.makes[1]] = driver(base, s.sizes[0], turn.x, turn.v, turn.a)


def _point(s: Step, m: Motion, given: Mapping[str, Scalar]) -> None:
    turn = m.find("link", s.uses[0])
    m.points[s.name] = rigid(m.bases[s.uses[0]], turn, *s.sizes)


def _guide(s: Step, m: Motion, given: Mapping[str, Scalar]) -> None:
    x, y, angle, offset = s.sizes
    m.guides[s.name] = Guide(fixed(x, y), scalar(angle), offset)


def _guide_on(s: Step, m: Motion, given: Mapping[str, Scalar]) -> None:
    turn: Scalar = m.find("link", s.uses[0])
    m.guides[s.name] = Guide(m.bases[s.uses[0]], Scalar(turn.x + s.sizes[0], turn.v, turn.a), s.sizes[1])


def _rrr(s: Step, m: Motion, given: Mapping[str, Scalar]) -> None:
    a, c = (m.find("point", n) for n in s.uses)
    found = m.dyads[s.name] = rrr(a, c, s.sizes[0], s.sizes[1], s.mode)
    for link, base, turn in zip(s.makes[:2], (a, c), found.angles, strict=True):
        m.bases[link], m.turns[link] = base, turn
    m.points[s.name] = found.joint


def _rrp(s: Step, m: Motion, given: Mapping[str, Scalar]) -> None:
    pin, guide = m.find("point", s.uses[0]), m.find("guide", s.uses[1])
    found = m.dyads[s.name] = rrp(pin, guide, s.sizes[0], s.mode)
    m.bases[s.makes[0]], m.turns[s.makes[0]] = pin, found.angles[0]
    m.points[s.name], m.slides[s.name] = found.joint, found.slides[0]


def _rpr(s: Step, m: Motion, given: Mapping[str, Scalar]) -> None:
    pivot, pin = (m.find("point", n) for n in s.uses)
    found = m.dyads[s.name] = rpr(pivot, pin, s.sizes[0], s.mode)
    m.bases[s.name], m.turns[s.name], m.slides[s.name] = pivot, found.angles[0], found.slides[0]


def _prp(s: Step, m: Motion, given: Mapping[str, Scalar]) -> None:
    first, second = (m.find("guide", n) for n in s.uses)
    found = m.dyads[s.name] = prp(first, second)
    m.points[s.name] = found.joint
    m.slides[f"{s.name}_1"], m.slides[f"{s.name}_2"] = found.slides


def _rpp(s: Step, m: Motion, given: Mapping[str, Scalar]) -> None:
    pin, guide = m.find("point", s.uses[0]), m.find("guide", s.uses[1])
    found = m.dyads[s.name] = rpp(pin, guide, s.sizes[0])
    m.slides[f"{s.name}_1"], m.slides[f"{s.name}_2"] = found.slides


def _three(s: Step, m: Motion, given: Mapping[str, Scalar]) -> None:
    g1, g2, g3 = (m.find("point", n) for n in s.uses)
    legs, platform = s.sizes
    found = _chosen(class_three((g1, g2, g3), legs, platform), s, m)
    leg1, plate = found.theta_t, found.theta_u
    corner = rigid(g1, leg1, legs[0])
    m.bases |= dict(zip(s.makes[:4], (g1, g2, g3, corner), strict=True))
    m.turns |= dict(zip(s.makes[:4], (leg1, *found.links, plate), strict=True))
    for name, arm in zip(s.makes[4:], (0j, *platform), strict=True):
        m.points[name] = rigid(corner, plate, abs(arm), np.angle(arm))


def _four(s: Step, m: Motion, given: Mapping[str, Scalar]) -> None:
    a, f = (m.find("point", n) for n in s.uses)
    first, second, lengths = s.sizes
    found = _chosen(class_four(a, f, first, second, lengths), s, m)
    near = [rigid(a, found.theta_t, abs(x), np.angle(x)) for x in first]
    far = [rigid(f, found.theta_u, abs(x), np.angle(x)) for x in second]
    m.bases |= dict(zip(s.makes[:4], (a, f, *near), strict=True))
    m.turns |= dict(zip(s.makes[:4], (found.theta_t, found.theta_u, *map(_turned, found.links)), strict=True))
    m.points |= dict(zip(s.makes[4:], (*near, *far), strict=True))


def _turned(link: Scalar) -> Scalar:
    """The turn of a link seen from its other end, in [-pi, pi]."""
    return Scalar(link.x - np.copysign(np.pi, link.x), link.v, link.a)


def _chosen(group: TwoLoops, s: Step, m: Motion) -> GroupMotion:
    modes = all_modes(group)
    sign, rank = (1 if s.mode > 0 else -1), abs(s.mode)
    fits = np.sign(modes.det) == sign
    hit = fits & (np.cumsum(fits, axis=-1) == rank)
    if not np.all(np.any(hit, axis=-1)):
        lacking = int(np.count_nonzero(~np.any(hit, axis=-1)))
        raise NoSolution(
            f"group {s.name!r}: mode {s.mode:+d} does not exist at {lacking} of {hit[..., 0].size} positions; there are "
            f"{int(np.min(modes.count))} to {int(np.max(modes.count))} modes."
        )
    slot = np.argmax(hit, axis=-1)[..., None]
    t, u = (np.take_along_axis(x, slot, axis=-1)[..., 0] for x in (modes.theta_t, modes.theta_u))
    found = m.groups[s.name] = mode_rates(group, t, u)
    return found


ACTIONS: dict[str, Action] = {
    "pivot": _pivot, "crank": _crank, "geared": _geared, "point": _point, "guide": _guide, "guide_on": _guide_on, "RRR": _rrr, "RRP": _rrp,
    "RPR": _rpr, "PRP": _prp, "RPP": _rpp, "III": _three, "IV": _four,
}  # fmt: skip
"""Kind of a Step -> the function that adds it to the Motion."""
