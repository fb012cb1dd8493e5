"""Claims of the thesis abstract on positions: inverse problem, angles, drive law, workspace."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.claims_structure import THESIS
from mechlab.catalog.delta6.parameters import Delta6Parameters, legs
from mechlab.catalog.delta6.poses import coordinates
from mechlab.catalog.delta6.probes import ANGLES, CENTRE, ROTARY, SOURCE, random_poses
from mechlab.catalog.delta6.responses import response
from mechlab.catalog.delta6.witnesses import Witness, witnesses
from mechlab.experiment.check import Claim, Finding, Verdict
from mechlab.mechanism.geometry import Array


# -- positions -----------------------------------------------------------------------------------------------------------


def head_centre() -> Finding:
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
        return Finding(computed, Verdict.HOLDS)
    return Finding(computed, Verdict.FAILS, "O is not where the formula puts it")


def larger_root() -> Finding:
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
        return Finding(computed, Verdict.HOLDS, "the smaller root is the assembly with the slider below the platform")
    return Finding(computed, Verdict.FAILS, "the larger root does not close the rods")


# -- angles --------------------------------------------------------------------------------------------------------------


def arctangent() -> Finding:
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
        return Finding(computed, Verdict.HOLDS)
    if np.array_equal(right, np.abs(gammas) < 0.5 * math.pi):
        return Finding(
            computed,
            Verdict.HOLDS_ONLY_IF,
            "|gamma| < 90 deg: the arctangent loses the quadrant. And g is the angle to turn back, gamma = -g",
        )
    return Finding(computed, Verdict.FAILS, "g is not the angle of the turn")


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


def remaining_angles() -> Finding:
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
        return Finding(computed, Verdict.HOLDS)
    if good:
        return Finding(
            computed,
            Verdict.HOLDS_ONLY_IF,
            f"the turns are undone in the order {' or '.join(good)} and every angle stays below 90 deg",
        )
    return Finding(computed, Verdict.FAILS, "no order gives the orientation back")


def two_vectors() -> Finding:
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
        return Finding(computed, Verdict.HOLDS)
    return Finding(computed, Verdict.HOLDS_ONLY_IF, "beta is not +-90 deg: there alpha and gamma turn about one axis and only their sum or difference is defined; "
                   "close to it errors grow as 1 / cos(beta)")  # fmt: skip


# -- drive law -----------------------------------------------------------------------------------------------------------


def _plain(values: Array) -> list[object]:
    """Numbers to twelve decimals, without negative zeros."""
    out: list[object] = (np.round(values, 12) + 0.0).tolist()
    return out


def gear_matrix(w: Witness) -> Array:
    """(3, 3) K of phi = K (alpha, beta, gamma) by the meshes of `parts`."""
    return np.array([w.mechanism.row(n) for n in ROTARY]) @ response(w, (*CENTRE, *ANGLES))[:, 3:]


def drive_law() -> Finding:
    """Equation (2) with k_vz in the term of beta too, against the gear meshes, for two values of k_vz."""
    error: dict[str, dict[str, float]] = {}
    for k_vz in (Fraction(1), Fraction(17, 22)):
        p: Delta6Parameters = replace(SOURCE, k_bevel=k_vz)
        printed = closed.printed_drive_matrix(p.geometry)
        error[str(k_vz)] = {w.name: float(np.abs(gear_matrix(w) - printed).max()) for w in witnesses(build(p, "parts"))}
    computed = {f"{who}: meshes - printed, k_vz = {k}": v for k, said in error.items() for who, v in said.items()}
    one, other = (max(said.values()) < 1e-12 for said in error.values())
    if one and other:
        return Finding(computed, Verdict.HOLDS)
    if one:
        return Finding(computed, Verdict.HOLDS_ONLY_IF, "k_vz = k(VZ, Pz) = 1: turning the T-shaped link by beta turns Pz by beta itself, so k_vz does not belong to beta. "
                       "The equal coefficients 0.783 of alpha and beta need k_vz = 1")  # fmt: skip
    return Finding(computed, Verdict.FAILS, "the meshes give another matrix")


def plus_signs() -> Finding:
    """Sense of the drives: N and Pr mesh externally, seen about +Z."""
    computed = {}
    for w in witnesses(build(SOURCE, "parts")):
        axes = [w.mechanism.joint(n).axis[2] for n in ROTARY]
        computed[f"{w.name}: turns about +Z per turn of gamma"] = [
            round(float(a * k), 12) for a, k in zip(axes, gear_matrix(w)[:, 2], strict=True)
        ]
    worst = min(min(v) for v in computed.values())
    if worst > 0.0:
        return Finding(computed, Verdict.HOLDS)
    return Finding(
        computed,
        Verdict.HOLDS_ONLY_IF,
        "drives 1 and 2 are counted positive about -Z: each external mesh reverses the sense",
    )


def one_shaft() -> Finding:
    """Only drive 3, 'responsible for OZ', turns."""
    computed = {}
    for w in witnesses(build(SOURCE, "parts")):
        computed[f"{w.name}: rates of alpha, beta, gamma"] = _plain(np.linalg.solve(gear_matrix(w), [0.0, 0.0, 1.0]))
    moving = {tuple(abs(x) > 1e-9 for x in v) for v in computed.values()}
    if moving == {(True, True, True)}:
        return Finding(computed, Verdict.HOLDS)
    return Finding(
        computed, Verdict.FAILS, "beta stays: the output link turns about Z and about its own axis X', not about Y'"
    )


def compensation() -> Finding:
    """Gears Pr turned together with the central shaft."""
    computed = {}
    for w in witnesses(build(SOURCE, "parts")):
        rates = np.linalg.lstsq(
            np.vstack([w.jacobian(), *(w.mechanism.row(n) for n in (*CENTRE, "rho1", "rho2", "phi3"))]),
            np.concatenate([np.zeros(len(w.jacobian()) + 3), np.ones(3)]), rcond=1e-11,
        )[0]  # fmt: skip
        computed[f"{w.name}: rates of alpha, beta, gamma"] = _plain(
            np.array([w.mechanism.row(n) @ rates for n in ANGLES])
        )
    if all(np.allclose(v, [0.0, 0.0, 1.0], atol=1e-9) for v in computed.values()):
        return Finding(computed, Verdict.HOLDS)
    return Finding(computed, Verdict.FAILS, "alpha or beta move")


def coupled_drives() -> Finding:
    """K is not diagonal."""
    matrices = {w.name: gear_matrix(w) for w in witnesses(build(SOURCE, "parts"))}
    computed = {f"{k}: K": _plain(m) for k, m in matrices.items()}
    off = min(float(np.abs(m - np.diag(np.diag(m))).max()) for m in matrices.values())
    if off > 1e-9:
        return Finding(
            computed, Verdict.HOLDS, "turning about Z needs all three rotary drives, alpha and beta two each"
        )
    return Finding(computed, Verdict.FAILS, "each drive turns one angle")


# -- workspace -----------------------------------------------------------------------------------------------------------


def grid_is_larger() -> Finding:
    """The cube of 2 m against the positions that exist."""
    counts = closed.workspace_counts(SOURCE.geometry, SOURCE.slider_min, SOURCE.slider_max)
    nodes = np.arange(-100, 101) / 100.0
    width = float(np.abs(nodes[np.argwhere(counts.xy_mask)]).max())
    tops = SOURCE.slider_height + SOURCE.platform_height
    height = max(abs(SOURCE.slider_min - tops - SOURCE.rod_length), abs(SOURCE.slider_max - tops))
    computed = {
        "analytic: nodes (x, y)": counts.xy_nodes,
        "analytic: farthest node in x or y [m]": width,
        "analytic: bound of |z| [m]": height,
    }
    if 0 < counts.xy_nodes and width < 1.0 and height < 1.0:
        return Finding(computed, Verdict.HOLDS)
    return Finding(computed, Verdict.FAILS, "the workspace reaches the border of the cube")


def workspace_test() -> Finding:
    """Nodes that the source's test accepts, with a limit on the bend of the cardans."""
    limits = (None, 60.0, 45.0, 40.0, 35.0)
    counts = [
        closed.workspace_counts(SOURCE.geometry, SOURCE.slider_min, SOURCE.slider_max, b and math.radians(b))
        for b in limits
    ]
    home = math.degrees(float(closed.cardan_bend(SOURCE.geometry, np.zeros(3))[0]))
    computed: dict[str, object] = {
        f"analytic: nodes (x, y), bend up to {b or 90:g} deg": c.xy_nodes for b, c in zip(limits, counts, strict=True)
    }
    computed |= {f"analytic: voxels, bend up to {b or 90:g} deg": c.voxels for b, c in zip(limits, counts, strict=True)}
    computed["analytic: bend at home [deg]"] = home
    if counts[2].xy_nodes == counts[0].xy_nodes:
        return Finding(computed, Verdict.HOLDS)
    return Finding(computed, Verdict.HOLDS_ONLY_IF, f"the cardans may bend up to 90 deg; at home they bend by {home:.1f} deg already, and a limit of 45 deg leaves "
                   f"{counts[2].xy_nodes} of {counts[0].xy_nodes} nodes")  # fmt: skip


