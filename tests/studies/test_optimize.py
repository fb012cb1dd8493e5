"""Optimisation: against closed forms, spec numbers, brute force; infeasible problems; fronts; files; the same seed."""

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import mechlab as ml
from mechlab.analytic import delta6 as closed
from mechlab.analytic import gear_linkage as gears
from mechlab.cli import main
from mechlab.errors import MechlabError, UsageError
from mechlab.studies.optimize.problem import TASKS, OptimisationGoal, TriedDesign
from mechlab.studies.optimize.quantity import quantity_set
from mechlab.studies.optimize.search import non_dominated
from mechlab.values import Range

FOURBAR = {"crank_angle": 0.0, "coupler": Range(0.12, 0.4)}
"""At crank angle 0 coupler b, rocker c = 0.25 and f = ground - crank = 0.2 make a triangle: cos mu = (b2 + c2 - f2) / 2bc."""


def angle_at_zero(b: float) -> float:
    return math.acos((b * b + 0.25**2 - 0.2**2) / (2 * b * 0.25))


def delta_dexterity(length: float, offset: float, radius: float) -> float:
    """Smallest inverse condition over a disc, by brute force."""
    p = ml.load("delta6", rod_length=length, radial_offset=offset).parameters
    a, r = np.meshgrid(np.linspace(0, 2 * np.pi, 1441), radius * np.linspace(0, 1, 6))
    where = np.stack([r * np.cos(a), r * np.sin(a), np.zeros_like(a)], axis=-1)
    return float(closed.inverse_condition(p.geometry, where).min())


def delta_reach(length: float, offset: float) -> float:
    """L sin 45 deg less the largest |g|, which is the same for the three legs."""
    return length * math.sin(math.pi / 4) - math.hypot(offset, 0.003315)


def test_four_bar_best_transmission_angle_is_that_of_the_right_angled_triangle() -> None:
    """d cos(mu) / db = 0 at b2 = c2 - f2 = 0.15^2; cos mu = 0.6 there."""
    found = ml.optimize("fourbar", FOURBAR, maximize="transmission_angle", evaluations=100)
    assert found.exit_code == 0 and found.active == ()
    assert found.best is not None
    assert found.best.values["transmission_angle"] == pytest.approx(math.acos(0.6), abs=1e-12)
    assert found.parameters["coupler"] == pytest.approx(0.15, abs=1e-6)  # flat: the root of the precision of the angle
    assert found.start.values["transmission_angle"] == pytest.approx(angle_at_zero(0.3), abs=1e-12)


def test_same_seed_same_answer_and_nothing_is_computed_twice() -> None:
    one, two, other = (
        ml.optimize("fourbar", FOURBAR, maximize="transmission_angle", evaluations=40, seed=s) for s in (3, 3, 4)
    )
    assert [*one.problem.trials] == [*two.problem.trials] != [*other.problem.trials]
    assert one.parameters == two.parameters


def test_gear_linkage_longest_dwell_for_a_play_is_the_synthesised_crank() -> None:
    """Spec, L1: reverse angle 2 deg at crank 0.4728822419, dwell 46.53457 deg; the engines say so too."""
    start = ml.load("gear_linkage", crank=0.3)
    found = ml.optimize(
        start, crank=Range(0.2, 0.9), maximize="dwell_angle", subject="reverse_angle<=2deg", evaluations=40
    )
    assert found.exit_code == 0 and found.best is not None
    crank = gears.crank_for("reverse_angle", math.radians(2.0), 1.0, 1.0, 0.5).crank
    assert found.parameters["crank"] == pytest.approx(crank, rel=1e-8)
    assert found.parameters["crank"] == pytest.approx(0.4728822419, rel=1e-8)
    assert math.degrees(found.best.values["dwell_angle"]) == pytest.approx(46.53457, abs=1e-5)
    assert found.active == (f"reverse_angle<={math.radians(2.0):.9g}",)
    assert {"pinocchio", "mujoco", "analytic", "again"} == found.checks["dwell_angle"].keys()


def test_reach_and_dexterity_of_the_delta() -> None:
    for length, offset in ((0.37, 0.228), (0.5, 0.15)):
        design = ml.load("delta6", rod_length=length, radial_offset=offset, bend_limit=math.pi / 4)
        said = quantity_set(design, ["reach", "dexterity"], {}).numbers(design)
        assert said["reach"] == pytest.approx(delta_reach(length, offset), abs=1e-8)
        assert said["dexterity"] == pytest.approx(delta_dexterity(length, offset, said["reach"]), abs=2e-6)  # 1441 rays
    short = ml.load("delta6", rod_length=0.3, bend_limit=math.pi / 4)  # bends too far on the axis already
    assert quantity_set(short, ["reach"], {}).numbers(short)["reach"] == pytest.approx(
        delta_reach(0.3, 0.228), abs=1e-12
    )


