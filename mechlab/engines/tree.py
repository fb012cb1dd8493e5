"""The tree of `mechlab.mechanism` itself as an engine: the third implementation beside Pinocchio and MuJoCo."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.motions import KeptMotions, TreeMotions
from mechlab.engines.protocol import Engine
from mechlab.experiment.tree_plant import TreePlant
from mechlab.mechanism.assembly import close
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.many_rows import ManyRows
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import Assembly
from mechlab.mechanism.warm_start import PoseEquations, TreeEquations


class NumpyTree(Engine):
    """The tree of `mechlab.mechanism` itself, as one more implementation of a state. It runs nothing."""

    name = "numpy"

    def plant(self, mechanism: Mechanism) -> TreePlant:
        """The numpy tree in the reference pose."""
        return TreePlant(mechanism)

    def assemble(
        self, mechanism: Mechanism, given: Mapping[str, Any], start: ArrayLike | None = None, steps: int = 10
    ) -> Assembly:
        """See `mechlab.mechanism.close`; joints and shafts alone can be given."""
        return close(mechanism, None if start is None else np.asarray(start, dtype=float), dict(given), steps=steps)

    def pose_equations(self, mechanism: Mechanism, names: tuple[str, ...]) -> PoseEquations:
        """The equations of the tree."""
        return TreeEquations(ManyRows(mechanism, names))

    def motions(self, mechanism: Mechanism) -> KeptMotions:
        """The motions of the tree."""
        return TreeMotions(mechanism)

    def accelerations(self, mechanism: Mechanism, q: ArrayLike, v: ArrayLike, force: ArrayLike | None = None) -> Array:
        """(nv,) by least squares of the constrained equations, rigid rows, without dry friction; (n, nv) of n states."""
        plant, q, v = TreePlant(mechanism), np.asarray(q, dtype=float), np.asarray(v, dtype=float)
        force = np.zeros(v.shape) if force is None else np.asarray(force, dtype=float)
        if q.ndim == 1:
            return plant.set(q, v).accelerations(force)
        return np.array([plant.set(*state).accelerations(f) for *state, f in zip(q, v, force, strict=True)])


ENGINES = {"numpy": NumpyTree()}
