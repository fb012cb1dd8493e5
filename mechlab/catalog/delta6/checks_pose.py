"""Checks A3, A7, A13, A14, A16: poses, rates and accelerations, closed forms against the constraint rows of the witnesses."""

from __future__ import annotations

from functools import partial

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.parameters import ANGLES, DRIVES, HEAD_POSE, ROTARY, SLIDERS, SOURCE, Delta6Parameters, legs
from mechlab.catalog.delta6.poses import (
    SHAFT_SENSE,
    Measure,
    accelerations,
    at_poses,
    coordinates,
    gear_matrix,
    moderate_poses,
    moving,
    plants,
    random_poses,
    reach,
    refuses,
    response,
    rows_of,
    trial_motion,
)  # fmt: skip
from mechlab.engines.protocol import StatePlant
from mechlab.experiment.entry import Check, CheckResult
from mechlab.experiment.tree_plant import TreePlant
from mechlab.kit.checked_quantities import CheckedQuantity, check_quantities
from mechlab.mechanism import integrate, newton, singularity
from mechlab.mechanism.geometry import Array

ROUND_TRIPS = 100_000
TIMES = (0.05, 0.37, 0.71)


def a3(p: Delta6Parameters) -> CheckResult:
    """Closed forms against themselves, and against the rows of the engines."""
    closure: dict[str, Array] = {}
    for fidelity in ("minimal", "parts", "full"):
        gaps = at_poses(p, fidelity, *random_poses(p, 8), lambda w: np.abs(w.closing()[0]).max())
        closure |= {f"{witness} {fidelity}": gap.max() for witness, gap in gaps.items()}
    centre, angles, tool = moderate_poses(p, 6, seed=5)
    jacobians = {"analytic": closed.jacobian(p.geometry, tool, *angles.T)}
    jacobians |= at_poses(p, "full", centre, angles, _jacobian)
    motion = trial_motion(p, TIMES)
    sliders = closed.slider_accelerations(p.geometry, motion.centre, motion.centre_rate, motion.centre_accel)
    second = {"analytic": np.hstack([sliders, closed.drives_from_angles(p.geometry, motion.angle_accel)])}
    second |= moving(p, "full", motion, lambda w, accel: rows_of(w, DRIVES) @ accelerations(w, accel))
    scale = np.abs(second["analytic"]).max()
    # Rounding: 45 coordinates, condition below 100. Central differences with 1e-6: 1e-9 of a second derivative of 1e2.
    return check_quantities(
        CheckedQuantity("inverse, then forward, 1e5 poses [m, rad]", 1e-12, {"analytic": _round_trip(p)}, 0.0),
        CheckedQuantity("drive rates against differences of positions", 1e-7, {"analytic": _difference_error(p)}, 0.0),
        CheckedQuantity("closure of the closed-form coordinates [m, rad]", 1e-12, closure, 0.0),
        CheckedQuantity("6 x 6 Jacobian, full mechanism", 1e-9, jacobians),
        CheckedQuantity("drive accelerations, relative", 1e-9, {k: v / scale for k, v in second.items()}),
    )


def _round_trip(p: Delta6Parameters) -> float:
    centre, angles = random_poses(p, ROUND_TRIPS, share=0.8)
    tool = centre + p.head_offset * closed.output_axis(angles)
    drives = closed.inverse(p.geometry, tool, *angles.T).drives
    back = closed.forward(p.geometry, drives[:, :3], drives[:, 3:])
    return float(max(np.abs(back.tool - tool).max(), np.abs(back.angles - angles).max()))


def _jacobian(w: StatePlant) -> Array:
    """(6, 6) drive rates per twist of D, the inverse of the twist per drive rates that the constraint rows give."""
    return np.asarray(np.linalg.inv(w.point_jacobian("D") @ response(w, DRIVES)))


