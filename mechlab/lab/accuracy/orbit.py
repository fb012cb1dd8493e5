"""The orbit of one freedom at constant energy: a swing between two turning points, full turns, or a run through a
part of either that fills the duration."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import NoSolution
from mechlab.lab.accuracy.branch import NEARLY_CLOSED, STRIDE, TURN, PoseBranch
from mechlab.lab.accuracy.energies import EnergyFunction, OneJointEnergies
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

TIME_MARGIN = 1.02
MOST_TURNS = 20_000
SAME_ENERGY = 1e-11
OFFSET = 0.381966
"""Share of a cell by which the nodes of a full turn are shifted: poses where assembly modes meet often lie at simple fractions of
a turn, and no node should fall on them."""

AT_TURNING, NEAR_TURNING = 1e-7, 1e-4
"""Nodes nearer than this to a turning point, as shares of the orbit, are at it: the speed there is the root of a difference of energies
that is rounding. Those of a swing fall on its ends; a run may begin a little beside one."""
BESIDE = 1e-8
"""A turning point nearer to the start than this [rad or m] is told by the energy of the start: a difference of poses would be rounding."""
ONE_TURN = TURN * np.linspace(0.0, 1.0, 33)[1:]


@dataclass(frozen=True)
class EnergyOrbit:
    """phi as a smooth function of x on [low, high]; time increases with x.

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

    def turning(self, along: Array) -> NDArray[np.bool_] | None:
        """Where |dphi/dx| vanishes together with the speed, at a turning point; None for an orbit without one."""
        if self.kind != "swing" and not self.square:
            return None
        return np.asarray(along < (AT_TURNING * self.radius if self.kind == "swing" else 2.0 * NEAR_TURNING * self.high))

    def at_turning(self, inertia: Array, force: Array) -> Array:
        """The limit of dt/dx at a turning point, from J and |dV/dphi|."""
        return np.asarray(np.sqrt((self.radius if self.kind == "swing" else 2.0) * inertia / force))


@dataclass(frozen=True)
class _Reached:
    what: str
    phi: float
    time: float
    fastest: float


Node = tuple[float, float, float, float]
"""phi, J, V, dV/dphi."""
CELL = 2.0
"""Length of a cell of a run [rad or m], at most."""
AHEAD = 4
STRAIGHT = 1e-2
"""Nearer than this to the last pose [rad or m], a pose is guessed along the tangent of that one."""


