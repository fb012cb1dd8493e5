"""Poses of the delta: joint coordinates of every fidelity from the closed forms, test poses and a test motion, and what
an engine's constraint rows say of rates, accelerations and forces there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.parameters import ANGLES, CENTRE, HEAD_POSE, ROTARY, SLIDERS, Delta6Parameters, legs
from mechlab.engines.protocol import IMPLEMENTATIONS, StatePlant, available, engine
from mechlab.errors import NoSolution
from mechlab.experiment.laws import drive_forces
from mechlab.experiment.recording import Recording
from mechlab.kit.questions import by_name
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism import Mechanism
from mechlab.mechanism.geometry import Array

SHAFT_SENSE = np.array([-1.0, -1.0, 1.0])
"""Rotary drives 1 and 2 turn about -Z, drive 3 about +Z."""


def coordinates(p: Delta6Parameters, fidelity: str, centre: ArrayLike, angles: ArrayLike) -> Array:
    """(n, nq) coordinates of a fidelity for head centres O (n, 3) [m] and angles alpha, beta, gamma (n, 3) [rad].

    The plain rods do not spin: each turns the shortest way from its home direction. Raises NoSolution out of reach.
    """
    m, values = build(p, fidelity), joint_values(p, fidelity, centre, angles)
    q = np.tile(m.reference(), (len(values["alpha"]), 1))
    for joint in m.joints:
        if joint.name in values:
            value = values[joint.name]
            q[:, m.q_slice[joint.name]] = value if joint.kind == "spherical" else (value - joint.zero)[:, None]
    return q


def joint_values(p: Delta6Parameters, fidelity: str, centre: ArrayLike, angles: ArrayLike) -> dict[str, Array]:
    """Joint or drive -> its values (n,), of ball joints quaternions w, x, y, z (n, 4); arguments as of `coordinates`."""
    centre, angles = np.atleast_2d(np.asarray(centre, dtype=float)), np.atleast_2d(np.asarray(angles, dtype=float))
    sliders = closed.inverse_position(p.geometry, centre).require()
    shafts = closed.drives_from_angles(p.geometry, angles)
    values: dict[str, Array] = {}
    for names, columns in ((CENTRE, centre), (ANGLES, angles), (SLIDERS, sliders), (ROTARY, shafts)):
        values |= by_name(names, columns)
    if fidelity == "minimal":
        values |= _swings(p, centre, sliders)
    if fidelity in ("parts", "full"):
        values |= _gears(p, angles, shafts)
    if fidelity == "full":
        values |= _cardans(p, centre, shafts) | _balls(p, centre, sliders)
        values["O_turn"] = np.tile([1.0, 0.0, 0.0, 0.0], (len(centre), 1))
    return values


def _rods(p: Delta6Parameters, centre: Array, sliders: Array) -> list[tuple[Array, Array, Array]]:
    """Per leg: unit rod directions (n, 3), the home direction (3,) and the fork axis fork_b (3,)."""
    out = []
    for leg in legs(p):
        upper = np.empty((len(centre), 3))
        upper[:, :2], upper[:, 2] = leg.upper[:2], sliders[:, leg.index - 1] - p.slider_height
        out.append(((centre + leg.lower - upper) / p.rod_length, leg.span / p.rod_length, leg.fork_b))
    return out


def _swings(p: Delta6Parameters, centre: Array, sliders: Array) -> dict[str, Array]:
    """The two revolutes that carry the rods of a leg in `minimal`."""
    out: dict[str, Array] = {}
    for i, (u, home, b) in enumerate(_rods(p, centre, sliders), start=1):
        out[f"swing{i}"] = np.arctan2(u @ np.cross(b, home), u @ home)
        out[f"sway{i}"] = np.arcsin(np.clip(u @ b, -1.0, 1.0))
    return out


def _gears(p: Delta6Parameters, angles: Array, shafts: Array) -> dict[str, Array]:
    """Central gears rho, planets nu against the carrier, double bevels p against the T-shaped carrier."""
    kn, kp, kv = float(p.k_spur), float(p.k_transfer / p.k_spur), float(p.k_bevel)
    out: dict[str, Array] = {}
    for i in (1, 2):
        out[f"rho{i}"] = shafts[:, i - 1] / kn
        out[f"nu{i}"] = (out[f"rho{i}"] - angles[:, 2]) / kp
        out[f"p{i}"] = kv * angles[:, 0]
    return out


def _cardans(p: Delta6Parameters, centre: Array, shafts: Array) -> dict[str, Array]:
    found = closed.cardan_angles(p.geometry, centre, shafts * SHAFT_SENSE)
    out: dict[str, Array] = {}
    for k in range(3):
        i = k + 1
        out |= {f"fork{i}_a": found.upper_fork[:, k], f"fork{i}_b": found.upper_cross[:, k]}
        out |= {f"ankle{i}_b": found.lower_cross[:, k], f"ankle{i}_a": found.lower_fork[:, k]}
        out[f"phi{i}_lower"] = shafts[:, k]
    return out


def _balls(p: Delta6Parameters, centre: Array, sliders: Array) -> dict[str, Array]:
    """Shortest turn of each plain rod, as quaternions (n, 4): (1 + u0 . u, u0 x u), normalized."""
    out: dict[str, Array] = {}
    for i, (u, home, _) in enumerate(_rods(p, centre, sliders), start=1):
        q = np.column_stack([1.0 + u @ home, np.cross(home, u)])
        out[f"ball{i}"] = q / np.linalg.norm(q, axis=1, keepdims=True)
    return out


def expand(p: Delta6Parameters, recording: Recording) -> tuple[Mechanism, Array]:
    """The `full` mechanism and its coordinates along a recording of any fidelity."""
    full = build(p, "full")
    if recording.fidelity == "full":
        return full, recording.q
    centre, angles = (np.column_stack([recording.channel(n) for n in names]) for names in (CENTRE, ANGLES))
    return full, coordinates(p, "full", centre, angles)


HEAD_CENTRE_SWING = 0.05
"""Swing of the head centre on the test motion, for parameters that reach as far as the source's [m]."""