def _difference_error(p: Delta6Parameters) -> float:
    """Largest difference between J twist and the drives of poses moved a step to both sides, for unit twists."""
    _, angles, tool = moderate_poses(p, 6, seed=5)
    step, worst = 1e-6, 0.0
    for k in range(6):
        velocity, rates = np.zeros((len(tool), 3)), np.zeros((len(tool), 3))
        (velocity if k < 3 else rates)[:, k % 3] = 1.0
        ahead = closed.inverse(p.geometry, tool + step * velocity, *(angles + step * rates).T).drives
        behind = closed.inverse(p.geometry, tool - step * velocity, *(angles - step * rates).T).drives
        twist = np.hstack([velocity, closed.angular_velocity(angles, rates)])
        alpha, beta, gamma = angles.T
        expected = closed.drive_rates(p.geometry, tool, alpha, beta, gamma, twist)
        worst = max(worst, float(np.abs((ahead - behind) / (2.0 * step) - expected).max()))
    return worst


def a7(p: Delta6Parameters) -> CheckResult:
    """Determinant, drive rates, angles and flags at and near beta = 90 deg."""
    betas = np.array([0.0, 0.6, 1.2, 1.5, np.pi / 2, 2.0])
    tilts = np.radians([0.0, 60.0, 80.0, 89.0])
    determinant = {"analytic": closed.orientation_determinant(betas)}
    determinant |= _at_tilts(p, betas, lambda w: np.linalg.det(_turning(w)))
    gain = {"analytic": closed.drive_rate_gain(p.geometry, tilts) * np.cos(tilts)}
    measured = _at_tilts(p, tilts, lambda w: np.linalg.norm(gear_matrix(w) @ np.linalg.inv(_turning(w)), 2))
    gain |= {k: v * np.cos(tilts) for k, v in measured.items()}
    pole = np.array([0.3, np.pi / 2, -0.7])
    rotation = closed.rotation_matrix(*pole)
    found = closed.extract_angles(rotation)
    again = closed.rotation_matrix(*found.values)
    table = closed.drive_rate_gain(SOURCE.geometry, np.radians([0.0, 60.0, 80.0, 89.0, 89.99]))
    # two to three printed digits
    printed = {"analytic": table / [2.4, 6.3, 18.6, 186.0, 1.86e4]}
    flags = {"analytic": _flags(p, bool(found.singular)), "numpy": _serial(p)}
    return check_quantities(
        CheckedQuantity("det E = cos(beta)", 1e-12, determinant, np.cos(betas)),
        CheckedQuantity("largest drive rates x cos(beta) [1/s per rad/s]", 1e-9, gain),
        CheckedQuantity("largest drive rates, source, relative", 0.02, printed, np.ones(5)),
        CheckedQuantity("R from the angles found at beta = 90 deg", 1e-12, {"analytic": again}, rotation),
        CheckedQuantity("flagged at 90 deg and not at 80 deg", 0.5, flags, [1.0, 0.0]),
    )


def _at_tilts(p: Delta6Parameters, betas: Array, measure: Measure) -> dict[str, Array]:
    angles = np.column_stack([np.full(len(betas), 0.4), betas, np.full(len(betas), -0.9)])
    return at_poses(p, "parts", np.zeros(angles.shape), angles, measure)


def _turning(w: StatePlant) -> Array:
    """(3, 3) angular velocity of the output link per rate of alpha, beta, gamma."""
    return np.asarray(w.point_jacobian("D")[3:] @ response(w)[:, 3:])


def _flags(p: Delta6Parameters, found: bool) -> list[float]:
    """1 where the closed form answers, flags the singularity and refuses to invert; expected at 90 deg, not at 80 deg."""
    out = []
    for beta in (np.pi / 2, np.radians(80.0)):
        tool = p.head_offset * closed.output_axis([0.3, beta, -0.7])
        answer = closed.inverse(p.geometry, tool, 0.3, beta, -0.7)
        finite = bool(np.all(np.isfinite(answer.drives)))
        refused = refuses(partial(closed.jacobian, p.geometry, tool, 0.3, beta, -0.7))
        out.append(float(finite and bool(answer.singular) and refused and found))
    return out


