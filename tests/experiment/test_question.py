"""Questions of the catalog: every key has a unit that the lab knows, and none is the name of a parameter."""

from __future__ import annotations

import pytest

from mechlab.catalog import NAMES, entry
from mechlab.experiment.parameters import describe
from mechlab.experiment.question import Answer, Answers, with_rates
from mechlab.studies.direct.toolpath import QUESTION as TOOLPATH
from mechlab.units import UNITS, compact

SI = {"", *(compact(u.si) for u in UNITS.values())}


@pytest.mark.parametrize("name", NAMES)
def test_every_key_of_a_question_has_a_unit(name):
    for question in (*entry(name).questions, TOOLPATH):
        keys = {*question.given, *question.optional, *question.answers}
        assert keys <= set(question.units), question.name
        assert {compact(u) for u in question.units.values()} <= SI, question.name


@pytest.mark.parametrize("name", NAMES)
def test_no_key_of_a_question_is_a_parameter(name):
    parameters = {i.name for i in describe(entry(name).parameters)}
    for question in entry(name).questions:
        assert not parameters & {*question.given, *question.optional}, question.name


def test_units_of_rates_and_accelerations():
    assert with_rates({"x": "m"}) == {"x": "m", "x_rate": "m/s", "x_accel": "m/s2"}


@pytest.mark.parametrize(("unit", "length", "apart"), [
    ("m", 1.0, False), ("m", 2e-6, True), ("m/s", 2e-6, True), ("rad", 2e-6, False),
])  # fmt: skip
def test_a_length_is_compared_at_the_size_of_the_mechanism(unit, length, apart):
    """1e-11 m is nothing in a metre and too much in a mechanism of 2 micrometres, whose lengths agree to 2e-15 m; an angle has no size."""
    answers = {"analytic": Answer({"x": 1e-7}), "pinocchio": Answer({"x": 1e-7 + 1e-11})}
    assert bool(Answers("pose", answers, units={"x": unit}, length=length).apart) is apart
