"""What each kind of element adds to the motion: its points, turns, slides and the result of its group."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from mechlab.analytic.assur.all_modes import all_modes
from mechlab.analytic.assur.guides import prp, rpp
from mechlab.analytic.assur.mode_rates import GroupMotion, mode_rates
from mechlab.analytic.assur.plane import Guide, Scalar, driver, fixed, rigid, scalar
from mechlab.analytic.assur.rrr import rrr
from mechlab.analytic.assur.sliders import rpr, rrp
from mechlab.analytic.assur.two_loops import TwoLoops, class_four, class_three
from mechlab.analytic.linkage.description import Step
from mechlab.analytic.linkage.motion import Motion
from mechlab.errors import NoSolution

Action = Callable[[Step, Motion, Mapping[str, Scalar]], None]


def _pivot(s: Step, m: Motion, given: Mapping[str, Scalar]) -> None:
    m.points[s.name] = fixed(*s.sizes)


def _crank(s: Step, m: Motion, given: Mapping[str, Scalar]) -> None:
    base, turn = m.find("point", s.uses[0]), given[s.name]
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
    "pivot": _pivot, "crank": _crank, "point": _point, "guide": _guide, "guide_on": _guide_on, "RRR": _rrr, "RRP": _rrp,
    "RPR": _rpr, "PRP": _prp, "RPP": _rpp, "III": _three, "IV": _four,
}  # fmt: skip
"""Kind of a Step -> what it does."""
