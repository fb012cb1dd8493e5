"""Initial states, energy and findings that both runners share."""

import numpy as np
import pytest

import mechlab as ml
from mechlab.errors import MechlabError, NoSolution
from mechlab.experiment.assembly_modes import mode_signs
from mechlab.experiment.energy import dissipation, energy, energy_finding, kinetic_energy, potential_energy, work
from mechlab.experiment.findings import kinematic_findings, saturation_finding, smallest_link
from mechlab.experiment.laws import Servo
from mechlab.experiment.motion import Hold
from mechlab.experiment.scene import Scene, initial_state, sample_grid
from mechlab.mechanism import Builder, ConstraintSet, Inertia, Spring, TreeKinematics, close, mode_sign, revolute


def fourbar():
    b = Builder("fourbar", gravity=(0, -9.81, 0))
    b.bar("crank", revolute("crank_angle"), 0.1)
    b.bar("coupler", revolute("coupler_rel"), 0.3, parent="crank", at=(0.1, 0, 0))
    b.bar("rocker", revolute("rocker_angle"), 0.25, at=(0.3, 0, 0))
    b.loop("pin", "coupler", "rocker", (0.3, 0, 0), (0.25, 0, 0))
    b.drive("crank_angle")
    return b.assemble({"crank_angle": 0.9, "coupler_rel": -0.3, "rocker_angle": 1.5}, hold=["crank_angle"])


def pendulum(**options):
    b = Builder("pendulum", gravity=(0, -9.81, 0))
    b.body("bob", revolute("angle", **options), inertia=Inertia.point(2.0, (0.5, 0, 0)))
    return b.build()


def test_initial_state_closes_far_from_the_reference():
    m = fourbar()
    q, v = initial_state(m, Scene("s", "full", 1.0, initial={"crank_angle": 4.0}, initial_rates={"crank_angle": 2.0}))
    tree = TreeKinematics(m, q, v)
    assert m.value("crank_angle", q) == pytest.approx(4.0, abs=1e-12)
    assert np.abs(ConstraintSet(m).residual(tree)).max() < 1e-12
    assert np.abs(ConstraintSet(m).jacobian(tree) @ v).max() < 1e-12 and v[0] == pytest.approx(2.0)
    rest, still = initial_state(m, Scene("s", "full", 1.0))
    assert np.array_equal(rest, m.reference()) and not still.any()


def test_initial_state_names_what_does_not_close():
    m = fourbar()
    with pytest.raises(NoSolution, match="rocker_angle = .* instead of 3"):
        initial_state(m, Scene("s", "full", 1.0, initial={"rocker_angle": 3.0}))
    with pytest.raises(MechlabError, match="'crank' does not exist"):
        initial_state(m, Scene("s", "full", 1.0, initial={"crank": 3.0}))
    with pytest.raises(MechlabError, match="finite"):
        initial_state(m, Scene("s", "full", 1.0, initial={"crank_angle": np.nan}))


def test_energy_of_a_pendulum():
    m = pendulum(stiffness=3.0, spring_rest=0.1, damping=0.2, armature=0.4)
    q, v = np.array([[0.3], [1.0]]), np.array([[2.0], [-1.0]])
    assert np.allclose(kinetic_energy(m, q, v), 0.5 * (2.0 * 0.25 + 0.4) * v[:, 0] ** 2)
    expected = 2.0 * 9.81 * 0.5 * np.sin(q[:, 0]) + 1.5 * (q[:, 0] - 0.1) ** 2
    assert np.allclose(potential_energy(m, q), expected)
    assert np.allclose(energy(m, q, v), expected + kinetic_energy(m, q, v))
    assert np.allclose(dissipation(m, q, v), 0.2 * v[:, 0] ** 2)


