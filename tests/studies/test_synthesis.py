"""The verb synthesize: tasks, units, ranges, what is out of reach."""

import json
import math
from fractions import Fraction

import numpy as np
import pytest

from mechlab import api
from mechlab.analytic import fourbar as closed_form
from mechlab.cli import main
from mechlab.errors import MechlabError
from mechlab.values import Range


def document(capsys: pytest.CaptureFixture[str], code: int, *command: str) -> dict:
    assert main(["synthesize", *command, "--json"]) == code
    return json.loads(capsys.readouterr().out)


def test_planetary(capsys: pytest.CaptureFixture[str]) -> None:
    found = document(capsys, 0, "planetary", "ratio=6", "planets=3")
    assert found["count"] == 11425 and len(found["solutions"]) == 100
    first = found["solutions"][0]
    assert [first[z] for z in ("z1", "z2", "z3", "z4")] == [18, 36, 18, 90] and first["size"] == 126
    narrow = ("z1=18:18", "z2=36", "z3=18,20", "pressure_angle_max=20deg", "limit=1")
    found = document(capsys, 0, "planetary", "ratio=6", "planets=3", *narrow)
    assert found["count"] == 2 and len(found["solutions"]) == 1
    found = document(capsys, 4, "planetary", "ratio=6", "planets=9")
    assert found["count"] == 0 and found["solutions"] == [] and "fewer planets" in found["message"]


def test_planetary_ranges_are_inclusive_and_count_is_that_of_the_closed_form(
    capsys: pytest.CaptureFixture[str],
) -> None:
    from mechlab.analytic.planetary_synthesis import series_planets

    found = document(
        capsys, 0, "planetary", "ratio=17/3", "planets=4", "z1=18:30", "z2=20:60", "z3=18:40", "limit=100000"
    )
    expected = series_planets("17/3", 4, range(18, 31), range(20, 61), range(18, 41))  # type: ignore[arg-type]
    assert found["count"] == len(expected) == len(found["solutions"])


@pytest.mark.parametrize(
    ("given", "crank"),
    [
        ("reverse_angle=2deg", 0.4728822419),
        ("dwell_angle=60deg", 0.4941925986),
        ("dwell_angle_one_sided=90deg", 0.5015867576),
    ],
)
def test_gear_linkage(capsys: pytest.CaptureFixture[str], given: str, crank: float) -> None:
    lengths = ("coupler=1", "rocker=1", "idler_radius=0.5")
    found = document(capsys, 0, "gear_linkage", *lengths, given)
    assert math.isclose(found["crank"], crank, abs_tol=1e-8)
    name, degrees = given.removesuffix("deg").split("=")
    assert math.isclose(found[name], math.radians(float(degrees)), abs_tol=1e-9)
    doubled = document(capsys, 0, "gear_linkage", "coupler=2", "rocker=2", "idler_radius=1", "frame=2", given)
    assert math.isclose(doubled["crank"], 2 * crank, abs_tol=2e-8)


def test_gear_linkage_out_of_reach(capsys: pytest.CaptureFixture[str]) -> None:
    lengths = ("coupler=.9", "rocker=.9", "idler_radius=.3")
    found = document(capsys, 4, "gear_linkage", *lengths, "reverse_angle=90deg")
    assert found["crank"] is None and "out of reach" in found["message"]
    assert 70.28 < math.degrees(found["reachable"]["high"]) < 90.0
    found = document(capsys, 4, "gear_linkage", "coupler=.3", "rocker=.4", "idler_radius=.1", "reverse_angle=1deg")
    assert "no crank turns fully" in found["error"]["message"]


def test_closed_differential(capsys: pytest.CaptureFixture[str]) -> None:
    found = document(capsys, 0, "closed_differential", "ratio_36_braked=4", "ratio_14_braked=2/3")
    first = found["solutions"][0]
    assert [first[f"z{k}"] for k in range(1, 7)] == [72, 18, 108, 18, 72, 162]
    assert math.isclose(first["ratio_36_braked"], 4.0) and math.isclose(first["ratio_14_braked"], 2 / 3)
    assert document(capsys, 4, "closed_differential", "ratio_36_braked=4", "ratio_14_braked=.66")["count"] == 0
    near = document(capsys, 0, "closed_differential", "ratio_36_braked=4", "ratio_14_braked=.66", "tolerance=.02")
    assert near["count"] > 0
    for s in near["solutions"]:
        assert abs(s["ratio_36_braked"] / 4 - 1) < 0.05 and abs(s["ratio_14_braked"] / 0.66 - 1) < 0.05


