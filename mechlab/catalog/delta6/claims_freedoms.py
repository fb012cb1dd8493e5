"""Claims of the thesis abstract on degrees of freedom."""

from __future__ import annotations

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.parameters import drive_names
from mechlab.catalog.delta6.poses import coordinates
from mechlab.catalog.delta6.probes import ANGLES, CENTRE, ROTARY, SOURCE
from mechlab.catalog.delta6.witnesses import NumpyWitness, witnesses
from mechlab.experiment.entry import Claim, ClaimResult, Verdict
from mechlab.mechanism.structure import null_space, rank

THESIS = "thesis abstract on a 6-DOF parallel mechanism with decoupled motions"
SIX = (*CENTRE, *ANGLES)


def _generic(fidelity: str) -> NumpyWitness:
    """The mechanism at a pose without symmetry."""
    w = NumpyWitness(build(SOURCE, fidelity))
    return w.at(coordinates(SOURCE, fidelity, [[0.02, -0.03, 0.01]], [[0.3, -0.5, 0.7]])[0])


def translation_count() -> ClaimResult:
    """Part 1: three formulas against the rank with the rotary drives held."""
    w = _generic("full")
    held = np.vstack([w.jacobian(), *(w.mechanism.row(n) for n in ROTARY)])
    basis = null_space(held)
    moving = rank(np.array([w.mechanism.row(n) for n in CENTRE]) @ basis)
    counts = {
        "cardans counted as if they could not turn": closed.somov_malyshev(10, 3, 6, 6),
        "cardans with turning shafts": closed.somov_malyshev(16, 9, 6, 6),
        "all rods between ball joints": closed.somov_malyshev(10, 3, 0, 12),
    }
    computed = counts | {"numpy: motions of the platform": moving, "numpy: freedoms with local spins": basis.shape[1]}
    if moving != 3:
        return ClaimResult(computed, Verdict.FAILS, f"the platform has {moving} motions")
    if set(counts.values()) == {3}:
        return ClaimResult(computed, Verdict.HOLDS)
    because = (
        "the cardan shafts are counted as if they could not turn; with turning shafts the formula gives "
        "9 = 3 + 3 shafts + 3 spins of the plain rods. The platform does have three motions (by rank)"
    )
    return ClaimResult(computed, Verdict.HOLDS_ONLY_IF, because)


def _gear_freedoms(joints: tuple[str, ...], meshes: tuple[str, ...]) -> int:
    """Freedoms of some joints of `parts` under some of its meshes, by rank."""
    m = build(SOURCE, "parts")
    rows = np.array([m.coefficient_row(r.coefficients) for r in m.relations if r.name in meshes])
    return len(joints) - rank(rows[:, [m.v_slice[j].start for j in joints]])


def _count(formula: int, measured: int, printed: int, what: str) -> ClaimResult:
    computed = {"analytic: formula": formula, "numpy: rank": measured}
    if formula == printed == measured:
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(computed, Verdict.FAILS, f"{what}: the formula gives {formula}, the rank {measured}")


def transfer_count() -> ClaimResult:
    """Part 2: N1, N2, Pr1, Pr2, two planets and the carrier."""
    joints = ("phi1", "phi2", "rho1", "rho2", "nu1", "nu2", "gamma")
    measured = _gear_freedoms(joints, ("N1_Pr1", "N2_Pr2", "Pr1_planet1", "Pr2_planet2"))
    return _count(closed.chebyshev(7, 7, 4), measured, 3, "transfer mechanism")


def head_count() -> ClaimResult:
    """Part 3: T-carrier, output gear, two double bevels, two input bevels; its base held."""
    joints = ("alpha", "beta", "p1", "p2", "nu1", "nu2")
    measured = _gear_freedoms(joints, ("Nz1_Pz1", "Nz2_Pz2", "Pz1_VZ", "Pz2_VZ"))
    return _count(closed.artobolevsky(6, 6, 4), measured, 2, "head")


def total_count() -> ClaimResult:
    """The whole: rank of the motions of the output link, and what the drives do not see."""
    computed: dict[str, int] = {}
    for w in witnesses(build(SOURCE, "full")):
        w.at(coordinates(SOURCE, "full", [[0.02, -0.03, 0.01]], [[0.3, -0.5, 0.7]])[0])
        basis = null_space(w.jacobian())
        twist = w.point_jacobian("D") @ basis
        spins = rank(twist[3:])
        computed |= {f"{w.name}: motions of the output link": rank(twist), f"{w.name}: of them rotations": spins}
    motions, turns = (set(list(computed.values())[k::2]) for k in (0, 1))
    if motions == {6} and turns == {3}:
        return ClaimResult(computed, Verdict.HOLDS, "three spins of the plain rods come on top; they are local")
    return ClaimResult(computed, Verdict.FAILS, f"the output link has {sorted(motions)} motions")


def without_plain_rods() -> ClaimResult:
    """The mock-up of figure 15: the cardan rods alone, all six drives held."""
    w = _generic("full")
    m = w.mechanism
    keep = [k for k, row in enumerate(w.constraints.rows) if not row.startswith("plain")]
    columns = [k for k, name in enumerate(m.rate_names) if not name.startswith("ball")]
    drives = np.array([m.row(n) for n in drive_names()])
    basis = null_space(np.vstack([w.jacobian()[keep], drives])[:, columns])
    free = rank(w.point_jacobian("O")[3:, columns] @ basis)
    computed = {"numpy: free rotations of the platform, drives held": free}
    if free == 0:
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(
        computed,
        Verdict.HOLDS_ONLY_IF,
        f"something else holds the platform parallel: the three cardan rods leave it {free} rotations",
    )


CLAIMS = (
    Claim("C01", "chapter 2, formula of Somov and Malyshev",
          "The first part, which translates, has three degrees of freedom.", 3, translation_count, THESIS),
    Claim("C02", "chapter 2, formula of Chebyshev",
          "The transfer mechanism, eight links of which seven move, has three degrees of freedom.", 3, transfer_count, THESIS),
    Claim("C03", "chapter 2, formula of Artobolevsky",
          "The head, seven elements of which six move, has two degrees of freedom.", 2, head_count, THESIS),
    Claim("C04", "chapter 2, conclusion on freedoms",
          "Together there are six degrees of freedom, three translations and three rotations.", "3 + 3", total_count, THESIS),
    Claim("C05", "chapter 5, figure 15",
          "The platform is moved by the linear drives although the links with spherical joints are left out.",
          "works without them", without_plain_rods, THESIS),
)  # fmt: skip