class OrbitSearch:
    """Follows the branch from its start until the orbit of the motion within `duration` [s] is known. beside [rad or m]: distance of the
    turning point behind a slow start, J rate^2 / (2 |dV/dphi|)."""

    def __init__(self, branch: PoseBranch, energies: EnergyFunction, rate: float, duration: float) -> None:
        self.branch, self.energies, self.duration = branch, energies, duration
        at = branch.first
        if isinstance(energies, OneJointEnergies):
            j, v, slope = energies.at(branch.start)
        else:
            j, v, slope = (float(x[0]) for x in energies(branch.q[at][None], branch.u[at][None]))
        self.rate = rate
        self.energy = 0.5 * j * rate**2 + v
        self.beside = 0.5 * j * rate**2 / abs(slope) if slope else math.inf
        self.first = (branch.start, j, v)
        if not j > 0.0:
            raise NoSolution("the freedom has no inertia")
        self.push = -slope
        self.drift: dict[int, float] = {}

    def orbit(self) -> EnergyOrbit:
        """The orbit. Raises NoSolution in an equilibrium, and where the joint reaches a limit position."""
        start = self.branch.start
        small = 1e-12 * max(abs(self.energy), abs(self.first[2]), 1e-300)
        if self.rate == 0.0 and abs(self.push) <= small:
            raise NoSolution("it stands in an equilibrium")
        sign = 1 if (self.rate or self.push) > 0 else -1
        ahead = self.reach(sign, self.duration * TIME_MARGIN)
        if ahead.what == "turn":
            cells = 4
            low = OFFSET * TURN / cells
            return EnergyOrbit("turn", low, low + TURN, TURN, True, cells, start, sign=sign)
        if self.rate == 0.0:
            behind = _Reached("corner", start, 0.0, 0.0)
        elif ahead.what == "corner":
            behind = self.reach(-sign, self.duration * TIME_MARGIN - 2.0 * ahead.time)
        else:
            slow = self.rate**2 < 0.2 * ahead.fastest**2
            behind = self.reach(-sign, self.duration, most=4) if slow else _Reached("time", start, 0.0, 0.0)
        if ahead.what == "corner" and behind.what == "corner":
            low, high = sorted((ahead.phi, behind.phi))
            middle, radius = 0.5 * (low + high), 0.5 * (high - low)
            if not radius:
                raise NoSolution("it stands in an equilibrium")
            near = low if start < middle else high
            x0 = 2.0 * math.asin(math.sqrt(min(0.5 * self._apart(near) / radius, 0.5)))
            return EnergyOrbit("swing", 0.0, math.pi, x0 if near == low else math.pi - x0, sign > 0, 1, middle, radius)
        if ahead.what == "corner" or behind.what == "corner":
            toward = ahead.what == "corner"
            corner = ahead.phi if toward else behind.phi
            outward = -sign if toward else sign
            far = behind.phi if toward else ahead.phi
            x0 = math.sqrt(self._apart(corner)) * (-1.0 if toward else 1.0)
            high = float(np.sqrt(abs(far - corner)))
            high = max(high, abs(x0))
            return EnergyOrbit("run", x0, high, x0, True, _cells(far - corner), corner, sign=outward, square=True)
        length = abs(ahead.phi - start)
        return EnergyOrbit("run", 0.0, length, 0.0, True, _cells(length), start, sign=sign)

    def _apart(self, corner: float) -> float:
        """Distance of the start from a turning point, by the energy where it is small."""
        apart = abs(self.branch.start - corner)
        return self.beside if max(apart, self.beside) < BESIDE else apart

    def reach(self, sign: int, budget: float, most: int = 10**9) -> _Reached:
        """Follow the motion to a turning point, a full turn after which everything repeats, or the end of `budget` [s]."""
        phi, _, v = self.first
        w, time, fastest, count = abs(self.rate), 0.0, abs(self.rate), 0
        slope = -self.push
        for new, j_new, v_new, slope_new in self._nodes(sign):
            square = 2.0 * (self.energy - v_new) / j_new
            if square <= 0.0:
                corner = self._corner((phi, v, slope), (new, v_new, slope_new))
                if sign * self.push < 0.0 and max(abs(corner - self.branch.start), self.beside) < BESIDE:
                    corner = self.branch.start - math.copysign(self.beside, self.push)
                return _Reached("corner", corner, time + 2.0 * abs(corner - phi) / max(w, 1e-300), fastest)
            w_new = math.sqrt(square)
            time += 2.0 * abs(new - phi) / (w + w_new)
            fastest, count = max(fastest, w_new), count + 1
            phi, v, slope, w = new, v_new, slope_new, w_new
            around = self.branch.turn is not None and abs(phi - self.branch.start) > TURN - 1e-9
            if around and abs(self.drift[sign]) <= SAME_ENERGY * max(abs(self.energy), abs(v)):
                return _Reached("turn", phi, time, fastest)
            if time > budget or count >= most:
                break
        return _Reached("time", phi, time, fastest)

    def _nodes(self, sign: int) -> Iterator[Node]:
        """phi, J, V, dV/dphi pose by pose; after a full turn those of the first turn again, V shifted by the work of a turn."""
        b = self.branch
        seen: list[Node] = []
        if b.turn is None:
            ends = list(range(b.first + 1, len(b.phi)) if sign > 0 else range(b.first - 1, -1, -1))
            if ends:
                seen += self._values_at(ends)
                yield from seen
            ended: list[NoSolution] = []
            while sign not in self.drift:
                before = len(b.phi)
                turned = self._extend(sign, seen[-1] if seen else (*self.first, -self.push), ended)
                more = len(b.phi) - before
                new = (
                    self._values_at(list(range(before, len(b.phi)) if sign > 0 else range(more - 1, -1, -1)))
                    if more
                    else []
                )
                seen += new
                if turned:
                    self.drift[sign] = seen[-1][2] - self.first[2]
                yield from new
                if ended:
                    raise ended[0]
        else:
            phis = b.start + sign * ONE_TURN
            seen = _nodes(phis, *self.energies(*b.at(phis)))
            self.drift[sign] = seen[-1][2] - self.first[2]
            yield from seen
        for turn in range(1, MOST_TURNS):
            for phi, jk, vk, dk in seen:
                yield phi + sign * turn * TURN, jk, vk + turn * self.drift[sign], dk

    def _extend(self, sign: int, last: Node, ended: list[NoSolution]) -> bool:
        """Extend the branch by one pose, or by AHEAD where no turning point is near (many evaluations cost little more than one).
        Returns whether a turn is full; appends to `ended` why the branch ends."""
        _, _, height, slope = last
        near = self.energy - height < 2.0 * AHEAD * STRIDE * sign * slope
        for _ in range(1 if near else AHEAD):
            try:
                self.branch.extend(sign)
            except NoSolution as cause:
                ended.append(cause)
                return False
            if self.branch.close_turn(sign):
                return True
        return False

    def _values_at(self, numbers: list[int]) -> list[Node]:
        """phi, J, V, dV/dphi of the poses with these numbers on the branch."""
        b = self.branch
        phi, q, u = (np.array([x[k] for k in numbers]) for x in (b.phi, b.q, b.u))
        return _nodes(phi, *self.energies(q, u))

    def _corner(self, inside: tuple[float, float, float], outside: tuple[float, float, float]) -> float:
        """The turning point between two (phi, V, dV/dphi): Newton's method from that of the cubic through them, kept between them."""
        good, bad = inside[0], outside[0]
        phi = _crossing(inside, outside, self.energy)
        q, u, last = None, None, phi
        for _ in range(60):
            if isinstance(self.energies, OneJointEnergies):
                _, v, slope = self.energies.at(phi)
            else:
                at = np.array([phi])
                if q is None or u is None or self.branch.turn is not None or abs(phi - last) > STRAIGHT:
                    q, u = self.branch.at(at, NEARLY_CLOSED)
                else:
                    q, u = self.branch.close(at, q + (phi - last) * u, NEARLY_CLOSED)
                _, v, slope = (float(x[0]) for x in self.energies(q, u))
            last, missing = phi, self.energy - v
            good, bad = (phi, bad) if missing > 0.0 else (good, phi)
            new = phi + missing / slope if slope else 0.5 * (good + bad)
            room = abs(bad - good)
            if not min(good, bad) - room <= new <= max(good, bad) + room:
                new = 0.5 * (good + bad)
            # Newton's error is of the order of its last step squared, which is rounding below the root of its unit
            if abs(new - phi) <= 1e-8 * max(1.0, abs(phi)):
                return new
            phi = new
        return phi


def _crossing(inside: tuple[float, float, float], outside: tuple[float, float, float], level: float) -> float:
    """Where the cubic through two (x, y, slope) takes the value `level` between them, to a thousandth of their distance."""
    (x0, y0, d0), (x1, y1, d1) = inside, outside
    h = x1 - x0
    low, high = 0.0, 1.0
    for _ in range(12):
        s = 0.5 * (low + high)
        r = 1.0 - s
        y = r * r * ((1.0 + 2.0 * s) * y0 + s * h * d0) + s * s * ((3.0 - 2.0 * s) * y1 - r * h * d1)
        low, high = (s, high) if y < level else (low, s)
    return x0 + 0.5 * (low + high) * h


def _nodes(phi: Array, inertia: Array, height: Array, slope: Array) -> list[Node]:
    return list(zip(phi.tolist(), inertia.tolist(), height.tolist(), slope.tolist(), strict=True))


def _cells(length: float) -> int:
    return max(1, int(np.ceil(abs(length) / CELL)))
