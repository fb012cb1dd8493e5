"""Engine one_freedom: J and its slope, motion against Pinocchio and the closed form, energy, limits, refusals."""

import json

import numpy as np
import pytest

from mechlab import api
from mechlab.analytic import fourbar as closed_form
from mechlab.catalog import fourbar
from mechlab.cli import main
from mechlab.engines.own.closed_path import ClosedPath, choose_path
from mechlab.engines.own.one_freedom import OneFreedom, run
from mechlab.engines.pinocchio.runner import run as run_pinocchio
from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.laws import ComputedTorque, Constant, Servo
from mechlab.experiment.motion import Ramp
from mechlab.experiment.scene import Scene, Settings
from mechlab.integrate.one_freedom import PathTable
from mechlab.mechanism import Builder, Inertia, Spring, prismatic, revolute

P = fourbar.Parameters()


def slider_crank(friction: float = 0.0, spring: bool = True):
    """Crank 0.1, rod 0.3, a slide with a damper and a spring to the ground, gravity across."""
    b = Builder("slider_crank")
    b.body("crank", revolute("crank", "-y"), inertia=Inertia.rod(0.5, (0, 0, 0), (0.1, 0, 0), 0.01))
    b.body(
        "rod",
        revolute("rod", "-y"),
        parent="crank",
        at=(0.1, 0, 0),
        inertia=Inertia.rod(0.8, (0, 0, 0), (0.3, 0, 0), 0.01),
    )
    b.body(
        "piston",
        prismatic("slide", "x", damping=2.0, friction=friction),
        at=(0.4, 0, 0),
        inertia=Inertia.box(1.2, 0.05, 0.05, 0.05),
    )
    b.loop("wrist", "rod", "piston", (0.3, 0, 0), (0, 0, 0))
    if spring:
        b.spring(Spring("spring", "ground", "piston", (0.6, 0.0, 0.1), stiffness=150.0, damping=1.0, rest_length=0.2))
    b.shaft("sum", {"crank": 1, "rod": 1}, inertia=0.002, damping=0.01)
    b.drive("crank")
    return b.assemble({"crank": 1.0}, hold=["crank"])


def test_generalised_inertia_is_that_of_the_closed_form():
    m = fourbar.build(P, "minimal")
    links = [closed_form.LinkMass(b.inertia.mass, b.inertia.com[0], b.inertia.matrix()[1, 1]) for b in m.bodies]
    bar = closed_form.MovingFourbar(*P.lengths, *links, mode=P.mode)
    model = OneFreedom(m)
    assert model.coordinate == "crank_angle"
    phi = np.linspace(-4.0, 9.0, 101)
    numbers = np.array([model.table(x)[-4:] for x in phi])
    exact = closed_form.generalised_inertia(bar, phi)
    # The stated error of the table, 1e-10 of the largest value of a column.
    assert model.table.error < 1e-10
    assert np.abs(numbers[:, 0] - exact.inertia).max() < 1e-9 * exact.inertia.max()
    assert np.abs(2 * numbers[:, 1] - exact.slope).max() < 1e-9 * np.abs(exact.slope).max()


def test_half_slope_is_half_of_the_slope_of_the_inertia():
    model = OneFreedom(slider_crank())
    for phi in (0.3, 2.0, 4.5):
        ahead, behind = (model.columns(phi + s)[-4] for s in (1e-5, -1e-5))
        assert model.columns(phi)[-3] == pytest.approx(0.5 * (ahead - behind) / 2e-5, abs=1e-9)


@pytest.mark.parametrize("scene", ["driven-crank", "free-run", "constant-torque"])
def test_fourbar_against_pinocchio(scene):
    made = fourbar.ENTRY.scenes[scene].make(P, "minimal")
    made = Scene(made.name, "minimal", 0.7, made.laws, made.initial, made.initial_rates)
    mine = run(fourbar.build(P, "minimal"), made, Settings(engine="one_freedom", integrator="DOP853"))
    theirs = run_pinocchio(fourbar.build(P, "minimal"), made, Settings(engine="pinocchio", integrator="DOP853"), [0.31])
    for name in ("crank_angle", "rocker_angle", "coupler_joint", "crank_angle_rate", "rocker_angle_rate"):
        scale = max(1.0, np.abs(mine.channel(name)).max())
        assert abs(mine.final()[name] - theirs.final()[name]) < 1e-6 * scale  # both DOP853 at 1e-9
    assert mine.health.trusted and mine.health.finding("energy_balance").value < 1e-6
    assert mine.health.finding("loop_gap").value < 1e-9


def test_springs_dampers_shafts_and_a_law_that_wants_the_plant():
    m = slider_crank()
    law = ComputedTorque(("crank",), (("crank", Ramp(1.0, 4.0)),), ((100.0, 20.0),))
    for laws in ((), (law,), (Servo("slide", Ramp(0.0, 0.0), 50.0, 1.0),)):
        scene = Scene("s", "full", 0.6, laws, {}, {"crank": 3.0})
        mine = run(m, scene, Settings(engine="one_freedom", integrator="DOP853"))
        theirs = run_pinocchio(m, scene, Settings(engine="pinocchio", integrator="DOP853"))
        for name in ("crank", "slide", "rod_rate", "crank_accel"):
            assert mine.final()[name] == pytest.approx(theirs.final()[name], abs=1e-6)
        assert mine.health.trusted


