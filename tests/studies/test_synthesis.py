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
from mechlab.kit.path_motion import EngineMotion
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
    assert "expected 3 to 200 numbers" in document(capsys, 1, "motion", "x=1,2", "y=1,2", "angle=0,1")["error"]["message"]


def measured(solution: dict, angles: list[float], *names: str) -> list[np.ndarray]:
    """What MuJoCo measures on the entry and parameters of a printed command line, at crank angles along its path."""
    words = solution["command"].split()
    assert words[:2] == ["mechlab", "run"] and words[2] == solution["entry"]
    m = api.load(words[2], dict(w.split("=") for w in words[3:])).mechanism()
    motion = EngineMotion("mujoco", m, {"crank_angle": (angles[0], angles[-1])}, 2)
    shares = (np.array(angles) - angles[0]) / (angles[-1] - angles[0])
    motion.places = np.union1d(np.linspace(0.0, 1.0, 121), shares)
    return [motion[n][np.searchsorted(motion.places, shares)] for n in names]


LOOP = ("x=.5,.4,.3,.2,.1,.05,.02,0,0,.03,.1,.15,.2,.3,.4,.5,.6,.6", "y=1.1,1.1,1.1,1,.9,.75,.6,.5,.4,.3,.25,.2,.3,.4,.5,.7,.9,1")
TIMING = "angle=" + ",".join(f"{20 * k}deg" for k in range(18))


def test_a_path_is_answered_by_entries_that_mujoco_leads_through_the_points(capsys: pytest.CaptureFixture[str]) -> None:
    """Cabrera, Simon and Prado 2002 print .0337 for the sum of squares of their four-bar (tests/analytic/test_path_synthesis.py)."""
    found = document(capsys, 0, "path", *LOOP, TIMING, "limit=1")
    targets = [complex(a, b) for a, b in zip(*(map(float, k.split("=")[1].split(",")) for k in LOOP), strict=True)]
    four, five = found["solutions"]
    assert (four["entry"], five["entry"]) == ("path_fourbar", "path_fivebar")
    for solution, most in ((four, 0.00903), (five, 0.0068)):
        x, z = measured(solution, solution["crank_angles"], "P_x", "P_z")
        squares = float(np.sum(np.abs(x + 1j * z - targets) ** 2))
        assert squares == pytest.approx(solution["squares"], rel=1e-6) and squares < most
        np.testing.assert_allclose(np.diff(solution["crank_angles"]), math.radians(20.0), atol=1e-12)


def test_six_bars_are_led_by_mujoco_nearer_to_the_points_than_four_bars(capsys: pytest.CaptureFixture[str]) -> None:
    found = document(capsys, 0, "path", *LOOP, TIMING, "chain=six-bar", "limit=2")
    targets = [complex(a, b) for a, b in zip(*(map(float, k.split("=")[1].split(",")) for k in LOOP), strict=True)]
    assert found["best_fourbar"]["squares"] == pytest.approx(0.00903, abs=1e-5)
    for solution in found["solutions"]:
        assert solution["entry"] in ("path_stephenson", "path_watt")
        x, z = measured(solution, solution["crank_angles"], "P_x", "P_z")
        squares = float(np.sum(np.abs(x + 1j * z - targets) ** 2))
        assert squares == pytest.approx(solution["squares"], rel=1e-6) and squares < 0.65 * found["best_fourbar"]["squares"]
        np.testing.assert_allclose(np.diff(solution["crank_angles"]), math.radians(20.0), atol=1e-12)


def test_few_points_are_met_exactly_and_the_text_has_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    given = ("path", "x=20,20,20,20,20,20", "y=20,25,30,35,40,45", "size=150", "limit=2")
    for solution in document(capsys, 0, *given)["solutions"]:
        x, z = measured(solution, solution["crank_angles"], "P_x", "P_z")
        np.testing.assert_allclose(x, 20.0, atol=1e-7)
        np.testing.assert_allclose(z, np.linspace(20.0, 45.0, 6), atol=1e-7)
        assert solution["command"] in api.synthesize("path", {k: v.split(",") for k, v in (g.split("=") for g in given[1:3])} | {
            "size": 150, "limit": 2}).text()  # fmt: skip


