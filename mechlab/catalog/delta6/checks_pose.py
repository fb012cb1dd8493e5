"""Checks A3, A7, A13, A14: positions, rates and accelerations of all six drives, singular poses, the reach."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.graded import Quantity, graded
from mechlab.catalog.delta6.parameters import Delta6Parameters, drive_names, legs
from mechlab.catalog.delta6.poses import coordinates
from mechlab.catalog.delta6.probes import ANGLES, CENTRE, ROTARY, SLIDERS, SOURCE, probe_motion, random_poses, reach
from mechlab.catalog.delta6.responses import accelerations, response
from mechlab.catalog.delta6.witnesses import Witness, witnesses
from mechlab.errors import NoSolution
from mechlab.experiment.check import Check, Measured
from mechlab.mechanism import integrate, newton, singularity
from mechlab.mechanism.geometry import Array

ROUND_TRIPS = 100_000
SIX = (*CENTRE, *ANGLES)


# -- A3 ------------------------------------------------------------------------------------------------------------------


def a3(p: Delta6Parameters) -> Measured:
    """Closed forms against themselves, and against the rows of the engines."""
    closure: dict[str, float] = {}
    jacobians: dict[str, Array] = {"analytic": _jacobians(p)}
    second: dict[str, Array] = {"analytic": _drive_accelerations(p)}
    for fidelity in ("minimal", "parts", "full"):
        for w in witnesses(build(p, fidelity)):
            opened = [np.abs(w.at(q).closing()[0]).max() for q in coordinates(p, fidelity, *random_poses(p, 8))]
            closure[f"{w.name} {fidelity}"] = max(opened)
            if fidelity == "full":
                jacobians[w.name], second[w.name] = _measured_jacobians(w, p), _measured_accelerations(w, p)
    scale = np.abs(second["analytic"]).max()
    # Rounding: 45 coordinates, condition below 100. Central differences with 1e-6: 1e-9 of a second derivative of 1e2.
    return graded(
        Quantity("inverse, then forward, 1e5 poses [m, rad]", 1e-12, {"analytic": _round_trip(p)}, 0.0),
        Quantity("drive rates against differences of positions", 1e-7, {"analytic": _difference_error(p)}, 0.0),
        Quantity("closure of the closed-form coordinates [m, rad]", 1e-12, closure, 0.0),
        Quantity("6 x 6 Jacobian, full mechanism", 1e-9, jacobians),
        Quantity("drive accelerations, relative", 1e-9, {k: v / scale for k, v in second.items()}),
    )


def _round_trip(p: Delta6Parameters) -> float:
    centre, angles = random_poses(p, ROUND_TRIPS, share=0.8)
    tool = centre + p.head_offset * closed.output_axis(angles)
    drives = closed.inverse(p.geometry, tool, *angles.T).drives
    back = closed.forward(p.geometry, drives[:, :3], drives[:, 3:])
    return float(max(np.abs(back.tool - tool).max(), np.abs(back.angles - angles).max()))


def _poses(p: Delta6Parameters) -> tuple[Array, Array, Array]:
    """Tool D, head centre O and angles of a few poses away from beta = 90 deg."""
    centre, angles = random_poses(p, 6, seed=5)
    angles = 0.7 * angles
    return centre + p.head_offset * closed.output_axis(angles), centre, angles


def _jacobians(p: Delta6Parameters) -> Array:
    tool, _, angles = _poses(p)
    return closed.jacobian(p.geometry, tool, *angles.T)


def _measured_jacobians(w: Witness, p: Delta6Parameters) -> Array:
    """The same from the constraint Jacobian: drive rates per twist of D, by inverting twist per drive rates."""
    _, centre, angles = _poses(p)
    out = []
    for q in coordinates(p, "full", centre, angles):
        moves = response(w.at(q), drive_names())
        out.append(np.linalg.inv(w.point_jacobian("D") @ moves))
    return np.array(out)


def _difference_error(p: Delta6Parameters) -> float:
    """Largest difference between J twist and the drives of poses moved a step to both sides, for unit twists."""
    tool, _, angles = _poses(p)
    step, worst = 1e-6, 0.0
    for k in range(6):
        velocity, rates = np.zeros((len(tool), 3)), np.zeros((len(tool), 3))
        (velocity if k < 3 else rates)[:, k % 3] = 1.0
        ahead = closed.inverse(p.geometry, tool + step * velocity, *(angles + step * rates).T).drives
        behind = closed.inverse(p.geometry, tool - step * velocity, *(angles - step * rates).T).drives
        twist = np.hstack([velocity, closed.angular_velocity(angles, rates)])
        expected = closed.drive_rates(p.geometry, tool, *angles.T, twist)
        worst = max(worst, float(np.abs((ahead - behind) / (2.0 * step) - expected).max()))
    return worst


TIMES = (0.05, 0.37, 0.71)


def _drive_accelerations(p: Delta6Parameters) -> Array:
    """Accelerations of the six drives on the probe motion, in closed form."""
    motion = probe_motion(p, TIMES)
    sliders = closed.slider_accelerations(p.geometry, motion.centre, motion.centre_rate, motion.centre_accel)
    return np.hstack([sliders, closed.drives_from_angles(p.geometry, motion.angle_accel)])


def _measured_accelerations(w: Witness, p: Delta6Parameters) -> Array:
    motion = probe_motion(p, TIMES)
    out = []
    rows = np.array([w.mechanism.row(n) for n in drive_names()])
    for k, q in enumerate(coordinates(p, "full", motion.centre, motion.angles)):
        v = response(w.at(q), SIX) @ motion.rate[k]
        out.append(rows @ accelerations(w.at(q, v), SIX, motion.accel[k]))
    return np.array(out)


# -- A7 ------------------------------------------------------------------------------------------------------------------


def a7(p: Delta6Parameters) -> Measured:
    """The orientation near beta = 90 deg."""
    betas = np.array([0.0, 0.6, 1.2, 1.5, np.pi / 2, 2.0])
    tilts = np.radians([0.0, 60.0, 80.0, 89.0])
    determinant = {"analytic": closed.orientation_determinant(betas)}
    gain = {"analytic": closed.drive_rate_gain(p.geometry, tilts) * np.cos(tilts)}
    for w in witnesses(build(p, "parts")):
        determinant[w.name] = np.array([np.linalg.det(_spin(w, p, b)) for b in betas])
        gain[w.name] = np.array(
            [np.linalg.norm(_phi(w, p, b) @ np.linalg.inv(_spin(w, p, b)), 2) * np.cos(b) for b in tilts]
        )
    pole = np.array([0.3, np.pi / 2, -0.7])
    rotation = closed.rotation_matrix(*pole)
    found = closed.extract_angles(rotation)
    again = closed.rotation_matrix(*found.values)
    table = closed.drive_rate_gain(SOURCE.geometry, np.radians([0.0, 60.0, 80.0, 89.0, 89.99]))
    return graded(
        Quantity("det E = cos(beta)", 1e-12, determinant, np.cos(betas)),
        Quantity("largest drive rates x cos(beta) [1/s per rad/s]", 1e-9, gain),
        # two to three printed digits
        Quantity("largest drive rates, source, relative", 0.02, {"analytic": table / [2.4, 6.3, 18.6, 186.0, 1.86e4]}, np.ones(5)),
        Quantity("R from the angles found at beta = 90 deg", 1e-12, {"analytic": again}, rotation),
        Quantity("flagged at 90 deg and not at 80 deg", 0.5, {"analytic": _flags(p, bool(found.singular)), "numpy": _serial(p)}, [1.0, 0.0]),
    )  # fmt: skip


def _at_tilt(w: Witness, p: Delta6Parameters, beta: float) -> Witness:
    return w.at(coordinates(p, "parts", np.zeros(3), [0.4, beta, -0.9])[0])


def _spin(w: Witness, p: Delta6Parameters, beta: float) -> Array:
    """(3, 3) angular velocity of the output link per rate of alpha, beta, gamma."""
    moves = response(_at_tilt(w, p, beta), SIX)
    return np.asarray(w.point_jacobian("D")[3:] @ moves[:, 3:])


def _phi(w: Witness, p: Delta6Parameters, beta: float) -> Array:
    moves = response(_at_tilt(w, p, beta), SIX)
    return np.array([w.mechanism.row(n) for n in ROTARY]) @ moves[:, 3:]


def _flags(p: Delta6Parameters, found: bool) -> list[float]:
    """The closed form must answer, flag and refuse to invert at 90 deg, and do nothing of that at 80 deg."""
    out = []
    for beta in (np.pi / 2, np.radians(80.0)):
        answer = closed.inverse(p.geometry, [0.0, 0.0, 0.0], 0.3, beta, -0.7)
        finite = bool(np.all(np.isfinite(answer.drives)))
        refused = _refuses(lambda b=beta: closed.jacobian(p.geometry, [0.0, 0.0, 0.0], 0.3, b, -0.7))
        out.append(float(finite and bool(answer.singular) and refused and found))
    return out


def _serial(p: Delta6Parameters) -> list[float]:
    m = build(p, "minimal")
    out = []
    for beta in (np.pi / 2, np.radians(80.0)):
        q = coordinates(p, "minimal", np.zeros(3), [0.3, beta, -0.7])[0]
        w = next(iter(witnesses(m))).at(q)
        out.append(float("serial" in singularity(m, q, w.point_jacobian("D"))))
    return out


def _refuses(ask: Callable[[], object]) -> bool:
    try:
        ask()
    except NoSolution:
        return True
    return False


# -- A13 -----------------------------------------------------------------------------------------------------------------


def a13(p: Delta6Parameters) -> Measured:
    """Out of reach nobody answers; just inside everybody does."""
    leg = legs(p)[0]
    outward = leg.span[:2] / np.hypot(*leg.span[:2])
    edge = reach(p)
    distances = (edge - 1e-4, edge + 1e-6, edge + 0.05)
    points = np.array([[*(s * outward), 0.0] for s in distances])
    answer = closed.inverse_position(p.geometry, points)
    said = {"analytic": np.isfinite(answer.drives).all(axis=1) & answer.reachable}
    refused = [not _refuses(lambda x=x: closed.inverse_position(p.geometry, x).require()) for x in points]
    said["analytic"] = said["analytic"] & np.array(refused)
    start = coordinates(p, "minimal", [[*(0.95 * edge * outward), 0.0]], np.zeros(3))[0]
    for w in witnesses(build(p, "minimal")):
        said[w.name] = np.array([_closes(w, start, x) for x in points])
    apart = np.array([0.0, 0.0, 3.0 * p.rod_length])
    assembly = closed.forward_position(p.geometry, apart)
    none = float(
        bool(assembly.assembles) or bool(np.isfinite(assembly.position).any()) or not _refuses(assembly.require)
    )
    return graded(
        Quantity("answered 0.1 mm inside, 1 um and 50 mm outside", 0.5, said, [1.0, 0.0, 0.0]),
        Quantity("answered for sliders that are too far apart", 0.5, {"analytic": none}, 0.0),
    )


def _closes(w: Witness, start: Array, centre: Array) -> bool:
    """True when Newton on the witness's rows brings O to `centre`."""
    m = w.mechanism
    rows = np.array([m.row(n) for n in SIX])

    def evaluate(q: Array) -> tuple[Array, Array]:
        residual, jacobian = w.at(q).closing()
        return np.concatenate([residual, rows[:3] @ q - centre, rows[3:] @ q]), np.vstack([jacobian, rows])

    return newton(evaluate, lambda q, dv: integrate(m, q, dv), start).closed


