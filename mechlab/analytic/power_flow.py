"""Power flow of a train of gears in steady motion: torques from statics, losses in each mesh by the direction of its
power, and the largest power that circulates in the train instead of going from input to output.

A mesh lets gears a and b roll on each other in a carrier: alpha w_a + beta w_b = 0, w the rates in the carrier. Its
reaction f puts the torque alpha f on a and beta e f on b (and the opposite on the carrier), where for a mesh
efficiency eta

    e = 1 without losses,   e = eta if a drives (f alpha w_a < 0),   e = 1 / eta if b drives,

so that (1 - eta) P is lost, P = |power into the mesh, seen in the carrier| being the rolling power. Statics: each mesh
reaction and external torque acts on a row r over the joint rates, and on every joint these forces sum to zero.

Sources: Willis 1841; Mueller 1998, Die Umlaufgetriebe (rolling and coupling power); Merritt 1941 (losses by rolling
power).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError, NoSolution
from mechlab.lazy_dataclass import dataclass

FloatArray = NDArray[np.float64]
MAX_ENUMERATED = 12  # meshes for which all 2^m sets of senses are tried
TINY = 1e-12


@dataclass(frozen=True)
class TrainMesh:
    """One mesh: gears a and b and their carrier as member numbers; alpha, beta as above; rows over the joint rates (n,):
    `rate_a`, `rate_b` in the carrier, `total_a`, `total_b` absolute, about the axes of the gears."""

    a: int
    b: int
    carrier: int
    alpha: float
    beta: float
    rate_a: FloatArray
    rate_b: FloatArray
    total_a: FloatArray
    total_b: FloatArray


@dataclass(frozen=True)
class MeshFlow:
    """Flow through all meshes, arrays (m,). Torques on gear a and b [N m]; powers [W] that the mesh gives to gear a, to gear
    b and to the carrier (absolute; their sum is -loss); `rolling`: power that enters the mesh in the carrier's frame;
    `toward_b`: +1 if a drives, -1 if b drives, 0 if nothing rolls; `loss`: (1 - eta) rolling."""

    torque_a: FloatArray
    torque_b: FloatArray
    power_a: FloatArray
    power_b: FloatArray
    power_carrier: FloatArray
    rolling: FloatArray
    toward_b: FloatArray
    loss: FloatArray


@dataclass(frozen=True)
class Flow:
    """`torques` (u,): the unknown external torques [N m]; `reactions` (m,): f of each mesh; `meshes`: the power flow in
    them. `shared`: True when meshes are redundant; then the reactions of least norm are taken: equal planets share."""

    torques: FloatArray
    reactions: FloatArray
    meshes: MeshFlow
    shared: bool


def flow(
    meshes: Sequence[TrainMesh],
    rates: ArrayLike,
    efficiency: ArrayLike,
    given_rows: ArrayLike,
    given_torques: ArrayLike,
    unknown_rows: ArrayLike,
) -> Flow:
    """The steady flow at joint rates (n,) [rad/s], mesh efficiencies (m,) in (0, 1].

    Each external torque [N m] acts on a row over the joint rates: given_rows (g, n) with given_torques (g,), and
    unknown_rows (u, n).
    Raises MechlabError when the unknown torques do not follow from the given ones, or contradict them (no steady state);
    NoSolution when no sense of flow in the meshes is consistent (the train locks itself under this load).
    """
    v, eta = np.asarray(rates, dtype=float), np.asarray(efficiency, dtype=float)
    if eta.shape != (len(meshes),) or not np.all((eta > 0.0) & (eta <= 1.0)):
        raise MechlabError(f"efficiency: expected {len(meshes)} numbers above 0 and up to 1, got {eta.tolist()}.")
    known = np.asarray(given_rows, dtype=float).reshape(-1, len(v))
    unknown = np.asarray(unknown_rows, dtype=float).reshape(-1, len(v))
    load = np.asarray(given_torques, dtype=float) @ known if len(known) else np.zeros(len(v))
    sense = np.zeros(len(meshes))
    seen: list[tuple[float, ...]] = []
    # The senses of flow decide the losses and follow from them: repeat until a set of senses comes back.
    while tuple(sense) not in seen:
        seen.append(tuple(sense))
        found = _statics(meshes, v, sense, eta, load, unknown)
        sense = found.meshes.toward_b if np.any(eta < 1.0) else sense
    if tuple(sense) == seen[-1]:
        return found
    # The repetition ran in a circle: try every set of senses, 2^m of them.
    for guess in product((1.0, -1.0), repeat=len(meshes)) if len(meshes) <= MAX_ENUMERATED else ():
        found = _statics(meshes, v, np.array(guess), eta, load, unknown)
        if np.array_equal(found.meshes.toward_b, guess):
            return found
    raise NoSolution(
        "no sense of flow in the meshes agrees with these torques and losses: the train locks itself under this load. "
        "Give the torque of the driving member instead, or better efficiencies."
    )


def _statics(
    meshes: Sequence[TrainMesh],
    v: FloatArray,
    sense: FloatArray,
    eta: FloatArray,
    load: FloatArray,
    unknown: FloatArray,
) -> Flow:
    """Reactions and unknown torques for a given sense of flow: a linear system."""
    e = np.where(sense > 0, eta, np.where(sense < 0, 1.0 / eta, 1.0))
    columns = [x.alpha * x.rate_a + k * x.beta * x.rate_b for x, k in zip(meshes, e, strict=True)]
    matrix = np.column_stack([*columns, *unknown])
    solution, _, rank, _ = np.linalg.lstsq(matrix, -load, rcond=1e-11)
    n = len(meshes)
    reaction_rank = int(np.linalg.matrix_rank(np.column_stack(columns), tol=1e-11))
    if rank - reaction_rank < len(unknown):
        raise MechlabError(
            f"{len(unknown)} external torques are unknown, but only {rank - reaction_rank} follow from the given ones. "
            "Give more of them (0 for a member that nothing drives or loads)."
        )
    gap = float(np.max(np.abs(matrix @ solution + load), initial=0.0))
    if gap > 1e-9 * max(float(np.max(np.abs(load), initial=0.0)), TINY):
        raise MechlabError(
            f"the given torques are in no equilibrium: {gap:.3g} N m is left over. Leave one of them open to be found."
        )
    reactions, torques = solution[:n], solution[n:]
    return Flow(torques, reactions, _through(meshes, v, reactions, e, eta), reaction_rank < n)


def _through(
    meshes: Sequence[TrainMesh], v: FloatArray, reactions: FloatArray, e: FloatArray, eta: FloatArray
) -> MeshFlow:
    alpha, beta = np.array([x.alpha for x in meshes]), np.array([x.beta for x in meshes])
    rate_a, rate_b, total_a, total_b = (
        np.array([getattr(x, key) for x in meshes]) @ v for key in ("rate_a", "rate_b", "total_a", "total_b")
    )
    torque_a, torque_b = alpha * reactions, beta * e * reactions
    to_a, to_b = torque_a * rate_a, torque_b * rate_b
    scale = max(float(np.max(np.abs(to_a), initial=0.0)), 1e-300)
    toward = np.where(np.abs(to_a) < TINY * scale, 0.0, -np.sign(to_a))
    rolling = np.maximum(np.abs(to_a), np.abs(to_b)) * np.abs(toward)
    # The carrier takes the opposite couples, at its own rate about the axes of the gears.
    to_carrier = -torque_a * (total_a - rate_a) - torque_b * (total_b - rate_b)
    return MeshFlow(
        torque_a, torque_b, torque_a * total_a, torque_b * total_b, to_carrier, rolling, toward, (1.0 - eta) * rolling
    )


def efficiency(powers: ArrayLike) -> float | None:
    """-(sum of powers taken out) / (sum of powers put in) from the external powers (k,) [W]; None when none is put in.

    Not positive when power has to be put in everywhere: the train is self-locking in this sense.
    """
    p = np.asarray(powers, dtype=float)
    into, out = float(p[p > 0].sum()), float(-p[p < 0].sum())
    return out / into if into > 0.0 else None


def circulating_power(members: ArrayLike, powers: ArrayLike) -> float:
    """The largest power [W] that circulates on any edge: it flows round without reaching the output.

    members (m, 3): the member numbers of gear a, gear b and carrier of each mesh; powers (m, 3) [W] that the mesh gives to
    each. Nodes are members and meshes; an edge carries the power between them, in its sense. A linear
    program finds the least sum of edge flows with the same net flow at every node; what it saves on an edge circulates.
    """
    from scipy.optimize import linprog

    who, given = np.asarray(members, dtype=int), np.asarray(powers, dtype=float)
    if who.shape != given.shape or who.ndim != 2 or who.shape[1] != 3:
        raise MechlabError(f"members and powers: expected two arrays (meshes, 3), got {who.shape} and {given.shape}.")
    amounts, balance = _edges(who, given)
    scale = float(np.max(amounts, initial=0.0))
    if scale == 0.0:
        return 0.0
    needed = linprog(np.ones(len(amounts)), A_eq=balance, b_eq=balance @ (amounts / scale),
                     bounds=[(0.0, x) for x in amounts / scale], method="highs")  # fmt: skip
    if not needed.success:
        raise MechlabError(f"the power graph has no flow: {needed.message}")
    saved = scale * float(np.max(amounts / scale - needed.x))
    return saved if saved > 1e-9 * scale else 0.0


def _edges(who: NDArray[np.int_], given: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Amounts (edges,) and the incidence matrix (nodes, edges): -1 where an edge leaves, +1 where it arrives."""
    labels = {x: k for k, x in enumerate(np.unique(who).tolist())}
    amounts, columns = [], []
    for i, row in enumerate(given):
        for member, p in zip(who[i].tolist(), row.tolist(), strict=True):
            column = np.zeros(len(labels) + len(given))
            column[labels[member]], column[len(labels) + i] = np.sign(p), -np.sign(p)
            columns.append(column)
            amounts.append(abs(p))
    return np.array(amounts), np.array(columns).T
