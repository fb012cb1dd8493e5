"""Claims C01 to C12 of the thesis abstract: degrees of freedom, decoupling, constant ratio, singular positions."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.bibliography import THESIS
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.parameters import CENTRE, DRIVES, ROTARY, SLIDERS, SOURCE
from mechlab.catalog.delta6.poses import at_poses, coordinates, forces, gear_matrix, random_poses, response, rows_of
from mechlab.engines.protocol import StatePlant
from mechlab.experiment.tree_plant import TreePlant
from mechlab.kit.claims import Evidence, Ledger, above, below, equals, evidence, fails, holds, labelled, only_if
from mechlab.mechanism import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import null_space, rank

LEDGER = Ledger(THESIS)
GENERIC_CENTRE, GENERIC_ANGLES = [[0.02, -0.03, 0.01]], [[0.3, -0.5, 0.7]]
"""A pose without symmetry."""


def _generic() -> TreePlant:
    """The full mechanism at a pose without symmetry."""
    w = TreePlant(build(SOURCE, "full"))
    return w.set(coordinates(SOURCE, "full", GENERIC_CENTRE, GENERIC_ANGLES)[0])


@LEDGER.claim(
    "C01", "chapter 2, formula of Somov and Malyshev",
    "The first part, which translates, has three degrees of freedom.", 3,
    fails("the platform has {moving} motions", when=~equals("moving")),
    holds(when=equals("formulas")),
    only_if("the cardan shafts are counted as if they could not turn; with turning shafts the formula gives 9 = 3 + 3 shafts + "
            "3 spins of the plain rods. The platform does have three motions (by rank)"),
)  # fmt: skip
def translation_count() -> Evidence:
    """Part 1: three formulas against the rank with the rotary drives held."""
    w = _generic()
    basis = null_space(np.vstack([w.jacobian(), rows_of(w, ROTARY)]))
    moving = rank(rows_of(w, CENTRE) @ basis)
    counts = {
        "cardans counted as if they could not turn": closed.somov_malyshev(10, 3, 6, 6),
        "cardans with turning shafts": closed.somov_malyshev(16, 9, 6, 6),
        "all rods between ball joints": closed.somov_malyshev(10, 3, 0, 12),
    }
    by_rank = {"numpy: motions of the platform": moving, "numpy: freedoms with local spins": basis.shape[1]}
    return evidence(counts | by_rank, moving=moving, formulas=list(counts.values()))


def _gear_freedoms(formula: int, joints: tuple[str, ...], meshes: tuple[str, ...]) -> Evidence:
    """Freedoms by a formula, and those of some joints of `parts` under some of its meshes, by rank."""
    m = build(SOURCE, "parts")
    rows = np.array([m.coefficient_row(r.coefficients) for r in m.relations if r.name in meshes])
    measured = len(joints) - rank(rows[:, [m.v_slice[j].start for j in joints]])
    return evidence({"analytic: formula": formula, "numpy: rank": measured}, formula=formula, measured=measured)


COUNTED_RIGHT = holds(when=equals("analytic: formula") & equals("numpy: rank"))


@LEDGER.claim(
    "C02", "chapter 2, formula of Chebyshev",
    "The transfer mechanism, eight links of which seven move, has three degrees of freedom.", 3,
    COUNTED_RIGHT, fails("transfer mechanism: the formula gives {formula}, the rank {measured}"),
)  # fmt: skip
def transfer_count() -> Evidence:
    """Part 2: N1, N2, Pr1, Pr2, two planets and the carrier."""
    joints = ("phi1", "phi2", "rho1", "rho2", "nu1", "nu2", "gamma")
    meshes = ("N1_Pr1", "N2_Pr2", "Pr1_planet1", "Pr2_planet2")
    return _gear_freedoms(closed.chebyshev(7, 7, 4), joints, meshes)


@LEDGER.claim(
    "C03", "chapter 2, formula of Artobolevsky",
    "The head, seven elements of which six move, has two degrees of freedom.", 2,
    COUNTED_RIGHT, fails("head: the formula gives {formula}, the rank {measured}"),
)  # fmt: skip
def head_count() -> Evidence:
    """Part 3: T-carrier, output gear, two double bevels, two input bevels; its base held."""
    joints = ("alpha", "beta", "p1", "p2", "nu1", "nu2")
    return _gear_freedoms(closed.artobolevsky(6, 6, 4), joints, ("Nz1_Pz1", "Nz2_Pz2", "Pz1_VZ", "Pz2_VZ"))


@LEDGER.claim(
    "C04", "chapter 2, conclusion on freedoms",
    "Together there are six degrees of freedom, three translations and three rotations.", "3 + 3",
    holds("three spins of the plain rods come on top; they are local",
          when=equals("*: motions of the output link", 6) & equals("*: of them rotations", 3)),
    fails("the output link has {motions} motions"),
)  # fmt: skip
def total_count() -> Evidence:
    """The whole: rank of the motions of the output link, and what the drives do not see."""

    def motions(w: StatePlant) -> tuple[int, int]:
        twist = w.point_jacobian("D") @ null_space(w.jacobian())
        return rank(twist), rank(twist[3:])

    computed: dict[str, int] = {}
    found = at_poses(SOURCE, "full", GENERIC_CENTRE, GENERIC_ANGLES, motions)
    for name, ((all_of_them, rotations),) in found.items():
        computed[f"{name}: motions of the output link"] = int(all_of_them)
        computed[f"{name}: of them rotations"] = int(rotations)
    return evidence(computed, motions=sorted(set(list(computed.values())[::2])))


@LEDGER.claim(
    "C05", "chapter 5, figure 15",
    "The platform is moved by the linear drives although the links with spherical joints are left out.",
    "works without them",
    holds(when=equals("free", 0)),
    only_if("something else holds the platform parallel: the three cardan rods leave it {free} rotations"),
)  # fmt: skip
def without_plain_rods() -> Evidence:
    """The mock-up of figure 15: the cardan rods alone, all six drives held."""
    w = _generic()
    keep = [k for k, row in enumerate(ConstraintSet(w.mechanism).rows) if not row.startswith("plain")]
    columns = [k for k, name in enumerate(w.mechanism.rate_names) if not name.startswith("ball")]
    basis = null_space(np.vstack([w.jacobian()[keep], rows_of(w, DRIVES)])[:, columns])
    free = rank(w.point_jacobian("O")[3:, columns] @ basis)
    return evidence({"numpy: free rotations of the platform, drives held": free}, free=free)


def _cross_rates(w: StatePlant) -> list[float]:
    """Largest slider rate per angle rate and drive rate per rate of O; largest rate of D per rotary drive [m/rad]."""
    moves, driven = response(w), response(w, DRIVES)
    sliders, rotary = rows_of(w, SLIDERS), rows_of(w, ROTARY)
    centre = max(np.abs(sliders @ moves[:, 3:]).max(), np.abs(rotary @ moves[:, :3]).max())
    return [float(centre), float(np.abs(w.point_jacobian("D")[:3] @ driven[:, 3:]).max())]


def _coupling(which: int) -> dict[str, float]:
    """One of the two cross rates, by each witness at a pose without symmetry."""
    found = at_poses(SOURCE, "full", GENERIC_CENTRE, GENERIC_ANGLES, _cross_rates)
    return {witness: float(rates[0, which]) for witness, rates in found.items()}


@LEDGER.claim(
    "C06", "chapter 2 and conclusion 2, head centre",
    "The kinematic decoupling leaves translations and rotations without relation (read of O).", "no relation",
    holds("for O, where the three axes of the head meet", when=below(1e-12, "*: largest cross rate")),
    fails("sliders and angles of the head are coupled"),
)  # fmt: skip
def decoupled_centre() -> Evidence:
    """Translations of O against rotations."""
    return evidence(labelled(_coupling(0), "largest cross rate"))


@LEDGER.claim(
    "C07", "chapter 4, A V = -B w, output link centre",
    "V, the velocity of the centre of the output link, depends on the linear drives alone (said of D).", "no relation",
    holds(when=below(1e-12, "*: rate of D per rotary drive [m/rad]")),
    fails("with the sliders at rest D moves when the head turns, for it stands 50 mm off O; holding D and turning "
          "needs the sliders. It is true of O"),
)  # fmt: skip
def decoupled_tool() -> Evidence:
    """The same for D, whose velocity the source calls V."""
    return evidence(labelled(_coupling(1), "rate of D per rotary drive [m/rad]"))


@LEDGER.claim(
    "C08", "introduction, on the approach",
    "Decoupling translations from rotations simplifies the tasks of kinematics, dynamics and control.", "simplifies",
    holds("the inertia of the translations does not depend on the angles, nor that of the rotations on the place. Independence in "
          "dynamics is not claimed, nor true: the forces of the sliders change by {percent:.1f} % when only the head turns, as the "
          "output link has its mass off O",
          when=below(1e-9, "numpy: change of the inertia *")),
    fails("the inertias of translations and rotations depend on each other's coordinates"),
)  # fmt: skip
def decoupled_forces() -> Evidence:
    """Blocks of the mass matrix over the other coordinates; forces of the sliders while O stands still and the head turns at 1 Hz."""
    t = np.linspace(0.0, 1.0, 24, endpoint=False)[:, None]
    size, phase, w = np.array([0.6, 0.5, 0.4]), np.array([0.0, 1.0, 2.0]), 2.0 * math.pi
    angles, rates, accel = (
        f * size * np.sin(w * t + phase + s) for f, s in ((1, 0.0), (w, 0.5 * math.pi), (w * w, math.pi))
    )
    witness = TreePlant(build(SOURCE, "minimal"))
    found = []
    for k, q in enumerate(coordinates(SOURCE, "minimal", np.zeros((len(t), 3)), angles)):
        v = response(witness.set(q))[:, 3:] @ rates[k]
        found.append(forces(witness.set(q, v), [0.0, 0.0, 0.0, *accel[k]], DRIVES)[:3])
    resting = forces(witness.set(witness.mechanism.reference()), np.zeros(6), DRIVES)[:3]
    moving = np.array(found)
    computed = {
        "numpy: slider force at rest [N]": resting.tolist(),
        "numpy: smallest [N]": float(moving.min()),
        "numpy: largest [N]": float(moving.max()),
    }
    centre, turned = random_poses(SOURCE, 6)
    for text, block, here, how in (("translations with the angles", slice(0, 3), np.zeros((6, 3)), turned),
                                   ("rotations with the place", slice(3, 6), centre, np.tile(GENERIC_ANGLES, (6, 1)))):  # fmt: skip
        found = []
        for q in coordinates(SOURCE, "minimal", here, how):
            moves = response(witness.set(q))[:, block]
            found.append(moves.T @ witness.mass_matrix() @ moves)
        change = np.ptp(np.array(found), axis=0).max() / np.abs(found[0]).max()
        computed[f"numpy: change of the inertia of the {text}, relative"] = float(change)
    return evidence(computed, percent=100 * float(np.ptp(moving)) / float(np.abs(resting).max()))


REGULAR = below(1e-9, "*: change of K at another pose") & above(1e-3, "det")
"""The rotary drives and the angles fix each other by one constant matrix."""


@LEDGER.claim(
    "C10", "chapter 4, rotation example",
    "The constant matrices show that there are no singular positions in rotation.", "none",
    fails("the matrix is not constant, or has no inverse", when=~REGULAR),
    holds(when=equals("*: directions of angular velocity at 90 deg", 3) & below(10.0, "growth")),
    only_if("singular means what the introduction says, a motion of the output link that no drive sees: drives and angles fix each "
            "other everywhere (det K = {det:.4g}). At beta = +-90 deg the axes of alpha and gamma coincide and an angular velocity is "
            "lost (det E = cos beta), which is commonly called singular too"),
)  # fmt: skip
def rotation_singular() -> Evidence:
    """Rates of the rotary drives for an angular velocity of 1 rad/s, towards beta = 90 deg; K here and elsewhere."""
    tilts = np.array([0.0, 60.0, 80.0, 89.0, 89.99])
    gains = closed.single_drive_rate_gain(SOURCE.geometry, np.radians(tilts)).max(axis=-1)
    computed = {f"analytic: largest rate of a drive at {b:g} deg": float(g) for b, g in zip(tilts, gains, strict=True)}
    pole = np.zeros(3), [0.3, 0.5 * math.pi, -0.7]
    ranks = at_poses(SOURCE, "parts", *pole, lambda w: rank(w.point_jacobian("D")[3:] @ response(w, DRIVES)))
    turns = labelled({k: int(found[0]) for k, found in ranks.items()}, "directions of angular velocity at 90 deg")
    K = closed.drive_matrix(SOURCE.geometry)
    elsewhere = at_poses(SOURCE, "parts", GENERIC_CENTRE, GENERIC_ANGLES, lambda w: float(np.abs(gear_matrix(w) - K).max()))
    same = labelled({k: float(v[0]) for k, v in elsewhere.items()}, "change of K at another pose")
    return evidence(computed | turns | same, growth=gains[-1] / gains[0], det=float(np.linalg.det(K)))


@LEDGER.claim(
    "C11", "chapter 2, last sentence, and conclusions; the aim says: in the transmission of rotations",
    "The mechanism has no singular positions.", "none",
    fails("the rods are linearly dependent somewhere within the reach (type II)", when=~equals("sides", 1)),
    holds(when=below(1e3, "largest")),
    only_if("singular means what the introduction says, a motion of the output link that no drive sees (C12), or the rotations alone "
            "are meant, as in the aim. At the edge of the reach, {edge:.4g} m from the middle, a rod lies horizontal and the slider "
            "rates have no bound (type I)"),
)  # fmt: skip
def translation_singular() -> Evidence:
    """Conditioning of the sliders towards the edge of the reach."""
    g = SOURCE.geometry.leg_offsets[0]
    outward, edge = g / np.linalg.norm(g), float(closed.reach_margin(SOURCE.geometry, np.zeros(3)))
    shares = (0.0, 0.7, 0.999, 1.0 - 1e-9)
    values = [float(closed.condition(SOURCE.geometry, [*(s * edge * outward), 0.0])) for s in shares]
    computed = {"analytic: edge of the reach [m]": edge}
    computed |= {f"analytic: condition at {s:.9g} of it": c for s, c in zip(shares, values, strict=True)}
    return evidence(computed, edge=edge, largest=values[-1], sides=len(np.unique(np.sign(_rod_triples(_inside())))))


def _inside() -> Array:
    """(n, 3) nodes O within the reach."""
    nodes = np.arange(-100, 101) / 100.0 * 2.0 * SOURCE.rod_length
    grid = np.stack([*np.meshgrid(nodes, nodes, indexing="ij"), np.zeros((201, 201))], axis=-1).reshape(-1, 3)
    return np.asarray(grid[closed.squared_heights(SOURCE.geometry, grid).min(axis=1) > 0.0])


def _rod_triples(centre: Array) -> Array:
    """(n,) det of the three unit rod directions."""
    h = closed.leg_heights(SOURCE.geometry, centre)
    rods = np.concatenate([closed.leg_vectors(SOURCE.geometry, centre), -h[..., None]], axis=-1)
    return np.linalg.det(rods / SOURCE.rod_length)


@LEDGER.claim(
    "C12", "introduction, meaning of singular",
    "There is no position in which the output link can move without its drives.", "none",
    holds("with the drives held nothing moves, in no pose of the scan (which is no proof)",
          when=equals("sides", 1) & ~equals("analytic: det K", 0.0)),
    fails("the rods are linearly dependent somewhere within the reach (type II)"),
)  # fmt: skip
def uncontrolled_motion() -> Evidence:
    """The source's own notion: motions of the output link that no drive sees. A scan of the reach, no proof."""
    inside = _inside()
    triples = _rod_triples(inside)
    signs = np.unique(np.sign(triples)).tolist()
    computed = {
        "analytic: poses": len(inside),
        "analytic: smallest |det| of the rods": float(np.abs(triples).min()),
        "analytic: signs": signs,
        "analytic: det K": float(np.linalg.det(closed.drive_matrix(SOURCE.geometry))),
    }
    return evidence(computed, sides=len(signs))
