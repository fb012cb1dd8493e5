"""The question `toolpath`: two witnesses, its file, and what is said of bad files."""

import json

import numpy as np
import pytest

from mechlab import api
from mechlab.cli import main
from mechlab.errors import MechlabError

CURVE_A = {
    "degree": 3, "knots": [0, 0, 0, 0, 0.2, 0.4, 0.6, 0.8, 1, 1, 1, 1],
    "points": [[0, 0], [60, 80], [120, -40], [180, 60], [240, 0], [300, 90], [340, 20], [400, 0]],
}  # fmt: skip
CUSP = {"degree": 3, "knots": [0, 0, 0, 0, 1, 1, 1, 1], "points": [[0, 0], [1, 1], [0, 1], [1, 0]]}


def write(folder, document):
    path = folder / "curve.json"
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    return str(path)


def test_length_and_braking_from_the_command_line(tmp_path, capsys):
    file = write(tmp_path, CURVE_A)
    assert (
        main(["solve", "toolpath", f"curve={file}", "speed=200", "exit_speed=50", "deceleration=1000", "--json"]) == 0
    )
    document = json.loads(capsys.readouterr().out)
    for witness in ("analytic", "quadrature"):
        said = document["answers"][witness]
        assert said["length"] == pytest.approx(462.770036091, abs=1e-9)
        assert sum(said["spans"]) == pytest.approx(said["length"], abs=1e-12)
        assert said["braking_length"] == pytest.approx(462.770036091 - 18.75, abs=1e-9)
        assert said["braking_parameter"] == pytest.approx(0.979146494, abs=1e-9)
    assert document["max_difference"] < 1e-9 and document["status"] == "solved"
    assert main(["solve", "toolpath", f"curve={file}", "speed=2000", "deceleration=1000"]) == 4
    assert "fastest start on it is 962" in capsys.readouterr().err


def test_units_of_the_points(tmp_path):
    plain = api.solve("toolpath", curve=write(tmp_path, CURVE_A))
    scaled = api.solve("toolpath", curve=write(tmp_path, CURVE_A | {"unit": "mm", "name": "A"}))
    assert scaled["analytic"]["length"] == pytest.approx(1e-3 * plain["analytic"]["length"], rel=1e-13)
    assert set(plain["analytic"]) == {"length", "spans"}  # no braking was asked


def test_a_cusp_has_a_length_and_is_named(tmp_path):
    found = api.solve("toolpath", curve=write(tmp_path, CUSP))
    # x = u(3 - 6u + 4u^2), y = 3u(1 - u): C' = 3 (1 - 2u) (1 - 2u, 1); |C'| = 3 |w| sqrt(1 + w^2), so L = 2 sqrt 2 - 1
    assert found["analytic"]["length"] == pytest.approx(2 * np.sqrt(2) - 1, abs=1e-12)
    assert found.max_difference < 1e-9
    assert any("stands still at u = 0.5" in note for note in found.answers["analytic"].notes)


