"""CPU time of closed forms a position, each beside the same formula in plain numpy: python -m tests.benchmarks --only linkages.

Plain numpy is what a reader of the docstring would write: whole arrays, no checks, no statuses, no mode that is out of reach.
pylinkage (numba, warm) stands beside the four-bar where it is installed.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from mechlab.analytic import assur, delta6, fourbar, gear_linkage
from mechlab.analytic.linkage import Linkage
from mechlab.catalog.class4_linkage import Class4Parameters
from mechlab.catalog.class4_linkage.geometry import family
from tests.benchmarks.rows import Row

BARS = (0.1, 0.3, 0.25, 0.3)
"""Crank, coupler, rocker, ground [m]."""
MANY = 100_000
Array = NDArray[np.float64]


def best(*works: Callable[[], object], repeats: int = 15) -> list[float]:
    """Smallest CPU time of each [s], of runs that alternate: other work on the machine is left out."""
    times = np.full(len(works), np.inf)
    for _ in range(repeats):
        for k, work in enumerate(works):
            start = time.process_time()
            work()
            times[k] = min(times[k], time.process_time() - start)
    return times.tolist()


def direct_fourbar(phi: Array) -> tuple[Array, ...]:
    """Coupler and rocker angle, and the vectors that the rates need."""
    a, b, c, g = BARS
    px, py = a * np.cos(phi), a * np.sin(phi)
    dx, dy = g - px, -py
    square = dx * dx + dy * dy
    x = (square + b * b - c * c) / (2.0 * square)
    y = np.sqrt(b * b / square - x * x)
    rx, ry = x * dx - y * dy, x * dy + y * dx
    sx, sy = rx - dx, ry - dy
    return np.arctan2(ry, rx), np.arctan2(sy, sx), px, py, rx, ry, sx, sy


def direct_motion(phi: Array) -> tuple[Array, ...]:
    """The same with rates and accelerations for the crank rate 1."""
    a, b, c, _ = BARS
    theta, psi, *_ = direct_fourbar(phi)
    det = np.sin(psi - theta)
    w2, w3 = a * np.sin(phi - psi) / (b * det), a * np.sin(phi - theta) / (c * det)
    e2 = (a * np.cos(phi - psi) + b * w2**2 * np.cos(theta - psi) - c * w3**2) / (b * det)
    e3 = (a * np.cos(phi - theta) + b * w2**2 - c * w3**2 * np.cos(psi - theta)) / (c * det)
    return theta, psi, w2, w3, e2, e3


def direct_modes(group: assur.TwoLoops) -> tuple[Array, Array]:
    """Class III and IV: roots t of t A^2 - B C by the companion matrix, u = -t A / B; no Newton, no sorting, no merged modes."""
    w, p, q = group.w, group.p, group.q
    c = np.abs(w) ** 2 + np.abs(p) ** 2 + np.abs(q) ** 2 - group.l**2
    alpha = np.array(np.broadcast_arrays(np.conj(p) * q, np.conj(w) * q))
    beta = np.array(np.broadcast_arrays(w * np.conj(p), c, np.conj(w) * p))
    gamma = np.array(np.broadcast_arrays(w * np.conj(q), p * np.conj(q)))

    def times(x: Array, y: Array) -> Array:
        out = np.zeros((len(x) + len(y) - 1, x.shape[-1]), dtype=complex)
        for i, part in enumerate(x):
            out[i : i + len(y)] += part * y
        return out

    def crossed(x: Array, y: Array) -> Array:
        return times(x[:, 0], y[:, 1]) - times(x[:, 1], y[:, 0])

    a, b, c_ = crossed(alpha, gamma), crossed(alpha, beta), crossed(beta, gamma)
    poly = -times(b, c_)
    poly[1:6] += times(a, a)
    companion = np.zeros((poly.shape[1], 6, 6), dtype=complex)
    companion[:, np.arange(5), np.arange(1, 6)] = 1.0
    companion[:, 5] = (-poly[:6] / poly[6]).T
    t = np.linalg.eigvals(companion)
    a, b = a[..., None], b[..., None]
    u = -t * (a[0] + t * (a[1] + t * a[2])) / (b[0] + t * (b[1] + t * (b[2] + t * b[3])))
    return np.angle(t), np.angle(u)


def direct_gears(g: gear_linkage.GearLinkage, phi: Array) -> list[Array]:
    """Angles, rates and accelerations of coupler, rocker, idler and output gear for the crank rate 1."""
    a, b, c = g.crank, g.coupler, g.rocker
    dx, dy = g.frame - a * np.cos(phi), -a * np.sin(phi)
    f, towards = np.hypot(dx, dy), np.arctan2(dy, dx)
    psi = towards + np.arccos((f * f + b * b - c * c) / (2.0 * b * f))
    chi = towards + np.pi - np.arccos((f * f + c * c - b * b) / (2.0 * c * f))
    s = np.sin(chi - psi)
    w2, w3 = a * np.sin(phi - chi) / (b * s), a * np.sin(phi - psi) / (c * s)
    e2 = (a * np.cos(phi - chi) + b * w2**2 * np.cos(psi - chi) - c * w3**2) / (b * s)
    e3 = (a * np.cos(phi - psi) + b * w2**2 - c * w3**2 * np.cos(chi - psi)) / (c * s)
    out = [psi, chi, w2, w3, e2, e3]
    for i, j, k in gear_linkage.transfer(g):
        out += [i * phi + j * (psi - psi[0]) + k * (chi - chi[0]), i + j * w2 + k * w3, j * e2 + k * e3]
    return out


def direct_delta_inverse(d: delta6.Delta6, position: Array) -> Array:
    """Sliders of the delta."""
    h2 = d.rod_length**2 - np.sum((position[:, None, :2] + d.leg_offsets) ** 2, axis=-1)
    return np.sqrt(h2) + position[:, 2:] + (d.platform_height + d.slider_height)


def direct_delta_forward(d: delta6.Delta6, sliders: Array) -> Array:
    """Head centre of the delta: three spheres."""
    top = sliders - (d.slider_height + d.platform_height)
    centres = np.concatenate([np.broadcast_to(-d.leg_offsets, (len(top), 3, 2)), top[..., None]], axis=-1)
    e, f = centres[:, 1] - centres[:, 0], centres[:, 2] - centres[:, 0]
    n = np.cross(e, f)
    n2 = np.sum(n * n, axis=-1, keepdims=True)
    ee, ff = np.sum(e * e, axis=-1, keepdims=True), np.sum(f * f, axis=-1, keepdims=True)
    arm = (ff * np.cross(n, e) + ee * np.cross(f, n)) / (2.0 * n2)
    drop = np.sqrt((d.rod_length**2 - np.sum(arm * arm, axis=-1, keepdims=True)) / n2) * np.sign(n[:, 2:])
    return centres[:, 0] + arm - drop * n


def direct_delta_drives(d: delta6.Delta6, tool: Array, angles: Array) -> Array:
    """All six drives of the delta for the output link's centre and angles."""
    alpha, beta, gamma = angles.T
    e1 = np.stack([np.cos(gamma) * np.cos(beta), np.sin(gamma) * np.cos(beta), -np.sin(beta)], axis=-1)
    sliders = direct_delta_inverse(d, tool - d.head_offset * e1)
    return np.concatenate([sliders, angles @ delta6.drive_matrix(d).T], axis=-1)