# -- A14 -----------------------------------------------------------------------------------------------------------------


def a14(p: Delta6Parameters) -> Measured:
    """Turning the head with O held, and with D held."""
    centre, angles = random_poses(p, 4, seed=9)
    angles = 0.7 * angles
    tool = centre + p.head_offset * closed.output_axis(angles)
    drive = closed.jacobian(p.geometry, tool, *angles.T)
    held_d = {"analytic": drive[:, :3, 3:] @ closed.rate_matrix(angles)}
    held_o: dict[str, Array] = {}
    for w in witnesses(build(p, "full")):
        pairs = [_slider_rates(w.at(q)) for q in coordinates(p, "full", centre, angles)]
        held_o[w.name] = np.array([a for a, _ in pairs])
        held_d[w.name] = np.array([b for _, b in pairs])
    moved = {k: float(np.abs(v).max() > max(1e-9, 1e-3 * abs(p.head_offset))) for k, v in held_d.items()}
    return graded(
        Quantity("slider rates with O held [m/rad]", 1e-12, held_o, np.zeros((len(angles), 3, 3))),
        Quantity("slider rates with D held [m/rad]", 1e-9, held_d),
        Quantity("sliders move with D held", 0.5, moved, float(p.head_offset != 0.0)),
    )


def _slider_rates(w: Witness) -> tuple[Array, Array]:
    """(3, 3) slider rates per rate of alpha, beta, gamma, with O held and with D held."""
    sliders = np.array([w.mechanism.row(n) for n in SLIDERS])
    moves = response(w, SIX)
    tool = w.point_jacobian("D")[:3] @ moves
    compensated = moves[:, 3:] - moves[:, :3] @ np.linalg.solve(tool[:, :3], tool[:, 3:])
    return sliders @ moves[:, 3:], sliders @ compensated


CHECKS = (
    Check("A3", "closed forms against themselves and against every mechanism: positions, rates, accelerations", a3, "specification, section 2"),
    Check("A7", "orientation at and near beta = 90 deg: determinant, drive rates, flag", a7, "det E = cos(beta)"),
    Check("A13", "out of reach there is no answer; just inside there is", a13, "discriminant of the position problem"),
    Check("A14", "turning the head: sliders stand with O held and move with D held", a14, "block-triangular 6 x 6 Jacobian"),
)  # fmt: skip