def test_a_motion_has_a_command_whose_coupler_point_goes_through_the_places(capsys: pytest.CaptureFixture[str]) -> None:
    crank = np.linspace(0.3, 1.5, 5)
    turn = closed_form.solve(0.1, 0.3, 0.25, 0.3, crank).coupler_angle
    given = [f"{k}={','.join(map(repr, v.tolist()))}" for k, v in (("x", 0.1 * np.cos(crank)), ("y", 0.1 * np.sin(crank)), ("angle", turn))]
    found = document(capsys, 0, "motion", *given)
    assert len(found["commands"]) == sum(s["one_mode"] for s in found["solutions"])
    for command in found["commands"]:
        p = dict(w.split("=") for w in command.split()[3:])
        ends = [float(p["first"]), float(p["first"]) + float(p["turn"])]
        x, z = measured({"command": command, "entry": "path_fourbar"}, ends, "P_x", "P_z")
        np.testing.assert_allclose(x + 1j * z, 0.1 * np.exp(1j * crank[[0, -1]]), atol=1e-8)


def test_bodies_are_carried_by_mujoco_through_positions_that_no_four_bar_has(capsys: pytest.CaptureFixture[str]) -> None:
    """Eight positions of the second link of a published six-bar (tests/analytic/test_motion_synthesis.py), to six digits."""
    given = {
        "x": [0.270056, 0.285709, 0.206419, 0.058973, -0.0459066, -0.0499226, -0.0468435, 0.00240202],
        "y": [0.162935, 0.20468, 0.274456, 0.280611, 0.222651, 0.225707, 0.204874, 0.194051],
        "angle": [-0.248496, 0.0232652, 0.707373, 1.6222, 2.21694, 1.82164, 1.51815, 1.12657],
    }
    words = [f"{k}={','.join(map(str, v))}" for k, v in given.items()]
    found = document(capsys, 0, "motion", *words, "chain=six-bar", "limit=2")
    six, four = found["solutions"], document(capsys, 0, "motion", *words, "limit=1")["solutions"]
    assert six[0]["entry"] == "path_watt" and four[0]["worst"] > 0.01
    for solution in (*six, *four):
        link = "coupler_angle" if solution["entry"] == "path_fourbar" else "link_angle"
        x, z, turn = measured(solution, solution["crank_angles"], "P_x", "P_z", link)
        far = np.hypot(x - given["x"], z - given["y"])
        off = np.abs(np.angle(np.exp(1j * (turn + solution["body_from_link"] - given["angle"]))))
        assert np.max(far) == pytest.approx(solution["worst"], abs=1e-8) and np.max(off) == pytest.approx(solution["worst_angle"], abs=1e-7)
    assert six[0]["worst"] < 1e-9 and found["best_fourbar"]["worst"] == pytest.approx(four[0]["worst"], abs=1e-8)


def test_a_function_is_generated_by_an_entry(capsys: pytest.CaptureFixture[str]) -> None:
    """The output angle of MuJoCo on its scale is the logarithm, at Chebyshev's points and, within the stated error, everywhere."""
    found = document(capsys, 0, "function", "x=1:2", "y=log10(x)", "turn=60deg", "turn_out=60deg", "limit=1")
    (best,) = found["solutions"]
    turned = np.linspace(0.0, math.radians(60.0), 61)
    (angle,) = measured(best, (best["parameters"]["first"] + turned).tolist(), "rocker_angle")
    wanted = math.radians(60.0) * np.log10(1.0 + turned / math.radians(60.0)) / math.log10(2.0)
    errors = np.angle(np.exp(1j * (angle - best["first_out"] - wanted)))
    assert np.max(np.abs(errors)) == pytest.approx(best["range_error"], rel=0.02) and best["range_error"] < math.radians(0.01)
    np.testing.assert_allclose(found["precision_points"]["x"], [1.067, 1.5, 1.933], atol=5e-4)


