"""A described linkage, solved: at given inputs, in all modes, along a motion."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from mechlab.analytic.assur.continuation import lowest_discriminant
from mechlab.analytic.assur.plane import Real, scalar
from mechlab.analytic.blocks import BLOCK, pieces
from mechlab.analytic.linkage.description import ACTIONS, LinkageDescription, Motion
from mechlab.errors import MechlabError, unknown
from mechlab.lazy_dataclass import dataclass

__all__ = ["BLOCK", "Input", "Linkage"]

Input = ArrayLike | tuple[ArrayLike, ArrayLike, ArrayLike]


@dataclass(frozen=True)
class Linkage(LinkageDescription):
    """A chain of groups; every method that adds one returns a new Linkage. Raises MechlabError for names used twice."""

    def solve(self, **inputs: Input) -> Motion:
        """Positions, rates and accelerations for the inputs: angle, or (angle, rate, accel), numbers or arrays.

        Where a group does not assemble its values are NaN and its `assembles` False: call `.require()` to have that
        raised. Raises MechlabError for a missing or unknown input.
        """
        for name in inputs:
            if name not in self.inputs:
                raise unknown(f"linkage {self.name!r}: input", name, self.inputs)
        given = {}
        for name in self.inputs:
            if name not in inputs:
                raise MechlabError(
                    f"linkage {self.name!r}: input {name!r} is missing; it needs {', '.join(self.inputs)}."
                )
            value = inputs[name]
            given[name] = scalar(*value) if isinstance(value, tuple) else scalar(value)
        motion = Motion()
        for step in self.steps:
            ACTIONS[step.kind](step, motion, given)
        return motion

    def blocks(self, count: int, **inputs: Input) -> Iterator[tuple[slice, Motion]]:
        """`solve` for long arrays (n,), BLOCK positions at a time."""
        for part in pieces(count):
            yield part, self.solve(**{name: _cut(value, part) for name, value in inputs.items()})

    def modes(self, **inputs: Input) -> tuple[tuple[dict[str, int], Motion], ...]:
        """Every combination of the dyads' modes that assembles everywhere at the given inputs, with its motion."""
        names = [s.name for s in self.steps if s.kind in ("RRR", "RRP", "RPR")]
        out = []
        for signs in product((1, -1), repeat=len(names)):
            chosen = dict(zip(names, signs, strict=True))
            motion = self.with_modes(chosen).solve(**inputs)
            if all(np.all(d.assembles) for d in motion.dyads.values()):
                out.append((chosen, motion))
        return tuple(out)

    def follow(self, drive: str, values: ArrayLike, rate: float = 1.0, **others: Input) -> Motion:
        """The motion along values (n,) of one input, in the chosen modes; the others stand still.

        Raises ChangePoint where two modes meet, also between the values, and NoSolution where a group does not
        assemble. Linkages of dyads only.
        """
        asked = np.atleast_1d(np.asarray(values, dtype=float))
        steps = np.diff(asked)
        pieces = [
            np.linspace(a, a + d, max(2, int(np.ceil(abs(d) / np.radians(0.5)))), endpoint=False)
            for a, d in zip(asked, steps, strict=False)
        ]
        grid = np.concatenate([*pieces, asked[-1:]])
        for name in self.solve(**{drive: asked[:1]}, **others).dyads:

            def level(x: Real, name: str = name) -> Real:
                return self.solve(**{drive: x}, **others).dyads[name].discriminant

            lowest_discriminant(level, grid)
        return self.solve(**{drive: (asked, rate, 0.0)}, **others).require()


def _cut(value: Input, part: slice) -> Input:
    if isinstance(value, tuple):
        return tuple(x if np.ndim(x) == 0 else np.asarray(x)[part] for x in value)
    return value if np.ndim(value) == 0 else np.asarray(value)[part]
