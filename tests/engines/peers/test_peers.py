"""Peers simulate the same mechanism: their short runs agree with Pinocchio's, as closely as their methods allow."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.peers.engine import INTEGRATORS, PEERS, controlled, installed, not_expressible, refusal, trace
from mechlab.engines.peers.exudyn import world_axes
from mechlab.engines.peers.job import independent, links_of
from mechlab.engines.peers.process import PeerStopped
from mechlab.errors import MechlabError
from mechlab.experiment.laws import Constant
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism import Builder, Mechanism, Spring, prismatic, revolute
from mechlab.mechanism.inertia import Inertia

PROBLEMS = {"pendulum": 0.5, "n_fourbar": 0.5, "andrews": 0.005, "bricard": 0.5, "flyball": 0.02, "slider_crank": 0.1}
"""Problem -> time of a short run [s], long before a singular position."""
OUTPUTS = 10


def need(peer: str) -> None:
    if not installed(peer):
        pytest.skip(f"{peer} is not installed")


@cache
def problem(name: str) -> tuple[Mechanism, Scene]:
    d = ml.load(name).for_scene(None)
    scene = replace(d.scene(None, None, None), duration=PROBLEMS[name])
    return d.mechanism(scene.fidelity), scene


_TRUTHS: dict[str, np.ndarray] = {}


def truth(mechanism: Mechanism, scene: Scene) -> np.ndarray:
    """Pinocchio's coordinates at the output times, computed once for each mechanism."""
    if mechanism.name in _TRUTHS:
        return _TRUTHS[mechanism.name]
    from mechlab.engines.pinocchio.trace import Stabilisation
    from mechlab.engines.pinocchio.trace import trace as ours

    sharp = Settings(engine="pinocchio", integrator="DOP853", tolerance=1e-12)
    _TRUTHS[mechanism.name] = ours(mechanism, scene, sharp, OUTPUTS, Stabilisation(0.01, 0.2)).q
    return _TRUTHS[mechanism.name]


def away(peer: str, integrator: str, mechanism: Mechanism, scene: Scene, value: float) -> float:
    settings = Settings(engine=peer, integrator=integrator, timestep=value, tolerance=value)
    found = trace(mechanism, scene, settings, OUTPUTS, limit=20.0)
    assert found.complete, found.reason
    expected = truth(mechanism, scene)
    return float(np.max(np.abs(found.q - expected)) / np.max(np.abs(expected - expected[0])))


# method, steps between two outputs or tolerance, limit of the largest deviation relative to the motion: second-order
# implicit rules miss h^2, Drake's discrete model h; tolerances are of a step, so that of a run is some hundred times larger
CASES = [
    ("exudyn", "generalized-alpha", 40, 2e-3),
    ("exudyn", "generalized-alpha, planar bodies", 40, 4e-3),
    ("exudyn", "trapezoidal, planar bodies, full Newton", 40, 4e-3),
    ("drake", "SAP", 400, 1e-2),
    ("opensim", "RungeKuttaMerson", 1e-8, 1e-5),
    # single precision; Kamino's solvers are of first order
    ("mujoco_warp", "RK4", 40, 1e-4),
    ("newton", "LOX", 40, 1e-2),
    ("newton", "DVI", 40, 1e-2),
]
TREES = [
    ("exudyn", "trapezoidal", 40, 2e-3),
    ("exudyn", "DOPRI5", 1e-8, 1e-5),
    ("drake", "runge_kutta3", 1e-7, 1e-4),
    ("opensim", "CPodes", 1e-9, 1e-4),
]


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize(("peer", "integrator", "value", "limit"), CASES)
def test_a_peer_moves_as_pinocchio_does(peer: str, integrator: str, value: float, limit: float, name: str) -> None:
    need(peer)
    if (peer, name) == ("drake", "flyball"):
        pytest.skip("Drake's discrete model takes the stiff dampers explicitly; its continuous one is tested below")
    mechanism, scene = problem(name)
    if "planar" in integrator and not_expressible(peer, integrator, mechanism, scene):
        assert name in ("bricard", "flyball")
        pytest.skip("not in the plane of x and y")
    if peer == "newton" and (mechanism.springs or name == "pendulum"):
        pytest.skip("Kamino has no springs between points, and a point mass is ill-conditioned in single precision")
    h = value if value < 1 else scene.duration / OUTPUTS / value
    assert away(peer, integrator, mechanism, scene, h) < limit


