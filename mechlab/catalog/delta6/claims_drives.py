"""Claims of the thesis abstract on the drive law and the workspace."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.claims_freedoms import THESIS
from mechlab.catalog.delta6.parameters import Delta6Parameters
from mechlab.catalog.delta6.probes import ANGLES, CENTRE, ROTARY, SOURCE
from mechlab.catalog.delta6.responses import response
from mechlab.catalog.delta6.witnesses import Witness, witnesses
from mechlab.experiment.entry import Claim, ClaimResult, Verdict
from mechlab.mechanism.geometry import Array


def _plain(values: ArrayLike) -> Any:
    """Numbers to twelve decimals as nested lists, without negative zeros."""
    return (np.round(np.asarray(values), 12) + 0.0).tolist()


def gear_matrix(w: Witness) -> Array:
    """(3, 3) K of phi = K (alpha, beta, gamma) by the meshes of `parts`."""
    return np.array([w.mechanism.row(n) for n in ROTARY]) @ response(w, (*CENTRE, *ANGLES))[:, 3:]


def drive_law() -> ClaimResult:
    """Equation (2) with k_vz in the term of beta too, against the gear meshes, for two values of k_vz."""
    error: dict[str, dict[str, float]] = {}
    for k_vz in (Fraction(1), Fraction(17, 22)):
        p: Delta6Parameters = replace(SOURCE, k_bevel=k_vz)
        printed = closed.printed_drive_matrix(p.geometry)
        error[str(k_vz)] = {w.name: float(np.abs(gear_matrix(w) - printed).max()) for w in witnesses(build(p, "parts"))}
    computed = {f"{who}: meshes - printed, k_vz = {k}": v for k, said in error.items() for who, v in said.items()}
    one, other = (max(said.values()) < 1e-12 for said in error.values())
    if one and other:
        return ClaimResult(computed, Verdict.HOLDS)
    if one:
        because = (
            "k_vz = k(VZ, Pz) = 1: turning the T-shaped link by beta turns Pz by beta itself, so k_vz does not belong "
            "to beta. The equal coefficients 0.783 of alpha and beta need k_vz = 1"
        )
        return ClaimResult(computed, Verdict.HOLDS_ONLY_IF, because)
    return ClaimResult(computed, Verdict.FAILS, "the meshes give another matrix")


def plus_signs() -> ClaimResult:
    """Sense of the drives: N and Pr mesh externally, seen about +Z."""
    computed = {}
    for w in witnesses(build(SOURCE, "parts")):
        axes = [w.mechanism.joint(n).axis[2] for n in ROTARY]
        computed[f"{w.name}: turns about +Z per turn of gamma"] = [
            round(float(a * k), 12) for a, k in zip(axes, gear_matrix(w)[:, 2], strict=True)
        ]
    worst = min(min(v) for v in computed.values())
    if worst > 0.0:
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(
        computed,
        Verdict.HOLDS_ONLY_IF,
        "drives 1 and 2 are counted positive about -Z: each external mesh reverses the sense",
    )


def one_shaft() -> ClaimResult:
    """Only drive 3, 'responsible for OZ', turns."""
    computed = {}
    for w in witnesses(build(SOURCE, "parts")):
        computed[f"{w.name}: rates of alpha, beta, gamma"] = _plain(np.linalg.solve(gear_matrix(w), [0.0, 0.0, 1.0]))
    moving = {tuple(abs(x) > 1e-9 for x in v) for v in computed.values()}
    if moving == {(True, True, True)}:
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(
        computed, Verdict.FAILS, "beta stays: the output link turns about Z and about its own axis X', not about Y'"
    )


def compensation() -> ClaimResult:
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
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(computed, Verdict.FAILS, "alpha or beta move")


def coupled_drives() -> ClaimResult:
    """K is not diagonal."""
    matrices = {w.name: gear_matrix(w) for w in witnesses(build(SOURCE, "parts"))}
    computed = {f"{k}: K": _plain(m) for k, m in matrices.items()}
    off = min(float(np.abs(m - np.diag(np.diag(m))).max()) for m in matrices.values())
    if off > 1e-9:
        return ClaimResult(
            computed, Verdict.HOLDS, "turning about Z needs all three rotary drives, alpha and beta two each"
        )
    return ClaimResult(computed, Verdict.FAILS, "each drive turns one angle")


def grid_is_larger() -> ClaimResult:
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
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(computed, Verdict.FAILS, "the workspace reaches the border of the cube")


def workspace_test() -> ClaimResult:
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
        return ClaimResult(computed, Verdict.HOLDS)
    because = (
        f"the cardans may bend up to 90 deg; at home they bend by {home:.1f} deg already, and a limit of 45 deg leaves "
        f"{counts[2].xy_nodes} of {counts[0].xy_nodes} nodes"
    )
    return ClaimResult(computed, Verdict.HOLDS_ONLY_IF, because)


CLAIMS = (
    Claim("C18", "chapter 3, equation (2)",
          "The drive angles contain alpha and beta with the same product of ratios.",
          "alpha kpm kvz kz -+ beta kpm kvz kz + gamma kN", drive_law, THESIS),
    Claim("C19", "chapter 3, equation (2), sign of gamma",
          "Drives 1 and 2 turn with +kN per turn of gamma.", "+kN", plus_signs, THESIS),
    Claim("C20", "chapter 3, before equation (2)",
          "When only the shaft responsible for OZ turns, the output link turns about all axes.", "all axes", one_shaft, THESIS),
    Claim("C21", "chapter 3, before equation (2)",
          "Without turns about OX and OY the gears Pr have to turn together with the central shaft.", "together", compensation, THESIS),
    Claim("C22", "conclusion 3",
          "The drives of the rotations depend on each other.", "coupled", coupled_drives, THESIS),
    Claim("C23", "chapter 3, workspace",
          "The cube x = y = z = [-1 m, 1 m] is larger than the workspace.", "[-1, 1] m", grid_is_larger, THESIS),
    Claim("C24", "chapter 3, workspace",
          "A node belongs to the workspace when the three coordinates are real and within their intervals.",
          "real and within limits", workspace_test, THESIS),
)  # fmt: skip