def test_delta_largest_reach_for_a_dexterity() -> None:
    found = ml.optimize(
        "delta6",
        rod_length=Range(0.33, 0.6),
        bend_limit=math.pi / 4,
        maximize="reach",
        subject="dexterity>=0.4",
        evaluations=48,
    )
    assert found.exit_code == 0 and found.best is not None
    length = brentq(lambda x: delta_dexterity(x, 0.228, delta_reach(x, 0.228)) - 0.4, 0.33, 0.6)
    assert found.parameters["rod_length"] == pytest.approx(length, abs=1e-5)
    assert found.best.values["reach"] == pytest.approx(delta_reach(length, 0.228), abs=1e-5)
    assert found.active == ("dexterity>=0.4",)


def test_workspace_volume_is_not_beaten_by_brute_force() -> None:
    axes = dict.fromkeys("xyz", Range(-0.4, 0.4, 21))
    given = {"bend_limit": math.pi / 4} | axes
    found = ml.optimize("delta6", given | {"radial_offset": Range(0.18, 0.24)}, maximize="volume", evaluations=48)
    every = [ml.workspace("delta6", given, radial_offset=float(r)).survey.volume for r in np.linspace(0.18, 0.24, 13)]
    assert found.best is not None
    assert found.best.values["volume"] >= max(every) > 0.0
    again = ml.workspace("delta6", given, **found.parameters).survey
    assert found.best.values["volume"] == again.volume == again.voxels * 0.04**3


def test_infeasible_names_the_constraint_and_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    command = ["optimize", "fourbar", "crank_angle=0", "coupler=0.12:0.4", "--minimize", "coupler"]
    assert main([*command, "--subject", "transmission_angle>=60deg", "--json"]) == 4
    captured = capsys.readouterr()
    document = json.loads(captured.out)
    assert document["best"] is None and document["status"] == "infeasible"
    assert "transmission_angle>=1.04719755 cannot be met" in document["message"] and document["message"] in captured.err
    assert document["nearest"]["parameters"]["coupler"] == pytest.approx(0.15, abs=2e-3)
    assert document["nearest"]["quantities"]["transmission_angle"] == pytest.approx(math.acos(0.6), abs=1e-4)
    found = ml.optimize(
        "fourbar",
        FOURBAR,
        maximize="transmission_angle",
        subject=("transmission_angle>=52deg", "coupler>=0.3"),
        evaluations=60,
    )
    assert found.exit_code == 4 and "not all of them in one design" in found.message
    nowhere = ml.optimize("gear_linkage", {"crank": (1.2, 1.5)}, maximize="dwell_angle", evaluations=40)
    assert nowhere.exit_code == 4 and "does not turn fully" in nowhere.message


def test_front_follows_the_closed_form(tmp_path: Path) -> None:
    """Large angle against short coupler: every coupler from 0.12 to 0.15 is on the front, none longer."""
    found = ml.optimize(
        "fourbar",
        FOURBAR,
        maximize="transmission_angle",
        front="min:coupler",
        subject="coupler<=0.14",
        evaluations=48,
        out=tmp_path,
    )
    x = np.array([t.x[0] for t in found.front])
    assert len(x) >= 10 and x[0] == pytest.approx(0.15, abs=1e-6) and x[-1] == pytest.approx(0.12, abs=1e-9)
    assert np.all(np.diff(x) < 0.0)
    for t in found.front:
        assert t.values["transmission_angle"] == pytest.approx(angle_at_zero(t.x[0]), abs=1e-12)
    assert found.parameters["coupler"] == pytest.approx(0.14, rel=1e-7)  # the bound holds the best, not the front
    table = list(csv.reader((tmp_path / "front.csv").read_text().splitlines()))
    assert table[0] == ["transmission_angle [rad]", "coupler [m]", "coupler [m]"]
    assert float(table[1][0]) == found.front[0].values["transmission_angle"]
    assert json.loads((tmp_path / "optimum.json").read_text())["evaluations"] == len(found.problem.trials)
    assert (tmp_path / "front.png").read_bytes()[:4] == b"\x89PNG"
    assert "<svg" in (tmp_path / "front.svg").read_text()[:500]


