"""Structure analysis by rank: freedoms, idle freedoms, redundant rows by name, independent coordinates.

The rank is taken at several assembled poses near the reference and the largest is used: a singular reference pose does
not mislead. Rows are scaled to unit length first, so that metres and radians compare.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from itertools import islice

import numpy as np

from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.batch_sparse import smallest_of_rows
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics, integrate
from mechlab.mechanism.least_norm import LARGE, least_norm
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import newton
from mechlab.mechanism.redundancy import Redundancy, repetitions
from mechlab.tables import counted

RANK_TOLERANCE = 1e-9
INDEPENDENT = 1e-8
"""Share of a row beyond which it does not repeat the rows before it."""
CLEAR = 1e-3
"""Share of a rate beyond which it is a good coordinate."""
CERTAIN = 1e-4
"""Smallest singular value of rows of unit length above which they are independent beyond doubt."""
NOTHING = 1e-12
"""Size of a row below which it says nothing."""
VOID = 1e-14
"""Size of a row, relative to the largest one and to 1, below which it is rounding."""
FREEDOMS = ("degree of freedom", "degrees of freedom")


@dataclass(frozen=True)
class Structure:
    """Freedoms that the constraints leave. `freedoms` = nv - rank; `idle` are named local freedoms; `mobility` the
    rest."""

    nv: int
    rows: int
    rank: int
    reference_rank: int
    idle: tuple[str, ...]
    redundant: tuple[Redundancy, ...]
    independent: tuple[str, ...]
    driven: int

    @property
    def freedoms(self) -> int:
        """Degrees of freedom, local ones included."""
        return self.nv - self.rank

    @property
    def mobility(self) -> int:
        """Degrees of freedom without the local ones."""
        return self.freedoms - len(self.idle)

    @property
    def sentence(self) -> str:
        """One line: coordinates, rows, freedoms."""
        rows = f"{counted(self.rows, 'constraint row')} of rank {self.rank}"
        text = f"{counted(self.nv, 'coordinate')}, {rows}: {counted(self.freedoms, *FREEDOMS)}"
        if self.idle:
            text += f" = {self.mobility} + {len(self.idle)} local ({', '.join(self.idle)})"
        return text


def rank(matrix: Array) -> int:
    """Numerical rank after scaling rows to unit length."""
    return ranks(matrix[None])[0]


def ranks(matrices: Array) -> list[int]:
    """Numerical ranks of matrices (P, m, n) after scaling rows to unit length. Where the rows of a large sparse one are clearly
    independent, as its smallest singular value by a sparse factorization says, they are counted."""
    if matrices.size == 0:
        return [0] * len(matrices)
    norms = np.linalg.norm(matrices, axis=2, keepdims=True)
    there = norms > VOID * np.maximum(1.0, norms.max(axis=1, keepdims=True))
    scaled = matrices / np.where(there, norms, 1.0)
    smallest = smallest_of_rows(np.where(there, scaled, 0.0)) if min(matrices.shape[1:]) >= LARGE else None
    if smallest is not None and np.min(smallest) > CERTAIN:
        return [int(x) for x in np.count_nonzero(there[..., 0], axis=1)]
    out: list[int] = []
    for k, x in enumerate(scaled):  # relations alone have the same rows in every pose
        same = k > 0 and np.array_equal(x, scaled[k - 1])
        out.append(out[-1] if same else int(np.linalg.matrix_rank(x, tol=RANK_TOLERANCE * max(x.shape))))
    return out


def null_space(matrix: Array, tolerance: float = RANK_TOLERANCE) -> Array:
    """(n, k) orthonormal basis of the null space of a (m, n) matrix, rows scaled first."""
    n = matrix.shape[1]
    if matrix.shape[0] == 0:
        return np.eye(n)
    norms = np.linalg.norm(matrix, axis=1, keepdims=True)
    _, values, vt = np.linalg.svd(matrix / np.where(norms > VOID * max(1.0, float(norms.max())), norms, 1.0))
    return vt[int(np.sum(values > tolerance * max(matrix.shape))) :].T


def sample_poses(mechanism: Mechanism, count: int = 4, spread: float = 0.1, seed: int = 7) -> list[Array]:
    """Assembled poses near the reference: steps along the null space, closed again by Newton. The first is the reference."""
    return [q for q, _ in _samples(mechanism, count, spread, seed)]


def _samples(mechanism: Mechanism, count: int = 4, spread: float = 0.1, seed: int = 7) -> Iterator[tuple[Array, Array]]:
    """`sample_poses` one by one, each with the constraint Jacobian there."""
    rng = np.random.default_rng(seed)
    tree, constraints = TreeKinematics(mechanism), ConstraintSet(mechanism)
    last: list[Array] = []

    def evaluate(x: Array) -> tuple[Array, Array]:
        tree.set(x)
        last[:] = x, constraints.jacobian(tree)
        return constraints.residual(tree), last[1]

    reference = mechanism.reference()
    at_reference = evaluate(reference)[1]
    yield reference, at_reference
    directions = _free_directions(at_reference, rng)
    for _ in range(count):
        direction = next(directions)
        size = float(np.max(np.abs(direction), initial=0.0))
        step = direction * (spread * step_size(mechanism) / size if size > 0 else 0.0)
        found = newton(evaluate, lambda x, dv: integrate(mechanism, x, dv), integrate(mechanism, reference, step))
        if found.closed:
            yield found.q, last[1] if found.q is last[0] else evaluate(found.q)[1]


def _free_directions(jacobian: Array, rng: np.random.Generator) -> Iterator[Array]:
    """Random directions (nv,) along which the rows of a Jacobian do not change at first order."""
    nv = jacobian.shape[1]
    if min(jacobian.shape) >= LARGE:
        while True:  # a projection needs no basis, whose vectors are dense
            any_direction = rng.standard_normal(nv)
            yield any_direction - least_norm(jacobian, jacobian @ any_direction)
    basis = null_space(jacobian)
    while True:
        yield basis @ rng.standard_normal(basis.shape[1]) if basis.shape[1] else np.zeros(nv)


def step_size(mechanism: Mechanism) -> float:
    """Size of a step in all coordinates [rad or m] that stays near a pose.

    1 without slides; with slides the largest offset of a body or loop [m], at most 1."""
    if not mechanism.slides:
        return 1.0
    lengths = [float(np.linalg.norm(b.placement.position)) for b in mechanism.bodies]
    lengths += [float(np.linalg.norm(x.placement_b.position)) for x in mechanism.loops]
    return min(1.0, max(lengths, default=0.0) or 1.0)


@dataclass(frozen=True)
class _Sampled:
    """A sampled pose, the constraint Jacobian there, and its rank."""

    q: Array
    jacobian: Array
    rank: int


@lru_cache(maxsize=64)
def _sampled(mechanism: Mechanism) -> tuple[_Sampled, ...]:
    """The reference and others; one alone where its rank is the largest that there can be, or its rows are those of the reference.
    A row that says nothing at a random pose says nothing anywhere."""
    samples = _samples(mechanism)
    found = list(islice(samples, 2))
    known = ranks(np.array([j for _, j in found]))
    first, last = found[0][1], found[-1][1]
    most = min(np.count_nonzero(np.linalg.norm(last, axis=1) >= NOTHING), last.shape[1])
    if len(found) > 1 and known[1] < most and not np.array_equal(first, last):
        more = list(samples)
        found, known = found + more, known + ranks(np.array([j for _, j in more]))
    return tuple(_Sampled(q, j, r) for (q, j), r in zip(found, known, strict=True))


def largest_rank(mechanism: Mechanism) -> int:
    """The rank of the constraints at a generic pose."""
    return max(sampled.rank for sampled in _sampled(mechanism))


def _generic(mechanism: Mechanism) -> _Sampled:
    return max(_sampled(mechanism)[1:] or _sampled(mechanism), key=lambda sampled: sampled.rank)


def generic(mechanism: Mechanism) -> tuple[Array, Array]:
    """A pose of the largest rank among the sampled ones, and the constraint Jacobian there."""
    best = _generic(mechanism)
    return best.q, best.jacobian


@lru_cache(maxsize=64)
def _generic_rows(mechanism: Mechanism) -> tuple[tuple[int, ...], Array]:
    """Indices of independent rows at a generic pose, and an orthonormal basis (nv, freedoms) of the motions that they leave."""
    best = _generic(mechanism)
    norms = np.linalg.norm(best.jacobian, axis=1)
    there = np.flatnonzero(norms >= NOTHING)
    if len(there) == best.rank >= LARGE:  # all that is there is independent
        keep, basis = there.tolist(), best.jacobian[there] / norms[there, None]
    else:
        keep, basis = _chosen(best.jacobian)
    return tuple(keep), np.linalg.qr(basis.T, mode="complete")[0][:, len(keep) :]


def independent_rows(mechanism: Mechanism, constraints: ConstraintSet) -> list[int]:
    """Indices of rows that are independent at a generic pose; earlier rows are preferred."""
    if _all_independent(mechanism):
        return list(range(len(constraints)))
    return list(_generic_rows(mechanism)[0])


@lru_cache(maxsize=64)
def _all_independent(mechanism: Mechanism) -> bool:
    """Whether all rows are independent beyond doubt in the reference pose, and so at a generic one, which then need not be looked for."""
    rows = ConstraintSet(mechanism).jacobian(TreeKinematics(mechanism))
    sizes = np.linalg.norm(rows, axis=1)
    if not len(rows) or min(rows.shape) >= LARGE or len(rows) > mechanism.nv or sizes.min() < NOTHING:
        return not len(rows)
    return bool(np.linalg.svd(rows / sizes[:, None], compute_uv=False)[-1] > CERTAIN)


def rows_repeat(mechanism: Mechanism) -> bool:
    """Whether a row of the loops repeats others, so that which rows are independent may change from pose to pose."""
    if not mechanism.loops or _all_independent(mechanism):
        return False
    kept, best = _generic_rows(mechanism)[0], _generic(mechanism)
    return bool(np.any(np.linalg.norm(np.delete(best.jacobian, kept, axis=0), axis=1) >= NOTHING))


def _chosen(matrix: Array) -> tuple[list[int], Array]:
    keep: list[int] = []
    basis = np.zeros((min(matrix.shape), matrix.shape[1]))
    for i, row in enumerate(matrix):
        rest, size = _new_part(basis[: len(keep)], row)
        if size > INDEPENDENT:
            basis[len(keep)] = rest
            keep.append(i)
    return keep, basis[: len(keep)]


def _new_part(basis: Array, row: Array) -> tuple[Array, float]:
    """The unit vector of what a row adds to an orthonormal basis (k, n), and the share of the row that this is."""
    norm = float(np.linalg.norm(row))
    if norm < NOTHING:
        return row, 0.0
    rest = row / norm
    for _ in range(2):  # twice is enough against rounding
        rest = rest - basis.T @ (basis @ rest)
    size = float(np.linalg.norm(rest))
    return rest / (size or 1.0), size


def redundancies(mechanism: Mechanism) -> tuple[Redundancy, ...]:
    """Redundant rows, each as the combination of earlier rows that it repeats, at a generic pose."""
    if _all_independent(mechanism):
        return ()
    return repetitions(_generic(mechanism).jacobian, _generic_rows(mechanism)[0], ConstraintSet(mechanism).rows)


def shared_loads(mechanism: Mechanism) -> tuple[str, ...]:
    """Loops, relations and curves with rows that repeat each other: how these share a load, rigid bodies do not say."""
    repeated = [r for r in redundancies(mechanism) if r.combination]
    rows = {r.row for r in repeated} | {name for r in repeated for name, _ in r.combination}
    return tuple(c.name for c in ConstraintSet(mechanism).items if rows.intersection(c.rows))


def _idle_blocks(mechanism: Mechanism, jacobian: Array) -> list[tuple[str, list[int], Array]]:
    """Bodies that can move with all loops closed: name, columns in the Jacobian, null space over these columns."""
    out: list[tuple[str, list[int], Array]] = []
    parents = {b.parent for b in mechanism.bodies}
    used = {n for r in mechanism.relations for n, _ in r.coefficients} | {d.on for d in mechanism.drives}
    used |= {n for x in mechanism.curves for n in (x.output, x.input)}
    held = {x.body_a for x in mechanism.loops} | {x.body_b for x in mechanism.loops}
    for body in mechanism.bodies:
        if body.name in parents or body.name not in held or not body.joints:
            continue
        if any(j.name in used for j in body.joints):
            continue
        columns = [
            k for j in body.joints for k in range(mechanism.v_slice[j.name].start, mechanism.v_slice[j.name].stop)
        ]
        block, tolerance = jacobian[:, columns], RANK_TOLERANCE
        if len(block) >= LARGE:  # rows of other parts of a large mechanism only cost time
            tolerance *= max(block.shape)
            block = block[np.any(block, axis=1)]
            tolerance /= max(block.shape)
        if rank(block) == 0:
            continue
        out.append((body.name, columns, null_space(block, tolerance)))
    return out


def idle_freedoms(mechanism: Mechanism) -> tuple[str, ...]:
    """Local freedoms: motions of a single part that keep all its loops closed (a rod between two ball joints spins
    about its own length). One name "spin of BODY" for each."""
    blocks = _idle_blocks(mechanism, generic(mechanism)[1])
    return tuple(f"spin of {body}" for body, _, free in blocks for _ in range(free.shape[1]))


def idle_directions(mechanism: Mechanism, jacobian: Array) -> Array:
    """(nv, k) directions of the local freedoms, at the pose of the constraint Jacobian (rows, nv)."""
    columns = [np.zeros((mechanism.nv, 0))]
    for _, where, free in _idle_blocks(mechanism, jacobian):
        block = np.zeros((mechanism.nv, free.shape[1]))
        block[where] = free
        columns.append(block)
    return np.hstack(columns)


def independent_coordinates(mechanism: Mechanism) -> tuple[str, ...]:
    """Rates that can be chosen freely (drives first): with them all others follow. A rate of which less than `CLEAR` is free
    of the rows and rates before it is taken only where no other is left: it would fix the pose badly."""
    free = _generic_rows(mechanism)[1]
    wanted = free.shape[1]
    basis = np.zeros((wanted, wanted))
    drives = {d.on: mechanism.row(d.on) for d in mechanism.drives}
    rates = dict(zip(mechanism.rate_names, np.eye(mechanism.nv), strict=True))
    chosen: list[str] = []
    for rows, least in ((drives, INDEPENDENT), (rates, CLEAR), (rates, INDEPENDENT)):
        for name, row in rows.items():
            if len(chosen) == wanted:
                return tuple(chosen)
            if name in chosen:
                continue
            # what is left of the row without the fixed ones is its part along the free motions
            along = row @ free / float(np.linalg.norm(row))
            share = float(np.linalg.norm(along))
            rest, size = _new_part(basis[: len(chosen)], along)
            if size * share > least:
                basis[len(chosen)] = rest
                chosen.append(name)
    return tuple(chosen)


@lru_cache(maxsize=64)
def structure(mechanism: Mechanism) -> Structure:
    """Structure of a mechanism: see `Structure`."""
    constraints = ConstraintSet(mechanism)
    best = _generic(mechanism)
    rows = [mechanism.row(d.on) for d in mechanism.drives]
    driven = rank(np.vstack([best.jacobian, *[r[None] for r in rows]])) - best.rank if rows else 0
    return Structure(
        nv=mechanism.nv,
        rows=len(constraints),
        rank=largest_rank(mechanism),
        reference_rank=_sampled(mechanism)[0].rank,
        idle=idle_freedoms(mechanism),
        redundant=redundancies(mechanism),
        independent=independent_coordinates(mechanism),
        driven=driven,
    )
