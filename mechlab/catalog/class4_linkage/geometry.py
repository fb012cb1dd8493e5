"""Parameters of the class IV linkage as the source prints them, and its closed form: the group for a crank angle, its modes."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic import assur
from mechlab.analytic.linkage import Linkage, Motion
from mechlab.catalog.bibliography import ZINCHENKO
from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.parameters import parameter
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

SOURCE = f"{ZINCHENKO.label}, step 2"


@dataclass(frozen=True)
class Class4Parameters:
    """Crank OA, ternary links A-C-D and F-B-E, binary links C-B and D-E; pivots O = (0, 0) and F."""

    OA: float = parameter(0.279, "m", "crank (link 1)", source=SOURCE, low=0, strict=True)
    AC: float = parameter(0.985, "m", "link 2, A to C", source=SOURCE, low=0, strict=True)
    AD: float = parameter(0.251, "m", "link 2, A to D", source=SOURCE, low=0, strict=True)
    CAD: float = parameter(math.radians(37.3), "rad", "link 2, from AC to AD, counter-clockwise", source=SOURCE)
    BC: float = parameter(0.3, "m", "link 3, C to B", source=SOURCE, low=0, strict=True)
    DE: float = parameter(0.554, "m", "link 4, D to E", source=SOURCE, low=0, strict=True)
    EF: float = parameter(1.3, "m", "link 5, F to E", source=SOURCE + ", decimal comma lost in the scan, as in step 6", low=0, strict=True)
    BF: float = parameter(2.06, "m", "link 5, F to B", source=SOURCE, low=0, strict=True)
    BFE: float = parameter(math.radians(28.1), "rad", "link 5, from FB to FE, counter-clockwise", source=SOURCE)
    F: tuple[float, float] = parameter(
        (0.0, -1.08), "m", "pivot of link 5: x, y", source=SOURCE + ", decimal comma lost in the scan"
    )
    mode: int = parameter(
        1, "", "+1: both dyads of the source clockwise (K = +1), -1: both counter-clockwise", low=-1, high=1
    )
    mass_per_length: float = parameter(1.0, "kg/m", "mass of the uniform bars", low=0, strict=True)
    gravity: float = parameter(0.0, "m/s2", "gravity, downwards; the source gives none")
    speed: float = parameter(1.0, "rad/s", "crank speed of the scenes", source=f"{ZINCHENKO.label}, step 3")
    start: float = parameter(-math.pi, "rad", "crank angle at which the scenes start", source=f"{ZINCHENKO.label}, step 3")


LINKS = ("link2", "link5", "link3", "link4")
JOINTS = ("C", "D", "B", "E")
THETAS = ("theta2", "theta3", "theta4", "theta5")


def ternaries(p: Class4Parameters) -> tuple[tuple[complex, complex], tuple[complex, complex]]:
    """Joints C, D of link 2 and B, E of link 5, each in the axes of its link."""
    return (
        (complex(p.AC), complex(p.AD * np.exp(1j * p.CAD))),
        (complex(p.BF), complex(p.EF * np.exp(1j * p.BFE))),
    )


def group(p: Class4Parameters, angle: ArrayLike, rate: ArrayLike = 1.0, accel: ArrayLike = 0.0) -> assur.TwoLoops:
    """The class IV group at crank angles, with the crank's rate and acceleration."""
    if len(p.F) != 2:
        raise MechlabError(f"class4_linkage: F must be two numbers, x and y of the pivot [m], got {p.F!r}.")
    pin = assur.driver(assur.fixed(), p.OA, angle, rate, accel)
    first, second = ternaries(p)
    return assur.class_four(pin, assur.fixed(*p.F), first, second, (p.BC, p.DE))


def family(p: Class4Parameters) -> assur.Family:
    """Crank angles to groups at unit crank rate."""
    return lambda angle: group(p, angle)


def linkage(p: Class4Parameters, mode: int) -> Linkage:
    """The linkage as a chain: crank and one class IV group. mode: sign of det J x rank among modes of that sign."""
    first, second = ternaries(p)
    return (
        Linkage("class4_linkage").pivot("O", 0.0, 0.0).pivot("F", *p.F).crank("crank", "O", "A", p.OA)
        .class_four("group", LINKS, ("A", "F"), first, second, (p.BC, p.DE), mode, JOINTS)
    )  # fmt: skip


@dataclass(frozen=True)
class Mode:
    """One or many positions in one mode: angles, rates, accelerations by name; points; sides of the two dyads; det J."""

    angles: dict[str, assur.Scalar]
    points: dict[str, assur.Point]
    k1: Array
    k2: Array
    det: Array


def positive(angle: ArrayLike) -> Array:
    """The same angle in [0, 2 pi)."""
    return np.asarray(np.asarray(angle, dtype=float) % (2.0 * np.pi))


def describe_mode(
    p: Class4Parameters, g: assur.TwoLoops, pin: assur.Point, theta2: ArrayLike, theta5: ArrayLike
) -> Mode:
    """A mode from its two angles. theta2 is from A to C, theta3 C to B, theta4 D to E, theta5 F to B, in [0, 2 pi).

    K1 = +1 where C, B, F of dyad 3-5 run clockwise, (B - C) x (F - C) < 0; K2 = +1 where A, C, B of dyad 2-3 do.
    """
    found = assur.mode_rates(g, np.asarray(theta2, dtype=float), np.asarray(theta5, dtype=float))
    first, second = ternaries(p)
    pivot = assur.fixed(*p.F)
    c, d = (assur.rigid(pin, found.theta_t, abs(x), np.angle(x)) for x in first)
    b, e = (assur.rigid(pivot, found.theta_u, abs(x), np.angle(x)) for x in second)
    turn = [assur.Scalar(z.x + np.pi, z.v, z.a) for z in found.links]
    angles = {
        "theta2": _in_turn(found.theta_t), "theta3": _in_turn(turn[0]), "theta4": _in_turn(turn[1]), "theta5": _in_turn(found.theta_u),
    }  # fmt: skip
    k1 = -np.sign(np.imag(np.conj(b.p - c.p) * (pivot.p - c.p)))
    k2 = -np.sign(np.imag(np.conj(c.p - pin.p) * (b.p - pin.p)))
    return Mode(angles, {"A": pin, "B": b, "C": c, "D": d, "E": e}, k1, k2, found.det)


