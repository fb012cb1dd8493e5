"""Makes a Mechanism from a planar linkage of Assur groups: a body for each link, loops for each group.

The plane is vertical: x of the linkage is x of the world, y of the linkage is z of the world; all joint axes are
parallel. Link L gives the joint or shaft `L_angle` (its direction in the plane) and, where its first pin moves, the
joint `L_joint`; a slide S gives the joint `S_slide`. Points become frames.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field, replace
from fractions import Fraction

import numpy as np

from mechlab.analytic.linkage import Linkage, Motion, Step
from mechlab.kit.planar_looks import Looks, bracket, strokes
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Builder, Inertia, Mechanism, Placement, prismatic, revolute
from mechlab.mechanism.geometry import IDENTITY, Array, axis_rotation
from mechlab.mechanism.parts import GROUND

AXIS = "-y"
"""Axis of every revolute joint: positive angles are counter-clockwise seen from the front."""


@dataclass(frozen=True)
class Style:
    """Masses and dimensions of the parts. names: link -> name of its angle instead of LINK_angle; width [m] of the
    bars; mass_per_length [kg/m]; drive_stiffness, drive_damping: of the drives of the cranks. A link consists of
    uniform round rods from its first pin to its other points; a slider is a uniform box."""

    mass_per_length: float = 1.0
    slider_mass: float = 0.1
    gravity: float = 9.81
    width: float = 0.02
    names: Mapping[str, str] = field(default_factory=dict)
    drive_stiffness: float = 200.0
    drive_damping: float = 2.0

    @property
    def radius(self) -> float:
        """Radius of the rods [m]."""
        return self.width / 4

    @property
    def block(self) -> tuple[float, float, float]:
        """Edges of a slider [m]: along its guide, along the joint axes, across both."""
        return 2.4 * self.width, 1.2 * self.width, 1.4 * self.width


def angle_name(link: str, style: Style) -> str:
    """Name of the quantity that is the direction of a link."""
    return style.names.get(link, f"{link}_angle")


class _Planar:
    """Collects the parts of the Mechanism, step by step of the linkage."""

    def __init__(
        self, linkage: Linkage, inputs: Mapping[str, float], motion: Motion, style: Style, summary: str
    ) -> None:
        self.linkage, self.motion, self.style = linkage, motion, style
        self.builder = Builder(linkage.name, gravity=(0.0, 0.0, -style.gravity), summary=summary)
        self.where: dict[str, tuple[str, complex]] = {}
        self.tips: dict[str, list[complex]] = {}
        self.path: dict[str, tuple[str, ...]] = {GROUND: ()}
        self.turn: dict[str, float] = {GROUND: 0.0}
        self.guess: dict[str, float] = {}
        self.guides: dict[str, tuple[str, complex, float]] = {}
        own = {name: float(slide.x) for name, slide in motion.slides.items()}
        self.looks = Looks(style.width, strokes(linkage, inputs, own))

    def bodies_of(self, link: str, pin: str, tips: list[complex], phase: float = 0.0) -> None:
        """A link on a pin, with rods to its tips; its coordinate counts from the angle `phase`, for gears."""
        parent, at = self.where[pin]
        style = self.style
        absolute = angle_name(link, style)
        joint = absolute if parent == GROUND else f"{link}_joint"
        value = float(self.motion.turns[link].x)
        tips = tips + self.tips.get(link, [])
        inertia = Inertia()
        for tip in tips:
            end = (tip.real, 0.0, tip.imag)
            inertia = inertia + Inertia.rod(style.mass_per_length * abs(tip), (0.0, 0.0, 0.0), end, style.radius)
        turned = Placement.of(axis_rotation((0.0, -1.0, 0.0), phase), (0.0, 0.0, 0.0)) if phase else IDENTITY
        self.builder.body(
            link, revolute(joint, AXIS, zero=phase), parent=parent, at=(at.real, 0.0, at.imag), turned=turned, inertia=inertia
        )
        self.looks.link(link, parent, at, tips)
        self.path[link] = (*self.path[parent], joint)
        self.turn[link] = value
        self.guess[joint] = value - self.turn[parent] - phase
        if parent != GROUND:
            turning = [n for n in self.path[link] if not n.endswith("_slide")]
            rest = value - sum(self.guess[n] for n in turning)  # constant angles of slots
            self.builder.shaft(absolute, dict.fromkeys(turning, 1), zero=rest)

    def slider(self, name: str, body: str, parent: str, foot: complex, angle: float, value: float) -> None:
        """A block that slides on its parent through `foot` in the direction of `angle`, both in the parent's axes."""
        turned = Placement.of(axis_rotation((0.0, -1.0, 0.0), angle), (0.0, 0.0, 0.0))
        self.builder.body(
            body, prismatic(f"{name}_slide", "x"), parent=parent, at=(foot.real, 0.0, foot.imag), turned=turned,
            inertia=Inertia.box(self.style.slider_mass, *self.style.block),
        )  # fmt: skip
        self.path[body] = (*self.path[parent], f"{name}_slide")
        self.turn[body] = self.turn[parent] + angle
        self.guess[f"{name}_slide"] = value

    def join(self, name: str, a: tuple[str, complex], b: tuple[str, complex]) -> None:
        """Close a loop by a pin between two points of bodies."""
        at_a, at_b = ((z.real, 0.0, z.imag) for _, z in (a, b))
        self.builder.loop(f"pin_{name}", a[0], b[0], at_a, at_b)
        self.looks.join(a, b)

    def gears(self, link: str, other: str, ratio: Fraction) -> None:
        """A link that turns `ratio` times as fast as another one, both seen from the ground."""
        terms = {n: Fraction(1) for n in self.path[link] if not n.endswith("_slide")}
        for n in self.path[other]:
            if not n.endswith("_slide"):
                terms[n] = terms.get(n, Fraction(0)) - ratio
        self.builder.relation(f"gears_{link}", **{n: c for n, c in terms.items() if c})

    def on_rail(
        self, name: str, body: str, parent: str, foot: complex, angle: float, value: float, lift: float
    ) -> None:
        """A slider as a carriage on a rail of its parent; `lift` [m] of its pin."""
        self.slider(name, body, parent, foot, angle, value)
        self.looks.carriage(name, body, parent, foot, angle, lift)

    def drawn(self) -> None:
        """Gives every body what is drawn of it."""
        shapes = self.looks.shapes()
        self.builder.bodies = [replace(b, shapes=shapes.get(b.name, ())) for b in self.builder.bodies]
        self.builder.ground(*shapes.get(GROUND, ()))


