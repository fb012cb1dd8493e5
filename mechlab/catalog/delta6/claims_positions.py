"""Claims C13 to C24 of the thesis abstract: positions and angles, the drive law, the workspace."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic import delta6 as closed
from mechlab.catalog.bibliography import THESIS
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.parameters import ANGLES, CENTRE, DRIVES, ROTARY, SOURCE, legs
from mechlab.catalog.delta6.poses import (
    at_home,
    at_poses,
    coordinates,
    gear_matrix,
    plants,
    random_poses,
    response,
    rows_of,
)
from mechlab.engines.protocol import StatePlant
from mechlab.kit.claims import (
    Evidence,
    Ledger,
    above,
    below,
    equals,
    evidence,
    fails,
    holds,
    labelled,
    near,
    none,
    only_if,
    true,
)  # fmt: skip
from mechlab.mechanism.geometry import Array

LEDGER = Ledger(THESIS)


@LEDGER.claim(
    "C13", "chapter 3, O from D", "O = -0.05 e1 + D is the common point of the three axes.", "-0.05 e1 + D",
    holds(when=below(1e-12, "*: largest difference [m]")),
    fails("O is not where the formula puts it"),
)  # fmt: skip
def head_centre() -> Evidence:
    """O = -0.05 e1 + D, with e1 and D taken from the mechanisms."""

    def gap(w: StatePlant) -> float:
        return float(np.abs(-0.05 * w.pose("output")[0][:, 0] + w.point("D") - w.point("O")).max())

    gaps = at_poses(SOURCE, "full", *random_poses(SOURCE, 5), gap)
    return evidence(labelled({k: float(v.max()) for k, v in gaps.items()}, "largest difference [m]"))


@LEDGER.claim(
    "C14", "chapter 3, equation (1)",
    "Of the two roots of (1) the larger one is the position of the upper cross.", "maximum of z",
    holds("the smaller root is the assembly with the slider below the platform",
          when=below(1e-12, "analytic: largest difference of the larger root [m]", "*: rods open by, larger root [m]")),
    fails("the larger root does not close the rods"),
)  # fmt: skip
def larger_root() -> Evidence:
    """Equation (1) solved as printed, leg by leg; each root is put into the mechanism."""
    centre, _ = random_poses(SOURCE, 5)
    roots = np.empty((len(centre), 3, 2))
    for i, leg in enumerate(legs(SOURCE)):
        for k, o in enumerate(centre):
            x, y, z = o + leg.lower
            flat = (leg.upper[0] - x) ** 2 + (leg.upper[1] - y) ** 2
            roots[k, i] = np.sort(np.roots([1.0, -2.0 * z, z**2 + flat - SOURCE.rod_length**2]).real)
    drives = closed.inverse_position(SOURCE.geometry, centre).require()
    off = float(np.abs(roots[:, :, 1] + SOURCE.slider_height - drives).max())
    computed = {"analytic: largest difference of the larger root [m]": off}
    poses = coordinates(SOURCE, "parts", centre, np.zeros((5, 3)))
    for name, w in plants(build(SOURCE, "parts")).items():
        for which, root in enumerate(("smaller", "larger")):
            gap = 0.0
            for k, q in enumerate(poses):
                for i in (1, 2, 3):
                    slider = roots[k, i - 1, which] + SOURCE.slider_height
                    q[w.mechanism.q_slice[f"q{i}"]] = slider - w.mechanism.zero(f"q{i}")
                gap = max(gap, np.abs(w.set(q).closing()[0]).max())
            computed[f"{name}: rods open by, {root} root [m]"] = float(gap)
    return evidence(computed)


@LEDGER.claim(
    "C15", "chapter 3, angle g",
    "g = arctan(-e1y / e1x) is the angle by which the output link is to be turned back.", "arctan(-e1y / e1x)",
    holds(when=true("right")),
    only_if("|gamma| < 90 deg: the arctangent loses the quadrant. And g is the angle to turn back, gamma = -g",
            when=true("right_below_90_deg")),
    fails("g is not the angle of the turn"),
)  # fmt: skip
def arctangent() -> Evidence:
    """g = arctan(-e1y / e1x) must be the angle that turns e1 back into the plane X0Z."""
    gammas = np.radians([-150.0, -100.0, -80.0, -20.0, 35.0, 85.0, 95.0, 150.0])
    e1 = closed.output_axis(np.column_stack([0.0 * gammas, 0.3 + 0.0 * gammas, gammas]))
    g = closed.printed_turn_back(e1)
    error = np.abs(closed.wrap(g + gammas))
    right = error < 1e-12
    degrees = {"gamma [deg]": gammas, "analytic: printed g [deg]": g, "analytic: wrong by [deg]": error}
    computed = {k: np.degrees(v).round(9).tolist() for k, v in degrees.items()}
    return evidence(computed, right=right, right_below_90_deg=np.array_equal(right, np.abs(gammas) < 0.5 * math.pi))


def _undo(rotation: Array, order: str) -> Array:
    """(3, 3) rotation rebuilt from angles found one after the other by arctangents of one quotient, axes in `order`."""
    axes = {"x": (1, 1, 2, 1.0), "y": (0, 0, 2, -1.0), "z": (0, 0, 1, 1.0)}
    rest, angles = rotation.copy(), {}
    for axis in order:
        column, below_, above_, sign = axes[axis]
        angles[axis] = sign * math.atan(rest[above_, column] / rest[below_, column])
        rest = closed.rotation_matrix(*(angles[axis] if axis == a else 0.0 for a in "xyz")).T @ rest
    return closed.rotation_matrix(angles["x"], angles["y"], angles["z"])


@LEDGER.claim(
    "C16", "chapter 3, remaining angles", "The remaining angles are found similarly.", "similarly",
    holds(when=below(1e-12, "analytic: R off by, order *")),
    only_if("the turns are undone in the order {orders} and every angle stays below 90 deg", when=true("any_order")),
    fails("no order gives the orientation back"),
)  # fmt: skip
def remaining_angles() -> Evidence:
    """beta and alpha 'similarly': in which order?"""
    angles = np.random.default_rng(4).uniform(-1.3, 1.3, (20, 3))
    rotations = [closed.rotation_matrix(*a) for a in angles]
    error = {
        order: float(max(np.abs(_undo(r, order) - r).max() for r in rotations))
        for order in ("zyx", "xyz", "yzx", "zxy")
    }
    good = [k for k, v in error.items() if v < 1e-12]
    computed = {f"analytic: R off by, order {k}": v for k, v in error.items()}
    return evidence(computed, orders=" or ".join(good), any_order=bool(good))


@LEDGER.claim(
    "C17", "chapter 3, e1 and e2",
    "Two unit vectors e1 and e2 determine the angles of the output link.", "alpha, beta, gamma",
    holds(when=below(1e-7, "near_the_pole") & none("analytic: flagged at 90 deg")),
    only_if("beta is not +-90 deg: there alpha and gamma turn about one axis and only their sum or difference is defined; "
            "close to it errors grow as 1 / cos(beta)"),
)  # fmt: skip
def two_vectors() -> Evidence:
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
    computed: dict[str, Any] = {
        f"analytic: angles off at {t:g} deg for 1e-9 in e1, e2 [rad]": v for t, v in wrong.items()
    }
    computed["analytic: flagged at 90 deg"] = bool(pole.singular)
    return evidence(computed, near_the_pole=wrong[89.999])


def _plain(values: ArrayLike) -> Any:
    """Numbers to twelve decimals as nested lists, without negative zeros."""
    return (np.round(np.asarray(values), 12) + 0.0).tolist()


@LEDGER.claim(
    "C18", "chapter 3, equation (2)",
    "The drive angles contain alpha and beta with the same product of ratios.", "alpha kpm kvz kz -+ beta kpm kvz kz + gamma kN",
    holds(when=below(1e-12, "*: meshes - printed, k_vz = *")),
    only_if("k_vz = k(VZ, Pz) = 1: turning the T-shaped link by beta turns Pz by beta itself, so k_vz does not belong "
            "to beta. The equal coefficients 0.783 of alpha and beta need k_vz = 1",
            when=below(1e-12, "*: meshes - printed, k_vz = 1")),
    fails("the meshes give another matrix"),
)  # fmt: skip
def drive_law() -> Evidence:
    """Equation (2) with k_vz in the term of beta too, against the gear meshes, for two values of k_vz."""
    computed: dict[str, float] = {}
    for k_vz in (Fraction(1), Fraction(17, 22)):
        p = replace(SOURCE, k_bevel=k_vz)
        printed = closed.printed_drive_matrix(p.geometry)
        off = {name: float(np.abs(k - printed).max()) for name, k in at_home(p, "parts", gear_matrix).items()}
        computed |= labelled(off, f"meshes - printed, k_vz = {k_vz}")
    return evidence(computed)


@LEDGER.claim(
    "C19", "chapter 3, equation (2), sign of gamma", "Drives 1 and 2 turn with +kN per turn of gamma.", "+kN",
    holds(when=above(0.0, "*: turns about +Z per turn of gamma")),
    only_if("drives 1 and 2 are counted positive about -Z: each external mesh reverses the sense"),
)  # fmt: skip
def plus_signs() -> Evidence:
    """Sense of the drives: N and Pr mesh externally, seen about +Z."""

    def about_z(w: StatePlant) -> list[float]:
        axes = [w.mechanism.joint(n).axis[2] for n in ROTARY]
        return [round(float(a * k), 12) for a, k in zip(axes, gear_matrix(w)[:, 2], strict=True)]

    return evidence(labelled(at_home(SOURCE, "parts", about_z), "turns about +Z per turn of gamma"))


@LEDGER.claim(
    "C20", "chapter 3, before equation (2)",
    "When only the shaft responsible for OZ turns, the output link turns about all axes (the fixed ones, OX, OY, OZ).", "all axes",
    holds(when=above(1e-9, "sizes")),
    only_if("the output link is turned away from home: at home X' lies along OX and it turns about OX and OZ alone",
            when=above(1e-9, "sizes_turned")),
    fails("in no pose does it turn about all of them"),
)  # fmt: skip
def one_shaft() -> Evidence:
    """Only drive 3, 'responsible for OZ', turns."""
    poses = np.zeros((2, 3)), [[0.0, 0.0, 0.0], [0.3, -0.5, 0.7]]
    found = at_poses(SOURCE, "parts", *poses, lambda w: _plain(w.point_jacobian("D")[3:] @ response(w, DRIVES)[:, 5]))
    sizes = np.abs(list(found.values()))
    computed = labelled({k: v.tolist() for k, v in found.items()}, "turns about OX, OY, OZ per turn of drive 3, at home and turned")
    return evidence(computed, sizes=sizes, sizes_turned=sizes[:, 1])


@LEDGER.claim(
    "C21", "chapter 3, before equation (2)",
    "Without turns about OX and OY the gears Pr have to turn together with the central shaft.", "together",
    holds(when=near("*: rates of alpha, beta, gamma", 1e-9, of=(0.0, 0.0, 1.0))),
    fails("alpha or beta move"),
)  # fmt: skip
def compensation() -> Evidence:
    """Gears Pr turned together with the central shaft."""

    def rates(w: StatePlant) -> Any:
        jacobian = w.jacobian()
        matrix = np.vstack([jacobian, rows_of(w, (*CENTRE, "rho1", "rho2", "phi3"))])
        right = np.concatenate([np.zeros(len(jacobian) + 3), np.ones(3)])
        v = np.linalg.lstsq(matrix, right, rcond=1e-11)[0]
        return _plain(np.array([w.mechanism.row(n) @ v for n in ANGLES]))

    return evidence(labelled(at_home(SOURCE, "parts", rates), "rates of alpha, beta, gamma"))


@LEDGER.claim(
    "C22", "conclusion 3", "The drives of the rotations depend on each other.", "coupled",
    holds("turning about Z needs all three rotary drives, alpha and beta two each", when=above(1e-9, "off_diagonal")),
    fails("each drive turns one angle"),
)  # fmt: skip
def coupled_drives() -> Evidence:
    """K is not diagonal."""
    matrices = at_home(SOURCE, "parts", gear_matrix)
    off = [float(np.abs(m - np.diag(np.diag(m))).max()) for m in matrices.values()]
    return evidence(labelled({k: _plain(m) for k, m in matrices.items()}, "K"), off_diagonal=off)


@LEDGER.claim(
    "C23", "chapter 3, workspace", "The cube x = y = z = [-1 m, 1 m] (-1,1 m in the scan) is larger than the workspace.", "[-1, 1] m",
    holds(when=above(0, "analytic: nodes (x, y)")
          & below(1.0, "analytic: farthest node in x or y [m]", "analytic: bound of |z| [m]")),
    fails("the workspace reaches the border of the cube"),
)  # fmt: skip
def grid_is_larger() -> Evidence:
    """The cube of 2 m against the positions that exist."""
    counts = closed.workspace_counts(SOURCE.geometry, SOURCE.slider_min, SOURCE.slider_max)
    nodes = np.arange(-100, 101) / 100.0
    tops = SOURCE.slider_height + SOURCE.platform_height
    return evidence({
        "analytic: nodes (x, y)": counts.xy_nodes,
        "analytic: farthest node in x or y [m]": float(np.abs(nodes[np.argwhere(counts.xy_mask)]).max()),
        "analytic: bound of |z| [m]": max(
            abs(SOURCE.slider_min - tops - SOURCE.rod_length), abs(SOURCE.slider_max - tops)
        ),
    })  # fmt: skip


@LEDGER.claim(
    "C24", "chapter 3, workspace",
    "A node belongs to the workspace when the three coordinates are real and within their intervals.",
    "real and within limits",
    holds(when=equals("analytic: nodes (x, y), bend up to 45 deg", of="analytic: nodes (x, y), bend up to 90 deg")),
    only_if("the cardans may bend up to 90 deg; at home they bend by {home:.1f} deg already, and a limit of 45 deg leaves "
            "{left} of {all} nodes"),
)  # fmt: skip
def workspace_test() -> Evidence:
    """Nodes that the source's test accepts, with a limit on the bend of the cardans."""
    limits = (None, 60.0, 45.0, 40.0, 35.0)
    counts = {
        b or 90.0: closed.workspace_counts(SOURCE.geometry, SOURCE.slider_min, SOURCE.slider_max, b and math.radians(b))
        for b in limits
    }
    home = math.degrees(SOURCE.home_bend)
    computed: dict[str, float] = {
        f"analytic: nodes (x, y), bend up to {b:g} deg": c.xy_nodes for b, c in counts.items()
    }
    computed |= {f"analytic: voxels, bend up to {b:g} deg": c.voxels for b, c in counts.items()}
    computed["analytic: bend at home [deg]"] = home
    return evidence(computed, home=home, left=counts[45.0].xy_nodes, all=counts[90.0].xy_nodes)