def test_a_six_bar_generates_a_function_with_its_scale_where_it_is_wanted(capsys: pytest.CaptureFixture[str]) -> None:
    given = ("function", "x=0:1", "y=exp(x)", "turn=100deg", "turn_out=100deg", "chain=six-bar", "first_out=20deg", "limit=1")
    (best,) = document(capsys, 0, *given)["solutions"]
    turned = np.linspace(0.0, math.radians(100.0), 61)
    (angle,) = measured(best, (best["parameters"]["first"] + turned).tolist(), "output_angle")
    wanted = math.radians(100.0) * (np.exp(turned / math.radians(100.0)) - 1.0) / (math.e - 1.0)
    errors = np.angle(np.exp(1j * (angle - math.radians(20.0) - wanted)))
    assert np.max(np.abs(errors)) == pytest.approx(best["range_error"], rel=0.03) and best["range_error"] < math.radians(0.01)


def test_a_line_and_a_dwell_are_found_as_entries(capsys: pytest.CaptureFixture[str]) -> None:
    (line,) = document(capsys, 0, "straight_line", "length=0.2", "angle=150deg", "limit=1")["solutions"]
    first = line["parameters"]["first"]
    x, z = measured(line, np.linspace(first, first + math.radians(150.0), 41).tolist(), "P_x", "P_z")
    assert (np.min(x), np.max(x)) == pytest.approx((0.0, 0.2), abs=1e-4)
    assert np.ptp(z) == pytest.approx(line["deviation"], rel=0.03) and line["deviation"] < 0.0005 * 0.2
    assert line["parameters"]["turn"] == pytest.approx(2 * math.pi)
    (rest,) = document(capsys, 0, "dwell", "angle=100deg", "swing=25deg", "limit=1")["solutions"]
    around = np.concatenate([[1.0], rest["dwell_from"] + np.linspace(0.0, math.radians(100.0), 41), [1.0 + 2 * math.pi]])
    if around[1] < 1.0 or around[-2] > around[-1]:
        around = np.concatenate([[1.0], np.sort(1.0 + (around[1:-1] - 1.0) % (2 * math.pi)), [1.0 + 2 * math.pi]])
    (angle,) = measured(rest, around.tolist(), "output_angle")
    assert np.ptp(np.unwrap(angle[1:-1])) == pytest.approx(rest["deviation"], rel=0.03) and rest["deviation"] < math.radians(0.1)


def test_a_slotted_dwell_is_found_as_an_entry(capsys: pytest.CaptureFixture[str]) -> None:
    (rest,) = document(capsys, 0, "dwell", "angle=90deg", "swing=45deg", "segment=straight", "limit=1")["solutions"]
    assert rest["entry"] == "slotted_dwell"
    around = rest["dwell_from"] + np.append(np.linspace(0.0, math.radians(90.0), 41), np.linspace(1.6, 2 * math.pi, 200))
    angle, x, z = measured(rest, around.tolist(), "lever_angle", "P_x", "P_z")
    assert np.ptp(angle[:41]) == pytest.approx(rest["deviation"], rel=0.03) and rest["deviation"] < math.radians(0.1)
    assert np.ptp(angle) == pytest.approx(rest["swing"], abs=1e-3) and rest["swing"] > math.radians(44.99)
    # the slide stays at least one crank, .05 m, from the pivot; kept at 72 places of the turn
    far = np.hypot(x - rest["parameters"]["pivot_x"], z - rest["parameters"]["pivot_y"])
    assert np.min(far) > 0.0495 and np.max(far) == pytest.approx(rest["parameters"]["lever"], rel=1e-3)


