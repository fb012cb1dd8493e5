"""Engine `numpy`: the tree of `mechlab.mechanism` itself, as one more implementation of a state. It runs nothing."""

from __future__ import annotations

from mechlab.engines.protocol import Engine
from mechlab.experiment.tree_plant import TreePlant
from mechlab.mechanism.model import Mechanism


class NumpyTree(Engine):
    """See the module."""

    name = "numpy"

    def plant(self, mechanism: Mechanism) -> TreePlant:
        """The numpy tree in the reference pose."""
        return TreePlant(mechanism)


ENGINES = {"numpy": NumpyTree()}
