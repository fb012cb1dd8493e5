"""The closed differential as users meet it: solve, simulate, claims, warnings; numbers of the specification's tables."""

import json
from pathlib import Path

import numpy as np
import pytest

from mechlab import api
from mechlab.catalog.closed_differential import ENTRY
from mechlab.catalog.closed_differential.build import Parameters
from mechlab.catalog.closed_differential.checks import predicted_lag, run
from mechlab.catalog.closed_differential.law import DRAGS
from mechlab.cli import main
from mechlab.errors import MechlabError, NoSolution
from mechlab.studies.check.check import checks_of

NAMES = ("w_H1", "w_H2", "w1", "w3")
USED = {"w_H2": 50, "w1": 200, "w3": 100 / 3, "w2": -300, "w5": 12.5, "M21": 40, "M23": 60, "M54": 20, "M56": 180,
        "start_moment": 700 / 3, "internal_moment": 400 / 3, "start_ratio": -4 / 3}  # fmt: skip
STATED = {"w_H2": 50, "w1": 850, "w3": -150, "w2": -650, "w5": -1450 / 3, "M21": 25, "M23": 75, "M54": 40, "M56": 160,
          "start_moment": 109.375, "internal_moment": 9.375, "start_ratio": -0.09375}  # fmt: skip


def final(scene: str, **options: object) -> dict[str, float]:
    found = api.simulate(ENTRY, scene=scene, **options)
    assert found.health.trusted
    return found.final()