def mechanism_of(
    linkage: Linkage,
    inputs: Mapping[str, float],
    style: Style | None = None,
    summary: str = "",
    motion: Motion | None = None,
    finish: Callable[[Builder], object] | None = None,
) -> Mechanism:
    """The Mechanism of a linkage, its reference pose assembled at the `inputs` (crank -> angle) in the linkage's modes.
    finish(builder) adds springs and the like.

    Raises NoSolution where it does not assemble there, MechlabError as the Builder does.
    """
    style = style or Style()
    motion = motion or linkage.solve(**inputs).require()
    plan = _Planar(linkage, inputs, motion, style, summary)
    for step in linkage.steps:
        if step.kind == "point":
            distance, angle = step.sizes
            tip = complex(distance * np.exp(1j * angle))
            plan.tips.setdefault(step.uses[0], []).append(tip)
    for step in linkage.steps:
        _add(plan, step)
    for name, (body, at) in plan.where.items():
        if body != GROUND:
            plan.builder.frame(name, body, (at.real, 0.0, at.imag))
        else:
            plan.builder.ground(bracket(at, style.width))
    plan.drawn()
    held = [angle_name(n, style) for n in linkage.inputs]
    for name in held:
        plan.builder.drive(name, stiffness=style.drive_stiffness, damping=style.drive_damping)
    if finish:
        finish(plan.builder)
    return plan.builder.assemble(plan.guess, hold=held)


def _add(plan: _Planar, s: Step) -> None:
    m = plan.motion
    if s.kind == "pivot":
        plan.where[s.name] = (GROUND, complex(*s.sizes))
    elif s.kind in ("crank", "geared"):
        plan.bodies_of(s.name, s.uses[0], [complex(s.sizes[0])], s.sizes[2] if s.kind == "geared" else 0.0)
        plan.where[s.makes[1]] = (s.name, complex(s.sizes[0]))
        if s.kind == "geared":
            plan.gears(s.name, s.uses[1], s.sizes[1])
    elif s.kind == "point":
        distance, angle = s.sizes
        plan.where[s.name] = (s.uses[0], complex(distance * np.exp(1j * angle)))
    elif s.kind == "guide":
        x, y, angle, offset = s.sizes
        plan.guides[s.name] = (GROUND, complex(x, y) + 1j * offset * np.exp(1j * angle), angle)
    elif s.kind == "guide_on":
        angle, offset = s.sizes
        plan.guides[s.name] = (s.uses[0], complex(1j * offset * np.exp(1j * angle)), angle)
    elif s.kind == "RRR":
        for link, pin, size in zip(s.makes[:2], s.uses, s.sizes, strict=True):
            plan.bodies_of(link, pin, [complex(size)])
        plan.join(s.name, (s.makes[0], complex(s.sizes[0])), (s.makes[1], complex(s.sizes[1])))
        plan.where[s.name] = (s.makes[0], complex(s.sizes[0]))
    elif s.kind == "RRP":
        parent, foot, angle = plan.guides[s.uses[1]]
        plan.bodies_of(s.makes[0], s.uses[0], [complex(s.sizes[0])])
        behind = plan.looks.lift[s.makes[0]] - plan.looks.gap
        plan.on_rail(s.name, f"{s.name}_slider", parent, foot, angle, float(m.slides[s.name].x), behind)
        plan.join(s.name, (s.makes[0], complex(s.sizes[0])), (f"{s.name}_slider", 0j))
        plan.where[s.name] = (f"{s.name}_slider", 0j)
    elif s.kind == "RPR":
        _slotted(plan, s)
    elif s.kind == "PRP":
        for k, guide in enumerate(s.uses):
            parent, foot, angle = plan.guides[guide]
            name = f"{s.name}_{k + 1}"
            lift = plan.looks.lift[parent] + (k + 1) * plan.looks.gap
            plan.on_rail(name, f"{name}_slider", parent, foot, angle, float(m.slides[name].x), lift)
        plan.join(s.name, (f"{s.name}_1_slider", 0j), (f"{s.name}_2_slider", 0j))
        plan.where[s.name] = (f"{s.name}_1_slider", 0j)
    elif s.kind == "RPP":
        parent, foot, angle = plan.guides[s.uses[1]]
        first, second = f"{s.name}_1", f"{s.name}_2"
        lift = plan.looks.lift[parent] + plan.looks.gap
        plan.on_rail(first, f"{first}_slider", parent, foot, angle, float(m.slides[first].x), lift)
        lift += plan.looks.gap
        plan.on_rail(second, f"{second}_slider", f"{first}_slider", 0j, s.sizes[0], float(m.slides[second].x), lift)
        plan.join(s.name, (f"{second}_slider", 0j), plan.where[s.uses[0]])
    elif s.kind == "III":
        _platform(plan, s)
    elif s.kind == "IV":
        _four(plan, s)