@pytest.mark.parametrize("name", ["pendulum", "flyball"])
@pytest.mark.parametrize(("peer", "integrator", "value", "limit"), TREES)
def test_a_peer_moves_a_tree_as_pinocchio_does(
    peer: str, integrator: str, value: float, limit: float, name: str
) -> None:
    need(peer)
    mechanism, scene = problem(name)
    h = value if value < 1 else scene.duration / OUTPUTS / value
    assert away(peer, integrator, mechanism, scene, h) < limit


def branched() -> tuple[Mechanism, Scene]:
    """A slide along a skew axis that carries an arm with two hinges in one body and a welded weight; springs and dampers
    everywhere, a load."""
    b = Builder("branched", gravity=(0.3, -2.0, -9.81))
    heavy = Inertia.box(2.0, 0.1, 0.2, 0.3, (0.05, 0.02, -0.03))
    skew = tuple(np.array([1.0, 2.0, 2.0]) / 3.0)
    b.body("carriage", prismatic("slide", skew, damping=0.7, stiffness=20.0, spring_rest=0.1), inertia=heavy)
    pins = [revolute("first", "x", damping=0.05), revolute("second", skew, stiffness=3.0, spring_rest=-0.2)]
    b.body("arm", *pins, parent="carriage", at=(0.2, 0.1, 0.0), inertia=heavy)
    b.body("weight", parent="arm", at=(0.0, 0.3, 0.1), inertia=Inertia.box(0.5, 0.1, 0.1, 0.2))
    b.spring(Spring("rope", "ground", "weight", (0.5, 0.5, 0.5), (0.01, 0.0, 0.1), 40.0, 0.5, 0.2))
    rates = {"slide": 0.2, "first": 1.0, "second": -0.5}
    return b.build(), Scene("swing", "full", 0.5, (Constant("first", 0.4),), initial_rates=rates)


@pytest.mark.parametrize(
    ("peer", "integrator", "value"),
    [("exudyn", "RK44", 1e-3), ("drake", "runge_kutta3", 1e-9), ("opensim", "RungeKuttaMerson", 1e-9)],
)
def test_axes_compound_joints_welds_springs_and_loads_are_carried_over(
    peer: str, integrator: str, value: float
) -> None:
    need(peer)
    mechanism, scene = branched()
    # rounding of 1e-9 a step over some hundred steps; RK4 at 1 ms is far below
    assert away(peer, integrator, mechanism, scene, value) < 1e-6


