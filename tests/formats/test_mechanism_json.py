"""A mechanism as JSON reads back equal; what is wrong in a JSON is named by its path."""

import dataclasses
import json

import pytest
from mechanism_zoo import ALL, fourbar, planetary, tree

from mechlab.errors import MechlabError
from mechlab.formats import from_json, to_json


@pytest.mark.parametrize("name", ALL)
def test_round_trip(name):
    m = ALL[name]()
    text = to_json(m)
    assert from_json(text) == m
    assert to_json(from_json(text)) == text


@pytest.mark.parametrize("seed", range(20))
def test_round_trip_of_random_trees(seed):
    m = tree(seed)
    assert from_json(to_json(m)) == m


def test_ratios_are_exact_texts():
    relation = json.loads(to_json(planetary()))["relations"][0]
    assert relation["coefficients"] == {"sun": "1", "carrier": "-1", "planet_0": "5/4"}


def test_extra_keys_are_tolerated_only_if_known():
    m = fourbar()
    assert from_json(to_json(m, {"urdf": {"root": "base"}})) == m
    with pytest.raises(MechlabError, match="'note' does not exist"):
        to_json(m, {"note": 1})


def edited(change):
    data = json.loads(to_json(fourbar()))
    change(data)
    return json.dumps(data)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.update(format="other"), "holds no mechanism"),
        (lambda d: d.update(schema=99), "schema 99"),
        (lambda d: d.update(colour=1), "key 'colour' does not exist"),
        (lambda d: d.pop("bodies"), "bodies is missing"),
        (lambda d: d["bodies"][1]["joints"][0].pop("name"), r"bodies\[1\].joints\[0\].name is missing"),
        (lambda d: d["bodies"][1]["joints"][0].update(axes=1), r"joints\[0\]: key 'axes'.*Did you mean 'axis'"),
        (lambda d: d["bodies"][2]["joints"][0].update(axis=[0, 1]), r"\[2\].joints\[0\].axis: expected 3 numbers"),
        (lambda d: d["bodies"][2]["joints"][0].update(axis=[0, "x", 1]), r"joints\[0\].axis\[1\]: expected a number"),
        (lambda d: d["bodies"][0]["inertia"].update(mass=-1), r"bodies\[0\].inertia: mass"),
        (lambda d: d["bodies"][0]["inertia"].update(mass=True), "expected a number, got True"),
        (lambda d: d["bodies"][0].update(parent="coupler"), "cycle"),
        (lambda d: d["bodies"][0].update(parent=3), r"bodies\[0\].parent: expected a text"),
        (lambda d: d["bodies"].reverse(), "depth-first"),
        (lambda d: d.update(bodies={}), "bodies: expected a list"),
        (lambda d: d.update(relations=[{"name": "r", "coefficients": {"crank": 2}}]), "crank: expected an exact"),
        (lambda d: d.update(relations=[{"name": "r", "coefficients": {"crank": "1/0"}}]), "exact ratio such as"),
        (lambda d: d.update(relations=[{"name": "r", "coefficients": {"crank": "1e999999999"}}]), "exact ratio such as"),
        (lambda d: d.update(gravity=[0, 0, 10**400]), r"gravity\[2\]: .* is outside the range of a double"),
        (lambda d: d.update(name="\ud800"), "which is no character"),
    ],
)  # fmt: skip
def test_errors_name_the_place(change, message):
    with pytest.raises(MechlabError, match=message):
        from_json(edited(change))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is not JSON"),
        ("[1]", "expected a JSON object, got list"),
        ("{" * 100000, "is not JSON|nested too deeply"),
        ('{"format": "mechlab.mechanism", "schema": 1, "name": "a", "name": "b"}', "written twice"),
        ('{"format": "mechlab.mechanism", "schema": 1, "gravity": [0, 0, NaN]}', "NaN is no number"),
    ],
)
def test_what_is_no_mechanism(text, message):
    with pytest.raises(MechlabError, match=message):
        from_json(text)


def test_integers_become_floats():
    m = dataclasses.replace(fourbar(), gravity=(0, -1, 0))
    assert from_json(to_json(m)) == m
    assert '"gravity": [0.0, -1.0, 0.0]' in to_json(m)