def _slotted(plan: _Planar, s: Step) -> None:
    """Adds an RPR group. Its lever extends to its declared points or, without any, to the pin in the reference pose, so
    that it has a shape and a mass."""
    offset = float(s.sizes[0])
    slide = float(plan.motion.slides[s.name].x)
    own = plan.tips.get(s.name, [])
    plan.bodies_of(s.name, s.uses[0], [] if own else [complex(slide, offset)])
    plan.slider(s.name, f"{s.name}_block", s.name, complex(0.0, offset), 0.0, slide)
    plan.looks.slotted(s.name, f"{s.name}_block", offset)
    plan.join(s.name, (f"{s.name}_block", 0j), plan.where[s.uses[1]])


def _platform(plan: _Planar, s: Step) -> None:
    legs, corners = s.sizes
    tips = [0j, *map(complex, corners)]
    for k in range(3):
        plan.bodies_of(s.makes[k], s.uses[k], [complex(legs[k])])
    first = s.makes[4]
    plan.where[first] = (s.makes[0], complex(legs[0]))
    plan.bodies_of(s.makes[3], first, tips[1:])
    for k in (1, 2):
        plan.join(s.makes[4 + k], (s.makes[k], complex(legs[k])), (s.makes[3], tips[k]))
        plan.where[s.makes[4 + k]] = (s.makes[3], tips[k])


def _four(plan: _Planar, s: Step) -> None:
    first, second, lengths = s.sizes
    for link, pin, tips in zip(s.makes[:2], s.uses, (first, second), strict=True):
        plan.bodies_of(link, pin, [complex(x) for x in tips])
    for k in (0, 1):
        plan.where[s.makes[4 + k]] = (s.makes[0], complex(first[k]))
        plan.where[s.makes[6 + k]] = (s.makes[1], complex(second[k]))
    for k in (0, 1):
        plan.bodies_of(s.makes[2 + k], s.makes[4 + k], [complex(lengths[k])])
        plan.join(s.makes[6 + k], (s.makes[2 + k], complex(lengths[k])), (s.makes[1], complex(second[k])))


def coordinates(m: Mechanism, linkage: Linkage, motion: Motion, style: Style) -> tuple[Array, Array]:
    """q (n, nq) and v (n, nv) of a closed-form motion over n positions; angles are continuous along them."""
    value: dict[str, Array] = {}
    rate: dict[str, Array] = {}
    for link, turn in motion.turns.items():
        value[angle_name(link, style)] = np.unwrap(np.atleast_1d(turn.x))
        rate[angle_name(link, style)] = turn.v
    for name, slide in motion.slides.items():
        value[f"{name}_slide"], rate[f"{name}_slide"] = slide.x, slide.v
    n = max(np.size(x) for x in value.values())
    q, v = np.zeros((n, m.nq)), np.zeros((n, m.nv))
    parent = {b.name: b.parent for b in m.bodies}
    for k, joint in enumerate(m.joints):
        if joint.name in value:
            q[:, k], v[:, k] = value[joint.name], rate[joint.name]
        else:
            link = joint.name.removesuffix("_joint")
            up = angle_name(parent[link], style)
            q[:, k] = value[angle_name(link, style)] - value[up]
            v[:, k] = rate[angle_name(link, style)] - rate[up]
        q[:, k] -= joint.zero
        if joint.kind == "revolute":
            q[:, k] -= 2 * np.pi * np.round(q[0, k] / (2 * np.pi))
    return q, v
