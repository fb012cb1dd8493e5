"""The platform: parameters, closed form of drives to all poses (class III) and of pose to drives (dyads), the Mechanism of
three cranks, three legs and the platform, and its scenes."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic import assur
from mechlab.analytic.linkage import Linkage
from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.entry import SceneRecipe
from mechlab.experiment.laws import ComputedTorque
from mechlab.experiment.motion import Sine
from mechlab.experiment.parameters import parameter
from mechlab.experiment.recording import Recording
from mechlab.experiment.scene import Scene, Settings
from mechlab.kit.checks import closed_form_recording
from mechlab.kit.planar_build import Style, mechanism_of
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array

AZIMUTHS = (math.radians(-150.0), math.radians(-30.0), math.radians(90.0))
EQUAL = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class PlatformParameters:
    """Base pivots and platform corners at azimuths about the centres of base and platform, three chains crank, leg. Radii and
    lengths are common ones, times a ratio for each chain: all ratios 1 and the usual azimuths make the regular platform."""

    base: float = parameter(0.5, "m", "radius of the base pivots", low=0, strict=True)
    platform: float = parameter(0.15, "m", "radius of the platform corners", low=0, strict=True)
    crank: float = parameter(0.3, "m", "driven cranks", low=0, strict=True)
    leg: float = parameter(0.3, "m", "legs", low=0, strict=True)
    base_ratios: tuple[float, ...] = parameter(
        EQUAL, "", "radius of each base pivot as a multiple of base", low=0, strict=True
    )
    base_azimuths: tuple[float, ...] = parameter(
        AZIMUTHS, "rad", "directions of the base pivots from the base's centre"
    )
    platform_ratios: tuple[float, ...] = parameter(
        EQUAL, "", "radius of each platform corner as a multiple of platform", low=0, strict=True
    )
    platform_azimuths: tuple[float, ...] = parameter(
        AZIMUTHS, "rad", "directions of the corners from the platform's centre at alpha = 0"
    )
    crank_ratios: tuple[float, ...] = parameter(EQUAL, "", "each crank as a multiple of crank", low=0, strict=True)
    leg_ratios: tuple[float, ...] = parameter(EQUAL, "", "each leg as a multiple of leg", low=0, strict=True)
    home_x: float = parameter(0.0, "m", "x of the platform's centre in its home pose")
    home_y: float = parameter(0.0, "m", "y of the platform's centre in its home pose")
    home_alpha: float = parameter(0.0, "rad", "angle of the platform in its home pose")
    elbow: int = parameter(
        1, "", "+1: elbows left of the way from base pivot to platform corner, -1: right", low=-1, high=1
    )
    mode: int = parameter(1, "", "assembly mode: 1 is the nearest to the home pose, 2 the next, up to 6", low=1, high=6)
    mass_per_length: float = parameter(1.0, "kg/m", "mass of the uniform bars", low=0, strict=True)
    gravity: float = parameter(9.81, "m/s2", "gravity, downwards")
    amplitude: float = parameter(0.25, "rad", "swing of the drives in the driven scene")
    frequency: float = parameter(3.0, "rad/s", "angular frequency of the swing", low=0, strict=True)

    @property
    def pivots(self) -> Array:
        """(3,) complex base pivots."""
        return self.base * np.array(self.base_ratios) * np.exp(1j * np.array(self.base_azimuths))

    @property
    def corners(self) -> Array:
        """(3,) complex corners from the centre of the platform, in its axes."""
        return self.platform * np.array(self.platform_ratios) * np.exp(1j * np.array(self.platform_azimuths))

    @property
    def plate(self) -> tuple[complex, complex]:
        """The 2nd and 3rd corner seen from the 1st."""
        c = self.corners
        return complex(c[1] - c[0]), complex(c[2] - c[0])

    @property
    def cranks(self) -> tuple[float, float, float]:
        """Lengths of the cranks [m]."""
        a, b, c = (self.crank * r for r in self.crank_ratios)
        return a, b, c

    @property
    def legs(self) -> tuple[float, float, float]:
        """Lengths of the legs [m]."""
        a, b, c = (self.leg * r for r in self.leg_ratios)
        return a, b, c


DRIVES = ("drive_1", "drive_2", "drive_3")
POSE = ("x", "y", "alpha")
LINKS = ("leg_1", "leg_2", "leg_3", "platform")
MERGING = 1e-9


@dataclass(frozen=True)
class PlatformMode:
    """Pose of one mode over positions: centre of the platform, its angle in (-pi, pi], det J, and whether rates exist."""

    centre: assur.Point
    alpha: assur.Scalar
    det: Array

    def values(self) -> dict[str, Array]:
        """x, y, alpha with _rate and _accel."""
        c, a = self.centre, self.alpha
        out: dict[str, Array] = {}
        for order, z, s in (("", c.p, a.x), ("_rate", c.v, a.v), ("_accel", c.a, a.a)):
            out |= {f"x{order}": np.real(z), f"y{order}": np.imag(z), f"alpha{order}": s}
        return out


def linkage(p: PlatformParameters, mode: int = 1) -> Linkage:
    """Three cranks and one class III group in the `mode` of the compositor."""
    chain = Linkage("platform_3rrr")
    for k, z in enumerate(p.pivots):
        chain = chain.pivot(f"A{k + 1}", float(z.real), float(z.imag))
    for k in range(3):
        chain = chain.crank(f"arm_{k + 1}", f"A{k + 1}", f"B{k + 1}", p.cranks[k])
    chain = chain.class_three("group", LINKS, ("B1", "B2", "B3"), p.legs, p.plate, mode, ("P1", "P2", "P3"))
    return chain.point("centre", "platform", *_back(p))


def _back(p: PlatformParameters) -> tuple[float, float]:
    """Distance and direction of the centre from the first corner, in the axes of the platform."""
    first = p.corners[0]
    return float(abs(first)), float(np.angle(-first))


def elbows(
    p: PlatformParameters, drives: ArrayLike, rates: ArrayLike = 0.0, accels: ArrayLike = 0.0
) -> tuple[assur.Point, ...]:
    """The three crank pins for drive angles (3, ...)."""
    drives = np.asarray(drives, dtype=float)
    rates, accels = np.broadcast_to(rates, drives.shape), np.broadcast_to(accels, drives.shape)
    pivots = [assur.fixed(z.real, z.imag) for z in p.pivots]
    return tuple(
        assur.driver(a, crank, *args) for a, crank, *args in zip(pivots, p.cranks, drives, rates, accels, strict=True)
    )


def group(p: PlatformParameters, pins: tuple[assur.Point, ...]) -> assur.TwoLoops:
    """The class III group on three pins."""
    return assur.class_three((pins[0], pins[1], pins[2]), p.legs, p.plate)


def mode_of(p: PlatformParameters, pins: tuple[assur.Point, ...], leg: ArrayLike, alpha: ArrayLike) -> PlatformMode:
    """Pose with rates of a mode given by the angles of leg 1 and platform."""
    found = assur.mode_rates(group(p, pins), np.asarray(leg, dtype=float), np.asarray(alpha, dtype=float))
    corner = assur.rigid(pins[0], found.theta_t, p.legs[0])
    centre = assur.rigid(corner, found.theta_u, *_back(p))
    return PlatformMode(centre, found.theta_u, found.det)


def order(p: PlatformParameters, pins: tuple[assur.Point, ...], modes: assur.Modes) -> np.ndarray:
    """(..., 6) order of the modes by |centre - home| + platform |alpha - home_alpha|, missing ones last."""
    first = assur.Point(*(np.asarray(x)[..., None] for x in (pins[0].p, pins[0].v, pins[0].a)))
    corner = first.p + p.legs[0] * np.exp(1j * modes.theta_t)
    centre = corner - p.corners[0] * np.exp(1j * modes.theta_u)
    turned = (modes.theta_u - p.home_alpha + np.pi) % (2 * np.pi) - np.pi
    away = np.abs(centre - complex(p.home_x, p.home_y)) + p.platform * np.abs(turned)
    return np.asarray(np.argsort(np.where(np.isnan(away), np.inf, away), axis=-1))


def inverse(
    p: PlatformParameters, centre: assur.Point, alpha: assur.Scalar, elbow: tuple[int, int, int]
) -> tuple[assur.Dyad, assur.Dyad, assur.Dyad]:
    """Dyads crank-leg of the three chains for a pose; their first angle is the drive."""
    found = []
    for k, z in enumerate(p.pivots):
        corner = assur.rigid(centre, alpha, float(abs(p.corners[k])), float(np.angle(p.corners[k])))
        found.append(assur.rrr(assur.fixed(z.real, z.imag), corner, p.cranks[k], p.legs[k], elbow[k]))
    return found[0], found[1], found[2]


@lru_cache(maxsize=64)
def home(p: PlatformParameters) -> tuple[float, float, float]:
    """Drive angles [rad] of the home pose. Raises NoSolution when the chains do not reach it."""
    k = p.elbow or 1
    dyads = inverse(p, assur.fixed(p.home_x, p.home_y), assur.scalar(p.home_alpha), (k, k, k))
    for i, d in enumerate(dyads):
        if not bool(d.assembles):
            corner = complex(p.home_x, p.home_y) + p.corners[i] * np.exp(1j * p.home_alpha)
            raise NoSolution(
                "platform_3rrr: crank and leg do not reach from the base pivot to the platform in the home pose; expected "
                f"|crank - leg| <= distance <= crank + leg, got crank {p.cranks[i]:g}, leg {p.legs[i]:g}, "
                f"distance {abs(corner - p.pivots[i]):g} m of chain {i + 1}. Choose other lengths, or home_x, home_y, home_alpha."
            )
    return tuple(float(d.angles[0].x) for d in dyads)  # type: ignore[return-value]


def track(p: PlatformParameters, drives: Array, rates: Array, accels: Array) -> tuple[Array, Array]:
    """Angles of leg 1 and platform (n,) along drive angles (3, n), from the home pose on, in one assembly mode.

    Raises NoSolution where that mode ends: no mode with the same sign of det J lies near the extrapolation.
    """
    modes = assur.all_modes(group(p, elbows(p, drives, rates, accels)))
    pins = elbows(p, drives)
    k = int(order(p, pins, modes)[0, 0])
    sign = np.sign(modes.det[0, k])
    path = [np.array([modes.theta_t[0, k], modes.theta_u[0, k]])]
    for i in range(1, drives.shape[1]):
        guess = 2 * path[-1] - path[-2] if i > 1 else path[-1]
        here = np.column_stack([modes.theta_t[i], modes.theta_u[i]])
        miss = (here - guess + np.pi) % (2 * np.pi) - np.pi
        size = np.where(np.sign(modes.det[i]) == sign, np.max(np.abs(miss), axis=1), np.inf)
        best = int(np.nanargmin(size))
        if not size[best] < 0.05:
            raise NoSolution(
                f"platform_3rrr: the assembly mode ends between the samples {i - 1} and {i} of the drives."
            )
        path.append(guess + miss[best])
    x = np.array(path)
    return x[:, 0], x[:, 1]


def style(p: PlatformParameters) -> Style:
    """Masses and looks; the platform's angle is `alpha`, the cranks' angles the drives."""
    names = {f"arm_{k + 1}": DRIVES[k] for k in range(3)} | {"platform": "alpha"}
    return Style(p.mass_per_length, gravity=p.gravity, width=0.08 * p.leg, names=names)


def linkage_at(p: PlatformParameters, drives: Array) -> Linkage:
    """The chain in the compositor's mode that is the nearest to the home pose at these drive angles (3,)."""
    pins = elbows(p, drives)
    modes = assur.all_modes(group(p, pins))
    k = int(order(p, pins, modes)[0])
    sign = 1 if modes.det[k] > 0 else -1
    return linkage(p, sign * int(np.count_nonzero(np.sign(modes.det[: k + 1]) == sign)))


