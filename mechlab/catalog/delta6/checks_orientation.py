"""Check A7: the orientation at and near beta = 90 deg."""

from __future__ import annotations

from functools import partial

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.graded import Quantity, graded
from mechlab.catalog.delta6.parameters import Delta6Parameters
from mechlab.catalog.delta6.poses import coordinates
from mechlab.catalog.delta6.probes import ANGLES, CENTRE, ROTARY, SOURCE, refuses
from mechlab.catalog.delta6.responses import response
from mechlab.catalog.delta6.witnesses import Witness, witnesses
from mechlab.experiment.entry import Check, CheckResult
from mechlab.mechanism import singularity
from mechlab.mechanism.geometry import Array

SIX = (*CENTRE, *ANGLES)


def a7(p: Delta6Parameters) -> CheckResult:
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
    flags = {"analytic": _flags(p, bool(found.singular)), "numpy": _serial(p)}
    return graded(
        Quantity("det E = cos(beta)", 1e-12, determinant, np.cos(betas)),
        Quantity("largest drive rates x cos(beta) [1/s per rad/s]", 1e-9, gain),
        # two to three printed digits
        Quantity("largest drive rates, source, relative", 0.02, {"analytic": table / [2.4, 6.3, 18.6, 186.0, 1.86e4]}, np.ones(5)),
        Quantity("R from the angles found at beta = 90 deg", 1e-12, {"analytic": again}, rotation),
        Quantity("flagged at 90 deg and not at 80 deg", 0.5, flags, [1.0, 0.0]),
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
        tool = p.head_offset * closed.output_axis([0.3, beta, -0.7])
        answer = closed.inverse(p.geometry, tool, 0.3, beta, -0.7)
        finite = bool(np.all(np.isfinite(answer.drives)))
        refused = refuses(partial(closed.jacobian, p.geometry, tool, 0.3, beta, -0.7))
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


CHECKS = (
    Check("A7", "orientation at and near beta = 90 deg: determinant, drive rates, flag", a7, "det E = cos(beta)"),
)  # fmt: skip
