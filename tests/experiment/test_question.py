"""Questions of the catalog: every key has a unit that the lab knows, and none is the name of a parameter."""

from __future__ import annotations

import pytest

from mechlab.catalog import NAMES, entry
from mechlab.experiment.parameters import describe
from mechlab.experiment.question import with_rates
from mechlab.studies.toolpath import QUESTION as TOOLPATH
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