@lru_cache(maxsize=32)
def build(p: PlatformParameters, fidelity: str) -> Mechanism:
    """Seven parts, two loops, three freedoms; the home pose is the reference."""
    inputs = {f"arm_{k + 1}": a for k, a in enumerate(home(p))}
    return mechanism_of(
        linkage_at(p, np.array(home(p))), inputs, style(p), "planar parallel platform 3-RRR (class III)"
    )


def _motions(p: PlatformParameters) -> tuple[Sine, ...]:
    """Each drive swings about its home angle, a third of a turn behind the one before."""
    return tuple(Sine(p.amplitude, p.frequency, -2.0 * math.pi * k / 3.0, a) for k, a in enumerate(home(p)))


def driven(p: PlatformParameters, fidelity: str) -> Scene:
    """The drives follow their swing by inverse dynamics."""
    motions = _motions(p)
    law = ComputedTorque(DRIVES, tuple(zip(DRIVES, motions, strict=True)), ((1e4, 200.0),) * 3)
    start = {n: m.at(0.0) for n, m in zip(DRIVES, motions, strict=True)}
    return Scene(
        "driven-cranks", fidelity, 2.0 * math.pi / p.frequency, (law,), {n: x[0] for n, x in start.items()},
        {n: x[1] for n, x in start.items()}, tolerance=1e-5, settings=Settings(timeconst=4.0),
    )  # fmt: skip


