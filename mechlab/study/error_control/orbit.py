"""Where a motion of one freedom at constant energy goes: it swings between two turning points, turns on and on, or runs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import NoSolution
from mechlab.mechanism.geometry import Array
from mechlab.study.error_control.branch import TURN, Branch
from mechlab.study.error_control.conservative import Energies

MARGIN = 1.02
MOST_TURNS = 20_000
SAME = 1e-11
OFFSET = 0.381966
"""Share of a cell by which the nodes of a turn are shifted: places where modes meet like to be simple fractions of it."""


@dataclass(frozen=True)
class Orbit:
    """phi as a smooth function of x on [low, high], along which time only increases.

    kind "swing": phi = middle - radius cos x; "turn": phi = start + sign x; "run": phi = corner + sign x^2 from a turning
    point, or start + sign x without one. x0: where the motion starts; forward: whether x increases there.
    """

    kind: str
    low: float
    high: float
    x0: float
    forward: bool
    cells: int
    middle: float = 0.0
    radius: float = 0.0
    sign: int = 1
    square: bool = False

    def phi(self, x: Array) -> Array:
        """phi(x)."""
        if self.kind == "swing":
            return np.asarray(self.middle - self.radius * np.cos(x))
        return self.middle + self.sign * (x * x if self.square else x)

    def slope(self, x: Array) -> Array:
        """|dphi/dx|."""
        if self.kind == "swing":
            return np.asarray(self.radius * np.abs(np.sin(x)))
        return 2.0 * np.abs(x) if self.square else np.ones_like(x)

    def turning(self, x: Array) -> NDArray[np.bool_]:
        """Where x is a turning point, so that speed and dphi/dx vanish together."""
        return np.asarray(self.slope(x) < 1e-7 * (self.radius if self.kind == "swing" else 1.0)) & (
            self.kind == "swing" or self.square
        )

    def at_turning(self, inertia: Array, force: Array) -> Array:
        """The limit of dt/dx at a turning point, from J and |dV/dphi|."""
        return np.asarray(np.sqrt((self.radius if self.kind == "swing" else 2.0) * inertia / force))


@dataclass(frozen=True)
class _End:
    what: str
    phi: float
    time: float
    fastest: float


class Explorer:
    """Follows the branch from its start until it is known where the motion goes within `duration`."""

    def __init__(self, branch: Branch, energies: Energies, rate: float, duration: float) -> None:
        self.branch, self.energies, self.duration = branch, energies, duration
        at = branch.first
        j, v, slope = energies(branch.q[at][None], branch.u[at][None])
        self.rate = rate
        self.energy = float(0.5 * j[0] * rate**2 + v[0])
        self.first = (branch.start, float(j[0]), float(v[0]))
        if not j[0] > 0.0:
            raise NoSolution("the freedom has no inertia")
        self.push = -float(slope[0])
        self.drift: dict[int, float] = {}

    def orbit(self) -> Orbit:
        """The orbit. Raises NoSolution where it cannot be told: an equilibrium, a limit position of the joint."""
        start = self.branch.start
        small = 1e-12 * max(abs(self.energy), abs(self.first[2]), 1e-300)
        if self.rate == 0.0 and abs(self.push) <= small:
            raise NoSolution("it stands in an equilibrium")
        sign = 1 if (self.rate or self.push) > 0 else -1
        ahead = self.reach(sign, self.duration * MARGIN)
        if ahead.what == "turn":
            cells = 4
            low = OFFSET * TURN / cells
            return Orbit("turn", low, low + TURN, TURN, True, cells, start, sign=sign)
        if self.rate == 0.0:
            behind = _End("corner", start, 0.0, 0.0)
        elif ahead.what == "corner":
            behind = self.reach(-sign, self.duration * MARGIN - 2.0 * ahead.time)
        else:
            slow = self.rate**2 < 0.2 * ahead.fastest**2
            behind = self.reach(-sign, self.duration, most=4) if slow else _End("time", start, 0.0, 0.0)
        if ahead.what == "corner" and behind.what == "corner":
            low, high = sorted((ahead.phi, behind.phi))
            middle, radius = 0.5 * (low + high), 0.5 * (high - low)
            x0 = float(np.arccos(np.clip((middle - start) / radius, -1.0, 1.0)))
            if self.rate == 0.0:
                x0 = 0.0 if start == low else np.pi
            return Orbit("swing", 0.0, np.pi, x0, sign > 0, 2, middle, radius)
        if ahead.what == "corner" or behind.what == "corner":
            toward = ahead.what == "corner"
            corner = ahead.phi if toward else behind.phi
            away = -sign if toward else sign
            far = behind.phi if toward else ahead.phi
            x0 = float(np.sqrt(abs(start - corner))) * (-1.0 if toward else 1.0)
            high = float(np.sqrt(abs(far - corner)))
            high = max(high, abs(x0))
            return Orbit("run", x0, high, x0, True, _cells(far - corner), corner, sign=away, square=True)
        length = abs(ahead.phi - start)
        return Orbit("run", 0.0, length, 0.0, True, _cells(length), start, sign=sign)

    def reach(self, sign: int, budget: float, most: int = 10**9) -> _End:
        """Go on until a turning point, a full turn after which everything repeats, or the end of the time."""
        phi, _, v = self.first
        w, time, fastest, count = abs(self.rate), 0.0, abs(self.rate), 0
        for new, j_new, v_new in self._nodes(sign):
            square = 2.0 * (self.energy - v_new) / j_new
            if square <= 0.0:
                corner = self._corner(phi, new)
                return _End("corner", corner, time + 2.0 * abs(corner - phi) / max(w, 1e-300), fastest)
            w_new = float(np.sqrt(square))
            time += 2.0 * abs(new - phi) / (w + w_new)
            fastest, count = max(fastest, w_new), count + 1
            phi, v, w = new, v_new, w_new
            around = self.branch.turn is not None and abs(phi - self.branch.start) > TURN - 1e-9
            if around and abs(self.drift[sign]) <= SAME * max(abs(self.energy), abs(v)):
                return _End("turn", phi, time, fastest)
            if time > budget or count >= most:
                break
        return _End("time", phi, time, fastest)

    def _nodes(self, sign: int) -> Iterator[tuple[float, float, float]]:
        """phi, J, V one after the other; after a full turn those of the first turn again, shifted by its work."""
        b = self.branch
        seen: list[tuple[float, float, float]] = []
        if b.turn is None:
            ends = range(b.first + 1, len(b.phi)) if sign > 0 else range(b.first - 1, -1, -1)
            known = [(b.phi[i], b.q[i], b.u[i]) for i in ends]
            for phi, q, u in known:
                j, v, _ = self.energies(q[None], u[None])
                seen.append((phi, float(j[0]), float(v[0])))
                yield seen[-1]
            while True:
                phi = b.extend(sign)
                k = len(b.phi) - 1 if sign > 0 else 0
                j, v, _ = self.energies(b.q[k][None], b.u[k][None])
                seen.append((phi, float(j[0]), float(v[0])))
                turned = b.close_turn(sign)
                if turned:
                    self.drift[sign] = seen[-1][2] - self.first[2]
                yield seen[-1]
                if turned:
                    break
        else:
            phis = b.start + sign * TURN * np.linspace(0.0, 1.0, 33)[1:]
            j, v, _ = self.energies(*b.at(phis))
            seen = [(float(x), float(y), float(z)) for x, y, z in zip(phis, j, v, strict=True)]
            self.drift[sign] = seen[-1][2] - self.first[2]
            yield from seen
        for turn in range(1, MOST_TURNS):
            for phi, jk, vk in seen:
                yield phi + sign * turn * TURN, jk, vk + turn * self.drift[sign]

    def _corner(self, inside: float, outside: float) -> float:
        """The turning point between two phi: Newton, kept between them."""
        good, bad = inside, outside
        phi = 0.5 * (good + bad)
        for _ in range(60):
            _, v, slope = self.energies(*self.branch.at(np.array([phi])))
            missing = self.energy - float(v[0])
            good, bad = (phi, bad) if missing > 0.0 else (good, phi)
            new = phi + missing / float(slope[0]) if slope[0] else 0.5 * (good + bad)
            room = abs(bad - good)
            if not min(good, bad) - room <= new <= max(good, bad) + room:
                new = 0.5 * (good + bad)
            if abs(new - phi) <= 1e-14 * max(1.0, abs(phi)):
                return new
            phi = new
        return phi


def _cells(length: float) -> int:
    return max(1, int(np.ceil(abs(length))))