def _serial(p: Delta6Parameters) -> list[float]:
    """1 where the numpy tree finds a serial singularity of the output link."""
    w = TreePlant(build(p, "minimal"))
    out = []
    for beta in (np.pi / 2, np.radians(80.0)):
        q = coordinates(p, "minimal", np.zeros(3), [0.3, beta, -0.7])[0]
        out.append(float("serial" in singularity(w.mechanism, q, w.set(q).point_jacobian("D"))))
    return out


def a13(p: Delta6Parameters) -> CheckResult:
    """Out of reach no witness answers; just inside each does."""
    leg = legs(p)[0]
    outward = leg.span[:2] / np.hypot(*leg.span[:2])
    edge = reach(p)
    distances = (edge - 1e-3 * edge, edge + 1e-6, edge + 0.05)
    points = np.array([[*(s * outward), 0.0] for s in distances])
    answer = closed.inverse_position(p.geometry, points)
    answered = [not refuses(closed.inverse_position(p.geometry, x).require) for x in points]
    values = {"analytic": np.isfinite(answer.drives).all(axis=1) & answer.reachable & np.array(answered)}
    start = coordinates(p, "minimal", [[*(0.95 * edge * outward), 0.0]], np.zeros(3))[0]
    for name, w in plants(build(p, "minimal")).items():
        values[name] = np.array([_closes(w, start, x) for x in points])
    apart = np.array([0.0, 0.0, 3.0 * p.rod_length])
    assembly = closed.forward_position(p.geometry, apart)
    somewhere = bool(assembly.assembles) or bool(np.isfinite(assembly.position).any()) or not refuses(assembly.require)
    return check_quantities(
        CheckedQuantity("answered 0.1 % inside the edge, 1 um and 50 mm outside", 0.5, values, [1.0, 0.0, 0.0]),
        CheckedQuantity("answered for sliders that are too far apart", 0.5, {"analytic": float(somewhere)}, 0.0),
    )


def _closes(w: StatePlant, start: Array, centre: Array) -> bool:
    """True when Newton on the witness's rows brings O to `centre`."""
    m, rows = w.mechanism, rows_of(w, HEAD_POSE)

    def evaluate(q: Array) -> tuple[Array, Array]:
        residual, jacobian, _ = w.set(q).closing()
        return np.concatenate([residual, rows[:3] @ q - centre, rows[3:] @ q]), np.vstack([jacobian, rows])

    return newton(evaluate, lambda q, dv: integrate(m, q, dv), start).closed


def a14(p: Delta6Parameters) -> CheckResult:
    """Slider rates when the head turns with O held, and with D held."""
    centre, angles, tool = moderate_poses(p, 4, seed=9)
    drive = closed.jacobian(p.geometry, tool, *angles.T)
    rates = at_poses(p, "full", centre, angles, _slider_rates)
    held_o = {k: v[:, 0] for k, v in rates.items()}
    held_d = {"analytic": drive[:, :3, 3:] @ closed.rate_matrix(angles)} | {k: v[:, 1] for k, v in rates.items()}
    moved = {k: float(np.abs(v).max() > max(1e-9, 1e-3 * abs(p.head_offset))) for k, v in held_d.items()}
    return check_quantities(
        CheckedQuantity("slider rates with O held [m/rad]", 1e-12, held_o, np.zeros((len(angles), 3, 3))),
        CheckedQuantity("slider rates with D held [m/rad]", 1e-9, held_d),
        CheckedQuantity("sliders move with D held", 0.5, moved, float(p.head_offset != 0.0)),
    )


