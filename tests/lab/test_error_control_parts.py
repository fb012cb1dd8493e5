"""What error control is made of: trees and rows of many poses, clocks, checks, ladders, LSODA, each against its theory."""

import itertools
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

from mechlab import api
from mechlab.errors import MechlabError
from mechlab.experiment.laws import law
from mechlab.experiment.recording import frame_positions
from mechlab.experiment.scene import Scene, Settings, initial_state
from mechlab.integrate.path_time import PathTime, SwingTime, chebyshev_nodes
from mechlab.lab.accuracy.branch import PoseBranch, _interpolated
from mechlab.lab.accuracy.convergence import error_of_steps, seen_order
from mechlab.lab.accuracy.energies import OneJointEnergies, TreeEnergies
from mechlab.lab.accuracy.energy_motion import EnergyMotion
from mechlab.lab.accuracy.even_run import EvenRun
from mechlab.lab.accuracy.measure import ErrorMeasure
from mechlab.lab.accuracy.refinement import RefinedMethod
from mechlab.lab.accuracy.rules import METHOD_RULES
from mechlab.lab.accuracy.solve import solve_to
from mechlab.lab.fastest_rate import fastest_rate
from mechlab.lab.methods import Problem, method
from mechlab.mechanism import Builder, ConstraintSet, Inertia, Spring, TreeKinematics, prismatic, revolute
from mechlab.mechanism.batch_tree import BatchRows, BatchTree
from mechlab.studies.chart.score import reference_of, tracked


def test_the_check_goes_on_from_where_it_stands() -> None:
    """A run in parts, another one of the same model between them, gives the same bits."""
    lived = api.load("andrews", duration=0.02).for_scene(None)
    problem = Problem(lived, lived.scene(), 20)
    way = method("MuJoCo RK4, hard")
    whole = way.stepper(problem, 5e-4).advance(6)
    one, other = way.stepper(problem, 5e-4), way.stepper(problem, 5e-4)
    parts = [one.advance(2)]
    assert np.array_equal(other.advance(3).q, whole.q[:4])
    parts.append(one.advance(4))
    assert np.array_equal(parts[1].q[0], parts[0].q[-1])
    assert np.array_equal(np.concatenate([parts[0].q, parts[1].q[1:]]), whole.q)
    again = method("Pinocchio RK4, soft stabilisation").stepper(problem, 5e-4)
    twice = [again.advance(2).q, again.advance(2).q]
    assert np.array_equal(twice[0][-1], twice[1][0]) and len(twice[1]) == 3


def test_dearer_equations_under_the_same_integrator_are_not_tried() -> None:
    """LSODA takes as many evaluations on Pinocchio's tree, and each is dearer: with MuJoCo's run known, it is left out."""
    lived = api.load("flyball", duration=0.4).for_scene(None)
    problem = Problem(lived, lived.scene(), 40)
    rules = {r.name: r for r in METHOD_RULES}
    measure = ErrorMeasure(problem, None)
    near, dear = (
        RefinedMethod(rules[f"LSODA on {x}'s tree"], problem, measure, 0.0, 1e-6) for x in ("MuJoCo", "Pinocchio")
    )
    # two runs make an estimate, the sharper one costs 1.6 times the first
    assert dear.cost_given([near, dear]) == pytest.approx(2.6 * dear.next_cost)
    near.refine(5.0)
    near.first_work = near.work = 1.0
    assert near.cost_given([near, dear]) == near.next_cost == pytest.approx(1.6)
    assert dear.cost_given([near, dear]) == pytest.approx(2.6 * dear.expected_work / near.expected_work)


