"""Claims of the thesis abstract on the equations of motion of the head."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.claims_freedoms import THESIS
from mechlab.catalog.delta6.poses import coordinates
from mechlab.catalog.delta6.probes import ANGLES, CENTRE, ROTARY, SOURCE
from mechlab.catalog.delta6.responses import response
from mechlab.catalog.delta6.witnesses import NumpyWitness, Witness, witnesses
from mechlab.experiment.entry import Claim, ClaimResult, Verdict
from mechlab.mechanism import Inertia, Mechanism
from mechlab.mechanism.geometry import Array

SIX = (*CENTRE, *ANGLES)


def _at(w: Witness, angles: tuple[float, float, float]) -> Array:
    """(nv, 3) motions of the head with O held, the witness moved to these angles."""
    return response(w.at(coordinates(SOURCE, "minimal", np.zeros(3), angles)[0]), SIX)[:, 3:]


def _with_output(inertia: Inertia) -> Mechanism:
    m = build(SOURCE, "minimal")
    return replace(m, bodies=tuple(replace(b, inertia=inertia) if b.name == "output" else b for b in m.bodies))


def _swing_of_mass(m: Mechanism, angle: int) -> float:
    """Largest change of the head's mass matrix, relative, when one angle goes through a turn."""
    w, found = NumpyWitness(m), []
    for x in np.linspace(0.0, 2.0 * np.pi, 9):
        angles = [0.4, 0.7, -0.3]
        angles[angle] = float(x)
        moves = _at(w, (angles[0], angles[1], angles[2]))
        found.append(moves.T @ w.mass_matrix() @ moves)
    return float(np.ptp(np.array(found), axis=0).max() / np.abs(found[0]).max())


def varying_coefficients() -> ClaimResult:
    """The mass matrix of the head for an output link of revolution, and for one that is not."""
    body = build(SOURCE, "minimal").body("output").inertia
    xx, yy, zz, xy, xz, yz = body.tensor
    lopsided = replace(body, tensor=(xx + 1e-5, yy + 2e-5, zz, xy, xz, yz))
    swings = {
        kind: [_swing_of_mass(_with_output(i), k) for k in (0, 1, 2)]
        for kind, i in (("of revolution", body), ("not of revolution", lopsided))
    }
    computed = {
        f"numpy: change of M with {a}, output link {kind}": s
        for kind, said in swings.items()
        for a, s in zip(ANGLES, said, strict=True)
    }
    depends = {kind: [s > 1e-9 for s in said] for kind, said in swings.items()}
    if all(depends["of revolution"]):
        return ClaimResult(computed, Verdict.HOLDS)
    if depends["not of revolution"][0] and not depends["of revolution"][0]:
        extra = "" if depends["not of revolution"][2] else "; on gamma nothing depends even then"
        return ClaimResult(
            computed, Verdict.HOLDS_ONLY_IF, f"the output link is not a body of revolution (else on beta alone){extra}"
        )
    return ClaimResult(computed, Verdict.FAILS, "the coefficients do not depend on these angles")


def no_gravity() -> ClaimResult:
    """What gravity asks of alpha, beta, gamma with O held, which the printed equations leave out."""
    computed: dict[str, object] = {}
    sizes: dict[str, float] = {}
    for name, gravity in (("9.81 m/s2", (0.0, 0.0, -9.81)), ("none", (0.0, 0.0, 0.0))):
        for w in witnesses(replace(build(SOURCE, "minimal"), gravity=gravity)):
            load = _at(w, (0.3, 0.2, -0.4)).T @ w.bias()
            computed[f"{w.name}: torques at rest, gravity {name} [N m]"] = load.round(9).tolist()
            sizes[name] = max(sizes.get(name, 0.0), float(np.abs(load).max()))
    computed["analytic: m g d cos(beta) [N m]"] = float(-closed.gravity(0.2, SOURCE.output_mass, SOURCE.head_offset)[1])
    if sizes["9.81 m/s2"] < 1e-9:
        return ClaimResult(computed, Verdict.HOLDS)
    if sizes["none"] < 1e-9:
        return ClaimResult(
            computed,
            Verdict.HOLDS_ONLY_IF,
            "no gravity acts, or the output link is balanced about O: otherwise m g d cos(beta) is missing in the equation of beta",
        )
    return ClaimResult(computed, Verdict.FAILS, "other torques are missing too")


def generalised_forces() -> ClaimResult:
    """Q = sum of M_k dphi_k/d(angle) against the virtual work of torques on the lower shafts of the gear train."""
    torques = np.array([0.3, -0.7, 1.1])
    expected = closed.generalized_forces(SOURCE.geometry, torques)
    computed = {"analytic: Q [N m]": expected.round(12).tolist()}
    worst = 0.0
    for w in witnesses(build(SOURCE, "parts")):
        moves = response(w.at(coordinates(SOURCE, "parts", np.zeros(3), [0.3, 0.2, -0.4])[0]), SIX)[:, 3:]
        work = moves.T @ sum(t * w.mechanism.row(n) for t, n in zip(torques, ROTARY, strict=True))
        computed[f"{w.name}: Q [N m]"] = work.round(12).tolist()
        worst = max(worst, float(np.abs(work - expected).max()))
    if worst < 1e-10:
        return ClaimResult(computed, Verdict.HOLDS)
    return ClaimResult(computed, Verdict.FAILS, "the virtual work of the drives is another")


CLAIMS = (
    Claim("C31", "chapter 4, kinetic energy",
          "The coefficients K' depend on the angles alpha, beta, gamma.", "alpha, beta, gamma", varying_coefficients, THESIS),
    Claim("C32", "chapter 4, Lagrange equations",
          "The equations of motion contain kinetic energy and drive torques alone.", "no gravity term", no_gravity, THESIS),
    Claim("C33", "chapter 4, generalised forces",
          "Q_a = M1 dphi1/da + M2 dphi2/da + M3 dphi3/da, and likewise for beta and gamma.", "sum of M dphi", generalised_forces, THESIS),
)  # fmt: skip