def _slider_rates(w: StatePlant) -> Array:
    """(2, 3, 3) slider rates per rate of alpha, beta, gamma, with O held and with D held."""
    sliders, moves = rows_of(w, SLIDERS), response(w)
    tool = w.point_jacobian("D")[:3] @ moves
    compensated = moves[:, 3:] - moves[:, :3] @ np.linalg.solve(tool[:, :3], tool[:, 3:])
    return np.array([sliders @ moves[:, 3:], sliders @ compensated])


def a16(p: Delta6Parameters) -> CheckResult:
    """What the closed forms say of rods and shafts, against the points of a few poses of the full mechanism."""
    centre, angles, tool = moderate_poses(p, 3, seed=23)
    values = {"analytic": np.array([_rods_and_shafts(p, *x) for x in zip(centre, angles, tool, strict=True)])}
    values |= at_poses(p, "full", centre, angles, _rods_and_shafts_in_place)
    # Rounding of numbers of the size of 1; a circle through guides that nearly stand in line loses some digits.
    note = "head centre, angles, sliders, heights, discriminant, bends, shafts, matrices A and B"
    return CheckResult(values, 1e-10, note=note)


def _rods_and_shafts(p: Delta6Parameters, centre: Array, angles: Array, tool: Array) -> Array:
    """Every number besides the six drives that the closed forms give for a pose."""
    g = p.geometry
    there = closed.inverse(g, tool, *angles)
    back = closed.forward(g, there.drives[:3], there.drives[3:])
    shafts = closed.cardan_angles(g, centre, SHAFT_SENSE * there.drives[3:])
    rows, sides = closed.implicit_matrices(g, centre)
    translation = back.translation
    return np.concatenate([
        there.head_centre, there.angles, there.translation.drives, there.translation.h2, translation.position,
        translation.heights, [translation.discriminant], shafts.bend, shafts.upper_shaft, shafts.lower_shaft,
        closed.cardan_bend(g, centre), rows.ravel(), sides.ravel(),
    ])  # fmt: skip


def _rods_and_shafts_in_place(w: StatePlant) -> Array:
    """The same from where the ends of the shafts and the platform of the full mechanism are."""
    centre = w.pose("platform")[1]
    upper, lower = (np.array([w.pose(f"{end}_{i}")[1] for i in (1, 2, 3)]) for end in ("stub", "shaft"))
    rods = lower - upper
    heights = -rods[:, 2]
    bend = np.arctan2(np.hypot(rods[:, 0], rods[:, 1]), heights)
    # O is as far from these three points as a rod is long; the circle through them has the radius abc / (4 area).
    a, b, c = upper - (lower - centre)
    sides = [float(np.linalg.norm(x)) for x in (b - a, c - b, a - c)]
    radius = float(np.prod(sides)) / (2.0 * float(np.linalg.norm(np.cross(b - a, c - a))))
    turned = SHAFT_SENSE * [w.value(n) for n in ROTARY]
    turned_below = SHAFT_SENSE * [w.value(f"{n}_lower") for n in ROTARY]
    return np.concatenate([
        centre, [w.value(n) for n in ANGLES], [w.value(n) for n in SLIDERS], heights**2, centre, heights,
        [float(rods[0] @ rods[0]) - radius**2], bend, turned, turned_below, bend, (2.0 * rods).ravel(),
        (2.0 * np.diag(heights)).ravel(),
    ])  # fmt: skip


CHECKS = (
    Check("A3", "closed forms against themselves and against every mechanism: positions, rates, accelerations", a3,
          "specification, section 2"),
    Check("A7", "orientation at and near beta = 90 deg: determinant, drive rates, flag", a7, "det E = cos(beta)"),
    Check("A13", "out of reach there is no answer; just inside there is", a13, "discriminant of the position problem"),
    Check("A14", "turning the head: sliders stand with O held and move with D held", a14,
          "block-triangular 6 x 6 Jacobian"),
    Check("A16", "rods and shafts where the parts stand: heights, bends, discriminant", a16,
          "points of the full mechanism"),
)  # fmt: skip