def test_a_place_by_fraction_distance_or_parameter(tmp_path, capsys):
    """Parameters at a quarter, half and three quarters of the length: specification, section 5, to the printed digits."""
    file = write(tmp_path, CURVE_A)
    assert main(["solve", "toolpath", f"curve={file}", "fraction=1/4,1/2,3/4", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    for witness in ("analytic", "quadrature"):
        said = document["answers"][witness]
        np.testing.assert_allclose(said["parameter"], [0.150257811, 0.452746239, 0.801730187], rtol=0, atol=5.1e-10)
        np.testing.assert_allclose(said["distance"], np.array([0.25, 0.5, 0.75]) * 462.770036091, rtol=0, atol=1e-9)
        assert np.shape(said["point"]) == (3, 2)
    half = api.solve("toolpath", curve=file, distance=0.5 * 462.770036091)
    back = api.solve("toolpath", curve=file, parameter=half["quadrature"]["parameter"])
    for witness in ("analytic", "quadrature"):
        assert half[witness]["parameter"] == pytest.approx(0.452746239, abs=5.1e-10)
        assert back[witness]["fraction"] == pytest.approx(0.5, abs=1e-11)  # the printed length has 12 digits
        np.testing.assert_allclose(back[witness]["point"], half[witness]["point"], atol=1e-9)
    ends = api.solve("toolpath", curve=file, fraction=[0.0, 1.0])
    for witness in ("analytic", "quadrature"):
        np.testing.assert_allclose(ends[witness]["point"], [[0, 0], [400, 0]], atol=1e-9)


@pytest.mark.parametrize(
    ("keys", "code", "said"),
    [
        (["distance=500"], 4, "37.23 m too short"),
        (["distance=5kg"], 1, "distance: expected a number [m], got one in kg"),
        (["fraction=5mm"], 1, "fraction: expected a number without a unit"),
        (["fraction=0.5,1.2"], 1, "fraction: expected 0 to 1, got 1.2"),
        (["parameter=-0.1"], 1, "parameter: expected 0 to 1, got -0.1"),
        (["distance=-1"], 1, "distance: expected 0 or more"),
        (["fraction=0.5", "distance=3"], 1, "fraction and distance are given; expected one of"),
        (["speed=1,2", "deceleration=1"], 1, "speed: expected a number [m/s]"),
    ],
)
def test_places_off_the_curve(tmp_path, capsys, keys, code, said):
    assert main(["solve", "toolpath", f"curve={write(tmp_path, CURVE_A)}", *keys]) == code
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("document", "said"),
    [
        ({"degree": 3, "points": CURVE_A["points"]}, "knots missing"),
        (CURVE_A | {"knots": CURVE_A["knots"][1:]}, "12 knots, got 11"),
        (CURVE_A | {"knots": [0, 0, 0, 0, 0.4, 0.2, 0.6, 0.8, 1, 1, 1, 1]}, "knot 5 = 0.2 follows 0.4"),
        (CURVE_A | {"weights": [1]}, "'weights' does not exist"),
        (CURVE_A | {"unit": "kg"}, "unit 'kg' does not exist"),
        (CURVE_A | {"degree": True}, "degree: expected a whole number"),
        ("{", "not JSON"),
        ("[]", "expected a JSON object"),
        ("[" * 60_000, "nested too deeply"),
        (CURVE_A | {"knots": [*CURVE_A["knots"][:-1], 10**400]}, "knots: expected a list of finite numbers"),
        (CURVE_A | {"points": [*CURVE_A["points"][:-1], [1e308, 0]]}, "1e+308 is too large"),
        (CURVE_A | {"name": ["a"]}, "name: expected a text"),
        (CURVE_A | {"unit": ["m"]}, "does not exist"),
        (CURVE_A | {"name": "\ud800"}, "which is no character"),
    ],
)
def test_bad_files_say_what_is_wrong(tmp_path, capsys, document, said):
    file = write(tmp_path, document)
    assert main(["solve", "toolpath", f"curve={file}"]) == 1
    err = capsys.readouterr().err
    assert said in err and file in err and err.count("\n") == 1


def test_bad_quantities(tmp_path):
    file = write(tmp_path, CURVE_A)
    for values, said in (
        ({}, "curve is missing"), ({"curve": "nowhere.json"}, "cannot read nowhere.json"),
        ({"curve": file, "sped": 1.0}, "'sped' does not exist"), ({"curve": file, "speed": 1.0}, "deceleration missing"),
        ({"curve": file, "speed": 1.0, "exit_speed": 2.0, "deceleration": 1.0}, "speed = 1"),
    ):  # fmt: skip
        with pytest.raises(MechlabError, match=said):
            api.solve("toolpath", values)


def test_show_says_what_can_be_asked(capsys):
    assert main(["show", "toolpath"]) == 0
    shown = capsys.readouterr().out
    assert "fraction distance parameter" in shown and "quadrature" in shown
    assert main(["show", "fourbar"]) == 0
    assert "angles, rates and accelerations of coupler and rocker" in capsys.readouterr().out