def test_kinetic_energy_is_half_v_m_v():
    m = fourbar()
    rng = np.random.default_rng(0)
    q, v = rng.normal(size=(5, 3)), rng.normal(size=(5, 3))
    expected = [0.5 * y @ TreeKinematics(m, x).mass_matrix() @ y for x, y in zip(q, v, strict=True)]
    assert np.allclose(kinetic_energy(m, q, v), expected)


def test_a_spring_between_points():
    b = Builder("sprung", gravity=(0, 0, 0))
    b.body("bob", revolute("angle"), inertia=Inertia.point(1.0, (1.0, 0, 0)))
    b.spring(Spring("spring", "ground", "bob", (0, 2.0, 0), (1.0, 0, 0), 8.0, 0.5, 1.0))
    m = b.build()
    length = np.sqrt(5.0)
    assert potential_energy(m, np.zeros((1, 1)))[0] == pytest.approx(4.0 * (length - 1.0) ** 2)
    rate = -2.0 / length * 3.0  # the end moves up at 3 m/s
    assert dissipation(m, np.zeros((1, 1)), np.full((1, 1), 3.0))[0] == pytest.approx(0.5 * rate**2)


def swing(wrong=0.0, n=400):
    """A damped pendulum by its own small steps; `wrong` spoils the rate over time."""
    from mechlab.integrate import RK4, integrate_fixed

    m = pendulum(damping=0.3)
    rows = []
    integrate_fixed(
        RK4,
        lambda t, y: np.array([y[1], (-2.0 * 9.81 * 0.5 * np.cos(y[0]) - 0.3 * y[1]) / 0.5]),
        0.0,
        [0.0, 0.0],
        2.0 / n,
        n,
        observe=lambda k, t, y: rows.append((t, *y)),
    )
    t, q, v = np.array(rows).T
    return m, t, q[:, None], v[:, None] * (1 + wrong * t[:, None])


def test_the_noise_of_a_wheel_at_rest_is_no_loss_of_energy():
    """Without weight nothing tells how much energy is much: rates of 1e-12 rad/s are rounding, those of 1e-3 are a motion."""
    b = Builder("wheel", gravity=(0, 0, 0))
    b.body("wheel", revolute("angle"), inertia=Inertia.cylinder(2.0, 0.5, 0.1))
    m, t = b.build(), np.linspace(0.0, 1.0, 21)
    for size, severity in ((1e-12, "ok"), (1e-3, "error")):
        v = size * (1.0 + t)[:, None]  # it quickens, and nothing drives it
        assert energy_finding(m, t, size * t[:, None], v, np.zeros(len(t))).severity == severity


def test_energy_finding_passes_a_right_run_and_fails_a_wrong_one():
    m, t, q, v = swing()
    good = energy_finding(m, t, q, v, -dissipation(m, q, v))
    assert good.severity == "ok" and good.value < 1e-6
    coarse = energy_finding(m, t[::8], q[::8], v[::8], -dissipation(m, q[::8], v[::8]))
    assert coarse.severity == "ok"
    m, t, q, v = swing(wrong=0.05)
    assert energy_finding(m, t, q, v, -dissipation(m, q, v)).severity == "error"
    assert energy_finding(m, t, q, v, np.zeros(len(t))).severity == "error"
    q[3] = np.nan
    assert energy_finding(m, t, q, v, np.zeros(len(t))).severity == "error"


def test_work_is_third_order_also_at_uneven_times():
    t = np.sort(np.random.default_rng(0).uniform(0, 1, 41))
    t[0] = 0.0
    assert np.allclose(work(t, t**2), t**3 / 3, atol=1e-12)