@pytest.mark.parametrize(
    ("task", "values", "message"),
    [
        ("planets", {}, "the task 'planets' does not exist.*planetary"),
        ("planetary", {"planets": 3}, "ratio is missing"),
        ("planetary", {"ratio": 6, "z5": 3}, "key 'z5' does not exist.*z4"),
        ("planetary", {"ratio": 6, "planets": 2.5}, "whole number"),
        ("planetary", {"ratio": 6, "z1": "few"}, "z1: expected whole numbers"),
        ("planetary", {"ratio": "six"}, "ratio"),
        ("gear_linkage", {"coupler": 1, "rocker": 1, "idler_radius": 0.5}, "exactly one of"),
        ("gear_linkage", {"coupler": 1, "rocker": 1, "reverse_angle": 0.1}, "idler_radius is missing"),
        (
            "gear_linkage",
            {"coupler": "x", "rocker": 1, "idler_radius": 0.5, "reverse_angle": 0.1},
            "coupler: expected a number",
        ),
        ("closed_differential", {"ratio_36_braked": 2, "ratio_14_braked": 2}, "must differ"),
    ],
)
def test_refusals(task: str, values: dict, message: str) -> None:
    with pytest.raises(MechlabError, match=message):
        api.synthesize(task, values)


def test_text_is_cut_and_says_so() -> None:
    text = api.synthesize("planetary", {"ratio": 6}).text()
    assert "11425 solutions" in text and "the first 20 of 100" in text and len(text.splitlines()) == 24


def stages(share: str, planets: int, teeth: list[int]) -> set[tuple[int, int, int]]:
    """Sun, planet, ring by trying all of them: evenly placed planets whose tips do not meet."""
    return {
        (s, p, r) for s in teeth for p in teeth for r in teeth
        if r == s + 2 * p and Fraction(s, s + r) == Fraction(share) and (s + r) % planets == 0
        and (s + p) * math.sin(math.pi / planets) >= p + 2
    }  # fmt: skip


@pytest.mark.parametrize(
    ("word", "teeth"),
    [("18,27,54,72", [18, 27, 54, 72]), ("18:72:7", list(range(18, 73, 9))), ("18:72", list(range(18, 73)))],
)
def test_a_list_of_teeth_is_a_list_and_a_count_is_kept(
    capsys: pytest.CaptureFixture[str], word: str, teeth: list[int]
) -> None:
    """i36 = a / b = 4/5 and i14 = (1 - a) / (1 - b) = 16/15 where a = 1/5 and b = 1/4."""
    ratios = ("ratio_36_braked=4/5", "ratio_14_braked=16/15")
    first, second = stages("1/5", 3, teeth), stages("1/4", 3, teeth)
    expected = {(*a, *b) for a in first for b in second}
    assert expected
    known = document(capsys, 0, "closed_differential", *ratios, f"teeth={word}", "limit=100000")
    assert {tuple(s[f"z{k}"] for k in range(1, 7)) for s in known["solutions"]} == expected


def test_the_count_of_a_range_of_teeth_is_obeyed_or_refused(capsys: pytest.CaptureFixture[str]) -> None:
    fixed = ("planetary", "ratio=6", "planets=3", "z2=18:60", "z3=18:60", "limit=1000000")
    every = document(capsys, 0, *fixed, "z1=18:24")
    some = document(capsys, 0, *fixed, "z1=18:24:3")
    wanted = [s for s in every["solutions"] if s["z1"] in (18, 21, 24)]
    assert some["solutions"] == wanted and len(wanted) < every["count"]
    assert "whole numbers of teeth" in document(capsys, 1, *fixed, "z1=18:20:4")["error"]["message"]


def test_tuple_list_and_range_of_teeth_mean_the_same() -> None:
    found = [
        api.synthesize("planetary", {"ratio": 6, "z1": z1, "z2": 36, "z3": 18}).to_dict()
        for z1 in ((18, 19, 20), [18, 19, 20], range(18, 21), np.arange(18, 21), Range(18, 20), Range(18, 20, 3))
    ]
    assert all(x == found[0] for x in found) and found[0]["count"]


def test_a_motion_through_five_positions_gives_back_its_fourbar(capsys: pytest.CaptureFixture[str]) -> None:
    """Positions of the coupler of a known four-bar, its frame in the crank pin: crank .1, coupler .3, rocker .25, ground .3."""
    crank = np.linspace(0.3, 1.5, 5)
    turn = closed_form.solve(0.1, 0.3, 0.25, 0.3, crank).coupler_angle
    given = [f"{k}={','.join(map(repr, v.tolist()))}" for k, v in (("x", 0.1 * np.cos(crank)), ("y", 0.1 * np.sin(crank)), ("angle", turn))]
    found = document(capsys, 0, "motion", *given)["solutions"]
    ours = [s for s in found if abs(s["driver"] - 0.1) < 1e-7 and abs(s["follower"] - 0.25) < 1e-7 and s["one_mode"]]
    assert len(ours) == 1 and ours[0]["coupler"] == pytest.approx(0.3, abs=1e-7)
    assert (ours[0]["follower_pivot_x"], ours[0]["follower_pivot_y"]) == pytest.approx((0.3, 0.0), abs=1e-7)
    assert "expected 5 numbers" in document(capsys, 1, "motion", "x=1,2", "y=1,2", "angle=0,1")["error"]["message"]