def test_non_dominated_designs() -> None:
    rng = np.random.default_rng(1)
    trials = [
        TriedDesign((float(k),), {"a": float(a), "b": float(b)})
        for k, (a, b) in enumerate(rng.integers(0, 30, (200, 2)))
    ]
    kept = non_dominated(trials, OptimisationGoal("a", 1), OptimisationGoal("b", -1))
    for t in trials:
        better = [k for k in kept if k.values["a"] >= t.values["a"] and k.values["b"] <= t.values["b"]]
        assert better  # each trial is matched or beaten by one on the front
    for k in kept:
        assert not any(
            t.values["a"] >= k.values["a"] and t.values["b"] <= k.values["b"] and dict(t.values) != dict(k.values)
            for t in trials
        )


@pytest.mark.slow
def test_quantities_of_cycles_and_runs() -> None:
    design = ml.load("fourbar")
    names = ["cycle.peak.crank_angle_force", "cycle.least.pin_transmission_angle", "run.final.crank_angle_rate"]
    said = quantity_set(design, names, {}).numbers(design)
    # extremes lie between the positions of a cycle: of twenty times as many the largest misses them by (step / 2)^2 / 2
    cycle, run = ml.cycle("fourbar", points=1441), ml.simulate("fourbar")
    assert said[names[0]] == pytest.approx(np.max(np.abs(cycle["crank_angle_force"])), rel=2e-5)
    assert said[names[1]] == pytest.approx(np.nanmin(cycle["pin_transmission_angle"]), rel=2e-5)
    assert said[names[2]] == run.channel("crank_angle_rate")[-1]


def test_bad_requests_name_the_culprit() -> None:
    for values, how, word in (
        ({"coupler": Range(0.2, 0.4)}, {"maximize": "speedd"}, "speedd"),
        ({"coupler": Range(0.2, 0.4)}, {"maximize": "transmission_angle"}, "run.final.CHANNEL"),
        ({"coupler": Range(0.2, 0.4)}, {"maximize": "rocker_angle"}, "also give crank_angle"),
        ({"coupler": Range(0.2, 0.4, 5)}, {"maximize": "crank"}, "without a count"),
        ({"coupler": Range(-0.2, 0.4)}, {"maximize": "crank"}, "must be > 0"),
        ({"coupler": 0.3}, {"maximize": "crank"}, "no parameter may vary"),
        ({"coupler": Range(0.2, 0.4), "wind": 1.0}, {"maximize": "crank"}, "wind"),
        ({"coupler": Range(0.2, 0.4)}, {"maximize": "crank", "subject": "crank<=3deg"}, r"\[m\]"),
        ({"coupler": Range(0.2, 0.4)}, {"maximize": "cycle.top.x"}, "least, largest, peak"),
    ):
        with pytest.raises(MechlabError, match=word):
            ml.optimize("fourbar", values, **how)
    with pytest.raises(MechlabError, match="cannot vary"):
        ml.optimize("delta6", leg_azimuths=Range(0.0, 1.0), maximize="reach")
    with pytest.raises(UsageError, match="say what is wanted"):
        ml.optimize("pendulum", length=(0.1, 2.0))
    with pytest.raises(UsageError, match="QUANTITY>=value"):
        ml.optimize("fourbar", FOURBAR, maximize="crank", subject="crank=3")