def peer(count: int) -> float | None:
    """Seconds of pylinkage (numba, warm) for positions, velocities and accelerations, or None where it is missing."""
    try:
        import pylinkage as pl
    except ModuleNotFoundError:
        return None
    ground, far = pl.Ground(0.0, 0.0), pl.Ground(0.3, 0.0)
    crank = pl.Crank(ground, 0.1, 2.0 * np.pi / count)
    pin = pl.RRRDyad(crank.output, far, 0.3, 0.25)
    linkage = pl.Linkage([ground, far, crank, pin])
    linkage.step_fast_with_kinematics(iterations=count)
    return best(lambda: linkage.step_fast_with_kinematics(iterations=count))[0]


def row(name: str, count: int, work: Callable[[], object], direct: Callable[[], object], asked: str) -> Row:
    """Work beside plain numpy, in microseconds a position."""
    value, reference = best(work, direct, repeats=4 if "modes" in name else 15)
    return Row(name, 1e6 * value / count, "us a position", "direct numpy", 1e6 * reference / count, asked)


def platform(angle: Array) -> assur.TwoLoops:
    """A class III group on a pin that goes round."""
    pins = (assur.driver(assur.fixed(), 0.1, angle), assur.fixed(0.6, 0.1), assur.fixed(0.2, 0.5))
    return assur.class_three(pins, (0.25, 0.3, 0.28), (0.3 + 0.0j, 0.1 + 0.25j))


