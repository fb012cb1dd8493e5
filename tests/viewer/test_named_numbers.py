"""Numbers of the model document that follow named parameters: slopes against builds at other values."""

from __future__ import annotations

import json

import pytest

from mechlab.api.finding import load_design
from mechlab.formats.mechanism_json import to_json
from mechlab.viewer.named_numbers import flat, named_numbers


@pytest.mark.parametrize("name", ["fourbar", "slider_crank", "planetary"])
def test_slopes_predict_another_design(name: str) -> None:
    """At a value 7 % away every number that is said to be affine is where its slope puts it."""
    d = load_design(name, {})
    found = named_numbers(d)
    assert found is not None and found.name == name and found.parameters
    base = flat(json.loads(to_json(d.mechanism(list(d.entry.fidelities)[-1]))))
    for parameter in found.parameters[:4]:
        value = parameter.value * 1.07 or 0.01
        other = load_design(name, {parameter.key: value})
        numbers = flat(json.loads(to_json(other.mechanism(list(other.entry.fidelities)[-1]))))
        for path, slope in parameter.slopes.items():
            expected = base[path] + slope * (value - parameter.value)
            assert numbers[path] == pytest.approx(expected, rel=1e-6, abs=1e-12), (parameter.key, path)


def test_a_length_of_the_four_bar_is_a_parameter() -> None:
    found = named_numbers(load_design("fourbar", {"crank": 0.11}))
    assert found is not None and found.given == ("crank=0.11",)
    crank = next(p for p in found.parameters if p.key == "crank")
    assert crank.value == 0.11 and crank.unit == "m"
    assert crank.slopes["bodies/1/placement/position/0"] == 1.0
    assert crank.slopes["frames/0/placement/position/0"] == 1.0
    assert "bodies/0/joints/0/zero" not in crank.slopes