def test_kinematic_findings():
    m = fourbar()
    q = np.array([close(m, None, {"crank_angle": x}, steps=5).q for x in np.linspace(0.5, 2.0, 9)])
    good = {f.name: f for f in kinematic_findings(m, q, np.zeros_like(q))}
    assert all(f.severity == "ok" for f in good.values()) and good["loop_gap"].value < 1e-12
    assert "crank_angle was kept" in good["assembly_mode"].sentence
    bad = q.copy()
    bad[4, 1] += 0.01
    found = {f.name: f for f in kinematic_findings(m, bad, np.zeros_like(q))}
    assert found["loop_gap"].severity == "error" and "pin." in found["loop_gap"].sentence
    other = close(m, [0.0, -3.0, -2.5], {"crank_angle": 0.9}).q
    jumped = np.vstack([q, other])
    found = {f.name: f for f in kinematic_findings(m, jumped, np.zeros_like(jumped))}
    assert found["assembly_mode"].severity == "warning" and found["assembly_mode"].value == 1
    bad[2] = np.nan
    found = {f.name: f for f in kinematic_findings(m, bad, np.zeros_like(q))}
    assert found["finite"].severity == "error" and found["finite"].value == 3


def test_mode_signs_agree_with_mode_sign():
    m = fourbar()
    q = np.array([close(m, None, {"crank_angle": x}, steps=5).q for x in (0.5, 2.0)])
    assert list(mode_signs(m, q, ["crank_angle"])) == [mode_sign(m, x, ["crank_angle"]) for x in q]
    assert not mode_signs(m, q, []).any()


def test_saturation():
    law = Servo("a", Hold(), 1.0, 0.0, limit=2.0)
    assert saturation_finding([law], {"a": np.array([1.0, 2.0, -2.0, 0.0])}).value == 0.5
    assert saturation_finding([law], {"a": np.array([1.0])}).severity == "ok"
    assert saturation_finding([Servo("a", Hold(), 1.0, 0.0)], {"a": np.array([1.0])}) is None


def test_sample_grid():
    regular = sample_grid(1.0, 1e-3)
    assert len(regular) == 201 and regular[-1] == 1.0 and np.allclose(regular / 1e-3, np.round(regular / 1e-3))
    assert len(sample_grid(0.0105, 1e-3)) == 12 and sample_grid(0.0105, 1e-3)[-1] == 0.0105
    assert list(sample_grid(1.0, 1e-3, [0.5, 0.25])) == [0.0, 0.25, 0.5, 1.0]
    for wrong in (0.0, -1.0, np.nan):
        with pytest.raises(MechlabError, match="duration"):
            sample_grid(wrong, 1e-3)
    with pytest.raises(MechlabError, match="sample times"):
        sample_grid(1.0, 1e-3, [np.nan])


@pytest.mark.parametrize(("miss", "smallest"), [(0.0, 0.1), (9.3e-5, 0.1), (0.02, 0.02)])
def test_axes_of_a_cross_that_miss_each_other_by_a_rounding_are_no_link(miss, smallest):
    b = Builder("cross", gravity=(0, -9.81, 0))
    b.bar("crank", revolute("crank"), 0.1)
    b.body("yoke", revolute("first"), parent="crank", at=(0.1, 0, 0), inertia=Inertia.axial(0.1, 1e-3, 1e-3))
    b.bar("coupler", revolute("second"), 0.3, parent="yoke", at=(miss, 0, 0))
    b.bar("rocker", revolute("rocker"), 0.25, at=(0.3, 0, 0))
    b.loop("pin", "coupler", "rocker", (0.3, 0, 0), (0.25, 0, 0))
    b.drive("crank")
    m = b.assemble({"crank": 0.9, "second": -0.3, "rocker": 1.5}, hold=["crank", "first"])
    assert smallest_link(m) == pytest.approx(smallest, rel=1e-12)


def test_a_run_in_which_nothing_moves_says_so() -> None:
    """A pendulum at rest without weight: there is no energy to balance, and no number without meaning in the sentence."""
    run = ml.simulate("pendulum", angle_0=0.0, gravity=0.0, duration=0.1)
    found = run.health.finding("energy_balance")
    assert (found.severity, found.value) == ("ok", 0.0)
    assert found.sentence == "energy balance: nothing moved, and no energy came or went"
