"""A sweep as data: axes, quantities, fixed values and the way to compute it, in one picklable object with a fingerprint.

A block is the unit of work: a range of points with their numbers, their outcomes, and the reasons of missing numbers.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import field
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from mechlab.errors import EngineMissing, MechlabError, user_fault
from mechlab.lab.design import Design
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.studies.named.number import NamedNumber

GOOD, BAD_INPUT, UNTRUSTED, NO_SOLUTION = 0, 1, 3, 4
"""Outcomes of a point, numbered like the exit codes."""
LONGEST = 300
"""Largest number of characters kept of a reason."""


@dataclass
class SweepBlock:
    """Results of m points: values (m, quantities), NaN where there is none; outcomes (m,); reasons: index of the point
    in the block -> sentence."""

    values: Array
    outcomes: np.ndarray
    reasons: dict[int, str]

    @classmethod
    def empty(cls, points: int, quantities: int) -> SweepBlock:
        """A block in which every value is NaN, every outcome GOOD, and no reason is set."""
        return cls(np.full((points, quantities), np.nan), np.zeros(points, dtype=np.int8), {})

    def gap(self, points: Any, outcome: int, reason: str) -> None:
        """Set the outcome and reason of points (an index or indices) without a number."""
        self.outcomes[points] = outcome
        sentence = " ".join(reason.split())
        short = sentence if len(sentence) <= LONGEST else f"{sentence[: LONGEST - 3]}..."
        self.reasons |= dict.fromkeys(np.atleast_1d(points).tolist(), short)

    def failed(self, points: Any, cause: BaseException) -> None:
        """Record the exception of points. A missing engine would stop every other point too, so it is raised again."""
        if isinstance(cause, EngineMissing):
            raise cause
        if isinstance(cause, MechlabError):
            self.gap(points, cause.exit_code, str(cause))
        elif (fault := user_fault(cause)) is not None:
            self.gap(points, BAD_INPUT, fault)
        else:
            self.gap(points, UNTRUSTED, f"internal error: {type(cause).__name__}: {cause}")


CLOSED_FORM, ANSWERS, ROLLOUT, RUNS = "closed form", "answers", "rollout", "runs"
METHODS = {
    CLOSED_FORM: "the closed form takes a block of points at once",
    ANSWERS: "one question for each point; an engine closes a block of them together",
    ROLLOUT: "the engine steps a block of motions together",
    RUNS: "one run or check for each point",
}
"""Methods of computation, with an explanation of each."""
BACKENDS = ("mujoco", "warp")
"""Who steps motions together: MuJoCo in double precision, or MuJoCo Warp in single precision, on a GPU where there is one."""
BLOCK = {CLOSED_FORM: 16384, ANSWERS: 256, ROLLOUT: 1024, RUNS: 32}
"""Largest number of points in a block. An interrupted sweep keeps whole blocks; a lost worker costs the blocks it works
on."""
FEWEST_BLOCKS = 64
"""Sweeps point by point have at least this number of blocks (or one for each point), so that workers share them
evenly."""
ANSWERED_TOGETHER, FEW_BLOCKS = 32, 8
"""Points that an engine closes together in 10 to 20 ms, hardly more than one of them takes, where that leaves so many blocks."""


@dataclass(frozen=True)
class SweepAxis:
    """One key and its values. role: "parameter", "given" (a quantity of the question) or "initial" (X_0, X_rate_0, X_force)."""

    key: str
    values: tuple[Any, ...]
    role: str
    unit: str = ""
    text: str = ""

    @property
    def is_text(self) -> bool:
        """True when a value is text."""
        return any(isinstance(x, str) for x in self.values)

    @property
    def coordinates(self) -> Array | list[str]:
        """The values as coordinates of a dataset: floats (n,), or texts."""
        return [str(x) for x in self.values] if self.is_text else np.array([float(x) for x in self.values])


@dataclass(frozen=True)
class SweepRequest:
    """The complete definition of a sweep: every scheduler computes the same blocks, in any order.

    load(source) gives the unchanged design; both must be picklable to leave this process. identity: content of the
    source as text. parameters, given: values that are the same at all points. backend: of BACKENDS, who steps runs that go together;
    None: MuJoCo. Points are numbered in the order of
    `work`: parameter axes vary slowest, so that neighbouring points share a design.
    """

    load: Callable[..., Design]
    source: Any
    identity: str
    name: str
    axes: tuple[SweepAxis, ...]
    quantities: tuple[NamedNumber, ...]
    method: str
    block: int
    parameters: Mapping[str, Any] = field(default_factory=dict)
    given: Mapping[str, Any] = field(default_factory=dict)
    witness: str = ""
    scene: str | None = None
    engine: str | None = None
    fidelity: str | None = None
    duration: float | None = None
    timestep: float | None = None
    backend: str | None = None
    versions: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def work(self) -> tuple[SweepAxis, ...]:
        """The axes in the order of work, the last one fastest."""
        return tuple(sorted(self.axes, key=lambda a: a.role != "parameter"))

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Number of values on each axis, in the user's order."""
        return tuple(len(a.values) for a in self.axes)

    @cached_property
    def count(self) -> int:
        """Number of points."""
        return math.prod(self.shape)

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return -(-self.count // self.block)

    def span(self, block: int) -> tuple[int, int]:
        """Index of the first point of a block, and of the one after its last."""
        return block * self.block, min(self.count, (block + 1) * self.block)

    def places(self, block: int) -> dict[str, np.ndarray]:
        """Key -> (m,) index into the values of its axis, for the points of a block."""
        index = np.unravel_index(np.arange(*self.span(block)), tuple(len(a.values) for a in self.work))
        return {a.key: i for a, i in zip(self.work, index, strict=True)}

    def in_users_order(self, flat: Array) -> Array:
        """An array over the points (count, ...), reshaped to the axes in the user's order."""
        shaped = flat.reshape(*(len(a.values) for a in self.work), *flat.shape[1:])
        keys = [a.key for a in self.work]
        order = [keys.index(a.key) for a in self.axes]
        return np.asarray(shaped.transpose(*order, *range(len(keys), shaped.ndim)))

    def description(self) -> dict[str, Any]:
        """Everything that the numbers depend on, as plain data: requests with equal descriptions give equal numbers."""
        return {
            "mechanism": self.identity, "axes": {a.key: [_plain(x) for x in a.values] for a in self.axes},
            "quantities": [[q.label, q.kind, q.name, q.reduce] for q in self.quantities],
            "parameters": {k: _plain(v) for k, v in sorted(self.parameters.items())},
            "given": {k: _plain(v) for k, v in sorted(self.given.items())}, "method": self.method, "block": self.block,
            "witness": self.witness, "scene": self.scene, "engine": self.engine, "fidelity": self.fidelity,
            "duration": self.duration, "timestep": self.timestep, "versions": dict(self.versions),
        } | ({} if self.backend is None else {"backend": self.backend})  # fmt: skip

    @cached_property
    def fingerprint(self) -> str:
        """A hash of `description`."""
        return hashlib.sha256(json.dumps(self.description(), sort_keys=True).encode()).hexdigest()


ROLLOUTS, FEW_TOGETHER = 16, 64
"""Least number of blocks of a sweep by rollout, for a cluster, and motions of a block that are worth a call."""
BLOCK_STEPS = 4_000_000
"""Steps of all motions of a block of rollouts, some 10 to 100 s of work, unless a single motion takes more."""


def block_size(method: str, count: int, steps: float = 1.0, backend: str | None = None) -> int:
    """Number of points of a block. It depends on the request alone, so that blocks are the same for every scheduler.

    steps: of each motion of a rollout. MuJoCo Warp wants as many motions at once as there are.
    """
    if backend == "warp":
        return max(1, min(BLOCK[CLOSED_FORM], int(10 * BLOCK_STEPS / steps)))
    if method == ROLLOUT:
        return max(1, min(max(count // ROLLOUTS, FEW_TOGETHER), BLOCK[method], int(BLOCK_STEPS / steps)))
    if method == CLOSED_FORM:
        return BLOCK[method]
    if method == ANSWERS and count > FEWEST_BLOCKS:
        return min(BLOCK[method], max(count // FEWEST_BLOCKS, min(count // FEW_BLOCKS, ANSWERED_TOGETHER)))
    return max(1, min(BLOCK[method], count // FEWEST_BLOCKS))


def _plain(value: Any) -> Any:
    if isinstance(value, tuple | list):
        return [_plain(x) for x in value]
    if isinstance(value, Fraction):
        return str(value)
    if isinstance(value, bool | str) or value is None:
        return value
    return float(value)
