"""A recording that shows the modes one after another, with all loops closed in every frame."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.recording import Finding, Health, Recording, basic_channels
from mechlab.experiment.scene import Settings
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics, integrate
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import newton
from mechlab.studies.modes.eigen import OSCILLATING, RIGID, UNSTABLE, VibrationMode
from mechlab.studies.modes.result import ModesResult

SECONDS, SWINGS, FRAMES = 4.0, 4, 80
"""For each mode: duration [s], number of oscillations, number of frames."""


LARGEST_TURN, LARGEST_SHIFT = 0.35, 0.12
"""Largest amplitude: of a joint [rad], and of a centre of mass relative to the size of the mechanism."""


MOST = 8


def mode_motion(result: ModesResult, chosen: Sequence[int] = ()) -> Recording:
    """A Recording of the chosen modes (numbers from 1; default: the slowest that are not rigid, at most eight).

    Motion of each: q = rest + a w(t) Re(shape exp(i phase(t))) with w = sin^2 over its SECONDS; every frame is
    assembled again. The time scale is that of the display, not of the mode; the findings give the frequency of each
    mode and its start in the recording. Raises MechlabError for a number that does not exist.
    """
    numbers = list(chosen) or _default(result.modes)
    for k in numbers:
        if not 1 <= k <= len(result.modes):
            raise MechlabError(f"{result.name}: mode {k} does not exist; modes are numbered 1 to {len(result.modes)}.")
    m = result.mechanism
    amplitudes, q, findings = {}, [result.q], []
    total = len(numbers) * FRAMES + 1
    t = np.linspace(0.0, max(1, len(numbers)) * SECONDS, total)
    for place, k in enumerate(numbers):
        mode = result.modes[k - 1]
        size = _amplitude(m, result.q, np.real(mode.shape))
        s = np.arange(1, FRAMES + 1) / FRAMES
        envelope = size * np.sin(math.pi * s) ** 2
        turns = SWINGS if mode.kind == OSCILLATING else 1
        swing = envelope[:, None] * np.real(mode.shape * np.exp(2j * math.pi * turns * s)[:, None])
        q += [_closed(m, integrate(m, result.q, x)) for x in swing]
        wave = np.zeros(total)
        wave[place * FRAMES + 1 : (place + 1) * FRAMES + 1] = envelope * np.cos(2 * math.pi * turns * s)
        amplitudes[f"mode_{k}"] = wave
        findings.append(_finding(k, mode, place * SECONDS))
    poses = np.array(q if numbers else [result.q])
    v = np.zeros((len(poses), m.nv))
    channels, units = basic_channels(m, poses, v)
    return Recording(
        m, t, poses, v, channels | amplitudes, units | dict.fromkeys(amplitudes, ""), Health(tuple(findings)),
        settings=Settings(engine="analytic"), scene=f"modes about {result.scene}", name=result.name, fidelity=result.fidelity,
        parameters=dict(result.parameters), versions=dict(result.versions),
    )  # fmt: skip


def shown_modes(result: ModesResult, chosen: Sequence[int] = ()) -> list[tuple[int, float, float]]:
    """(number, start, end) [s] of every mode in the recording that `mode_motion` makes of the chosen ones."""
    numbers = list(chosen) or _default(result.modes)
    return [(k, place * SECONDS, (place + 1) * SECONDS) for place, k in enumerate(numbers)]


def _default(found: tuple[VibrationMode, ...]) -> list[int]:
    lively = [k for k, m in enumerate(found, 1) if m.kind != RIGID]
    return (lively or list(range(1, len(found) + 1)))[:MOST]


def _finding(k: int, mode: VibrationMode, start: float) -> Finding:
    what = f"{mode.frequency_hz:.5g} Hz" + (f", damping {mode.damping:.3g}" if mode.damping else "")
    if mode.kind == UNSTABLE:
        what = f"grows with {mode.growth:.4g} 1/s"
    elif mode.kind == RIGID:
        what = "no stiffness"
    text = f"{start:g} to {start + SECONDS:g} s: mode {k}, {mode.kind}, {what}; tempo and size are of the picture"
    severity = "warning" if mode.kind == UNSTABLE else "ok"
    return Finding(f"mode_{k}", mode.omega, 0.0, "rad/s", severity, text)


def _amplitude(m: Mechanism, q: Array, shape: Array) -> float:
    """Factor of the shape (nv,) that reaches the first of LARGEST_TURN and LARGEST_SHIFT; 1 where nothing moves."""
    points = _centres(m, q)
    size = float(np.max(np.ptp(np.vstack([points, np.zeros((1, 3))]), axis=0))) or 1.0
    h = 1e-4
    moved = float(np.max(np.linalg.norm(_centres(m, integrate(m, q, h * shape)) - points, axis=1))) / h
    slides = [m.v_slice[name].start for name in m.slides]
    turn = float(np.max(np.abs(np.delete(shape, slides)), initial=0.0))
    limits = [
        LARGEST_SHIFT * size / moved if moved > 1e-9 else math.inf,
        LARGEST_TURN / turn if turn > 1e-9 else math.inf,
    ]
    least = min(limits)
    return least if math.isfinite(least) else 1.0


def _centres(m: Mechanism, q: Array) -> Array:
    tree = TreeKinematics(m, q)
    out = []
    for body in m.bodies:
        rotation, origin = tree.pose(body.name)
        out += [origin, origin + rotation @ np.array(body.inertia.com)]
    return np.array(out)


def _closed(m: Mechanism, q: Array) -> Array:
    tree, constraints = TreeKinematics(m), ConstraintSet(m)
    if not len(constraints):
        return q
    found = newton(
        lambda x: (constraints.residual(tree.set(x)), constraints.jacobian(tree)), lambda x, dv: integrate(m, x, dv), q
    )
    return found.q
