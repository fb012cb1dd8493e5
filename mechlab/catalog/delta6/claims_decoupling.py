"""Claims of the thesis abstract on decoupling, constant ratio and singular positions."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.cardan_chain import cardan_chain, turned
from mechlab.catalog.delta6.claims_freedoms import THESIS
from mechlab.catalog.delta6.parameters import drive_names
from mechlab.catalog.delta6.poses import coordinates
from mechlab.catalog.delta6.probes import ANGLES, CENTRE, ROTARY, SLIDERS, SOURCE
from mechlab.catalog.delta6.responses import forces, response
from mechlab.catalog.delta6.witnesses import NumpyWitness, witnesses
from mechlab.experiment.entry import Claim, ClaimResult, Verdict
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.structure import rank

SIX = (*CENTRE, *ANGLES)


def _coupling() -> tuple[dict[str, float], dict[str, float]]:
    """Per witness: slider rates per angle rate with O held, and rates of D per rotary drive with the sliders held."""
    centre: dict[str, float] = {}
    tool: dict[str, float] = {}
    for w in witnesses(build(SOURCE, "full")):
        w.at(coordinates(SOURCE, "full", [[0.02, -0.03, 0.01]], [[0.3, -0.5, 0.7]])[0])
        m, moves, driven = w.mechanism, response(w, SIX), response(w, drive_names())
        sliders, rotary = (np.array([m.row(n) for n in names]) for names in (SLIDERS, ROTARY))
        centre[w.name] = float(max(np.abs(sliders @ moves[:, 3:]).max(), np.abs(rotary @ moves[:, :3]).max()))
        tool[w.name] = float(np.abs(w.point_jacobian("D")[:3] @ driven[:, 3:]).max())
    return centre, tool


def decoupled_centre() -> ClaimResult:
    """Translations of O against rotations."""
    centre, _ = _coupling()
    computed = {f"{k}: largest cross rate": v for k, v in centre.items()}
    if max(centre.values()) < 1e-12:
        return ClaimResult(computed, Verdict.HOLDS, "for O, where the three axes of the head meet")
    return ClaimResult(computed, Verdict.FAILS, "sliders and angles of the head are coupled")


def decoupled_tool() -> ClaimResult:
    """The same for D, whose velocity the source calls V."""
    _, tool = _coupling()
    computed = {f"{k}: rate of D per rotary drive [m/rad]": v for k, v in tool.items()}
    if max(tool.values()) < 1e-12:
        return ClaimResult(computed, Verdict.HOLDS)
    because = (
        "with the sliders at rest D moves when the head turns, for it stands 50 mm off O; holding D and turning "
        "needs the sliders. It is true of O"
    )
    return ClaimResult(computed, Verdict.FAILS, because)


def decoupled_forces() -> ClaimResult:
    """Forces of the sliders while O stands still and the head turns at 1 Hz."""
    t = np.linspace(0.0, 1.0, 24, endpoint=False)[:, None]
    size, phase, w = np.array([0.6, 0.5, 0.4]), np.array([0.0, 1.0, 2.0]), 2.0 * math.pi
    angles, rates, accel = (
        f * size * np.sin(w * t + phase + s) for f, s in ((1, 0.0), (w, 0.5 * math.pi), (w * w, math.pi))
    )
    witness = NumpyWitness(build(SOURCE, "minimal"))
    found = []
    for k, q in enumerate(coordinates(SOURCE, "minimal", np.zeros((len(t), 3)), angles)):
        v = response(witness.at(q), SIX)[:, 3:] @ rates[k]
        found.append(forces(witness.at(q, v), SIX, [0.0, 0.0, 0.0, *accel[k]], drive_names())[:3])
    resting = forces(witness.at(witness.mechanism.reference()), SIX, np.zeros(6), drive_names())[:3]
    forces_on = np.array(found)
    computed = {
        "numpy: slider force at rest [N]": resting.tolist(),
        "numpy: smallest [N]": float(forces_on.min()),
        "numpy: largest [N]": float(forces_on.max()),
    }
    swing = float(np.ptp(forces_on)) / float(np.abs(resting).max())
    if swing < 1e-6:
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(
        computed,
        Verdict.FAILS,
        f"the forces of the sliders change by {100 * swing:.1f} % when only the head turns: the output link has its mass 50 mm off O",
    )


def constant_ratio() -> ClaimResult:
    """The cardan shafts by themselves: as built, with forks out of phase, with shafts that are not parallel."""
    bend = float(closed.cardan_bend(SOURCE.geometry, np.zeros(3))[0])
    inputs = np.radians(np.arange(0.0, 361.0, 30.0))

    def error(misphase: float, tilt: float) -> dict[str, float]:
        chain = cardan_chain(SOURCE.rod_length, bend, misphase, tilt)
        return {w.name: float(np.degrees(np.abs(turned(w, inputs) - inputs).max())) for w in witnesses(chain)}

    cases = {
        "in phase, parallel": error(0.0, 0.0),
        "forks 90 deg out of phase": error(0.5 * math.pi, 0.0),
        "shafts 10 deg apart": error(0.0, math.radians(10.0)),
    }
    computed = {f"{who}: {case}, output - input [deg]": x for case, said in cases.items() for who, x in said.items()}
    good, bad = max(cases["in phase, parallel"].values()), [min(said.values()) for said in list(cases.values())[1:]]
    if good > 1e-8:
        return ClaimResult(computed, Verdict.FAILS, f"even in phase the output is off by {good:.3g} deg")
    if max(bad) < 1e-8:
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(
        computed, Verdict.HOLDS_ONLY_IF, "the two forks of every cardan rod are in phase and its shafts are parallel"
    )


def rotation_singular() -> ClaimResult:
    """Rates of the rotary drives for an angular velocity of 1 rad/s, towards beta = 90 deg."""
    tilts = np.array([0.0, 60.0, 80.0, 89.0, 89.99])
    gains = closed.drive_rate_gain(SOURCE.geometry, np.radians(tilts))
    computed: dict[str, object] = {
        f"analytic: largest drive rates at {b:g} deg": float(g) for b, g in zip(tilts, gains, strict=True)
    }
    ranks = {}
    for w in witnesses(build(SOURCE, "parts")):
        w.at(coordinates(SOURCE, "parts", np.zeros(3), [0.3, 0.5 * math.pi, -0.7])[0])
        ranks[w.name] = rank(w.point_jacobian("D")[3:] @ response(w, drive_names()))
    computed |= {f"{k}: directions of angular velocity at 90 deg": r for k, r in ranks.items()}
    if min(ranks.values()) == 3 and gains[-1] < 10.0 * gains[0]:
        return ClaimResult(computed, Verdict.HOLDS)
    because = (
        "at beta = +-90 deg the axes of alpha and gamma coincide and one angular velocity is lost (det E = cos beta). "
        "Constant matrices show only that nothing is singular between the drives and the angles"
    )
    return ClaimResult(computed, Verdict.FAILS, because)


def translation_singular() -> ClaimResult:
    """Conditioning of the sliders towards the edge of the reach."""
    g = SOURCE.geometry.leg_offsets[0]
    outward, edge = g / np.linalg.norm(g), float(closed.reach_margin(SOURCE.geometry, np.zeros(3)))
    shares = (0.0, 0.7, 0.999, 1.0 - 1e-9)
    values = [float(closed.condition(SOURCE.geometry, [*(s * edge * outward), 0.0])) for s in shares]
    computed: dict[str, object] = {"analytic: edge of the reach [m]": edge}
    computed |= {f"analytic: condition at {s:.9g} of it": c for s, c in zip(shares, values, strict=True)}
    if values[-1] < 1e3:
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(
        computed,
        Verdict.FAILS,
        f"at the edge of the reach, {edge:.4g} m from the middle, a rod lies horizontal and the slider rates have no bound (type I)",
    )


def _rod_triples(centre: Array) -> Array:
    """(n,) det of the three unit rod directions."""
    h = closed.leg_heights(SOURCE.geometry, centre)
    rods = np.concatenate([closed.leg_vectors(SOURCE.geometry, centre), -h[..., None]], axis=-1)
    return np.linalg.det(rods / SOURCE.rod_length)


def uncontrolled_motion() -> ClaimResult:
    """The source's own notion: motions of the output link that no drive sees. A scan of the reach, no proof."""
    nodes = np.arange(-100, 101) / 100.0 * 2.0 * SOURCE.rod_length
    grid = np.stack([*np.meshgrid(nodes, nodes, indexing="ij"), np.zeros((201, 201))], axis=-1).reshape(-1, 3)
    inside = grid[closed.squared_heights(SOURCE.geometry, grid).min(axis=1) > 0.0]
    triples = _rod_triples(inside)
    determinant = float(np.linalg.det(closed.drive_matrix(SOURCE.geometry)))
    computed = {"analytic: poses": len(inside), "analytic: smallest |det| of the rods": float(np.abs(triples).min()),
                "analytic: signs": np.unique(np.sign(triples)).tolist(), "analytic: det K": determinant}  # fmt: skip
    if len(np.unique(np.sign(triples))) == 1 and determinant != 0.0:
        return ClaimResult(
            computed, Verdict.HOLDS, "with the drives held nothing moves, in no pose of the scan (which is no proof)"
        )
    return ClaimResult(computed, Verdict.FAILS, "the rods are linearly dependent somewhere within the reach (type II)")


CLAIMS = (
    Claim("C06", "chapter 2 and conclusion 2, head centre",
          "Translations and rotations are kinematically decoupled (said of O).", "no relation", decoupled_centre, THESIS),
    Claim("C07", "chapter 4, A V = -B w, output link centre",
          "V, the velocity of the centre of the output link, depends on the linear drives alone (said of D).",
          "no relation", decoupled_tool, THESIS),
    Claim("C08", "introduction and conclusion 2, dynamics",
          "The decoupling makes translations and rotations independent in dynamics too.", "no relation", decoupled_forces, THESIS),
    Claim("C09", "chapter 2, constant ratio",
          "The ratio between rotary drives and output link is constant.", "constant", constant_ratio, THESIS),
    Claim("C10", "chapter 4, rotation example",
          "The constant matrices show that there are no singular positions in rotation.", "none", rotation_singular, THESIS),
    Claim("C11", "title, conclusions",
          "The mechanism has no singular positions.", "none", translation_singular, THESIS),
    Claim("C12", "introduction, meaning of singular",
          "There is no position in which the output link can move without its drives.", "none", uncontrolled_motion, THESIS),
)  # fmt: skip