def reach(p: Delta6Parameters) -> float:
    """Horizontal distance from the home pose to the nearest pose with a horizontal rod [m]."""
    return float(closed.reach_margin(p.geometry, np.zeros(3)))


def without_stops(p: Delta6Parameters) -> Delta6Parameters:
    """The same delta with slider stops that no test motion reaches: the checks do not ask what stops do to a motion."""
    low, high = min(p.slider_min, p.home_reading - 1.0), max(p.slider_max, p.home_reading + 1.0)
    return replace(p, slider_min=low, slider_max=high)


def random_poses(p: Delta6Parameters, count: int, share: float = 0.5, seed: int = 3) -> tuple[Array, Array]:
    """Head centres O (count, 3) within `share` of the reach and angles (count, 3) with |beta| < 1.5 rad."""
    rng = np.random.default_rng(seed)
    radius, turn = share * reach(p) * np.sqrt(rng.random(count)), rng.uniform(-np.pi, np.pi, count)
    centre = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), rng.uniform(-0.1, 0.1, count)])
    return centre, rng.uniform([-3.0, -1.5, -3.0], [3.0, 1.5, 3.0], (count, 3))


def moderate_poses(p: Delta6Parameters, count: int, seed: int) -> tuple[Array, Array, Array]:
    """`random_poses` with 0.7 of their angles, so that |beta| stays below 61 deg; and D of each (count, 3)."""
    centre, angles = random_poses(p, count, seed=seed)
    angles = 0.7 * angles
    return centre, angles, centre + p.head_offset * closed.output_axis(angles)


@dataclass(frozen=True)
class HeadMotion:
    """Head centre and angles with their first and second derivatives, each (n, 3)."""

    centre: Array
    centre_rate: Array
    centre_accel: Array
    angles: Array
    angle_rate: Array
    angle_accel: Array

    @property
    def rate(self) -> Array:
        """(n, 6) rates of O_x, O_y, O_z, alpha, beta, gamma."""
        return np.hstack([self.centre_rate, self.angle_rate])

    @property
    def accel(self) -> Array:
        """(n, 6) their accelerations."""
        return np.hstack([self.centre_accel, self.angle_accel])


