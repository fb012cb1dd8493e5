"""Positions, rates and accelerations of the three-gear four-bar, in closed form and, for the rates, by rolling alone.

A = (0, 0) crank pivot, D = (frame, 0) rocker pivot, B crank pin, C joint of coupler and rocker; angles run counter-clockwise
from A -> D. Gear a is fixed on the crank and centred at B, idler c is free at C, output gear d is free at D:
coupler = ra + rc, rocker = rc + rd. Mode +1: C lies left of the line from B to D.

With i = ra / rd, j = rc / rd and w = d/d(crank angle):

    w_out = i - (i + j) w_coupler + (1 + j) w_rocker,
    angle_out = i phi - (i + j) (coupler angle - its start) + (1 + j) (rocker angle - its start),

the start being crank angle 0. Source: gear-lever mechanisms in printing machines (three-gear linkage).

`rolling_rates` is an independent model to check this: the positions come from an intersection of circles, the joint C
has the velocity that keeps both rods rigid, and at each pitch point both gears have the same velocity along the common tangent.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.analytic.blocks import FloatArray, flattened, piece, pieces
from mechlab.analytic.fourbar import loop_rates
from mechlab.errors import MechlabError, NoSolution
from mechlab.lazy_dataclass import dataclass

TURN_TOLERANCE = 1e-12
FLAT = 2e-12
"""Four times the area of the triangle BCD over coupler times rocker (twice the sine of the transmission angle): without rates below."""

Vector = tuple[FloatArray, FloatArray]


@dataclass(frozen=True)
class GearLinkage:
    """Lengths [m] and assembly mode of a three-gear four-bar whose crank turns fully.

    Raises MechlabError for lengths that leave a gear without radius, NoSolution when the crank cannot turn fully: it is
    at most min(coupler + rocker - frame, frame - |coupler - rocker|). At that length itself there is a change point.
    """

    crank: float
    coupler: float
    rocker: float
    idler_radius: float
    frame: float = 1.0
    mode: int = 1

    def __post_init__(self) -> None:
        for name in ("coupler", "rocker", "idler_radius", "frame"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise MechlabError(f"{name} = {value!r}; expected a length greater than zero")
        if not (math.isfinite(self.crank) and self.crank >= 0.0):
            raise MechlabError(f"crank = {self.crank!r}; expected a length of at least zero")
        if self.mode not in (1, -1):
            raise MechlabError(f"mode = {self.mode!r}; expected +1 (C left of the way from B to D) or -1")
        if self.idler_radius >= min(self.coupler, self.rocker):
            raise MechlabError(
                f"idler_radius = {self.idler_radius:g} m leaves no room for the other gears; expected less than the "
                f"shorter of coupler and rocker, {min(self.coupler, self.rocker):g} m"
            )
        if self.crank > self.longest_crank * (1.0 + TURN_TOLERANCE) or self.longest_crank <= 0.0:
            can = (
                f"it turns fully up to {self.longest_crank:.9g} m"
                if self.longest_crank > 0.0
                else "no crank turns fully with this coupler, rocker and frame"
            )
            raise NoSolution(
                f"crank = {self.crank:.9g} m does not turn fully: {can}, "
                "min(coupler + rocker - frame, frame - |coupler - rocker|)"
            )

    @property
    def longest_crank(self) -> float:
        """Crank length at which the modes meet (change point) [m]; shorter cranks turn fully."""
        return longest_crank(self.coupler, self.rocker, self.frame)

    @property
    def radii(self) -> tuple[float, float, float]:
        """Pitch radii of gear a (on the crank), idler c and output gear d [m]."""
        return self.coupler - self.idler_radius, self.idler_radius, self.rocker - self.idler_radius

    @property
    def ratio(self) -> float:
        """i = ra / rd: turns of the output for one turn of the crank."""
        ra, _, rd = self.radii
        return ra / rd

    @property
    def idler_ratio(self) -> float:
        """rc / rd."""
        _, rc, rd = self.radii
        return rc / rd

    @property
    def at_change_point(self) -> bool:
        """True when the crank has the length at which coupler and rocker come into one line with the frame."""
        return self.crank >= self.longest_crank * (1.0 - TURN_TOLERANCE)


@dataclass(frozen=True)
class LinkageMotion:
    """Answer of `motion`, arrays in the broadcast shape of the inputs. Angles [rad] are continuous in the crank angle;
    rates and accelerations are NaN exactly where `regular` is False: there coupler and rocker are in one line."""

    coupler_angle: FloatArray
    rocker_angle: FloatArray
    idler_angle: FloatArray
    output_angle: FloatArray
    coupler_rate: FloatArray
    rocker_rate: FloatArray
    idler_rate: FloatArray
    output_rate: FloatArray
    coupler_accel: FloatArray
    rocker_accel: FloatArray
    idler_accel: FloatArray
    output_accel: FloatArray
    transmission_angle: FloatArray
    regular: NDArray[np.bool_]


def longest_crank(coupler: float, rocker: float, frame: float = 1.0) -> float:
    """min(coupler + rocker - frame, frame - |coupler - rocker|) [m]; not positive when no crank turns fully."""
    return min(coupler + rocker - frame, frame - abs(coupler - rocker))


def angles(g: GearLinkage, crank_angle: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Coupler and rocker angle and the angle BCD [rad], continuous in the crank angle (they return after each turn).

    The half angles of the triangle BCD are taken from Heron's product, which keeps its digits where it is flat.
    """
    phi = np.asarray(crank_angle, dtype=float)
    return _angles(g, *_triangle(g, phi)[1:])


