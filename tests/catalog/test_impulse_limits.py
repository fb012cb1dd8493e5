"""Limits of one-way rotation of the impulse transmission: the formula against its own regime, and against simulation."""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction

import pytest

from mechlab.analytic.impulse import limits, unidirectional
from mechlab.catalog.impulse_transmission.build import Parameters
from mechlab.catalog.impulse_transmission.questions import closing
from mechlab.cli import main


def asked(capsys, *keys, code=0):
    assert main(["solve", "impulse_transmission", *keys, "--json"]) == code
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(("q", "M0", "M1"), [("4/3", 0, 750), ("4/3", 18, 750), ("4/5", 2, 10)])
def test_limits_part_the_regimes(q, M0, M1):
    """On one side of each limit the regime exists, on the other it sticks, or sin(psi_m) is above 1."""
    p, w = Parameters(q=Fraction(q), M0=M0, M1=M1).impulse, 150.0
    found = limits(p, w)

    def reason(speed=w, load=M0, friction=M1):
        return str(unidirectional(p, speed, load, friction).reason)

    for key, value in (("load", found.sticking_load), ("friction", found.sticking_friction)):
        assert reason(**{key: value * 0.9999}) == "exists"
        assert "sticks" in reason(**{key: value * 1.0001})
    assert reason(speed=found.sticking_speed * 1.0001) == "exists"
    assert "sticks" in reason(speed=found.sticking_speed * 0.9999)
    assert "sin(psi_m)" in reason(speed=found.existence_speed * 0.9999)
    assert "sin(psi_m)" in reason(friction=found.existence_friction * 1.0001)
    assert float(unidirectional(p, w, found.standstill_load, M1).mean_speed) == pytest.approx(0.0, abs=1e-9)


def test_the_simulated_shaft_sticks_beyond_the_limit():
    p = Parameters(M0=0, M1=750).impulse
    load = limits(p, 150.0).sticking_load
    below, above = (closing(replace(p, M0=x * load), 150.0) for x in (0.99, 1.01))
    assert below.stuck_psi == 0.0 and above.stuck_psi > 0.0


def test_limits_from_the_command_line(capsys):
    """Specification, A3: 1.590386 rad/s without friction at 150 rad/s and q = 4/3."""
    document = asked(capsys, "limits_at_speed=150")
    said = document["answers"]
    for witness in ("analytic", "hybrid"):
        assert said[witness]["frictionless_mean_speed"] == pytest.approx(1.590386, abs=5.1e-7)
    # the simulation knows the limits to rtol 1e-11 of its cycles, and 1e-9 of its root finding
    shared = ("sticking_speed", "sticking_load", "sticking_friction", "standstill_load")
    for key in shared:
        assert said["hybrid"][key] == pytest.approx(said["analytic"][key], rel=1e-7)
    assert said["analytic"]["existence_load"] == 750.0


def test_what_has_no_limits(capsys):
    found = asked(capsys, "limits_at_speed=150", "q=4/5")
    assert found["answers"]["analytic"]["frictionless_mean_speed"] == pytest.approx(1.667801, abs=5.1e-7)
    assert "sticking_load" not in found["answers"]["analytic"] and "without any load too" in found["message"]
    assert "not smaller than the friction" in asked(capsys, "limits_at_speed=150", "M0=800", code=4)["message"]
    assert "the spring c holds" in asked(capsys, "limits_at_speed=150", "c=5", code=4)["message"]
    for key in ("limits_at_speed", "input_speed"):
        assert main(["solve", "impulse_transmission", f"{key}=-1"]) == 1
        assert f"{key}: expected more than 0 rad/s, got -1" in capsys.readouterr().err
