"""The parts of a planar linkage as one sees them: bars and plates in layers, pins from layer to layer, slotted levers, rails.

The plane is xz; a part in layer k stands `Looks.gap` * k in front of it, towards -y. Looks never change a mass.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field

import numpy as np

from mechlab.analytic.linkage import Linkage
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import GROUND, Placement, shape
from mechlab.mechanism.geometry import Array, axis_rotation
from mechlab.mechanism.parts import Color, Shape

COLORS: tuple[Color, ...] = (
    (0.16, 0.42, 0.75, 1.0), (0.90, 0.55, 0.13, 1.0), (0.20, 0.58, 0.56, 1.0), (0.62, 0.33, 0.64, 1.0),
    (0.80, 0.26, 0.28, 1.0), (0.45, 0.55, 0.20, 1.0),
)  # fmt: skip
DARK: Color = (0.30, 0.33, 0.38, 1.0)
STEEL: Color = (0.62, 0.66, 0.72, 1.0)
UPRIGHT = axis_rotation((1.0, 0.0, 0.0), math.pi / 2)
"""Turns the xy plane of a shape into the plane of the linkage."""
ALONG = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
"""Turns a rail along z with its head at +y to one along x with its head towards the eye."""
LAYERS = 3
BRACKET = -0.85
"""Layer of the bearing blocks of the frame, in bar widths."""
FLAT = 1e-9
"""Pins nearer to one line than this share of their span are on one bar."""


@dataclass
class Looks:
    """Collects what is drawn of each body; `shapes()` has all of it at the end.

    width [m] of the bars; strokes: slide -> (lowest, highest) value [m], see `strokes`.
    """

    width: float
    strokes: Mapping[str, tuple[float, float]]
    lift: dict[str, float] = field(default_factory=lambda: {GROUND: 0.0})
    tips: dict[str, list[complex]] = field(default_factory=dict)
    slots: dict[str, tuple[float, tuple[float, float]]] = field(default_factory=dict)
    more: dict[str, list[Shape]] = field(default_factory=dict)
    pinned: set[tuple[str, complex]] = field(default_factory=set)

    @property
    def gap(self) -> float:
        """Distance of two layers [m]."""
        return 1.2 * self.width

    def link(self, name: str, parent: str, at: complex, tips: Sequence[complex]) -> None:
        """A link on a pin at a point of its parent, with further pins at `tips`."""
        self.lift[name] = self.gap * (len(self.tips) % LAYERS)
        self.tips[name] = list(tips)
        below = BRACKET * self.width if parent == GROUND else self.lift[parent]
        self.pin(name, 0j, below, self.lift[name])
        self.pinned.add((parent, _near(at)))

    def pin(self, body: str, at: complex, one: float, other: float) -> None:
        """A pin of a body from one layer to another [m]."""
        half = 0.55 * self.width
        low, high = min(one, other) - half, max(one, other) + half
        place = Placement.of(UPRIGHT, (at.real, -0.5 * (low + high), at.imag))
        self.more.setdefault(body, []).append(
            shape("cylinder", place, DARK, radius=0.18 * self.width, length=high - low)
        )
        self.pinned.add((body, _near(at)))

    def join(self, a: tuple[str, complex], b: tuple[str, complex]) -> None:
        """The pin of a loop, carried by its first body."""
        self.pin(*a, self.lift[a[0]], self.lift[b[0]])
        self.pinned.add((b[0], _near(b[1])))

    def slotted(self, link: str, block: str, offset: float) -> None:
        """A block in the slot of a link, `offset` [m] to the left of its pin."""
        self.slots[link] = (offset, self.strokes[link])
        self.lift[block] = self.lift[link]
        w = self.width
        self.more.setdefault(block, []).append(
            shape("box", Placement.of(np.eye(3), (0.0, -self.lift[link], 0.0)), STEEL, x=1.5 * w, y=0.9 * w, z=0.62 * w)
        )

    def carriage(self, name: str, body: str, parent: str, foot: complex, angle: float, lift: float) -> None:
        """A carriage of a body on a rail of its parent, through `foot` in the direction `angle` of the parent's plane; `lift` of its
        pin [m]."""
        w, (low, high) = self.width, self.strokes[name]
        length, ends = 2.4 * w, 0.8 * w
        base = Placement.of(ALONG, (0.0, w - lift, 0.0))
        self.more.setdefault(body, []).append(
            shape("carriage", base, DARK, length=length, width=1.4 * w, height=1.25 * w, rail_width=0.5 * w)
        )
        turned = Placement.of(axis_rotation((0.0, -1.0, 0.0), angle), (foot.real, 0.0, foot.imag))
        begin = Placement.of(np.eye(3), (low - 0.5 * length - ends, 0.0, 0.0))
        self.more.setdefault(parent, []).append(
            shape("rail", turned @ begin @ base, STEEL, length=high - low + length + 2.0 * ends, width=0.5 * w)
        )
        self.lift[body] = lift

    def shapes(self) -> dict[str, tuple[Shape, ...]]:
        """Body (and the ground) -> all that is drawn of it."""
        out = {name: list(items) for name, items in self.more.items()}
        for number, (name, tips) in enumerate(self.tips.items()):
            drawn = _flat(self, name, tips, COLORS[number % len(COLORS)])
            for tip in tips:
                if (name, _near(tip)) not in self.pinned:
                    self.pin(name, tip, self.lift[name], self.lift[name])
            out[name] = [*drawn, *self.more.get(name, [])]
        return {name: tuple(items) for name, items in out.items()}


def _near(at: complex) -> complex:
    return complex(round(at.real, 9), round(at.imag, 9))


def _flat(looks: Looks, name: str, tips: Sequence[complex], color: Color) -> list[Shape]:
    """The bar of a link; three bars as a triangle, or a plate where they would fill it or it has more pins; a slotted bar where
    a block slides in it."""
    w, back = looks.width, (0.0, -looks.lift[name], 0.0)
    thickness, bore = 0.5 * w, 0.18 * w
    found: list[Shape] = []
    rest = [t for t in tips if abs(t) > FLAT * w]
    if name in looks.slots:
        offset, (low, high) = looks.slots[name]
        on = [t.real for t in rest if abs(t.imag - offset) <= FLAT * w and t.real > 0.0]
        eyes = 1.0 if offset == 0.0 else 0.0
        length = max([*on, high + w])
        place = Placement.of(UPRIGHT, (0.0, back[1], offset))
        found.append(shape("slotted_link", place, color, length=length, width=1.3 * w, thickness=thickness, bore=eyes * bore,
                           slot_low=low, slot_high=high, slot_width=0.66 * w))  # fmt: skip
        rest = [t for t in rest if t.real not in on]
        if offset and not rest:
            rest = [1j * offset]
    corners = np.array([0j, *rest])
    across = float(np.max(np.abs(np.imag(corners * np.conj(rest[0]))))) / abs(rest[0]) if rest else 0.0
    if len(rest) == 2 and _inner_radius(corners) > w:
        sides = [(a, b) for a, b in zip(corners, np.roll(corners, -1), strict=True)]
        return [*found, *(_bar(a, b, back[1], color, w, thickness, bore) for a, b in sides)]
    if len(rest) > 1 and across > FLAT * abs(rest[0]):
        places = {f"{axis}_{k}": v for k, c in enumerate(corners, 1) for axis, v in (("x", c.real), ("y", c.imag))}
        plate = Placement.of(UPRIGHT, back)
        return [*found, shape("plate_link", plate, color, points=len(corners), width=w, thickness=thickness, bore=bore, **places)]
    return [*found, *(_bar(0j, tip, back[1], color, w, thickness, bore) for tip in rest)]


def _bar(a: complex, b: complex, y: float, color: Color, width: float, thickness: float, bore: float) -> Shape:
    turned = axis_rotation((0.0, -1.0, 0.0), float(np.angle(b - a))) @ UPRIGHT
    place = Placement.of(turned, (float(a.real), y, float(a.imag)))
    return shape("link", place, color, length=abs(b - a), width=width, thickness=thickness, bore=bore)


def _inner_radius(corners: Array) -> float:
    """Radius of the circle inside a triangle of three points."""
    a, b, c = corners
    around = abs(b - a) + abs(c - b) + abs(a - c)
    return float(abs(np.imag(np.conj(b - a) * (c - a)))) / around if around else 0.0


def bracket(at: complex, width: float) -> Shape:
    """The bearing block of the frame at a fixed pivot."""
    place = Placement.of(UPRIGHT, (at.real, width, at.imag))
    return shape("bracket", place, DARK, height=3.0 * width, width=1.6 * width, thickness=0.8 * width)


TURN = np.linspace(0.0, 2.0 * math.pi, 73)


def strokes(linkage: Linkage, inputs: Mapping[str, float], own: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Slide -> (lowest, highest) value [m] while each crank turns once, the others standing at `inputs`, as far as the linkage
    assembles; `own`: values at `inputs`, which count too."""
    found = {name: [float(x)] for name, x in own.items()}
    if not own:
        return {}
    for crank in inputs:
        motion = linkage.solve(**{k: (x + TURN if k == crank else np.full(len(TURN), x)) for k, x in inputs.items()})
        closed = np.logical_and.reduce([np.broadcast_to(d.assembles, TURN.shape) for d in motion.dyads.values()])
        for name in found:
            found[name] += np.broadcast_to(motion.slides[name].x, TURN.shape)[closed].tolist()
    return {name: (min(values), max(values)) for name, values in found.items()}