CLAIMS = (
    Claim("C13", "chapter 3, O from D", "O = -0.05 e1 + D is the common point of the three axes.", "-0.05 e1 + D", head_centre, THESIS),
    Claim("C14", "chapter 3, equation (1)", "Of the two roots of (1) the larger one is the position of the upper cross.", "maximum of z", larger_root, THESIS),
    Claim("C15", "chapter 3, angle g", "g = arctan(-e1y / e1x) is the angle by which the output link is to be turned back.", "arctan(-e1y / e1x)", arctangent, THESIS),
    Claim("C16", "chapter 3, remaining angles", "The remaining angles are found similarly.", "similarly", remaining_angles, THESIS),
    Claim("C17", "chapter 3, e1 and e2", "Two unit vectors e1 and e2 determine the angles of the output link.", "alpha, beta, gamma", two_vectors, THESIS),
    Claim("C18", "chapter 3, equation (2)", "The drive angles contain alpha and beta with the same product of ratios.", "alpha kpm kvz kz -+ beta kpm kvz kz + gamma kN", drive_law, THESIS),
    Claim("C19", "chapter 3, equation (2), sign of gamma", "Drives 1 and 2 turn with +kN per turn of gamma.", "+kN", plus_signs, THESIS),
    Claim("C20", "chapter 3, before equation (2)", "When only the shaft responsible for OZ turns, the output link turns about all axes.", "all axes", one_shaft, THESIS),
    Claim("C21", "chapter 3, before equation (2)", "Without turns about OX and OY the gears Pr have to turn together with the central shaft.", "together", compensation, THESIS),
    Claim("C22", "conclusion 3", "The drives of the rotations depend on each other.", "coupled", coupled_drives, THESIS),
    Claim("C23", "chapter 3, workspace", "The cube x = y = z = [-1 m, 1 m] is larger than the workspace.", "[-1, 1] m", grid_is_larger, THESIS),
    Claim("C24", "chapter 3, workspace", "A node belongs to the workspace when the three coordinates are real and within their intervals.", "real and within limits", workspace_test, THESIS),
)  # fmt: skip