def trial_motion(p: Delta6Parameters, t: ArrayLike) -> HeadMotion:
    """All six freedoms at 1 Hz: O swings by about 0.05 m (less where the reach is short), the angles by 0.6, 0.5, 0.4 rad."""
    time = np.asarray(t, dtype=float)[:, None]
    swing = min(HEAD_CENTRE_SWING, 0.35 * reach(p))
    w = 2.0 * np.pi
    parts = []
    for amplitude, phase in (([swing, swing, 0.6 * swing], [0.0, 1.3, 2.1]), ([0.6, 0.5, 0.4], [0.4, 1.7, 2.9])):
        size, x = np.array(amplitude), w * time + np.array(phase)
        parts += [size * np.sin(x), size * w * np.cos(x), -size * w**2 * np.sin(x)]
    return HeadMotion(*parts)


def refuses(ask: Callable[[], object]) -> bool:
    """True when the closed form says that there is no solution."""
    try:
        ask()
    except NoSolution:
        return True
    return False


def plants(mechanism: Mechanism) -> dict[str, StatePlant]:
    """The mechanism in its reference pose as each of three implementations computes it: the numpy tree and the engines that
    are installed, each from its own kinematics and its own constraint rows."""
    return {name: engine(name).plant(mechanism) for name in IMPLEMENTATIONS if not available(name)}


def rows_of(witness: StatePlant, names: Sequence[str]) -> Array:
    """(k, nv) rates of joints or shafts by name from the rates of all coordinates."""
    return np.array([witness.mechanism.row(name) for name in names])


def response(witness: StatePlant, given: Sequence[str] = HEAD_POSE) -> Array:
    """(nv, k) rates of everything per unit rate of each joint or shaft in `given`, by the constraint Jacobian.

    Where local freedoms remain (spins of the plain rods), the smallest rates.
    """
    jacobian, rows = witness.jacobian(), rows_of(witness, given)
    right = np.vstack([np.zeros((len(jacobian), len(rows))), np.eye(len(rows))])
    return np.asarray(np.linalg.lstsq(np.vstack([jacobian, rows]), right, rcond=1e-11)[0])


def gear_matrix(witness: StatePlant) -> Array:
    """(3, 3) K of phi = K (alpha, beta, gamma): rates of the rotary drives per rate of the angles, O held."""
    return (rows_of(witness, ROTARY) @ response(witness))[:, 3:]


Measure: TypeAlias = Callable[[StatePlant], Any]
"""What is computed from a witness at its state: a number or an array of fixed shape."""


def at_poses(
    p: Delta6Parameters, fidelity: str, centre: ArrayLike, angles: ArrayLike, measure: Measure
) -> dict[str, Array]:
    """Witness -> (n, ...) what is measured at rest at each of n poses of a fidelity."""
    poses = coordinates(p, fidelity, centre, angles)
    return {name: np.array([measure(w.set(q)) for q in poses]) for name, w in plants(build(p, fidelity)).items()}


def at_home(p: Delta6Parameters, fidelity: str, measure: Measure) -> dict[str, Any]:
    """Witness -> what is measured in the reference pose."""
    return {name: measure(w) for name, w in plants(build(p, fidelity)).items()}


def moving(
    p: Delta6Parameters, fidelity: str, motion: HeadMotion, measure: Callable[[StatePlant, Array], Array]
) -> dict[str, Array]:
    """Witness -> (n, ...) what is measured on a motion; `measure` gets the witness, which moves, and the six accelerations."""
    poses = coordinates(p, fidelity, motion.centre, motion.angles)
    out = {}
    for name, w in plants(build(p, fidelity)).items():
        found = []
        for q, rate, accel in zip(poses, motion.rate, motion.accel, strict=True):
            found.append(measure(w.set(q, response(w.set(q)) @ rate), accel))
        out[name] = np.array(found)
    return out


def accelerations(witness: StatePlant, values: ArrayLike) -> Array:
    """(nv,) accelerations that keep the constraints and give O and alpha, beta, gamma the accelerations `values` (6,)."""
    matrix = np.vstack([witness.jacobian(), rows_of(witness, HEAD_POSE)])
    right = np.concatenate([-witness.constraint_bias(), np.asarray(values, dtype=float)])
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-11)[0])


def forces(witness: StatePlant, values: ArrayLike, drives: tuple[str, ...]) -> Array:
    """(drives,) forces [N, N m] that give O and alpha, beta, gamma the accelerations `values` (6,) at the present state."""
    return drive_forces(witness, rows_of(witness, HEAD_POSE), np.asarray(values, dtype=float), drives)
