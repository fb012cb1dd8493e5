"""Parameters that only scenes use: their values share one mechanism."""

from dataclasses import replace

import pytest

from mechlab.catalog import NAMES, entry
from mechlab.experiment.parameters import scene_defaults


@pytest.mark.parametrize("name", NAMES)
def test_no_mechanism_changes_with_them(name: str) -> None:
    found = entry(name)
    p = found.parameters()
    for key, default in scene_defaults(found.parameters).items():
        other = replace(p, **{key: 1.3 * default + 0.1})
        for fidelity in found.fidelities:
            if fidelity != "kinematic":
                assert found.build(other, fidelity) == found.build(p, fidelity), key
