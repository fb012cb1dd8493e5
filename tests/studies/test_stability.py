"""Stability maps: boundaries of theory met by measurement, what each kind of map shows, and what is refused."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mechlab as ml
from mechlab.cli import main
from mechlab.errors import MechlabError
from mechlab.experiment.laws import Constant
from mechlab.experiment.scene import Scene
from mechlab.lab.design import design
from mechlab.lab.methods import Problem, method
from mechlab.lab.own_mechanism import entry_of
from mechlab.mechanism import Builder, Inertia, Mechanism, prismatic, revolute
from mechlab.mechanism.parts import LinearRelation
from mechlab.studies.stability.data import MethodPanel, RunOutcome, StabilityAxis
from mechlab.studies.stability.loops import change_point
from mechlab.studies.stability.measure import panels
from mechlab.studies.stability.plan import OUTPUTS, StabilityCase, StabilityPlan, with_softness
from mechlab.studies.stability.springs import largest_step, linearise, plan_stiffness
from mechlab.studies.stability.study import spaced, study
from mechlab.studies.stability.vary import faster_joint, link_length, scale_mass, scale_springs, shift_loops
from mechlab.values import Range

MASS, STIFFNESS = 2.0, 800.0
OMEGA = math.sqrt(STIFFNESS / MASS)
DECAY = 50.0


def oscillator(stiffness: float = STIFFNESS, damping: float = 0.0) -> Mechanism:
    """A mass on a slide, with a spring or a damper."""
    b = Builder("oscillator", gravity=(0.0, 0.0, 0.0))
    slide = prismatic("x", "x", stiffness=stiffness, damping=damping)
    b.body("block", slide, inertia=Inertia.box(MASS, 0.1, 0.1, 0.1))
    return b.build()


def wheels(torque: float = 1.0) -> tuple[Mechanism, Scene]:
    """Two wheels, the second twice as fast the other way, turned by a torque on the first."""
    b = Builder("wheels", gravity=(0.0, 0.0, 0.0))
    b.body("large", revolute("a", "z"), inertia=Inertia.cylinder(4.0, 0.2, 0.05))
    b.body("small", revolute("b", "z"), at=(0.3, 0.0, 0.0), inertia=Inertia.cylinder(1.0, 0.1, 0.05))
    from fractions import Fraction

    b.meshes.append(LinearRelation("mesh", (("b", Fraction(1)), ("a", Fraction(2))), "external"))
    return b.build(), Scene("turn", "full", 0.4, (Constant("a", torque),))


def problem_of(m: Mechanism, scene: Scene) -> Problem:
    return Problem(design(entry_of(m), {}), scene, OUTPUTS)


def around(m: Mechanism, rate: float, name: str, limit: float) -> tuple[RunOutcome, RunOutcome]:
    """Outcomes of a method at 3.4 % below and above a timestep."""
    duration = OUTPUTS * limit * math.sqrt(14 * 15)
    scene = Scene("free", "full", duration, initial_rates={"x": rate}, initial={"x": 0.1})
    steps = (duration / OUTPUTS / 15, duration / OUTPUTS / 14)
    plan = StabilityPlan(
        "one", "one", StabilityAxis("y", "", (1.0,)), lambda y: problem_of(m, scene), (method(name),), steps, "gap"
    )
    shown, _ = panels(plan, 5.0, lambda line: None)
    below, above = shown[0].cells[0]
    return below.outcome, above.outcome


UNDAMPED = [
    ("MuJoCo Euler, defaults", 2.0),
    ("MuJoCo implicitfast, defaults", 2.0),
    ("Pinocchio semi-implicit Euler", 2.0),
    ("MuJoCo RK4, defaults", 2.0 * math.sqrt(2.0)),
    ("Pinocchio RK4, soft stabilisation", 2.0 * math.sqrt(2.0)),
]


@pytest.mark.parametrize(("name", "limit"), UNDAMPED)
def test_an_undamped_spring_limits_the_timestep_as_in_theory(name: str, limit: float) -> None:
    m = oscillator()
    scene = Scene("free", "full", 1.0)
    # GROWTH lets the spectral radius exceed 1 by a thousandth, which moves the boundary by less than that
    assert largest_step(linearise(m, scene), method(name)) == pytest.approx(limit / OMEGA, rel=1e-3)
    below, above = around(m, 0.0, name, limit / OMEGA)
    assert below is not RunOutcome.BLOWN_UP
    assert above is RunOutcome.BLOWN_UP


def test_a_decay_rate_limits_rk4_to_2_785_tau() -> None:
    m = oscillator(0.0, DECAY * MASS)
    linear = linearise(m, Scene("free", "full", 1.0))
    # the root of 1 + z/2 + z^2/6 + z^3/24 = 0, from the stability polynomial
    root = -float(np.real([r for r in np.roots([1 / 24, 1 / 6, 1 / 2, 1.0]) if abs(r.imag) < 1e-9][0]))
    for name in ("MuJoCo RK4, defaults", "Pinocchio RK4, soft stabilisation"):
        assert largest_step(linear, method(name)) == pytest.approx(root / DECAY, rel=1e-3)
        below, above = around(m, 5.0, name, root / DECAY)
        assert (below is not RunOutcome.BLOWN_UP, above) == (True, RunOutcome.BLOWN_UP)
    assert largest_step(linear, method("Pinocchio semi-implicit Euler")) == pytest.approx(2.0 / DECAY, rel=1e-3)
    assert math.isinf(largest_step(linear, method("MuJoCo implicitfast, defaults")))  # damping is implicit there


def test_discrete_has_no_limit_on_a_spring() -> None:
    m = oscillator()
    assert math.isinf(largest_step(linearise(m, Scene("free", "full", 1.0)), method("MuJoCo discrete, defaults")))
    below, above = around(m, 0.0, "MuJoCo discrete, defaults", 20.0 / OMEGA)
    assert RunOutcome.BLOWN_UP not in (below, above)


def slip(h: float, time_constant: float, torque: float = 1.0) -> float:
    """Largest residual of the relation of the wheels under RK4 [rad]."""
    m, scene = wheels(torque)
    way = with_softness(method("MuJoCo RK4, hard"), time_constant=time_constant)
    run = way.run(problem_of(m, scene), h)
    return float(np.max(np.abs(run.q @ np.array([2.0, 1.0]))))


def test_residual_law_and_refsafe() -> None:
    h, impedance = 1e-3, 0.9999
    large, small = 0.5 * 4.0 * 0.2**2, 0.5 * 1.0 * 0.1**2
    compliance = 4.0 / large + 1.0 / small
    force = (2.0 / large) / compliance  # of the row with the torque 1 on the large wheel

    def law(tc: float) -> float:
        return (1.0 - impedance) * tc**2 * compliance * force

    for multiple in (2.0, 4.0, 8.0):
        assert slip(h, multiple * h) == pytest.approx(law(multiple * h), rel=0.05)
    # refsafe: a time constant below 2 h is taken as 2 h
    assert slip(h, 0.5 * h) == pytest.approx(slip(h, 2.0 * h), rel=1e-9)
    assert slip(0.5 * h, 0.1 * h) == pytest.approx(law(h), rel=0.05)


def test_light_parts_follow_the_predicted_lag() -> None:
    m, scene = wheels(30.0)
    d = design(entry_of(m), {})
    entry = replace(d.entry, scenes={"free-motion": replace(d.entry.scenes["free-motion"], make=lambda p, f: scene)})
    found = study(replace(d, entry=entry), kinds=["light-parts"], methods=["MuJoCo RK4, hard"], budget=6.0).map(
        "light-parts"
    )
    line = next(t for t in found.theory if "MuJoCo RK4, hard" in t.methods)
    panel = found.panels[0]
    compared = 0
    for k, limit in enumerate(line.x):
        good, bad = panel.limit(k, found.x.values, frozenset(set(RunOutcome) - {RunOutcome.RIGHT, RunOutcome.NOT_RUN}))
        if 0.0 < good and math.isfinite(bad):
            compared += 1
            assert good / 1.05 <= limit <= bad * 1.05
    assert compared >= 2
    assert all(a < b for a, b in zip(line.x, line.x[1:], strict=False)) is (line.y[0] < line.y[-1])


def test_mass_ratio_of_bricard_hurts_mujoco_and_not_pinocchio() -> None:
    """benchmarks.md 4.10: MuJoCo RK4 hard 1.2e-7, 3.4e-6, 3.9e-4 at 1, 1e2, 1e4; Pinocchio RK4 stays at 1e-8."""
    names = ["MuJoCo RK4, hard", "Pinocchio RK4, soft stabilisation"]
    found = study(ml.load("bricard"), kinds=["mass-ratio"], methods=names, budget=12.0).map("mass-ratio")
    column = found.x.values.index(min(found.x.values, key=lambda h: abs(h - 0.025)))
    rows = [found.y.values.index(y) for y in (1.0, 1e2, 1e4)]
    mujoco = [found.panel(names[0]).cells[k][column].value for k in rows]
    pinocchio = [found.panel(names[1]).cells[k][column].value for k in rows]
    assert mujoco[1] > 5.0 * mujoco[0]
    assert mujoco[2] > 20.0 * mujoco[1]
    assert max(pinocchio) < 1e-5
    assert mujoco[2] > 1e3 * pinocchio[2]


def test_gear_ratio_alone_is_no_difficulty() -> None:
    """engines.md section 4: the same accuracy for ratios 1 to 1e4."""
    m, scene = wheels()
    for ratio in (0.01, 1.0, 100.0):
        geared = faster_joint(m, "b", ratio)
        end = method("MuJoCo RK4, hard").run(problem_of(geared, scene), 1e-3)
        inertia = 0.08 + 0.005 * (2.0 * ratio) ** 2
        assert end.v[-1] @ [1.0, 0.0] == pytest.approx(scene.duration / inertia, rel=1e-4)  # softness: 1 - d
        assert end.v[-1][1] == pytest.approx(-2.0 * ratio * end.v[-1][0], rel=1e-3)


def test_change_point_of_the_fourbar_is_grashofs() -> None:
    m = ml.load("fourbar").mechanism()
    found = change_point(m, ("crank_angle",), link_length(m))
    assert found is not None
    # crank .1, ground .3, rocker .25, coupler .3: s + l = p + q at a coupler of .45 or .15
    assert abs(found.shift) == pytest.approx(0.15, abs=2e-5)
    assert found.turns


def test_nearer_to_the_change_point_smaller_steps_are_needed() -> None:
    name = "MuJoCo RK4, hard"
    found = study(ml.load("fourbar"), "free-run", kinds=["singularity"], methods=[name], budget=12.0).map("singularity")
    panel = found.panel(name)
    column = len(found.x.values) // 2
    values = [row[column].value if row[column].outcome is not RunOutcome.BLOWN_UP else math.inf for row in panel.cells]
    run = [v for v in values if not math.isnan(v)]
    assert len(run) >= 3
    assert run[0] > 3.0 * run[-1]  # rows ascend with the distance


def test_flyball_map_meets_theory_in_every_row() -> None:
    d = ml.load("flyball").for_scene(None)
    case = StabilityCase(d, d.scene(), ("MuJoCo RK4, defaults",))
    plan = plan_stiffness(case)
    assert isinstance(plan, StabilityPlan)
    shown, _ = panels(plan, 8.0, lambda line: None)
    compared = 0
    for k, limit in enumerate(plan.theory(plan.methods)[0].x):
        good, bad = shown[0].limit(k, plan.steps, frozenset({RunOutcome.BLOWN_UP}))
        if good and math.isfinite(bad):
            compared += 1
            assert good * 0.95 < limit < bad * 1.05
    assert compared >= 4


def test_what_has_no_springs_gets_no_stiffness_map_and_is_told_why(capsys: pytest.CaptureFixture[str]) -> None:
    found = study(ml.load("pendulum"))
    assert not found.maps
    assert found.exit_code == 4
    assert "no springs" in found.without["stiffness"]
    assert "no loops" in found.without["mass-ratio"]
    with pytest.raises(MechlabError, match="no map 'stiffness': it has no springs"):
        study(ml.load("pendulum"), kinds=["stiffness"])
    assert main(["stability", "pendulum", "--json"]) == 4
    assert json.loads(capsys.readouterr().out)["without"]["sticking"] == "it has no dry friction"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--map", "stifness"], "Did you mean 'stiffness'"),
        (["--methods", "leapfrog"], "leapfrog"),
        (["--scene", "swim"], "swim"),
        (["spring_stiffness=1:1:3"], "the range is empty"),
        (["nose_mass=1:10"], "slider_mass"),
        (["spring_stiffness=1:10:1000"], "expected 2 to 40 values"),
        (["--budget", "0"], "budget"),
    ],
)
def test_bad_input(arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stability", "flyball", *arguments]) == 1
    assert words in capsys.readouterr().err


def test_a_range_makes_a_map_of_its_own_and_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = [
        "stability",
        "fourbar",
        "coupler_mass=1e-3:1e3:3",
        "--budget",
        "4",
        "--scene",
        "free-run",
        "--methods",
        "RK4, hard",
        "--json",
    ]
    assert main([*command, "-o", str(tmp_path / "out")]) == 0
    document = json.loads(capsys.readouterr().out)
    (made,) = document["maps"]
    assert made["y"]["values"] == pytest.approx([1e-3, 1.0, 1e3])
    assert (made["y"]["unit"], made["x"]["unit"]) == ("kg", "s")
    assert len(made["methods"][0]["status"]) == 3
    assert len(made["methods"][0]["status"][0]) == len(made["x"]["values"])
    assert made["methods"][0]["status"][1][0] in ("stable and right", "not run")
    assert made["sentence"].startswith("MuJoCo RK4, hard is right in")
    picture = tmp_path / "out" / "stability_fourbar_coupler_mass.png"
    assert picture.read_bytes()[:4] == b"\x89PNG"
    kept = json.loads((tmp_path / "out" / "stability_fourbar.json").read_text())
    assert kept["maps"][0]["methods"] == made["methods"]
    with pytest.raises(MechlabError, match="-o takes a folder"):
        study(ml.load("pendulum")).save(tmp_path / "out.png")


def test_spacing_of_ranges() -> None:
    assert spaced("m", Range(1e-3, 1e3, 7)) == pytest.approx([10.0**k for k in range(-3, 4)])
    assert spaced("m", Range(0.0, 1.0, 3)) == (0.0, 0.5, 1.0)


def test_varied_mechanisms() -> None:
    m = ml.load("fourbar").mechanism()
    heavy = scale_mass(m, "coupler", 3.0)
    assert heavy.body("coupler").inertia.mass == pytest.approx(3.0 * m.body("coupler").inertia.mass)
    assert heavy.body("rocker") == m.body("rocker")
    stiff = scale_springs(oscillator(100.0, 4.0), 25.0)
    assert (stiff.joint("x").stiffness, stiff.joint("x").damping) == (2500.0, 20.0)
    longer = shift_loops(m, 0.01).loops[0].placement_a.translation
    assert np.linalg.norm(longer) == pytest.approx(np.linalg.norm(m.loops[0].placement_a.translation) + 0.01)
    with pytest.raises(MechlabError, match="does not exist"):
        scale_mass(m, "nose", 2.0)
    with pytest.raises(MechlabError, match="does not close"):
        shift_loops(m, 5.0)


def test_a_limit_is_read_from_the_cells() -> None:
    from mechlab.studies.stability.data import StabilityCell

    cells = tuple(
        StabilityCell(o)
        for o in (RunOutcome.NOT_RUN, RunOutcome.RIGHT, RunOutcome.DRIFTING, RunOutcome.BLOWN_UP, RunOutcome.RIGHT)
    )
    panel = MethodPanel("m", (cells,))
    assert panel.limit(0, (1.0, 2.0, 3.0, 4.0, 5.0), frozenset({RunOutcome.BLOWN_UP})) == (3.0, 4.0)
    assert panel.limit(0, (1.0, 2.0, 3.0, 4.0, 5.0), frozenset({RunOutcome.REFUSED})) == (5.0, math.inf)


def test_ends_of_ranges_have_no_part_in_a_map() -> None:
    """MuJoCo has soft stops there, the reference none: with them every run of the platform in free fall looked wrong."""
    d = ml.load("delta6").for_scene(None)
    assert any(j.range for j in d.mechanism().joints)
    problem = StabilityCase(d, d.scene()).free.problem(duration=0.3)
    assert not any(j.range for j in problem.mechanism.joints)
    fall = method("MuJoCo RK4, hard").run(problem, 1e-3)
    truth = method("Pinocchio DOP853").run(problem, 1e-8)
    assert np.max(np.abs(fall.q - truth.q)) < 1e-4  # RK4 with soft loops at 1 ms: 1e-7 to 1e-5 on the delta