@pytest.mark.parametrize("peer", PEERS)
def test_an_absent_peer_is_named_with_its_extra(peer: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mechlab.engines.peers.engine.find_spec", lambda name: None)
    mechanism, scene = problem("pendulum")
    why = refusal(peer, INTEGRATORS[peer][0], mechanism, scene)
    assert peer in why and "mechanism-lab[peers]" in why
    with pytest.raises(MechlabError, match="not installed"):
        trace(mechanism, scene, Settings(engine=peer, integrator=INTEGRATORS[peer][0]), OUTPUTS)


def test_what_cannot_be_carried_over_is_said_by_name() -> None:
    mechanism, scene = branched()
    rough = Builder("rough")
    rough.body("a", revolute("pin", "z", friction=0.1), inertia=Inertia.box(1.0, 0.1, 0.1, 0.1))
    assert "friction of pin" in not_expressible("drake", "SAP", rough.build(), scene)
    loop, fall = problem("bricard")
    for peer, integrator in (("exudyn", "RK44"), ("drake", "runge_kutta3")):
        assert "closes no loops" in not_expressible(peer, integrator, loop, fall)
    assert not_expressible("opensim", "CPodes", loop, fall) == ""
    wheels = Builder("wheels")
    for name, at in (("one", 0.0), ("two", 0.04)):
        wheels.body(name, revolute(name, "z"), at=(at, 0.0, 0.0), inertia=Inertia.box(1.0, 0.1, 0.1, 0.1))
    wheels.gears("mesh", "one", "two", (20, 20))
    assert "drops joint equalities" in not_expressible("newton", "LOX", wheels.build(), Scene("turn", "full", 1.0))
    assert "gear relation mesh" in not_expressible("exudyn", "trapezoidal", wheels.build(), Scene("turn", "full", 1.0))
    geared = ml.load("planetary")
    assert not_expressible("exudyn", "trapezoidal", geared.mechanism(), geared.scene(None, None, None))
    with pytest.raises(MechlabError, match="Existing: SAP"):
        not_expressible("drake", "RK45", mechanism, scene)
    with pytest.raises(MechlabError, match="Existing: drake, exudyn, mujoco_warp, newton, opensim"):
        refusal("chrono", "SAP", mechanism, scene)


def test_the_rows_given_to_exudyn_are_as_many_as_are_independent() -> None:
    # anchors: of Bricard's five rows one is redundant; dropping a rotation of the loop frame works, dropping others may not
    mechanism, scene = problem("bricard")
    rows = independent(mechanism, mechanism.reference())["hinge_5"]
    assert rows[:3] == (True, True, True) and sorted(rows[3:]) == [False, True]
    planar, _ = problem("andrews")
    assert set(independent(planar, planar.reference()).values()) == {(True, True, False)}


def test_the_trapezoidal_rule_closes_loops_along_the_axes_of_the_world() -> None:
    # by hand, with exudyn.SolveDynamic and a SphericalJoint: 6.5e-5 m at 1.5625 ms (Exudyn 1.13.6); GenericJoint: 8.5e-4 m
    need("exudyn")
    d = ml.load("slider_crank").for_scene(None)
    scene = d.scene(None, None, None)
    assert d.entry.reference is not None
    own = d.entry.reference(d.parameters, scene)
    for integrator in ("trapezoidal", "trapezoidal, full Newton"):
        settings = Settings(engine="exudyn", integrator=integrator, timestep=scene.duration / 3200)
        found = trace(d.mechanism(), scene, settings, 100, limit=20.0)
        at = np.searchsorted(own.t, np.linspace(0.0, scene.duration, 101) * (1 - 1e-12))
        slider = d.mechanism().value("slider_position", found.q) - d.mechanism().value("slider_position", own.q[at])
        assert np.max(np.abs(slider)) < 1e-4


def test_rows_are_left_out_along_a_world_axis_only_where_it_stays_one() -> None:
    planar, _ = problem("andrews")
    for loop in planar.loops:
        assert world_axes(links_of(planar), loop, (True, True, False)) == [1, 1, 0]
        assert world_axes(links_of(planar), loop, (False, True, True)) is None  # x turns with the body
    tilted, _ = branched()
    loop = replace(planar.loops[0], body_a="weight", body_b="ground")
    assert world_axes(links_of(tilted), loop, (True, True, True)) == [1, 1, 1]
    assert world_axes(links_of(tilted), loop, (True, True, False)) is None


def test_planar_bodies_carry_loads_on_both_sides_and_give_rates() -> None:
    need("exudyn")
    mechanism, scene = problem("slider_crank")
    mechanism = replace(mechanism, name="loaded")
    scene = replace(scene, laws=(Constant("rod_joint", 2.0), Constant("slider_position", -30.0)))
    step = scene.duration / 1000
    assert away("exudyn", "trapezoidal, planar bodies", mechanism, scene, step) < 1e-4
    settings = [
        Settings(engine="exudyn", integrator=f"generalized-alpha{bodies}", timestep=step)
        for bodies in ("", ", planar bodies")
    ]
    tree, planar = (trace(mechanism, scene, s, OUTPUTS).v for s in settings)
    assert np.max(np.abs(tree - planar)) < 1e-3 * np.max(np.abs(tree))  # both of second order


def test_what_planar_bodies_cannot_express_is_named() -> None:
    mechanism, scene = problem("bricard")
    assert "plane of x and y" in not_expressible("exudyn", "trapezoidal, planar bodies", mechanism, scene)
    still = Builder("still")
    still.body("a", revolute("pin", "z", damping=0.1), inertia=Inertia.box(1.0, 0.1, 0.1, 0.1))
    assert "damper" in not_expressible("exudyn", "trapezoidal, planar bodies", still.build(), scene)


@pytest.mark.parametrize("integrator", ["generalized-alpha", "trapezoidal"])
def test_full_and_modified_newton_find_the_same_motion(integrator: str) -> None:
    need("exudyn")
    mechanism, scene = problem("slider_crank")
    found = [
        trace(mechanism, scene, Settings(engine="exudyn", integrator=f"{integrator}{newton}", timestep=1e-3), OUTPUTS)
        for newton in ("", ", full Newton")
    ]
    # both stop at Exudyn's relative tolerance 1e-8 of a step, over 100 steps
    assert np.max(np.abs(found[0].q - found[1].q)) < 1e-6


@pytest.mark.parametrize("peer", PEERS)
def test_the_clock_of_a_run_holds_more_than_its_steps(peer: str) -> None:
    need(peer)
    mechanism, scene = problem("slider_crank")
    integrator = next(i for i in INTEGRATORS[peer] if not not_expressible(peer, i, mechanism, scene))
    settings = Settings(engine=peer, integrator=integrator, timestep=1e-3, tolerance=1e-4)
    found = trace(mechanism, scene, settings, OUTPUTS)
    assert found.total_s > found.cpu_s > 0.0


def test_links_carry_all_mass_but_that_of_the_ground() -> None:
    mechanism, _ = branched()
    links = links_of(mechanism)
    assert [x.name for x in links.links] == ["slide", "first", "second"]
    assert [x.parent for x in links.links] == [-1, 0, 1]
    assert sum(x.inertia.mass for x in links.links) == pytest.approx(mechanism.total_mass)


def test_integrators_with_step_control_are_known() -> None:
    assert controlled("opensim", "CPodes") and not controlled("drake", "SAP")


def test_a_run_past_its_limit_is_stopped_and_the_next_one_works() -> None:
    need("exudyn")
    mechanism, scene = problem("pendulum")
    long = Settings(engine="exudyn", integrator="RK44", timestep=1e-7)
    with pytest.raises(PeerStopped, match=r"stopped after 0\.3 s"):
        trace(mechanism, replace(scene, duration=100.0), long, OUTPUTS, limit=0.3)
    assert away("exudyn", "RK44", mechanism, scene, 1e-3) < 1e-8


def test_a_peer_that_dies_is_a_reason_and_the_next_run_works(monkeypatch: pytest.MonkeyPatch) -> None:
    need("exudyn")
    from mechlab.engines.peers.process import process

    mechanism, scene = problem("pendulum")
    assert away("exudyn", "RK44", mechanism, scene, 1e-3) < 1e-8
    running = process("exudyn")._popen
    assert running is not None
    stopped = type(running).poll
    running.kill()
    running.wait()
    monkeypatch.setattr(type(running), "poll", lambda self: None)  # it dies after having been looked at
    found = trace(mechanism, scene, Settings(engine="exudyn", integrator="RK44"), OUTPUTS)
    assert not found.complete and "died" in found.reason
    monkeypatch.setattr(type(running), "poll", stopped)
    assert away("exudyn", "RK44", mechanism, scene, 1e-3) < 1e-8
