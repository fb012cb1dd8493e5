"""Claims of the thesis abstract on positions and angles."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.claims_freedoms import THESIS
from mechlab.catalog.delta6.parameters import legs
from mechlab.catalog.delta6.poses import coordinates
from mechlab.catalog.delta6.probes import SOURCE, random_poses
from mechlab.catalog.delta6.witnesses import witnesses
from mechlab.experiment.entry import Claim, ClaimResult, Verdict
from mechlab.mechanism.geometry import Array


def head_centre() -> ClaimResult:
    """O = -0.05 e1 + D, with e1 and D taken from the mechanisms."""
    centre, angles = random_poses(SOURCE, 5)
    computed = {}
    for w in witnesses(build(SOURCE, "full")):
        gaps = []
        for q in coordinates(SOURCE, "full", centre, angles):
            w.at(q)
            gaps.append(np.abs(-0.05 * w.pose("output")[0][:, 0] + w.point("D") - w.point("O")).max())
        computed[f"{w.name}: largest difference [m]"] = float(max(gaps))
    if max(computed.values()) < 1e-12:
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(computed, Verdict.FAILS, "O is not where the formula puts it")


def larger_root() -> ClaimResult:
    """Equation (1) solved as printed, leg by leg; each root is put into the mechanism."""
    centre, _ = random_poses(SOURCE, 5)
    roots = np.empty((len(centre), 3, 2))
    for i, leg in enumerate(legs(SOURCE)):
        for k, o in enumerate(centre):
            x, y, z = o + leg.lower
            flat = (leg.upper[0] - x) ** 2 + (leg.upper[1] - y) ** 2
            roots[k, i] = np.sort(np.roots([1.0, -2.0 * z, z**2 + flat - SOURCE.rod_length**2]).real)
    drives = closed.inverse_position(SOURCE.geometry, centre).require()
    computed: dict[str, float] = {
        "analytic: largest difference of the larger root [m]": float(
            np.abs(roots[:, :, 1] + SOURCE.slider_height - drives).max()
        )
    }
    poses = coordinates(SOURCE, "parts", centre, np.zeros((5, 3)))
    worst = 0.0
    for w in witnesses(build(SOURCE, "parts")):
        gaps = np.zeros(2)
        for which in (0, 1):
            for k, q in enumerate(poses):
                for i in (1, 2, 3):
                    q[w.mechanism.q_slice[f"q{i}"]] = (
                        roots[k, i - 1, which] + SOURCE.slider_height - w.mechanism.zero(f"q{i}")
                    )
                gaps[which] = max(gaps[which], np.abs(w.at(q).closing()[0]).max())
            computed[f"{w.name}: rods open by, {('smaller', 'larger')[which]} root [m]"] = float(gaps[which])
        worst = max(worst, float(gaps[1]))
    same = computed["analytic: largest difference of the larger root [m]"] < 1e-12
    if same and worst < 1e-12:
        return ClaimResult(
            computed, Verdict.HOLDS, "the smaller root is the assembly with the slider below the platform"
        )
    return ClaimResult(computed, Verdict.FAILS, "the larger root does not close the rods")


def arctangent() -> ClaimResult:
    """g = arctan(-e1y / e1x) must be the angle that turns e1 back into the plane X0Z."""
    gammas = np.radians([-150.0, -100.0, -80.0, -20.0, 35.0, 85.0, 95.0, 150.0])
    e1 = closed.output_axis(np.column_stack([0.0 * gammas, 0.3 + 0.0 * gammas, gammas]))
    g = closed.printed_turn_back(e1)
    error = np.abs(closed.wrap(g + gammas))
    right = error < 1e-12
    computed = {
        "gamma [deg]": np.degrees(gammas).round(9).tolist(),
        "analytic: printed g [deg]": np.degrees(g).round(9).tolist(),
        "analytic: wrong by [deg]": np.degrees(error).round(9).tolist(),
    }
    if right.all():
        return ClaimResult(computed, Verdict.HOLDS)
    if np.array_equal(right, np.abs(gammas) < 0.5 * math.pi):
        return ClaimResult(
            computed,
            Verdict.HOLDS_ONLY_IF,
            "|gamma| < 90 deg: the arctangent loses the quadrant. And g is the angle to turn back, gamma = -g",
        )
    return ClaimResult(computed, Verdict.FAILS, "g is not the angle of the turn")


def _undo(rotation: Array, order: str) -> Array:
    """(3, 3) rotation rebuilt from angles found one after the other by arctangents of one quotient, axes in `order`."""
    axes = {"x": (1, 1, 2, 1.0), "y": (0, 0, 2, -1.0), "z": (0, 0, 1, 1.0)}
    rest, angles = rotation.copy(), {}
    for axis in order:
        column, below, above, sign = axes[axis]
        angles[axis] = sign * math.atan(rest[above, column] / rest[below, column])
        turn = {"x": (angles[axis], 0.0, 0.0), "y": (0.0, angles[axis], 0.0), "z": (0.0, 0.0, angles[axis])}[axis]
        rest = closed.rotation_matrix(*turn).T @ rest
    return closed.rotation_matrix(angles["x"], angles["y"], angles["z"])


def remaining_angles() -> ClaimResult:
    """beta and alpha 'similarly': in which order?"""
    angles = np.random.default_rng(4).uniform(-1.3, 1.3, (20, 3))
    rotations = [closed.rotation_matrix(*a) for a in angles]
    error = {
        order: float(max(np.abs(_undo(r, order) - r).max() for r in rotations))
        for order in ("zyx", "xyz", "yzx", "zxy")
    }
    computed = {f"analytic: R off by, order {k}": v for k, v in error.items()}
    good = [k for k, v in error.items() if v < 1e-12]
    if len(good) == len(error):
        return ClaimResult(computed, Verdict.HOLDS)
    if good:
        return ClaimResult(
            computed,
            Verdict.HOLDS_ONLY_IF,
            f"the turns are undone in the order {' or '.join(good)} and every angle stays below 90 deg",
        )
    return ClaimResult(computed, Verdict.FAILS, "no order gives the orientation back")


def two_vectors() -> ClaimResult:
    """alpha and gamma from e1 and e2 with an error of 1e-9, towards beta = 90 deg."""
    noise = 1e-9
    rng = np.random.default_rng(6)
    wrong = {}
    for tilt in (0.0, 80.0, 89.9, 89.999):
        angles = np.tile([0.3, math.radians(tilt), -0.7], (200, 1))
        r = closed.rotation_matrix(*angles.T)
        e1 = r[:, :, 0] + noise * rng.standard_normal((200, 3))
        e2 = r[:, :, 1] + noise * rng.standard_normal((200, 3))
        e1 /= np.linalg.norm(e1, axis=1, keepdims=True)
        e2 -= np.sum(e1 * e2, axis=1, keepdims=True) * e1
        e2 /= np.linalg.norm(e2, axis=1, keepdims=True)
        found = closed.extract_angles(closed.rotation_from_axes(e1, e2)).values
        wrong[tilt] = float(np.abs(found - angles).max())
    pole = closed.extract_angles(closed.rotation_matrix(0.3, 0.5 * math.pi, -0.7))
    computed: dict[str, object] = {
        f"analytic: angles off at {t:g} deg for 1e-9 in e1, e2 [rad]": v for t, v in wrong.items()
    }
    computed["analytic: flagged at 90 deg"] = bool(pole.singular)
    if wrong[89.999] < 1e2 * noise and not pole.singular:
        return ClaimResult(computed, Verdict.HOLDS)
    because = (
        "beta is not +-90 deg: there alpha and gamma turn about one axis and only their sum or difference is defined; "
        "close to it errors grow as 1 / cos(beta)"
    )
    return ClaimResult(computed, Verdict.HOLDS_ONLY_IF, because)


CLAIMS = (
    Claim("C13", "chapter 3, O from D",
          "O = -0.05 e1 + D is the common point of the three axes.", "-0.05 e1 + D", head_centre, THESIS),
    Claim("C14", "chapter 3, equation (1)",
          "Of the two roots of (1) the larger one is the position of the upper cross.", "maximum of z", larger_root, THESIS),
    Claim("C15", "chapter 3, angle g",
          "g = arctan(-e1y / e1x) is the angle by which the output link is to be turned back.", "arctan(-e1y / e1x)", arctangent, THESIS),
    Claim("C16", "chapter 3, remaining angles",
          "The remaining angles are found similarly.", "similarly", remaining_angles, THESIS),
    Claim("C17", "chapter 3, e1 and e2",
          "Two unit vectors e1 and e2 determine the angles of the output link.", "alpha, beta, gamma", two_vectors, THESIS),
)  # fmt: skip