@pytest.mark.parametrize(("stiffness", "damping"), [(400.0, 0.0), (400.0, 4.0), (100.0, 60.0)])
def test_the_fastest_rate_is_that_of_the_oscillator(stiffness: float, damping: float) -> None:
    """m s^2 + c s + k = 0 with m = 2 kg: the joint's own spring, and the same between two points."""
    slow = np.roots([2.0, damping, stiffness])
    for own in (True, False):
        b = Builder("oscillator", gravity=(0.0, 0.0, 0.0))
        kept = {"stiffness": stiffness, "damping": damping} if own else {}
        b.body("mass", prismatic("slide", "x", **kept), inertia=Inertia.box(2.0, 0.1, 0.1, 0.1))
        if not own:
            ends = ((-1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
            b.spring(Spring("s", "ground", "mass", *ends, stiffness=stiffness, damping=damping, rest_length=1.0))
        found = fastest_rate(b.build(), Scene("s", "full", 1.0))
        assert found == pytest.approx(max(abs(slow)), rel=1e-12)


def test_the_beat_is_the_integral_and_its_inverse() -> None:
    """Kepler's equation: t = x - e sin x has dt/dx = 1 - e cos x."""
    x = np.pi * np.arange(13.0) / 12
    beat = SwingTime.of(1.0 - 0.6 * np.cos(x))
    t = np.linspace(-5.0, 40.0, 50)
    found, _ = beat.invert(t, 1e-7)
    assert found - 0.6 * np.sin(found) == pytest.approx(t, abs=1e-13)
    assert beat.time(2.5) == pytest.approx(2.5 - 0.6 * np.sin(2.5), abs=1e-14)


def test_states_of_the_energy_are_rates_and_accelerations() -> None:
    lived = api.load("slider_crank").for_scene(None)
    result = solve_to(lived, None, 1e-8, outputs=4000)
    h = result.t[1]
    rate = (result.q[2:] - result.q[:-2]) / (2 * h)
    accel = (result.v[2:] - result.v[:-2]) / (2 * h)
    assert result.accelerations is not None
    # central differences: h^2 / 6 times the third derivative, for harmonics of rates w of the size of a few w^3 and w^4
    w = np.max(np.abs(result.v))
    assert np.max(np.abs(rate - result.v[1:-1])) < 2.0 * w**3 * h**2
    assert np.max(np.abs(accel - result.accelerations[1:-1])) < 4.0 * w**4 * h**2


@pytest.mark.parametrize("name", ["n_fourbar", "andrews", "bricard", "slider_crank", "quick_return", "platform_3rrr"])
def test_many_poses_at_once_are_those_of_the_tree(name: str) -> None:
    m = api.load(name).mechanism()
    rng = np.random.default_rng(3)
    q, u = rng.normal(size=(4, m.nv)), rng.normal(size=(4, m.nv))
    tree, rows = BatchTree(m), None
    rows = BatchRows(tree)
    residual, jacobian = rows.evaluate(q)
    assert np.abs(tree.frame_positions(q) - frame_positions(m, q)).max(initial=0.0) < 1e-13
    inertia, _, slope = TreeEnergies(tree, Scene("s", "full", 1.0))(q, u)
    single, constraints = TreeKinematics(m), ConstraintSet(m)
    for k in range(4):
        single.set(q[k])
        assert np.sort(residual[k]) == pytest.approx(np.sort(constraints.residual(single)), abs=1e-13)
        theirs = np.linalg.norm(constraints.jacobian(single), axis=1)
        assert np.sort(np.linalg.norm(jacobian[k], axis=1)) == pytest.approx(np.sort(theirs), abs=1e-12)
        assert inertia[k] == pytest.approx(u[k] @ single.mass_matrix() @ u[k], rel=1e-12)
        from mechlab.mechanism.statics import passive_force

        assert slope[k] == pytest.approx(
            float((single.bias_force() - passive_force(single)) @ u[k]), rel=1e-9, abs=1e-9
        )


def test_the_clock_is_the_integral_and_its_inverse() -> None:
    n, cells = 24, 3
    x = 0.2 + 2.5 / cells * (np.arange(cells)[:, None] + 0.5 * (chebyshev_nodes(n) + 1.0))
    clock = PathTime.of(0.2, 2.7, 1.0 / x)
    assert clock.total == pytest.approx(np.log(2.7 / 0.2), abs=1e-12)
    t = np.linspace(0.0, clock.total, 40)
    cell, xi, _ = clock.invert(t)
    found = 0.2 + 2.5 / cells * (cell + 0.5 * (xi + 1.0))
    assert found == pytest.approx(0.2 * np.exp(t), abs=1e-11)


@pytest.mark.parametrize("name", ["LSODA on MuJoCo's tree", "LSODA on Pinocchio's tree"])
def test_lsoda_on_either_engine_follows_the_reference(name: str) -> None:
    lived = api.load("flyball", duration=0.3).for_scene(None)
    problem = Problem(lived, lived.scene())
    truth = reference_of(problem)
    trace = method(name).run(problem, 1e-9)
    # the global error of the whole scene is some tens of tolerances (measured: 15 to 30)
    assert np.max(np.abs(tracked(problem, truth.names, trace.q, trace.v) - truth.values)) < 1e-7
    loops = api.load("slider_crank").for_scene(None)
    assert "loops" in method(name).available(Problem(loops, loops.scene()))


def test_the_jacobian_given_to_lsoda_is_that_of_its_equations() -> None:
    """Central differences of the accelerations, with a damped joint, a constant load and a spring between two points."""
    import mujoco

    drive, trace = (import_module(f"mechlab.engines.mujoco.{name}") for name in ("drive", "trace"))
    b = Builder("two", gravity=(0.0, 0.0, -9.81))
    b.body("arm", revolute("a", "y", damping=0.3), inertia=Inertia.rod(1.0, (0, 0, 0), (0.5, 0.0, 0.0), 0.02))
    b.body(
        "bob",
        prismatic("s", "x", stiffness=40.0),
        parent="arm",
        at=(0.5, 0, 0),
        inertia=Inertia.box(2.0, 0.1, 0.1, 0.1),
    )
    b.spring(
        Spring("k", "ground", "bob", (1.0, 0.3, 0.2), (0.0, 0.1, 0.0), stiffness=800.0, damping=30.0, rest_length=0.4)
    )
    m, scene = b.build(), Scene("s", "full", 1.0, (law("constant", on="a", value=2.0),))
    model, data, map_ = drive.run_model(m, Settings(integrator="LSODA", tolerance=1e-6), ())
    drive.put_start(data, map_, *initial_state(m, scene))
    trace._driven(m, scene, model, data, map_)

    def slope(y: np.ndarray) -> np.ndarray:
        data.qpos[:], data.qvel[:] = y[:2], y[2:]
        mujoco.mj_forward(model, data)
        return np.concatenate([y[2:], data.qacc])

    y, step = np.array([0.3, -0.1, 1.2, 0.7]), 1e-6
    told = np.column_stack([(slope(y + step * e) - slope(y - step * e)) / (2 * step) for e in np.eye(4)])
    found = trace._Linearised(model, data)(0.0, y)
    # one-sided differences by 1e-7 of accelerations that bend by some hundreds
    assert found == pytest.approx(told, rel=1e-5, abs=1e-3)


def test_the_runner_does_not_take_lsoda_for_something_else() -> None:
    with pytest.raises(MechlabError, match="LSODA"):
        api.simulate("flyball", duration=0.1, settings=Settings(integrator="LSODA"))


def test_a_constant_load_pushes_as_it_should() -> None:
    """x = F t^2 / (2 m), which RK4 integrates exactly."""
    from mechlab.engines.mujoco.trace import adaptive, trace

    b = Builder("sledge", gravity=(0.0, 0.0, 0.0))
    b.body("mass", prismatic("slide", "x"), inertia=Inertia.box(2.0, 0.1, 0.1, 0.1))
    m = b.build()
    scene = Scene("s", "full", 1.0, (law("constant", on="slide", value=3.0),))
    t = np.linspace(0.0, 1.0, 11)
    assert trace(m, scene, Settings(timestep=0.05), 10).q[:, 0] == pytest.approx(0.75 * t**2, abs=1e-12)
    exact = adaptive(m, scene, Settings(integrator="LSODA", tolerance=1e-10), 10)
    assert exact.q[:, 0] == pytest.approx(0.75 * t**2, abs=1e-8)


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_the_closed_form_of_one_joint_is_that_of_the_tree(kind: str) -> None:
    b = Builder("one", gravity=(1.0, -2.0, 9.0))
    joint = revolute if kind == "revolute" else prismatic
    first = joint("j", (0.6, 0.0, 0.8), stiffness=7.0, spring_rest=0.2, armature=0.3)
    b.body("arm", first, at=(0.1, 0.2, 0.3), inertia=Inertia.rod(2.0, (0, 0, 0), (0.5, 0.4, 0.1), 0.02))
    b.spring(Spring("s", "ground", "arm", (1.0, 0.3, 0.2), (0.3, 0.1, 0.0), stiffness=150.0, rest_length=0.2))
    scene = Scene("s", "full", 1.0, (law("constant", on="j", value=3.0),))
    tree = BatchTree(b.build())
    q = np.random.default_rng(1).normal(size=(6, 1))
    ones = np.ones((6, 1))
    for mine, theirs in zip(OneJointEnergies(tree, scene)(q, ones), TreeEnergies(tree, scene)(q, ones), strict=True):
        assert mine == pytest.approx(theirs, rel=1e-12, abs=1e-12)
    single = np.array([OneJointEnergies(tree, scene).at(float(x)) for x in q[:, 0]]).T
    assert single == pytest.approx(np.array(TreeEnergies(tree, scene)(q, ones)), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(("name", "changes"), [("pendulum", {}), ("slider_crank", {}), ("andrews", {"duration": 0.02})])
def test_what_fewer_nodes_would_change_is_what_they_change(name: str, changes: dict) -> None:
    """Against the motion made of the fewer nodes alone: the same to first order in the change."""
    lived = api.load(name, **changes).for_scene(None)
    m, scene = lived.mechanism(), lived.scene()
    tree = BatchTree(m)
    t = np.linspace(0.0, scene.duration, 31)
    coarse, fine = (EnergyMotion(m, scene, *initial_state(m, scene), tree, BatchRows(tree)) for _ in range(2))
    coarse.refine(8)
    fine.refine(16)
    states = fine.states(t)
    told, done = fine.moved(states, t, every=2), coarse.states(t).q - states.q
    assert np.max(np.abs(told - done)) < 0.02 * np.max(np.abs(done)) + 1e-12


def test_poses_between_are_those_of_the_polynomial() -> None:
    """Four poses with tangents determine a polynomial of degree 7, at uneven places, between and beyond them; two a cubic."""
    rng = np.random.default_rng(3)
    x = np.array([0.0, 0.3, 0.7, 0.9, 1.3])
    phi = np.array([-0.1, 0.1, 0.3, 0.5, 1.0, 1.4])
    for count, degree in ((5, 7), (2, 3)):
        curves = [np.polynomial.Polynomial(rng.standard_normal(degree + 1)) for _ in range(3)]
        q, u = (np.array([c(x[:count]) for c in cs]).T for cs in (curves, [c.deriv() for c in curves]))
        # rounding times the sizes of the basis, some hundred beyond the ends
        assert _interpolated(x[:count], q, u, phi) == pytest.approx(np.array([c(phi) for c in curves]).T, abs=1e-11)


def test_sharpened_poses_have_tangents_as_exact_as_poses() -> None:
    """du = dq/dphi against the difference of poses closed to 1e-12; before, tangents are off by the last correction (1e-3)."""
    made = api.load("andrews").for_scene(None)
    m = made.mechanism()
    tree = BatchTree(m)
    branch = PoseBranch(m, m.reference(), 0, tree, BatchRows(tree))
    for _ in range(6):
        branch.extend(1)
    phi, step = np.array(branch.phi[1:]), 1e-4
    ahead, behind = (branch.close(phi + s, np.array(branch.q[1:]) + s * np.array(branch.u[1:]))[0] for s in (step, -step))
    slopes = (ahead - behind) / (2.0 * step)  # off by step^2 / 6 times a third derivative of about 10
    before = np.max(np.abs(np.array(branch.u[1:]) - slopes))
    branch.sharpen()
    after = np.max(np.abs(np.array(branch.u[1:]) - slopes))
    assert after < 1e-6 < 1e-5 < before


@pytest.mark.parametrize("steps", [(1.0, 0.5, 0.25), (1.0, 0.5, 0.4), (1.0, 0.8, 0.5), (1.0, 0.625, 0.5)])
@pytest.mark.parametrize("power", [1.0, 2.0, 3.5])
def test_the_error_follows_from_steps_in_any_ratio(steps: tuple[float, ...], power: float) -> None:
    """Errors 3 h^p: told to the last digit by an order of at least p, and no less than they are by a lower one or two runs."""
    errors = [3.0 * h**power for h in steps]
    changes = [a - b for a, b in itertools.pairwise(errors)]
    assert seen_order(changes, steps, 4.0) == pytest.approx(power, abs=1e-5)  # xtol 1e-6 of the root
    assert error_of_steps(changes, steps, (4.0, 4.0), False, False, False) == pytest.approx(errors[-1], rel=1e-4)
    assert error_of_steps(changes, steps, (1.0, 4.0), False, False, False) >= errors[-1] * (1.0 - 1e-9)
    assert error_of_steps(changes[:1], steps[:2], (4.0, 4.0), False, False, False) >= errors[1] * (1.0 - 1e-9)


def test_runs_with_steps_that_do_not_divide_each_other_are_compared() -> None:
    """A pendulum's angle sin t at 51 and at 65 times: the cubic between two nodes is off by h^4 / 384."""
    lived = api.load("pendulum").for_scene(None)
    problem = Problem(lived, replace(lived.scene(), duration=6.0))
    measure = ErrorMeasure(problem, None)

    def run(count: int, shift: float) -> EvenRun:
        t = np.linspace(0.0, 6.0, count)[:, None]
        return EvenRun.of(measure, np.sin(t) + shift, np.cos(t))

    one, other = run(51, 0.0), run(65, 0.0)
    q, v = other.at(one.t)
    h = 6.0 / 64
    assert np.max(np.abs(q - one.q)) < h**4 / 384 and np.max(np.abs(v - one.v)) < h**3  # the spline's ends are of third order
    # the tracked bob is at a distance of the rod's length from the pin: it moves by as much as the angle, times that length
    assert one.apart(other, measure) < h**4 / 384 < 1e-6
    apart = one.apart(run(65, 1e-3), measure)
    assert apart == run(65, 1e-3).apart(one, measure) == pytest.approx(run(51, 1e-3).apart(one, measure), rel=1e-3)