def test_energy_is_kept_to_1e_8():
    m = fourbar.build(fourbar.Parameters(gravity=0.0), "minimal")
    scene = Scene("free", "minimal", 5.0, (), {}, {"crank_angle": 2 * np.pi})
    found = run(m, scene, Settings(engine="one_freedom", timestep=1e-3))
    assert found.health.finding("energy_balance").value < 1e-8  # specification: 1.1e-8 with RK4 on a spline


def test_dry_friction_against_pinocchio():
    m = slider_crank(friction=3.0, spring=False)
    scene = Scene("s", "full", 0.3, (), {}, {"crank": 8.0})
    mine = run(m, scene, Settings(engine="one_freedom", timestep=2e-4))
    theirs = run_pinocchio(m, scene, Settings(engine="pinocchio", timestep=2e-4))
    assert mine.final()["crank"] == pytest.approx(theirs.final()["crank"], abs=1e-3)  # both smooth it, differently


def test_a_run_into_a_limit_position_ends_there():
    b = fourbar.Parameters(crank=0.3, coupler=0.2, rocker=0.25, ground=0.4)
    m = fourbar.build(b, "minimal")
    path = ClosedPath(m, "crank_angle")
    low, high = path.limits()
    ranges = closed_form.crank_limits(*b.lengths).ranges
    assert any(abs(low - x) < 1e-6 and abs(high - y) < 1e-6 for x, y in ranges)
    with pytest.raises(NoSolution, match="cannot be moved beyond"):
        path.at(high + 0.1)


def test_mechanisms_with_more_freedoms_are_refused(capsys):
    with pytest.raises(MechlabError, match="degrees of freedom"):
        choose_path(api.load("prosthetic_leg").mechanism())
    assert main(["simulate", "prosthetic_leg", "--engine", "one_freedom", "--json"]) == 1
    assert "exactly 1" in json.loads(capsys.readouterr().out)["error"]["message"]


def test_the_command_line_runs_it(capsys):
    assert main(["simulate", "fourbar", "--engine", "one_freedom", "--duration", "0.2", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["engine"] == "one_freedom" and document["final"]["rocker_angle"]


def test_path_table_meets_its_error_and_repeats():
    table = PathTable(
        lambda x: np.array([np.exp(np.sin(x)), x]), 1.0, 1e-11, period=2 * np.pi, turn=np.array([0.0, 2 * np.pi])
    )
    x = np.linspace(-20.0, 30.0, 500)
    got = np.array([table(y) for y in x])
    assert np.abs(got[:, 0] - np.exp(np.sin(x))).max() < 1e-10 and np.abs(got[:, 1] - x).max() < 1e-12
    assert table.error <= 1e-11

    def ends(y: float) -> np.ndarray:
        if y > 1.0:
            raise NoSolution("over")
        return np.array([np.sqrt(1.0 - y)])

    short = PathTable(ends, 0.7)
    assert short(0.9)[0] == pytest.approx(np.sqrt(0.1), abs=1e-9)
    with pytest.raises(NoSolution, match="ends at"):
        short(1.1)


def test_max_error_chooses_it_and_meets_the_error() -> None:
    import mechlab as ml
    from mechlab import api

    run = ml.simulate("fourbar", scene="free-run", max_error=1e-6, duration=1.0)
    assert run.settings.engine == "one_freedom" and run.health.trusted
    exact = ml.simulate("fourbar", scene="free-run", engine="analytic", duration=1.0)  # DOP853 to 1e-12, own equation
    # The change between two steps is 15 times the error of the finer one for a method of fourth order.
    assert abs(run.channel("crank_angle")[-1] - exact.channel("crank_angle")[-1]) < 1e-6
    other = api.simulate("fourbar", scene="free-run", max_error=1e-3, duration=0.3, engine="mujoco")
    assert other.recording.settings.engine == "mujoco"


def test_an_overflow_of_a_coarse_run_is_no_answer_and_no_fault():
    """The run at four times the step, which the step error is estimated from, is unstable here; the run itself is within its error."""
    made = api.simulate("fourbar", scene="driven-crank", engine="one_freedom", duration=0.3)
    truth = api.simulate("fourbar", scene="driven-crank", engine="analytic", duration=0.3)
    apart = abs(made.channel("rocker_angle")[-1] - truth.channel("rocker_angle")[-1])
    assert made.health.trusted
    assert apart <= made.errors["rocker_angle"] <= 1e-4


def test_a_motion_too_fast_to_follow_ends_the_run_and_a_force_that_is_no_number_is_refused():
    """1e6 N m on the crank: before, the path was closed pose by pose over millions of turns."""
    m = slider_crank()
    made = run(m, Scene("hard", "full", 0.1, (Constant("crank", 1e6),)), Settings(engine="one_freedom"))
    found = made.health.finding("blow_up")
    assert made.health.exit_code == 3 and "beyond 1e+06" in found.sentence and np.all(np.isfinite(made.v))
    with pytest.raises(MechlabError, match="the force nan at t = 0"):
        run(m, Scene("nan", "full", 0.1, (Constant("crank", np.nan),)), Settings(engine="one_freedom"))