def _in_turn(s: assur.Scalar) -> assur.Scalar:
    return assur.Scalar(positive(s.x), s.v, s.a)


@dataclass(frozen=True)
class GroupSolution:
    """All modes over positions (...): theta2, theta5, det (..., 6) padded with NaN; count; K1, K2 (..., 6); `chosen`
    (...): index of the mode that the parameters select, -1 where nothing assembles."""

    modes: assur.Modes
    k1: Array
    k2: Array
    chosen: np.ndarray


def solve_all(p: Class4Parameters, angle: ArrayLike) -> GroupSolution:
    """All modes at crank angles (...), and the one that the parameter `mode` selects: K1 = K2 = mode. Where several
    modes or none have these signs, det J with the sign of `mode` decides, then the smallest theta2."""
    angle = np.asarray(angle, dtype=float)
    g = group(p, angle)
    modes = assur.all_modes(g)
    pin = assur.driver(assur.fixed(), p.OA, angle)
    z = describe_mode(p, group(p, angle[..., None]), _spread(pin), modes.theta_t, modes.theta_u)
    sign = 1 if p.mode >= 0 else -1
    present = ~np.isnan(modes.theta_t)
    score = 4.0 * ((z.k1 == sign) & (z.k2 == sign)) + 2.0 * (np.sign(modes.det) == sign) - 0.1 * np.arange(6)
    score = np.where(present, score, -np.inf)
    chosen = np.where(modes.count > 0, np.argmax(score, axis=-1), -1)
    return GroupSolution(modes, z.k1, z.k2, chosen)


def _spread(point: assur.Point) -> assur.Point:
    return assur.Point(*(np.asarray(x)[..., None] for x in (point.p, point.v, point.a)))


def label(k1: float, k2: float, taken: list[str]) -> str:
    """Name of a mode by the sides of its dyads; a second one of the same sides gets a number."""
    sign = {1: "+1", -1: "-1", 0: "0"}
    same = k1 == k2
    name = f"K={sign[int(k1)]}" if same else f"K1={sign[int(k1)]} K2={sign[int(k2)]}"
    count = sum(1 for t in taken if t == name or t.startswith(f"{name} ("))
    return name if not count else f"{name} ({count + 1})"


def at(p: Class4Parameters, angle: ArrayLike, rate: ArrayLike = 1.0, accel: ArrayLike = 0.0) -> Mode:
    """The chosen mode at crank angles (n,) or one. Raises NoSolution where there is none."""
    angle = np.asarray(angle, dtype=float)
    found = solve_all(p, angle)
    if np.any(found.chosen < 0):
        raise NoSolution(f"class4_linkage: no assembly exists at {np.count_nonzero(found.chosen < 0)} crank angles.")
    index = found.chosen[..., None]
    t, u = (np.take_along_axis(x, index, axis=-1)[..., 0] for x in (found.modes.theta_t, found.modes.theta_u))
    rate, accel = np.broadcast_to(rate, angle.shape), np.broadcast_to(accel, angle.shape)
    pin = assur.driver(assur.fixed(), p.OA, angle, rate, accel)
    return describe_mode(p, group(p, angle, rate, accel), pin, t, u)


@lru_cache(maxsize=64)
def arcs(p: Class4Parameters) -> tuple[tuple[float, float], ...]:
    """Arcs of crank angle without any assembly."""
    return assur.empty_arcs(family(p))


def start_angle(p: Class4Parameters) -> float:
    """Crank angle of the start [rad]: `start`, or an angle at most 0.2 rad behind the arc without assembly that `start`
    lies in. Raises NoSolution when the linkage closes at no crank angle."""
    for low, high in arcs(p):
        if high - low >= 2.0 * math.pi - 1e-9:
            raise NoSolution(
                "class4_linkage: no assembly exists at any crank angle; restore a length towards the default."
            )
        inside = (p.start - low) % (2.0 * math.pi)
        if inside <= high - low:
            return p.start + (high - low - inside) + min(0.2, 0.25 * (2.0 * math.pi - (high - low)))
    return p.start


def motion_at(p: Class4Parameters, angle: float) -> tuple[Linkage, Motion]:
    """The linkage in the mode chosen at this crank angle [rad], and its motion. Raises NoSolution: none exists."""
    found = solve_all(p, angle)
    k = int(found.chosen)
    if k < 0:
        raise NoSolution(f"class4_linkage: no assembly exists at the crank angle {math.degrees(angle):.6g} deg.")
    det = found.modes.det[: int(found.modes.count)]
    sign = 1 if det[k] > 0 else -1
    rank = int(np.count_nonzero(np.sign(det[: k + 1]) == sign))
    chain = linkage(p, sign * rank)
    motion = chain.solve(crank=angle)
    for name in LINKS:
        motion.turns[name] = _in_turn(motion.turns[name])
    return chain, motion