@pytest.mark.parametrize(
    ("more", "expected"), [([], USED), (["teeth=80,20,120,20,80,180"], USED), (["teeth=30,30,90,40,60,160"], STATED)]
)
def test_solve_by_three_witnesses(more: list[str], expected: dict[str, float], capsys) -> None:
    assert main(["solve", "closed_differential", "w_H1=100", "M_H1=100", "M_H2=200", *more, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    for witness in ("analytic", "pinocchio", "mujoco"):
        for key, value in expected.items():
            assert document["answers"][witness][key] == pytest.approx(value, rel=1e-9), (witness, key)
    assert document["max_difference"] < 1e-8
    assert "(10)" in document["message"]


def test_solve_with_other_quantities() -> None:
    braked = api.solve(ENTRY, w_H1=100.0, w3=0.0)
    assert braked["analytic"]["w_H2"] == pytest.approx(25.0) and braked.max_difference < 1e-8
    many = api.solve(ENTRY, w1=np.array([1.0, 2.0]), w3=0.0)
    np.testing.assert_allclose(many["mujoco"]["w_H1"], [0.4, 0.8], rtol=1e-12)
    with pytest.raises(MechlabError, match="M_H2 = 0"):
        api.solve(ENTRY, w_H1=100.0, M_H2=0.0)
    with pytest.raises(MechlabError, match="turn as one"):
        api.solve(ENTRY, w_H1=100.0, w_H2=50.0, teeth=(20, 20, 60, 30, 30, 90))


@pytest.mark.parametrize("fidelity", ["minimal", "parts", "full"])
@pytest.mark.parametrize("engine", ["mujoco", "pinocchio"])
def test_constant_moments(fidelity: str, engine: str) -> None:
    found = final("constant-moments", duration=0.5, fidelity=fidelity, engine=engine)
    tolerance = 1e-6 if fidelity == "minimal" else 1e-5
    np.testing.assert_allclose([found["w1"], found["w3"]], [461.383100, -54.935543], atol=tolerance)
    np.testing.assert_allclose([found["w_H1"], found["w_H2"]], [151.592, -3.304], atol=5e-4)  # printed to 3 decimals
    np.testing.assert_allclose([found[k] for k in ("w_H1", "w_H2")], [151.5919144805, -3.3036782639], atol=tolerance)


@pytest.mark.parametrize("fidelity", ["minimal", "parts", "full"])
def test_constant_moments_of_another_train(fidelity: str) -> None:
    values = {"teeth": (20, 40, 100, 50, 20, 90), "module": 0.003, "planets": 2, "J_H1": 0.01, "J14": 0.2, "J36": 0.05,
              "J_H2": 0.3, "J2": 2e-3, "m2": 1.0, "J5": 1e-3, "m5": 0.4,
              "M_H1": -30.0, "M_H2": 55.0, "w_H1_0": 12.0, "w_H2_0": -7.0}  # fmt: skip
    truth = final("constant-moments", engine="analytic", **values)
    found = final("constant-moments", fidelity=fidelity, **values)
    for name in NAMES:
        assert found[name] == pytest.approx(truth[name], abs=1e-5)


@pytest.mark.parametrize(
    ("scene", "values", "carriers"),
    [
        ("held-input-dry-load", {}, (100.0, 0.0)),
        ("internal-drag", {}, (-158.013, -175.523)),
        ("one-way-stop", {}, (162.4695, 40.6174)),
        ("locked-pair", {"M_H2": 200.0}, (100.0, 50.0)),
        ("locked-pair", {"M_H2": 220.0}, (69.3765, 34.6883)),
        ("locked-pair", {"M_H2": 150.0}, (176.5587, 88.2794)),
    ],
)
@pytest.mark.parametrize("fidelity", ["minimal", "full"])
def test_tables(scene: str, values: dict[str, float], carriers: tuple[float, float], fidelity: str) -> None:
    found = final(scene, fidelity=fidelity, **values)
    np.testing.assert_allclose([found["w_H1"], found["w_H2"]], carriers, atol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "values", "carriers"),
    [
        ("housing-drag", {}, (363.910, 45.976)),
        ("motor-and-viscous-load", {}, (200.0, 0.0)),
        ("constant-power", {"duration": 0.5}, (156.6, 22.5)),
        ("constant-power", {}, (1604.0, 1.64)),
        ("backstop-two-range", {"M_H2": 50.0}, (100.0, 77.5)),
        ("backstop-two-range", {"M_H2": 100.0}, (100.0, 55.0)),
        ("backstop-two-range", {"M_H2": 150.0}, (100.0, 32.5)),
        ("backstop-two-range", {"M_H2": 200.0}, (100.0, 25.0)),
    ],
)
def test_long_tables(scene: str, values: dict[str, float], carriers: tuple[float, float]) -> None:
    found = final(scene, **values)
    printed = 0.5 if scene == "constant-power" else 1e-3  # that row of the table has three digits
    np.testing.assert_allclose([found["w_H1"], found["w_H2"]], carriers, atol=printed)
    truth = final(scene, engine="analytic", **values)
    np.testing.assert_allclose([found[n] for n in NAMES], [truth[n] for n in NAMES], atol=1e-6)


def test_dry_load_stops_in_time_and_sticks() -> None:
    found = api.simulate(ENTRY, scene="held-input-dry-load", fidelity="parts")
    w, torque, t = found.channel("w_H2"), found.channel("H1_force"), found.t
    stop = t[np.argmax(w < 0.1)]  # the capture smooths the last 0.07 rad/s
    assert 0.3505 <= stop <= 0.352
    np.testing.assert_allclose(torque[(t > 0.05) & (t < 0.34)], 69.6416, atol=1e-3)
    np.testing.assert_allclose(torque[t > 0.4], 0.0, atol=1e-3)
    assert np.max(np.abs(w[t > 0.4])) < 1e-9


@pytest.mark.parametrize("part", ["minimal", "parts", "full"])
def test_structure(part: str) -> None:
    s = api.load(ENTRY).structure(part)
    assert s.freedoms == 2
    assert (s.nv, s.rows) == {"minimal": (2, 0), "parts": (6, 4), "full": (10, 12)}[part]
    assert len(s.redundant) == (4 if part == "full" else 0)


def test_checks() -> None:
    report = api.check([ENTRY])
    assert {o.check.id: o.passed for o in report.outcomes} == dict.fromkeys([c.id for c in checks_of(ENTRY)], True)


@pytest.mark.parametrize("fidelity", ["parts", "full"])
@pytest.mark.parametrize("light", [{}, {"J2": 2.4e-6}, {"J14": 3e-5}])
def test_predicted_lag_is_the_measured_one(fidelity: str, light: dict[str, float]) -> None:
    p = Parameters(**light)
    predicted = predicted_lag(p, fidelity)
    found = run("mujoco", p, "constant-moments", 0.2, fidelity)
    rows = {r.name: found.mechanism.coefficient_row(r.coefficients) for r in found.mechanism.relations}
    for name, row in rows.items():
        assert abs(float(row @ found.q[-1])) == pytest.approx(predicted[name], rel=0.01)


@pytest.mark.parametrize("light", [{"J2": 2.4e-10}, {"J14": 3e-8}, {"J36": 1.5e5}])
def test_inertia_ratio_of_a_million(light: dict[str, float]) -> None:
    truth = final("constant-moments", engine="analytic", **light)
    found = final("constant-moments", fidelity="minimal", **light)
    for name in NAMES:
        assert found[name] == pytest.approx(truth[name], rel=1e-9, abs=1e-9)
    for fidelity in ("parts", "full"):
        result = api.simulate(ENTRY, light, scene="constant-moments", fidelity=fidelity)
        final_speeds = result.recording.final()
        wrong = max(abs(final_speeds[n] - truth[n]) for n in NAMES) > 1e-5
        if wrong or "J36" not in light:
            assert result.exit_code == 3 and any("lag" in note for note in result.notes)


def test_ratio_of_a_thousand() -> None:
    """a - b = 1/1000: w1 = 1000 times the difference of the carriers; nothing is light, so all fidelities are right."""
    teeth = (250, 125, 500, 249, 127, 503)
    values = {"teeth": teeth, "module": 1e-3, "w_H1_0": 10.0, "w_H2_0": 10.1, "planets": 1, "J14": 30.0, "J36": 150.0}
    p = Parameters(teeth=teeth)
    assert abs(p.train.a - p.train.b) < 2.5e-3
    truth = final("constant-moments", engine="analytic", **values)
    for fidelity in ("minimal", "parts"):
        found = api.simulate(ENTRY, scene="constant-moments", fidelity=fidelity, **values)
        gap = max(abs(found.final()[n] - truth[n]) for n in NAMES)
        assert gap < 1e-6 if fidelity == "minimal" else gap < 1e-4 or not found.health.trusted


def test_verdicts_and_figure(tmp_path: Path, capsys) -> None:
    target = tmp_path / "verdict.png"
    # The old form, a file in the place of a name, draws the first figure and says how to write it now.
    assert main(["claims", "closed_differential", "--figure", str(target), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert "`figure` takes the name" in document["warnings"][0]
    kinds = {c["id"]: c["kind"] for c in document["claims"]}
    assert {k: kinds[k] for k in ("L1", "L2", "L3", "L5", "L6", "L7", "K7")} == dict.fromkeys(
        ("L1", "L2", "L3", "L5", "L6", "L7", "K7"), "fails"
    )
    assert {k: kinds[k] for k in ("E1", "E2", "K6", "L4")} == dict.fromkeys(("E1", "E2", "K6", "L4"), "holds only if")
    assert all(kinds[k] == "holds" for k in ("K1", "K2", "K3", "K5"))
    assert (kinds["K4"], kinds["E4"], kinds["E5"]) == ("fails", "unreadable in the scan", "misprint, correct is")
    for claim in document["claims"]:
        said = " ".join(claim["computed"])
        assert claim["id"] in ("K2",) or ("pinocchio" in said and "mujoco" in said and "analytic" in said), claim["id"]
    assert target.stat().st_size > 20_000 and document["figure"] == str(target)


def test_readings_of_the_figure_of_the_law() -> None:
    """Both powers from a run of Pinocchio; with drag on both blocks no moment but drag acts on them: c14 w1 = M1, c36 w3 = M3, by hand."""
    (figure,) = (f for f in ENTRY.figures if f.name == "equations (8) and (10)")
    at_once, later, ratio = (r.ours for r in figure.draw().readings)
    run_ = api.simulate(ENTRY, scene="constant-moments", duration=0.1, engine="pinocchio")
    powers = np.array([run_.channel("H1_rate") * 100.0, run_.channel("H2_rate") * 200.0])
    np.testing.assert_allclose(at_once, powers[:, 0], rtol=1e-9)
    np.testing.assert_allclose(later, powers[:, -1], rtol=1e-6)
    # speeds of the blocks from the drags, M1 = a M_H1 - b M_H2 and M3 = (1 - a) M_H1 - (1 - b) M_H2, per M_H1; drags 1 and 3 to each other
    a, b = Parameters().train.a, Parameters().train.b
    w1, w3 = (a - 2.0 * b) / DRAGS[0], (1.0 - a - 2.0 * (1.0 - b)) / DRAGS[1]
    assert ratio == pytest.approx((a * w1 + (1.0 - a) * w3) / (b * w1 + (1.0 - b) * w3), rel=1e-9)


def test_equal_moments_are_no_equilibrium_of_the_blocks() -> None:
    """K4 with the mass matrix of the specification: the blocks accelerate by J^-1 (30, -30) N m and the carriers with them."""
    blocks = np.linalg.solve([[0.04924, 0.03252], [0.03252, 0.77604]], [30.0, -30.0])
    a, b = 72 / 180, 18 / 180
    carriers = [x * blocks[0] + (1 - x) * blocks[1] for x in (a, b)]
    assert (carriers[0], blocks[0]) == pytest.approx((221.5, 652.9), abs=0.05)
    found = {c.id: c for c in ENTRY.claims}["K4"].test().computed
    for who in ("analytic", "pinocchio", "mujoco"):
        assert found[f"{who}: accelerations of H1, H2, blocks 14, 36 [rad/s2]"] == pytest.approx([*carriers, *blocks], abs=1e-3)


def test_doubtful_and_bad_parameters() -> None:
    assert api.load(ENTRY).warnings == ()
    assert any("equal angles" in w for w in api.load(ENTRY, teeth=(30, 30, 90, 40, 60, 160)).warnings)
    assert any("touch" in w for w in api.load(ENTRY, planets=4).warnings)
    with pytest.raises(MechlabError, match="z6 = z4"):
        api.load(ENTRY, teeth=(30, 30, 90, 40, 60, 161))
    same = {"teeth": (20, 20, 60, 30, 30, 90)}
    with pytest.raises(MechlabError, match="turn as one"):
        api.load(ENTRY, **same).mechanism("minimal")
    with pytest.raises(NoSolution):
        api.simulate(ENTRY, scene="constant-moments", fidelity="parts", **same)


def test_teeth_stand_in_gaps() -> None:
    """Phases of every planet against its sun and ring: half a pitch apart at the pitch points, also for odd numbers."""
    from mechlab.shapes import external_phase, internal_phase

    for p in (Parameters(), Parameters(teeth=(30, 30, 90, 40, 60, 160))):
        for stage in p.stages:
            sun, planet, ring = stage.teeth
            phase = stage.ring_phase
            for k in range(p.planets):
                own = external_phase(sun, 0.0, planet, stage.azimuth(k))
                wanted = internal_phase(planet, own, ring, stage.azimuth(k))
                turns = (phase - wanted) * ring / (2 * np.pi)
                assert abs(turns - round(turns)) < 1e-9


def test_page_shows_all_gears() -> None:
    found = api.simulate(ENTRY, scene="constant-moments", duration=0.05)
    full, q = ENTRY.expand(Parameters(), found)
    other = api.simulate(ENTRY, scene="constant-moments", duration=0.05, fidelity="full")
    assert q.shape == (len(found.t), full.nq)
    np.testing.assert_allclose(q[-1], other.q[-1], atol=1e-6)
