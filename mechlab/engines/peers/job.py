"""What a peer is asked, as plain data that travels to another process, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from mechlab.experiment.scene import Scene, initial_state
from mechlab.mechanism import ConstraintSet, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.structure import redundancies, sample_poses

WORTH = 1e-6
"""A row is independent of others when the part that they do not span is at least this share, in the median of poses."""


@dataclass(frozen=True)
class Job:
    """A run: the mechanism with its assembled start q (nq,), v (nv,), constant loads (nv,) on the coordinates, `outputs` + 1
    even times up to `duration` [s], the integrator, and its step [s] or tolerance. rows: of each loop, which of its rows
    are independent of the others (see `independent`)."""

    mechanism: Mechanism
    q: Array
    v: Array
    loads: Array
    duration: float
    outputs: int
    integrator: str
    value: float
    rows: dict[str, tuple[bool, ...]]

    @property
    def between(self) -> float:
        """Distance of the output times [s]."""
        return self.duration / self.outputs

    @property
    def each(self) -> int:
        """Steps of the size `value`, rounded so that they divide the distance of the outputs."""
        return max(1, round(self.between / self.value))


def job_of(mechanism: Mechanism, scene: Scene, outputs: int, integrator: str, value: float) -> Job:
    """The job of a scene whose laws are constant loads (see `refusal`)."""
    q, v = initial_state(mechanism, scene)
    loads = np.zeros(mechanism.nv)
    for law in scene.laws:
        loads = loads + law.value * mechanism.row(law.on)  # type: ignore[attr-defined]
    lean = replace(
        mechanism,
        bodies=tuple(replace(b, shapes=()) for b in mechanism.bodies),
        shafts=tuple(replace(s, shapes=()) for s in mechanism.shafts),
        ground_shapes=(),
    )
    rows = dict(_independent(mechanism, tuple(q.tolist())))
    return Job(lean, q, v, loads, scene.duration, outputs, integrator, value, rows)


@lru_cache(maxsize=32)
def _independent(mechanism: Mechanism, q: tuple[float, ...]) -> tuple[tuple[str, tuple[bool, ...]], ...]:
    return tuple(independent(mechanism, np.array(q)).items())


def independent(mechanism: Mechanism, q: Array) -> dict[str, tuple[bool, ...]]:
    """Loop -> which of its rows to keep, for engines that break down on redundant rows.

    No fixed choice of the rows of a redundant loop is right at all poses. Rows are kept one by one: the next is the row
    whose part not spanned by those kept is largest in the median over the poses (the start and some near the
    reference).
    """
    tree, constraints = TreeKinematics(mechanism), ConstraintSet(mechanism)
    if not mechanism.loops:
        return {}
    poses = [q, *sample_poses(mechanism, count=8, spread=1.0)]
    jacobians = [constraints.jacobian(tree.set(x)) for x in poses]
    wanted = len(constraints) - len(redundancies(mechanism))
    keep = _spread(jacobians, wanted)
    return {x.name: tuple(i in keep for i in range(s.start, s.stop)) for x in mechanism.loops
            for s in [constraints.slices[x.name]]}  # fmt: skip


def _spread(jacobians: list[Array], wanted: int) -> set[int]:
    """`wanted` rows at most, each with the largest part not spanned by those before it, in the median over the
    poses."""
    scale = max(float(np.max(np.linalg.norm(j, axis=1), initial=0.0)) for j in jacobians)
    rests = [j / scale for j in jacobians]
    keep: list[int] = []
    while len(keep) < wanted:
        worst = np.median([np.linalg.norm(r, axis=1) for r in rests], axis=0)
        worst[keep] = -1.0
        k = int(np.argmax(worst))
        if worst[k] < WORTH:
            break
        keep.append(k)
        for r in rests:
            size = float(np.linalg.norm(r[k]))
            if size > WORTH:
                u = r[k] / size
                r -= np.outer(r @ u, u)
    return set(keep)