@pytest.mark.parametrize(
    ("task", "values", "message"),
    [
        ("path", {"x": (1, 2), "y": (1, 2)}, "x: expected 3 to 200 numbers"),
        ("path", {"x": (1, 2, 3), "y": (1, 2)}, "y: expected 3 numbers"),
        ("path", {"x": (1, 1, 3), "y": (1, 1, 2)}, "points 1 and 2 are the same"),
        ("path", {"x": (1, 2, 3), "y": (1, 1, 2), "angle": (0, 2, 1)}, "must grow, or fall"),
        ("path", {"x": (1, 2, 3), "y": (1, 1, 2), "transmission_angle_min": 2.0}, "transmission_angle_min: expected 0 to"),
        ("motion", {"x": (1, 1, 1), "y": (2, 2, 2), "angle": (0, 1, 2)}, "the body's origin stays in one place"),
        ("motion", {"x": (1, 1, 3), "y": (2, 2, 2), "angle": (0, 0, 1)}, "positions 1 and 2 are the same"),
        ("motion", {"x": (1, 2, 3), "y": (2, 2, 2), "angle": (0, 0, 1), "arm": 0.0}, "arm: expected 0.002 to 2000 m, got 0"),
        ("motion", {"x": (1, 2, 3), "y": (2, 2, 2), "angle": (0, 0)}, "angle: expected 3 numbers"),
        ("motion", {"x": (0, 1e9, 2e9), "y": (2, 2, 2), "angle": (0, 0, 1)}, "extend over 2e\\+09 m.*1e-06 to 100000 m"),
        ("path", {"x": (0, 1e-9, 2e-9), "y": (2, 2, 2)}, "extend over 2e-09 m"),
        ("path", {"x": (1, 2, 3), "y": (1, 1, 2), "chain": "watt"}, "chain: expected four-bar or six-bar, got 'watt'"),
        ("path", {"x": (1, 2, 3), "y": (1, 1, 2), "points": 3}, "key 'points' does not exist"),
        ("function", {"x": Range(1, 2), "y": "foo(x)"}, "'foo\\(x\\)'.*log10"),
        ("function", {"x": Range(1, 2), "y": "__import__('os')"}, "is none of numbers"),
        ("function", {"x": Range(1, 2), "y": "x +"}, "cannot read"),
        ("function", {"x": Range(-1, 1), "y": "x^2"}, "ends where it began"),
        ("function", {"x": Range(0, 1), "y": "log(x)"}, "not finite"),
        ("function", {"x": (1, 2, 2), "y": (1, 2, 3)}, "two points have the same input"),
        ("function", {"x": (1, 2, 3), "y": (1, 2, 4), "points": 4}, "points spaces a function"),
        ("function", {"x": Range(1, 2), "y": "x^2", "turn": 0}, "turn: expected an angle that is not 0"),
        ("function", {"x": Range(0, 1), "y": "exp(x)", "chain": "six-bar", "first": 0, "first_out": 1}, "first or first_out, not both"),
        ("straight_line", {"length": 0}, "length: expected a length above 0"),
        ("straight_line", {}, "length is missing"),
        ("dwell", {"angle": 1.0, "segment": "line"}, "segment: expected arc or straight, got 'line'"),
        ("dwell", {"angle": 1.0, "clearance": 1.0}, "clearance: expected segment=straight beside it"),
        ("dwell", {"angle": 1.0, "segment": "straight", "clearance": 0.0}, "clearance: expected 0.05 to 10"),
        ("dwell", {}, "angle is missing"),
        ("dwell", {"angle": 6.0}, "angle: expected 0.17"),
    ],
)
def test_refusals_of_linkages(task: str, values: dict, message: str) -> None:
    with pytest.raises(MechlabError, match=message):
        api.synthesize(task, values)


def test_what_is_out_of_reach_says_what_to_try() -> None:
    found = api.synthesize("straight_line", {"length": 1.0, "transmission_angle_min": 1.3})
    assert found.exit_code == 4 and "smaller transmission_angle_min" in found.message
    held = api.synthesize("function", {"x": (1, 2, 3, 4), "y": (1, 2, 3, 1.5), "first": 0.0, "transmission_angle_min": 1.2})
    assert held.exit_code == 4 and "least squares" in held.message and held.to_dict()["solutions"] == []
