"""Checks A13 and A14: out of reach there is no answer; what the sliders do when the head turns."""

from __future__ import annotations

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.graded import Quantity, graded
from mechlab.catalog.delta6.parameters import Delta6Parameters, legs
from mechlab.catalog.delta6.poses import coordinates
from mechlab.catalog.delta6.probes import ANGLES, CENTRE, SLIDERS, random_poses, reach, refuses
from mechlab.catalog.delta6.responses import response
from mechlab.catalog.delta6.witnesses import Witness, witnesses
from mechlab.experiment.entry import Check, CheckResult
from mechlab.mechanism import integrate, newton
from mechlab.mechanism.geometry import Array

SIX = (*CENTRE, *ANGLES)


def a13(p: Delta6Parameters) -> CheckResult:
    """Out of reach nobody answers; just inside everybody does."""
    leg = legs(p)[0]
    outward = leg.span[:2] / np.hypot(*leg.span[:2])
    edge = reach(p)
    distances = (edge - 1e-3 * edge, edge + 1e-6, edge + 0.05)
    points = np.array([[*(s * outward), 0.0] for s in distances])
    answer = closed.inverse_position(p.geometry, points)
    said = {"analytic": np.isfinite(answer.drives).all(axis=1) & answer.reachable}
    refused = [not refuses(closed.inverse_position(p.geometry, x).require) for x in points]
    said["analytic"] = said["analytic"] & np.array(refused)
    start = coordinates(p, "minimal", [[*(0.95 * edge * outward), 0.0]], np.zeros(3))[0]
    for w in witnesses(build(p, "minimal")):
        said[w.name] = np.array([_closes(w, start, x) for x in points])
    apart = np.array([0.0, 0.0, 3.0 * p.rod_length])
    assembly = closed.forward_position(p.geometry, apart)
    none = float(
        bool(assembly.assembles) or bool(np.isfinite(assembly.position).any()) or not refuses(assembly.require)
    )
    return graded(
        Quantity("answered 0.1 % inside the edge, 1 um and 50 mm outside", 0.5, said, [1.0, 0.0, 0.0]),
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


def a14(p: Delta6Parameters) -> CheckResult:
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
    Check("A13", "out of reach there is no answer; just inside there is", a13, "discriminant of the position problem"),
    Check("A14", "turning the head: sliders stand with O held and move with D held", a14,
          "block-triangular 6 x 6 Jacobian"),
)  # fmt: skip
