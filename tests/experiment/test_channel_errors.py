"""The error of each channel from two runs, against functions whose difference is known."""

import math

import numpy as np
import pytest

from mechlab import api
from mechlab.experiment.errors import differences, with_errors
from mechlab.experiment.recording import Recording

MECHANISM = api.load("pendulum").mechanism()


def recording(t, **channels):
    t = np.asarray(t, dtype=float)
    return Recording(MECHANISM, t, np.zeros((len(t), 1)), np.zeros((len(t), 1)), channels)


def test_the_largest_difference_over_the_run_times_the_factor():
    t = np.linspace(0.0, 2.0, 201)
    fine, coarse = recording(t, x=np.sin(t), w=100.0 * t), recording(t, x=np.sin(t) + 1e-3 * t, w=100.0 * t)
    found = differences(fine, coarse, 0.5)
    assert found["x"] == pytest.approx(1e-3, rel=1e-9)
    # equal runs are as good as rounding lets them be, no better: a few units in the last place of 200
    assert 1e-14 < found["w"] < 1e-11


def test_only_times_that_both_recorded_are_compared():
    a, b = np.linspace(0.0, 1.0, 11), np.union1d(np.linspace(0.0, 1.0, 6), [0.123])
    found = differences(recording(a, x=a**2), recording(b, x=b**2 + 0.01), 1.0)
    assert found["x"] == pytest.approx(0.01, rel=1e-9)


def test_what_cannot_be_compared_has_an_infinite_error():
    t = np.linspace(0.0, 1.0, 11)
    bad = np.where(t > 0.5, np.nan, t)
    fine = recording(t, x=t, y=t, z=bad)
    short = recording(t[:6], x=t[:6], y=t[:6], z=t[:6])
    assert all(math.isinf(e) for e in differences(fine, short, 1.0).values())
    found = differences(fine, recording(t, x=t, z=t), 1.0)
    assert found["x"] < 1e-14 and math.isinf(found["y"]) and math.isinf(found["z"])
    # not a number at the same times in both, as of an angle that does not exist there
    assert differences(fine, fine, 1.0)["z"] < 1e-14


def test_parts_of_an_error_add_up_and_what_no_other_run_tells_is_infinite_and_said():
    t = np.linspace(0.0, 1.0, 11)
    run = recording(t, x=t, y=t)
    other, third = recording(t, x=t + 0.1, y=t), recording(t, x=t - 0.01)
    found = with_errors(run, [(other, 1.0), (third, 2.0)])
    assert found.errors["x"] == pytest.approx(0.12) and math.isinf(found.errors["y"])
    (finding,) = found.health.findings
    assert finding.severity == "warning" and "the error of y could not be estimated" in finding.sentence
    assert "any channel" in with_errors(run, []).health.findings[0].sentence
    assert not with_errors(run, [(other, 1.0)]).health.findings