def free(p: PlatformParameters, fidelity: str) -> Scene:
    """The platform is let go in its home pose."""
    return Scene(
        "free-run", fidelity, 0.25, (), dict(zip(DRIVES, home(p), strict=True)), {}, tolerance=1e-4, drives="free"
    )


def reference(p: PlatformParameters, scene: Scene) -> Recording:
    """The driven scene in closed form. Raises MechlabError for the free run."""
    law = scene.laws[0] if scene.laws else None
    if not isinstance(law, ComputedTorque):
        raise MechlabError(f"platform_3rrr: scene {scene.name!r} has no closed form; engines: mujoco, pinocchio.")
    m = build(p, "minimal")
    t = np.linspace(0.0, scene.duration, 721)
    motion = np.array([[f.at(float(x)) for x in t] for _, f in law.commands])
    angle, rate, accel = (motion[:, :, k] for k in range(3))
    leg, alpha = track(p, angle, rate, accel)
    found = assur.mode_rates(group(p, elbows(p, angle, rate, accel)), leg, alpha)
    turns = (found.theta_t, *found.links)
    value = {"platform_joint": alpha - leg}
    speed = {"platform_joint": found.theta_u.v - found.theta_t.v}
    for k, name in enumerate(DRIVES):
        value |= {name: angle[k], f"leg_{k + 1}_joint": np.unwrap(turns[k].x) - angle[k]}
        speed |= {name: rate[k], f"leg_{k + 1}_joint": turns[k].v - rate[k]}
    q = np.column_stack([value[j.name] - j.zero for j in m.joints])
    q -= 2 * np.pi * np.round(q[0] / (2 * np.pi))
    v = np.column_stack([speed[j.name] for j in m.joints])
    return closed_form_recording(m, scene, t, q, v)


SCENES = {
    "driven-cranks": SceneRecipe(driven, "minimal", "the drives swing about the home pose, by inverse dynamics"),
    "free-run": SceneRecipe(free, "minimal", "the platform falls from its home pose"),
}