def test_delta_task_runs_without_words(capsys: pytest.CaptureFixture[str]) -> None:
    """Few evaluations: within 2 % of the optimum that the closed form gives; the slow test asks for all of it."""
    assert main(["optimize", "delta6", "--evaluations", "48", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["task"] == TASKS["delta6"].text and document["parameters"]["bend_limit"] == math.pi / 4
    assert document["best"]["quantities"]["reach"] > 0.98 * _delta_optimum()
    assert document["best"]["quantities"]["dexterity"] >= 0.3 * (1 - 1e-8)
    assert document["best"]["quantities"]["reach"] > 4 * document["start"]["quantities"]["reach"]


def _delta_optimum() -> float:
    """Guides as far out as allowed: then the dexterity sets the rod."""
    length = brentq(lambda x: delta_dexterity(x, 0.228, delta_reach(x, 0.228)) - 0.3, 0.4, 0.6)
    return delta_reach(length, 0.228)


@pytest.mark.slow
def test_delta_task_finds_the_optimum() -> None:
    found = ml.optimize("delta6", evaluations=80)
    assert found.best is not None
    assert found.best.values["reach"] == pytest.approx(_delta_optimum(), rel=1e-5)
    assert any("radial_offset at its highest" in a for a in found.active)
    other = [delta_reach(x, r) for x in np.linspace(0.25, 0.6, 36) for r in np.linspace(0.1, 0.228, 14)
             if delta_reach(x, r) > 0 and delta_dexterity(x, r, delta_reach(x, r)) >= 0.3]  # fmt: skip
    assert found.best.values["reach"] >= max(other)


@pytest.mark.slow
def test_gear_linkage_task_is_not_beaten_by_synthesised_cranks() -> None:
    """Equal coupler and rocker make one turn a turn; for each, synthesis gives the crank whose reverse angle is the play."""
    found = ml.optimize("gear_linkage", evaluations=300)  # a fifth of the task's own search
    assert found.exit_code == 0 and found.best is not None
    best = 0.0
    for side in np.linspace(0.7, 1.0, 13):  # longer ones, with a small idler, never stop the output
        for idler in (0.2, 0.3):
            crank = gears.crank_for("reverse_angle", math.radians(2.0), side, side, idler).crank
            if crank is not None:
                said = gears.regime(gears.GearLinkage(crank, side, side, idler))
                if said.least_transmission_angle >= math.radians(30.0):
                    best = max(best, said.dwell_angle_one_sided)
    assert best > 0.0
    assert found.best.values["dwell_angle_one_sided"] >= 0.995 * best


@pytest.mark.slow
def test_four_bar_task_is_the_centric_linkage() -> None:
    """The least transmission angle over a turn is largest where those at 0 and pi are equal: b2 = a2 + d2 - c2."""
    found = ml.optimize("fourbar", evaluations=40)
    # Extremes between the positions: the search for a place ends at 1e-7 of 5 deg, COBYQA's trust region at 1e-11.
    assert found.parameters["coupler"] == pytest.approx(math.sqrt(0.1**2 + 0.3**2 - 0.25**2), abs=1e-5)


@pytest.mark.parametrize("crank", [0.08, 0.1063])
def test_extremes_of_a_cycle_are_those_between_its_positions(crank: float) -> None:
    """The law of cosines where crank and ground are in line gives the least angle of coupler and rocker; the grid of 7
    positions, which begins at the reference pose, misses it by degrees."""
    names = ["cycle.least.pin_transmission_angle", "cycle.span.rocker_angle"]
    design = ml.load("fourbar", crank=crank)
    found = quantity_set(design, names, {}).sources[0]
    from dataclasses import replace

    numbers = replace(found, points=7).numbers(design)  # type: ignore[type-var]

    def opening(diagonal: float, a: float, b: float) -> float:
        return math.acos((a * a + b * b - diagonal * diagonal) / (2.0 * a * b))

    ends = [opening(0.3 + s * crank, 0.3, 0.25) for s in (-1, 1)]
    least = min(min(x, math.pi - x) for x in ends)
    assert numbers[names[0]] == pytest.approx(least, abs=1e-9)
    swing = [opening(0.3 + s * crank, 0.25, 0.3) for s in (-1, 1)]  # the rocker's ends: crank and coupler in line
    assert numbers[names[1]] == pytest.approx(abs(swing[1] - swing[0]), abs=1e-9)


@pytest.mark.parametrize(
    ("quantity", "given", "word"),
    [
        ("cycle.least.pin_angle", {}, "pin_transmission_angle"),
        ("cycle.least.pin_transmission_angle", {"crank_angel_rate": 2.0}, "crank_angle_rate"),
        ("run.final.rocker", {}, "rocker_angle"),
        ("run.health.loop", {}, "loop_gap"),
    ],
)
def test_a_mistyped_column_is_refused_before_a_design_is_tried(quantity: str, given: dict, word: str) -> None:
    seen: list[int] = []
    with pytest.raises(MechlabError, match=f"does not exist.*{word}"):
        ml.optimize(
            "fourbar", {"crank": Range(0.08, 0.12)} | given, maximize="crank", subject=f"{quantity}>=1",
            progress=lambda done, total: seen.append(done),
        )  # fmt: skip
    assert not seen


def test_fewer_designs_than_a_search_needs_are_refused() -> None:
    with pytest.raises(MechlabError, match="expected 40 or more, got 4\\."):
        ml.optimize("fourbar", FOURBAR, maximize="transmission_angle", evaluations=4)


def test_a_quantity_that_does_not_exist_is_refused_before_the_search(monkeypatch: pytest.MonkeyPatch) -> None:
    from mechlab.studies.optimize import study

    monkeypatch.setattr(study, "search", lambda *args: pytest.fail("the search began"))
    for wrong in ("cycle.peak.foo", "cycle.foo.crank_angle_force", "foo"):
        with pytest.raises(MechlabError, match="does not exist|expected cycle.HOW.COLUMN"):
            ml.optimize("fourbar", crank=Range(0.08, 0.12), minimize=wrong, crank_angle_rate=20)
