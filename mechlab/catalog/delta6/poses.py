"""All joint coordinates of every fidelity from the closed forms: start poses for the engines, poses for the page."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.delta6 import cardan_angles, drives_from_angles, inverse_position
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.parameters import Delta6Parameters, legs
from mechlab.experiment.recording import Recording
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array


def coordinates(p: Delta6Parameters, fidelity: str, centre: ArrayLike, angles: ArrayLike) -> Array:
    """(n, nq) coordinates for head centres O (n, 3) and angles alpha, beta, gamma (n, 3).

    Idle spins of the plain rods are those of the shortest turn. Raises NoSolution out of reach.
    """
    found = joint_values(p, fidelity, centre, angles)
    return _pack(build(p, fidelity), found, len(found["alpha"]))


def joint_values(p: Delta6Parameters, fidelity: str, centre: ArrayLike, angles: ArrayLike) -> dict[str, Array]:
    """Joint or drive -> its values (n,), quaternions (n, 4), as of `coordinates`."""
    centre, angles = np.atleast_2d(np.asarray(centre, dtype=float)), np.atleast_2d(np.asarray(angles, dtype=float))
    values = _shared(p, centre, angles)
    if fidelity == "minimal":
        values |= _swings(p, centre)
    if fidelity in ("parts", "full"):
        values |= _gears(p, angles)
    if fidelity == "full":
        values |= _cardans(p, centre, angles) | _balls(p, centre)
        values["O_turn"] = np.tile([1.0, 0.0, 0.0, 0.0], (len(centre), 1))
    return values


def _pack(m: Mechanism, values: dict[str, Array], n: int) -> Array:
    q = np.tile(m.reference(), (n, 1))
    for joint in m.joints:
        if joint.name in values:
            value = values[joint.name]
            q[:, m.q_slice[joint.name]] = value if joint.kind == "spherical" else (value - joint.zero)[:, None]
    return q


def _shared(p: Delta6Parameters, centre: Array, angles: Array) -> dict[str, Array]:
    sliders = inverse_position(p.geometry, centre).require()
    shafts = drives_from_angles(p.geometry, angles)
    out = {f"O_{a}": centre[:, k] for k, a in enumerate("xyz")}
    out |= {name: angles[:, k] for k, name in enumerate(("alpha", "beta", "gamma"))}
    for k in range(3):
        out |= {f"q{k + 1}": sliders[:, k], f"phi{k + 1}": shafts[:, k]}
    return out


def _spans(p: Delta6Parameters, centre: Array) -> list[tuple[Array, Array, Array]]:
    """Per leg: unit rod directions (n, 3), the home direction and fork_b."""
    sliders = inverse_position(p.geometry, centre).require()
    out = []
    for leg in legs(p):
        upper = np.column_stack(
            [
                np.full(len(centre), leg.upper[0]),
                np.full(len(centre), leg.upper[1]),
                sliders[:, leg.index - 1] - p.slider_height,
            ]
        )
        out.append(((centre + leg.lower - upper) / p.rod_length, leg.span / p.rod_length, leg.fork_b))
    return out


def _swings(p: Delta6Parameters, centre: Array) -> dict[str, Array]:
    out: dict[str, Array] = {}
    for i, (u, home, b) in enumerate(_spans(p, centre), start=1):
        out[f"swing{i}"] = np.arctan2(u @ np.cross(b, home), u @ home)
        out[f"sway{i}"] = np.arcsin(np.clip(u @ b, -1.0, 1.0))
    return out


def _gears(p: Delta6Parameters, angles: Array) -> dict[str, Array]:
    shafts = drives_from_angles(p.geometry, angles)
    kn, kp, kv = float(p.k_spur), float(p.k_transfer / p.k_spur), float(p.k_bevel)
    out: dict[str, Array] = {}
    for i in (1, 2):
        out[f"rho{i}"] = shafts[:, i - 1] / kn
        out[f"nu{i}"] = (out[f"rho{i}"] - angles[:, 2]) / kp
        out[f"p{i}"] = kv * angles[:, 0]
    return out


def _cardans(p: Delta6Parameters, centre: Array, angles: Array) -> dict[str, Array]:
    shafts = drives_from_angles(p.geometry, angles)
    about_z = shafts * np.array([-1.0, -1.0, 1.0])
    found = cardan_angles(p.geometry, centre, about_z)
    out: dict[str, Array] = {}
    for k in range(3):
        i = k + 1
        out |= {f"fork{i}_a": found.upper_fork[:, k], f"fork{i}_b": found.upper_cross[:, k]}
        out |= {
            f"ankle{i}_b": found.lower_cross[:, k],
            f"ankle{i}_a": found.lower_fork[:, k],
            f"phi{i}_lower": shafts[:, k],
        }
    return out


def _balls(p: Delta6Parameters, centre: Array) -> dict[str, Array]:
    """Shortest turn of each plain rod, as quaternions (n, 4): (1 + u0 . u, u0 x u), normalised."""
    out: dict[str, Array] = {}
    for i, (u, home, _) in enumerate(_spans(p, centre), start=1):
        q = np.column_stack([1.0 + u @ home, np.cross(home, u)])
        out[f"ball{i}"] = q / np.linalg.norm(q, axis=1, keepdims=True)
    return out


def expand(p: Delta6Parameters, recording: Recording) -> tuple[Mechanism, Array]:
    """The `full` mechanism and its coordinates along a recording of any fidelity."""
    full = build(p, "full")
    if recording.fidelity == "full":
        return full, recording.q
    centre = np.column_stack([recording.channel(f"O_{a}") for a in "xyz"])
    angles = np.column_stack([recording.channel(a) for a in ("alpha", "beta", "gamma")])
    return full, coordinates(p, "full", centre, angles)