def rows() -> list[Row]:
    """The section of the table."""
    phi = np.linspace(-np.pi, np.pi, MANY)
    chain = (
        Linkage("fourbar").pivot("O", 0.0, 0.0).pivot("D", 0.3, 0.0).crank("crank", "O", "A", 0.1)
        .rrr("B", ("coupler", "rocker"), ("A", "D"), (0.3, 0.25))
    )  # fmt: skip
    gears = gear_linkage.GearLinkage(0.2, 0.9, 0.8, 0.3)
    d, rng = delta6.Delta6(), np.random.default_rng(11)
    centre = rng.uniform((-0.04, -0.04, -0.1), (0.04, 0.04, 0.1), (MANY, 3))
    angles = rng.uniform(-0.5, 0.5, (MANY, 3))
    sliders = delta6.inverse_position(d, centre).require()
    turn = np.linspace(-np.pi, np.pi, 7200)
    four, three = family(Class4Parameters())(turn), platform(turn)
    small = phi[:: MANY // 72]

    def composed() -> None:
        for _ in chain.blocks(MANY, crank=(phi, 1.0, 0.0)):
            pass

    works: list[tuple[str, int, Callable[[], object], Callable[[], object], str]] = [
        ("four-bar, positions", MANY, lambda: fourbar.positions(*BARS, phi), lambda: direct_fourbar(phi), "value <= 0.06"),
        ("four-bar, with rates and accelerations", MANY,
         lambda: fourbar.solve(*BARS, phi, 1.0), lambda: direct_motion(phi), "value <= 0.12"),
        ("four-bar as a Linkage, in blocks, with rates and accelerations", MANY,
         composed, lambda: direct_motion(phi), "value <= 0.12"),
        ("four-bar, 72 positions alone, with rates and accelerations", len(small),
         lambda: fourbar.solve(*BARS, small, 1.0), lambda: direct_motion(small), ""),
        ("class III, all modes", len(turn), lambda: assur.all_modes(three), lambda: direct_modes(three), "ratio <= 3"),
        ("class IV, all modes", len(turn), lambda: assur.all_modes(four), lambda: direct_modes(four), "ratio <= 3"),
        ("gear linkage, with rates and accelerations", MANY,
         lambda: gear_linkage.motion(gears, phi), lambda: direct_gears(gears, phi), "ratio <= 3"),
        ("delta, sliders for a position", MANY,
         lambda: delta6.inverse_position(d, centre), lambda: direct_delta_inverse(d, centre), "ratio <= 3"),
        ("delta, position for sliders", MANY,
         lambda: delta6.forward_position(d, sliders), lambda: direct_delta_forward(d, sliders), "ratio <= 3"),
        ("delta, six drives for a pose", MANY,
         lambda: delta6.inverse(d, centre, *angles.T), lambda: direct_delta_drives(d, centre, angles), "ratio <= 3"),
    ]  # fmt: skip
    out = [row(*work) for work in works]
    other = peer(72_000)
    if other is not None:
        out.append(
            Row(
                "four-bar, with rates and accelerations, beside a peer",
                out[1].value,
                "us a position",
                "pylinkage",
                1e6 * other / 72_000,
            )
        )
    return out
