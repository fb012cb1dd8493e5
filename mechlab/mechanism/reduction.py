"""Exact reduction of a train of gears: as many coordinates as freedoms, no constraint rows, equal mass matrix.

Independent joints become nested bodies on one axis, every other part a Shaft with inertia; orbiting masses count
in the inertia of their carrier. Every joint of the original stays a joint or a shaft of its name, with the same
physical value.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.angle_basis import AngleBasis, Row, dependent_angles, eliminate, positive
from mechlab.mechanism.constant_inertia import InertiaShare, shares
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Body, Shaft
from mechlab.mechanism.reduced_bodies import Chain, chain_bodies, chains, coaxial, part_shafts, without_welds

MASS_TOLERANCE = 1e-12  # relative to the largest entry


@dataclass(frozen=True)
class Reduction:
    """`mechanism`: the reduced model. `basis`: q = K y of the original in its independent joints y."""

    original: Mechanism
    mechanism: Mechanism
    basis: AngleBasis

    def expand(self, q: Array) -> Array:
        """(..., nq) coordinates of the original from those of the reduced model (..., f): every part's angle, exactly."""
        names = [j.name for j in self.original.joints]
        columns = [self.mechanism.value(n, q) - self.original.zero(n) for n in names]
        return np.stack(columns, axis=-1)


def reduce(mechanism: Mechanism, independent: Sequence[str] | None = None, name: str | None = None) -> Reduction:
    """The exact reduction of a Mechanism of revolute-jointed parts and LinearRelations.

    `independent`: joints to keep as coordinates (default: carriers and other parts on a common axis first). Damping, dry
    friction, springs, armatures, drives and shafts are kept. A part that turns on a Shaft's carrier has no picture in
    the reduced model (`expand` gives its pose). The mass matrix is compared with K^T M K at random poses before this
    returns. Raises MechlabError that says why there is no exact reduction: loops, other joints than revolutes, point
    springs, ranges of dependent joints, an inertia that depends on the pose, gravity across the axes, parts that cannot
    stand on one path.
    """
    m = without_welds(mechanism)
    _eligible(m)
    basis = dependent_angles(m, independent or _choose(m))
    found = shares(m, basis)
    rows = _rows_with_inertia(m, basis, found)
    damped = [basis.rows[j.name] for j in m.joints if j.damping] + [
        basis.combine(s.coefficients) for s in m.shafts if s.damping
    ]
    chain = chains(m, basis, [*rows, *damped])
    kept = {link.body.name for link in chain.links if link.nested}  # these keep their own inertia
    rows = _rows_with_inertia(m, basis, [x for x in found if x.owner not in kept])
    titles = {positive(x.row): (f"{x.owner}_{x.kind}", x.row) for x in reversed(found)}
    reduced = _assemble(m, basis, chain, rows, titles, name or m.name)
    _same_mass(m, basis, chain, reduced)
    return Reduction(mechanism, reduced, basis)


def _eligible(m: Mechanism) -> None:
    for joint in m.joints:
        if joint.kind != "revolute":
            raise MechlabError(
                f"{m.name}: joint {joint.name!r} is {joint.kind}; an exact reduction takes revolutes only."
            )
    for body in m.bodies:
        if len(body.joints) != 1:
            raise MechlabError(
                f"{m.name}: body {body.name!r} has {len(body.joints)} joints; give each a body of its own."
            )
    if m.springs:
        raise MechlabError(
            f"{m.name}: spring {m.springs[0].name!r} acts between points; its force depends on the pose. "
            "Use a stiffness of a joint or shaft."
        )


def _choose(m: Mechanism) -> list[str]:
    """Independent joints: those on the axis that most parts share, carriers and driven parts first."""
    driven = {d.on for d in m.drives}
    parents = {b.parent for b in m.bodies}

    def worth(body: Body) -> tuple[bool, int, bool, bool, bool]:
        joint = body.joints[0]
        grounded = body.parent == GROUND
        sharing = sum(coaxial(m, body, b) for b in m.bodies if b.parent == GROUND) if grounded else 0
        return grounded, sharing, body.name in parents, joint.range is not None, joint.name in driven

    ranked = sorted(m.bodies, key=worth)
    order = [b.joints[0].name for b in ranked]
    pivots = eliminate(m, order)
    return [n for n in order if n not in pivots]


def _rows_with_inertia(m: Mechanism, basis: AngleBasis, found: list[InertiaShare]) -> dict[Row, float]:
    """Inertia [kg m2] by row over the independent joints; a row and its negative count as one."""
    out: dict[Row, float] = {}
    for share in found:
        _add(out, share.row, share.inertia)
    for joint in m.joints:
        _add(out, basis.rows[joint.name], joint.armature)
    for shaft in m.shafts:
        _add(out, basis.combine(shaft.coefficients), shaft.inertia)
    return out


def _add(out: dict[Row, float], row: Row, inertia: float) -> None:
    if inertia > 0.0 and any(row):
        key = positive(row)
        out[key] = out.get(key, 0.0) + inertia


def _assemble(
    m: Mechanism,
    basis: AngleBasis,
    chain: Chain,
    inertia: dict[Row, float],
    titles: dict[Row, tuple[str, Row]],
    name: str,
) -> Mechanism:
    left = dict(inertia)
    bodies = chain_bodies(m, chain, left)
    shafts = part_shafts(m, basis, chain, left)
    taken = {j.name for b in bodies for j in b.joints} | {s.name for s in shafts}
    for row, value in left.items():
        title, turning = titles.get(row, ("inertia", row))  # it turns as the part whose name it bears
        shafts.append(Shaft(_fresh(title, taken), chain.coefficients(turning), inertia=value))
    kept = {b.name for b in bodies}
    for frame in m.frames:
        if frame.body not in kept | {GROUND}:
            raise MechlabError(
                f"{m.name}: frame {frame.name!r} stands on {frame.body!r}, which becomes a shaft and has no pose. "
                f"Put the frame on one of {', '.join(sorted(kept))}, or keep that part with independent=."
            )
    return replace(m, name=name, bodies=tuple(bodies), relations=(), shafts=tuple(shafts))


def _fresh(name: str, taken: set[str]) -> str:
    title, k = name, 2
    while title in taken:
        title, k = f"{name}_{k}", k + 1
    taken.add(title)
    return title


def _same_mass(m: Mechanism, basis: AngleBasis, chain: Chain, reduced: Mechanism) -> None:
    """Raise MechlabError unless the reduced mass matrix equals K^T M K at random poses."""
    rng = np.random.default_rng(23)
    k = basis.matrix @ chain.to_independent
    small, large = TreeKinematics(reduced), TreeKinematics(m)
    for _ in range(4):
        x = rng.uniform(-3.0, 3.0, reduced.nv)
        wanted = k.T @ large.set(m.reference() + k @ x).mass_matrix() @ k
        got = small.set(x).mass_matrix()
        gap = float(np.max(np.abs(got - wanted), initial=0.0)) / max(float(np.max(np.abs(wanted))), 1e-300)
        if gap > MASS_TOLERANCE:
            raise MechlabError(
                f"{m.name}: the reduced mass matrix differs from K^T M K by {gap:.3g} (limit {MASS_TOLERANCE:g}); "
                "the inertias span too many decades to be added exactly. Keep the fidelity with bodies."
            )