def _triangle(g: GearLinkage, phi: FloatArray) -> tuple[Vector, Vector, FloatArray, FloatArray]:
    """Vectors A -> B and B -> D, the length of B -> D, and four times the area of the triangle BCD."""
    pin = g.crank * np.cos(phi), g.crank * np.sin(phi)
    way = g.frame - pin[0], -pin[1]
    b, c, f = g.coupler, g.rocker, np.hypot(*way)
    return pin, way, f, np.sqrt(np.maximum((b + c - f) * (f - b + c) * (f + b - c) * (b + c + f), 0.0))


def _angles(g: GearLinkage, way: Vector, f: FloatArray, area: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    b, c, f2 = g.coupler, g.rocker, f * f
    towards = np.arctan2(way[1], way[0])
    at_b = np.arctan2(area, f2 + (b - c) * (b + c))
    at_d = np.arctan2(area, f2 - (b - c) * (b + c))
    at_c = np.arctan2(area, b * b + c * c - f2)
    return towards + g.mode * at_b, towards + np.pi - g.mode * at_d, at_c


def motion(
    g: GearLinkage, crank_angle: ArrayLike, crank_rate: ArrayLike = 1.0, crank_accel: ArrayLike = 0.0
) -> LinkageMotion:
    """Motion of all parts for a given crank motion; arguments broadcast. Rates [rad/s], accelerations [rad/s2].

    With crank_rate 1 and crank_accel 0 the rates are the transfer functions w and e of the source.
    """
    given = [np.asarray(x, dtype=float) for x in (crank_angle, crank_rate, crank_accel)]
    for name, x in zip(("crank_angle", "crank_rate", "crank_accel"), given, strict=True):
        if not np.all(np.isfinite(x)):
            raise MechlabError(f"{name} holds values that are not finite; expected finite numbers")
    shape, inputs = flattened(*given)
    count = math.prod(shape)
    found: dict[str, Any] = {name: np.empty(count) for name in LinkageMotion.__dataclass_fields__}
    found["regular"] = np.ones(count, dtype=bool)
    psi0, chi0, _ = angles(g, 0.0)
    gears = dict(zip(("idler", "output"), transfer(g), strict=True))
    for part in pieces(count):
        phi, w, e = (piece(x, part) for x in inputs)
        pin, way, f, area = _triangle(g, phi)
        psi, chi, found["transmission_angle"][part] = _angles(g, way, f, area)
        if not np.min(area, initial=1.0) > FLAT * g.coupler * g.rocker:
            regular = found["regular"][part] = area > FLAT * g.coupler * g.rocker
            area, f = np.where(regular, area, np.nan), np.where(regular, f, 1.0)
        half = 0.5 / (f * f)
        x, y = 0.5 + (g.coupler - g.rocker) * (g.coupler + g.rocker) * half, g.mode * area * half
        bar = x * way[0] - y * way[1], x * way[1] + y * way[0]
        lever = bar[0] - way[0], bar[1] - way[1]
        rates = loop_rates(pin, bar, lever, 0.5 * g.mode * area, g.coupler, g.rocker, w, e)
        for kind, crank, two, moved in (
            ("angle", phi, (psi, chi), (psi - psi0, chi - chi0)),
            ("rate", w, rates[:2], rates[:2]),
            ("accel", e, rates[2:], rates[2:]),
        ):
            found[f"coupler_{kind}"][part], found[f"rocker_{kind}"][part] = two
            for name, (of_crank, of_coupler, of_rocker) in gears.items():
                found[f"{name}_{kind}"][part] = of_crank * crank + of_coupler * moved[0] + of_rocker * moved[1]
    return LinkageMotion(**{name: values.reshape(shape) for name, values in found.items()})


def transfer(g: GearLinkage) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Coefficients of crank, coupler and rocker turns in those of the idler and of the output gear.

    Idler: w_c = -(ra/rc) + (1 + ra/rc) w_coupler; output: i, -(i + j), 1 + j.
    """
    ra, rc, rd = g.radii
    i, j = ra / rd, rc / rd
    return (-ra / rc, 1.0 + ra / rc, 0.0), (i, -(i + j), 1.0 + j)


def rolling_rates(g: GearLinkage, crank_angle: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Rates of idler and output gear for a crank rate of 1 rad/s. (...) -> (...), (...)."""
    phi = np.asarray(crank_angle, dtype=float)
    b = g.crank * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    d = np.zeros_like(b) + [g.frame, 0.0]
    c = _joint(g, b, d)
    vb = _turned(b)
    vc = _rigid(c, b, d, vb)
    ra, rc, _ = g.radii
    first = b + ra / g.coupler * (c - b)
    tangent = _turned(c - b)
    # Gear a turns with the crank: rate 1 about B.
    surface = _dot(vb + _turned(first - b) - vc, tangent)
    idler = surface / _dot(_turned(first - c), tangent)
    second = c + rc / g.rocker * (d - c)
    tangent = _turned(d - c)
    surface = _dot(vc + idler[..., None] * _turned(second - c), tangent)
    return idler, surface / _dot(_turned(second - d), tangent)


def _joint(g: GearLinkage, b: FloatArray, d: FloatArray) -> FloatArray:
    """C (..., 2) where the circles about B and D meet, on the side of the mode."""
    way = d - b
    square = _dot(way, way)
    along = 0.5 * (1.0 + (g.coupler**2 - g.rocker**2) / square)
    across = np.sqrt(np.maximum(g.coupler**2 / square - along**2, 0.0))
    return np.asarray(b + along[..., None] * way + g.mode * across[..., None] * _turned(way))


def _rigid(c: FloatArray, b: FloatArray, d: FloatArray, vb: FloatArray) -> FloatArray:
    """Velocity of C: (v - v_B) . BC = 0 and v . DC = 0."""
    matrix = np.stack([c - b, c - d], axis=-2)
    right = np.stack([_dot(vb, c - b), np.zeros(c.shape[:-1])], axis=-1)
    return np.asarray(np.linalg.solve(matrix, right[..., None])[..., 0])


def _turned(x: FloatArray) -> FloatArray:
    return np.stack([-x[..., 1], x[..., 0]], axis=-1)


def _dot(x: FloatArray, y: FloatArray) -> FloatArray:
    return np.asarray(np.sum(x * y, axis=-1))
