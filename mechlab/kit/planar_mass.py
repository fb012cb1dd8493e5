"""A moving planar linkage as particles: its rods lie between points of the closed-form motion, its sliders at such
points."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mechlab.analytic.assur.plane import Point
from mechlab.analytic.linkage import Linkage, Motion, Step
from mechlab.errors import MechlabError
from mechlab.experiment.entry import CheckResult
from mechlab.kit.mass_check import NOTHING, Particles, State, compare, rod, solid
from mechlab.kit.planar_build import Style, angle_name
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.parts import GROUND


def compare_planar(m: Mechanism, chain: Linkage, positions: Sequence[dict[str, Any]], style: Style) -> CheckResult:
    """Compares the engines with the particles. positions: input of the chain -> angle, rate, acceleration; the first
    position is the reference pose."""
    states = [planar_state(m, chain, chain.solve(**at).require(), style) for at in positions]
    return compare([(m, replace(s, is_reference=s is states[0])) for s in states])


def planar_state(m: Mechanism, chain: Linkage, motion: Motion, style: Style) -> State:
    """The State of one position with rates. Only names and parents of bodies are taken from the mechanism."""
    values, rates = _named(m, motion, style)
    particles = sum(_rods(chain, motion, style), NOTHING) + sum(_blocks(chain, motion, style), NOTHING)
    points = {n: _upright(z.p) for n, z in motion.points.items()}
    return State(values, rates, particles, points, (0.0, 0.0, -style.gravity), len(chain.inputs))


def rods(chain: Linkage) -> Iterator[tuple[str, str]]:
    """Pairs (link, point): a rod from the first pin of the link to the point.

    Raises MechlabError for a slotted link without a point.
    """
    pointed = {s.uses[0] for s in chain.steps if s.kind == "point"}
    for s in chain.steps:
        if s.kind in ("crank", "geared", "RRP"):
            yield s.makes[0], s.makes[1]
        elif s.kind == "point":
            yield s.uses[0], s.name
        elif s.kind == "RRR":
            yield from ((link, s.name) for link in s.makes[:2])
        elif s.kind == "III":  # three legs, and a plate from its first corner to the others
            yield from zip(s.makes[:3], s.makes[4:], strict=True)
            yield from ((s.makes[3], corner) for corner in s.makes[5:])
        elif s.kind == "IV":  # two forks, and two rods between their ends
            first, second, near, far, c, d, b, e = s.makes
            yield from ((first, c), (first, d), (second, b), (second, e), (near, b), (far, e))
        elif s.kind == "RPR" and s.name not in pointed:
            raise MechlabError(
                f"{chain.name}: no point says how long the slotted link {s.name!r} is; add .point(NAME, {s.name!r}, LENGTH)."
            )


def _rods(chain: Linkage, motion: Motion, style: Style) -> Iterator[Particles]:
    for link, end in rods(chain):
        a, b = motion.bases[link], motion.points[end]
        mass = style.mass_per_length * float(np.abs(b.p - a.p))
        yield rod(mass, _upright(a.p), _upright(b.p), _upright(a.v), _upright(b.v), style.radius)


def _blocks(chain: Linkage, motion: Motion, style: Style) -> Iterator[Particles]:
    """Sliders as particles: boxes at a point, with an edge along a rotating direction."""
    for s in chain.steps:
        for at, angle, rate in _sliders(s, motion):
            along, up = (_upright(np.exp(1j * angle) * z) for z in (1.0, 1j))
            axes = np.column_stack([along, (0.0, 1.0, 0.0), up])
            spread = np.array(style.block) / np.sqrt(12.0)
            yield solid(style.slider_mass, _upright(at.p), spread, axes, _upright(at.v), (0.0, -rate, 0.0))


def _sliders(s: Step, motion: Motion) -> Iterator[tuple[Point, Any, Any]]:
    """Point, direction [rad] and rate of the direction [rad/s] of each slider of a group."""
    if s.kind == "RRP":
        turn = motion.guides[s.uses[1]].angle
        yield motion.points[s.name], turn.x, turn.v
    elif s.kind == "RPR":
        turn = motion.turns[s.name]
        yield motion.points[s.uses[1]], turn.x, turn.v
    elif s.kind == "PRP":
        for guide in s.uses:
            turn = motion.guides[guide].angle
            yield motion.points[s.name], turn.x, turn.v
    elif s.kind == "RPP":  # the second carries the pin, the first lies back along the cross slide
        turn, cross, pin = motion.guides[s.uses[1]].angle, motion.slides[f"{s.name}_2"], motion.points[s.uses[0]]
        angle = turn.x + s.sizes[0]
        way = cross.x * np.exp(1j * angle)
        rate = (cross.v + 1j * turn.v * cross.x) * np.exp(1j * angle)
        yield Point(pin.p - way, pin.v - rate, pin.a), turn.x, turn.v
        yield pin, angle, turn.v


def _named(m: Mechanism, motion: Motion, style: Style) -> tuple[dict[str, Any], dict[str, Any]]:
    """Values and rates of all joints and shafts: absolute angles of links, angles relative to the parent link,
    slides."""
    parent = {b.name: b.parent for b in m.bodies}
    turns = {link: (float(t.x), float(t.v)) for link, t in motion.turns.items()}
    found = {angle_name(link, style): t for link, t in turns.items()}
    found |= {f"{n}_slide": (float(s.x), float(s.v)) for n, s in motion.slides.items()}
    for link, (angle, rate) in turns.items():
        if parent[link] != GROUND:
            above, above_rate = turns[parent[link]]
            found[f"{link}_joint"] = (angle - above, rate - above_rate)
    return {n: x for n, (x, _) in found.items()}, {n: v for n, (_, v) in found.items()}


def _upright(z: Any) -> Array:
    """A vector x + i y of the linkage's plane in the world: (x, 0, y)."""
    return np.array([np.real(z), 0.0, np.imag(z)], dtype=float)


def bars_state(
    values: Mapping[str, Sequence[Any]],
    ends: Mapping[str, tuple[complex, complex]],
    bars: Iterable[tuple[str, str, float, float]],
    gravity: float,
) -> State:
    """The State of a linkage of one degree of freedom made of uniform round bars, in a vertical plane.

    values: joint or shaft -> value, rate, ... ends: point -> position [m], velocity [m/s] as x + i y, y upwards. bars:
    (point, point, mass [kg], radius [m]). gravity [m/s2]: positive downwards.
    """
    at = {n: (_upright(z), _upright(dz)) for n, (z, dz) in ends.items()}
    parts = (rod(mass, at[a][0], at[b][0], at[a][1], at[b][1], radius) for a, b, mass, radius in bars)
    angles, rates = ({n: float(x[k]) for n, x in values.items()} for k in (0, 1))
    return State(angles, rates, sum(parts, NOTHING), {n: z for n, (z, _) in at.items()}, (0.0, 0.0, -gravity), 1)
