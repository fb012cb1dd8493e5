"""Check A3: positions, rates and accelerations of all six drives, closed forms against every mechanism."""

from __future__ import annotations

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.graded import Quantity, graded
from mechlab.catalog.delta6.parameters import Delta6Parameters, drive_names
from mechlab.catalog.delta6.poses import coordinates
from mechlab.catalog.delta6.probes import ANGLES, CENTRE, probe_motion, random_poses
from mechlab.catalog.delta6.responses import accelerations, response
from mechlab.catalog.delta6.witnesses import Witness, witnesses
from mechlab.experiment.entry import Check, CheckResult
from mechlab.mechanism.geometry import Array

ROUND_TRIPS = 100_000
SIX = (*CENTRE, *ANGLES)


def a3(p: Delta6Parameters) -> CheckResult:
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
        alpha, beta, gamma = angles.T
        expected = closed.drive_rates(p.geometry, tool, alpha, beta, gamma, twist)
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


CHECKS = (
    Check("A3", "closed forms against themselves and against every mechanism: positions, rates, accelerations", a3,
          "specification, section 2"),
)  # fmt: skip
