"""Modes about a rest against closed forms, the equation of one freedom, and each engine against the other."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mechlab as ml
from mechlab.errors import MechlabError, NoSolution, Untrustworthy
from mechlab.mechanism import Builder, ConstraintSet, Inertia, Mechanism, TreeKinematics, floating, prismatic, revolute
from mechlab.studies.modes.motion import mode_motion
from mechlab.studies.modes.result import ModesResult, eigenvalue_gaps

# Difference quotients of sixth order at 1e-3 rad: 1e-12 of the stiffness; frequencies halve it.
FINE = 1e-9


def omegas(found: ModesResult) -> list[float]:
    return [m.omega for m in found.modes]


def all_agree(found: ModesResult, expected: list[float], tolerance: float = FINE) -> None:
    """Every witness by itself, not only the one that speaks."""
    assert len(found.answering) >= 2
    for name, witness in found.answering.items():
        np.testing.assert_allclose([m.omega for m in witness.modes], expected, rtol=tolerance, atol=1e-9, err_msg=name)


def chain(lengths: tuple[float, float], masses: tuple[float, float], g: float) -> Mechanism:
    b = Builder("double", gravity=(0.0, -g, 0.0))
    b.body("bob_1", revolute("angle_1"), inertia=Inertia.point(masses[0], (0.0, -lengths[0], 0.0)))
    low = Inertia.point(masses[1], (0.0, -lengths[1], 0.0))
    return b.body("bob_2", revolute("angle_2"), parent="bob_1", at=(0.0, -lengths[0], 0.0), inertia=low).build()


def spring_tree(k: tuple[float, float], m: tuple[float, float], c: tuple[float, float]) -> Mechanism:
    """Two masses on a line, the second on the first: k1 to the ground, k2 and c2 between."""
    b = Builder("springs", gravity=(0.0, 0.0, 0.0))
    for i, parent in enumerate(("ground", "mass_1")):
        joint = prismatic(f"x{i + 1}", "x", stiffness=k[i], damping=c[i])
        b.body(f"mass_{i + 1}", joint, parent=parent, inertia=Inertia.axial(m[i], 1e-3, 1e-3))
    return b.build()


@pytest.mark.parametrize(("length", "gravity"), [(1.0, 9.81), (0.3, 1.62)])
def test_a_pendulum_settles_and_swings_with_the_root_of_g_over_l(length: float, gravity: float) -> None:
    found = ml.modes("pendulum", length=length, gravity=gravity)  # released from the horizontal: falls to the bottom
    assert math.isclose(math.remainder(found.equilibrium["angle"] + math.pi / 2, 2 * math.pi), 0.0, abs_tol=1e-10)
    all_agree(found, [math.sqrt(gravity / length)], 1e-8)
    assert found.modes[0].kind == "oscillating" and found.modes[0].damping == 0.0
    assert found.modes[0].frequency_hz == pytest.approx(math.sqrt(gravity / length) / (2 * math.pi), rel=1e-8)


def test_an_upright_pendulum_is_named_unstable() -> None:
    found = ml.modes("pendulum", start_angle=math.pi / 2)
    assert [m.kind for m in found.modes] == ["unstable"]
    for witness in found.answering.values():
        assert witness.modes[0].growth == pytest.approx(math.sqrt(9.81), rel=1e-8)
    assert "UNSTABLE" in found.text() and found.to_dict()["modes"][0]["kind"] == "unstable"


def test_a_double_pendulum_has_the_frequencies_and_shapes_of_the_textbook() -> None:
    l1, l2, m1, m2, g = 0.7, 0.4, 2.0, 0.5, 9.81
    found = ml.modes(chain((l1, l2), (m1, m2), g))
    # absolute angles: M = [[(m1+m2) l1^2, m2 l1 l2], [m2 l1 l2, m2 l2^2]], K = g diag((m1+m2) l1, m2 l2)
    mass = np.array([[(m1 + m2) * l1**2, m2 * l1 * l2], [m2 * l1 * l2, m2 * l2**2]])
    values, vectors = np.linalg.eig(np.linalg.solve(mass, g * np.diag([(m1 + m2) * l1, m2 * l2])))
    order = np.argsort(values)
    all_agree(found, np.sqrt(values[order]).tolist())
    for mode, k in zip(found.modes, order, strict=True):
        shape = found.shape(mode)
        absolute = np.array([shape["angle_1"], shape["angle_1"] + shape["angle_2"]])
        assert abs(abs(absolute @ vectors[:, k]) - np.linalg.norm(absolute)) < 1e-9
        assert max(abs(shape["angle_1"]), abs(shape["angle_2"])) == pytest.approx(1.0)


def test_a_tree_of_springs_and_dampers_has_the_eigenvalues_of_its_matrices() -> None:
    k, m, c = (400.0, 90.0), (2.0, 0.5), (0.0, 1.5)  # damping between the masses only: no proportional damping
    found = ml.modes(spring_tree(k, m, c))
    # relative coordinates: x1, x2 = position of the second relative to the first
    mass = np.array([[m[0] + m[1], m[1]], [m[1], m[1]]])
    state = np.block(
        [
            [np.zeros((2, 2)), np.eye(2)],
            [-np.linalg.solve(mass, np.diag(k)), -np.linalg.solve(mass, np.diag(c))],
        ]
    )
    expected = sorted((r for r in np.linalg.eigvals(state) if r.imag > 0), key=abs)
    for witness in found.answering.values():
        got = [next(r for r in mode.eigenvalues if r.imag > 0) for mode in witness.modes]
        np.testing.assert_allclose(got, expected, rtol=1e-9)
    assert found.modes[0].damping == pytest.approx(-expected[0].real / abs(expected[0]), rel=1e-8)
    assert found.phase(found.modes[0])  # parts of a non-proportional mode do not move in step


def test_strong_damping_gives_two_real_roots() -> None:
    m, c, k = 1.5, 40.0, 100.0
    b = Builder("dashpot", gravity=(0.0, 0.0, 0.0))
    b.body("block", prismatic("x", "x", stiffness=k, damping=c), inertia=Inertia.axial(m, 1e-3, 1e-3))
    found = ml.modes(b.build())
    mode = found.modes[0]
    assert mode.kind == "overdamped" and mode.damping == pytest.approx(c / (2 * math.sqrt(k * m)), rel=1e-10)
    roots = sorted(r.real for r in mode.eigenvalues)
    np.testing.assert_allclose(roots, np.sort(np.roots([m, c, k])), rtol=1e-10)


def test_a_free_shaft_is_rigid_and_decays_with_its_drag() -> None:
    b = Builder("shaft", gravity=(0.0, 0.0, 0.0))
    b.body("rotor", revolute("turn", damping=0.3), inertia=Inertia.axial(1.0, 0.1, 0.05))
    found = ml.modes(b.build())
    assert [m.kind for m in found.modes] == ["rigid"] and found.modes[0].damping is None
    assert sorted(r.real for r in found.modes[0].eigenvalues) == pytest.approx([-3.0, 0.0], rel=1e-9)
    assert "rigid" in found.text()


def test_a_fourbar_under_its_weight_against_potential_and_inertia_along_the_crank() -> None:
    """omega^2 = V'' / J with V and J by numpy from poses that are assembled one by one."""
    found = ml.modes("fourbar", free=True)
    m = found.mechanism
    crank = found.equilibrium["crank_angle"]
    tree, constraints = TreeKinematics(m), ConstraintSet(m)
    from mechlab.mechanism import close

    def weight(angle: float) -> float:
        q = close(m, found.q, {"crank_angle": angle}).q
        tree.set(q)
        heights = [(tree.pose(b.name)[1] + tree.pose(b.name)[0] @ np.array(b.inertia.com))[2] for b in m.bodies]
        return 9.81 * sum(b.inertia.mass * z for b, z in zip(m.bodies, heights, strict=True))

    h = 2e-3
    v = [weight(crank + k * h) for k in (-2, -1, 0, 1, 2)]
    slope = (v[0] - 8 * v[1] + 8 * v[3] - v[4]) / (12 * h)
    curvature = (-v[0] + 16 * v[1] - 30 * v[2] + 16 * v[3] - v[4]) / (12 * h**2)
    jacobian = constraints.jacobian(tree.set(found.q))
    u = np.linalg.svd(jacobian)[2][-1]
    u = u / (m.row("crank_angle") @ u)
    assert abs(slope) < 1e-8 and curvature > 0
    # second differences of V at 2e-3: rounding 1e-16 V / h^2 = 1e-10
    all_agree(found, [math.sqrt(curvature / (u @ tree.mass_matrix() @ u))], 1e-7)
    assert found.max_difference is not None and found.max_difference < 1e-8


def test_a_flyball_hangs_and_its_balls_swing_against_weight_and_spring() -> None:
    found = ml.modes("flyball")
    p = ml.load("flyball").parameters
    g, half = p.gravity, 0.5 * p.arm_length
    pull = 0.5 * p.slider_mass * g  # each spring carries half of the slider
    length = p.spring_length + pull / p.spring_stiffness
    inertia = p.ball_mass * p.arm_length**2 + p.arm_mass * ((p.arm_length**2 + p.section**2) / 12.0 + half**2)
    stiffness = g * (p.ball_mass * p.arm_length + p.arm_mass * half) + pull * (half + half**2 / length)
    assert found.equilibrium["slider_height"] == pytest.approx(p.shaft_length - half - length, abs=1e-12)
    for witness in found.answering.values():
        swing = [m.omega for m in witness.modes if m.kind == "oscillating"]
        assert swing == pytest.approx([math.sqrt(stiffness / inertia)] * 2, rel=1e-7)
        assert [m.kind for m in witness.modes].count("rigid") == 1  # the shaft turns freely


@pytest.mark.parametrize("fidelity", ["minimal", "full"])
def test_the_delta_on_its_servos_is_the_same_in_both_engines(fidelity: str) -> None:
    """`full` has fixed and spherical loops with redundancy, `minimal` shafts: other rows, the same six modes."""
    found = ml.modes("delta6", fidelity=fidelity)
    kinds = [m.kind for m in found.modes]
    assert kinds.count("overdamped") == 6 and kinds.count("rigid") == len(kinds) - 6  # rods spin freely
    assert {"pinocchio", "mujoco"} <= set(found.answering) and found.exit_code == 0
    assert found.relative_difference is not None and found.relative_difference < 1e-8
    # the head turns about gamma with drive 3 alone at stiffness 200 and damping 4, and more inertia than the rotor's
    assert min(m.omega for m in found.modes if m.omega) > 100.0


def test_redundant_rows_do_no_harm() -> None:
    found = ml.modes("bricard")
    assert [m.kind for m in found.modes] == ["oscillating"] and len(found.answering) == 3
    assert found.relative_difference is not None and found.relative_difference < 1e-8


def test_the_squeezer_stands_on_top_of_its_spring_and_rests_below_it_under_load() -> None:
    top = ml.modes("andrews")  # K1 and K2 are aligned at the start: the spring is longest, without a load
    assert [m.kind for m in top.modes] == ["unstable"]
    below = ml.modes("andrews", beta_force=0.03)
    assert [m.kind for m in below.modes] == ["oscillating"] and len(below.answering) == 3
    assert below.relative_difference is not None and below.relative_difference < 1e-8


def test_a_frequency_is_that_of_a_small_swing_in_a_run() -> None:
    found = ml.modes("slider_crank")
    name, small = "crank_angle", 1e-4
    if name not in found.equilibrium:
        name = next(iter(found.equilibrium))
    start = found.equilibrium[name] + small
    period = 2 * math.pi / found.modes[0].omega
    run = ml.simulate(
        "slider_crank", **{f"{name}_0": start, f"{name}_rate_0": 0.0}, duration=period, timestep=period / 2000
    )
    # amplitude 1e-4: the frequency shifts by its square; loops of the engine are soft to 1e-8
    assert run.at(name, period) - found.equilibrium[name] == pytest.approx(small, rel=1e-3)
    assert run.at(name, period / 2) - found.equilibrium[name] == pytest.approx(-small, rel=1e-2)


def test_a_steady_motion_is_refused_with_a_sentence() -> None:
    with pytest.raises(NoSolution, match="servo on crank_angle follows a motion"):
        ml.modes("fourbar", scene="driven-crank")
    with pytest.raises(NoSolution, match="no equilibrium at rest"):
        b = Builder("pushed", gravity=(0.0, 0.0, 0.0))
        b.body("rotor", revolute("turn"), inertia=Inertia.axial(1.0, 0.1, 0.05))
        ml.modes(b.build(), turn_force=1.0)
    with pytest.raises(MechlabError, match="turn_rate_0|crank_angle_rate_0"):
        ml.modes("fourbar", crank_angle_rate_0=1.0)


def test_a_singular_rest_is_not_linearised() -> None:
    """A parallelogram folded flat: two motions branch there."""
    b = Builder("flat", gravity=(0.0, 0.0, 0.0))
    b.bar("crank", revolute("a", "z"), 0.2).bar("rocker", revolute("c", "z"), 0.2, at=(0.5, 0.0, 0.0))
    b.bar("coupler", revolute("b", "z"), 0.5, parent="crank", at=(0.2, 0.0, 0.0))
    b.loop("pin", "coupler", "rocker", (0.5, 0.0, 0.0), (0.2, 0.0, 0.0))
    with pytest.raises(Untrustworthy, match="singular"):
        ml.modes(b.build())


def test_a_difference_between_witnesses_is_not_hidden() -> None:
    found = ml.modes("pendulum")
    wrong = replace(found.modes[0], omega=3.2, eigenvalues=(3.2j, -3.2j))
    (gap, share, _), *_ = eigenvalue_gaps(found.modes, (wrong,))
    assert gap == pytest.approx(3.2 - math.sqrt(9.81), rel=1e-6) and share > 1e-3
    doubtful = replace(
        found, witnesses={**found.witnesses, "mujoco": replace(found.witnesses["mujoco"], modes=(wrong,))}
    )
    assert doubtful.exit_code == 3 and "do not trust" in doubtful.message
    assert eigenvalue_gaps(found.modes, ())[-1][0] == math.inf


def test_the_motion_of_the_modes_stays_closed_and_starts_at_rest(tmp_path: Path) -> None:
    found = ml.modes("fourbar", free=True, out=tmp_path)
    run = mode_motion(found)
    tree, constraints = TreeKinematics(found.mechanism), ConstraintSet(found.mechanism)
    assert max(np.max(np.abs(constraints.residual(tree.set(q)))) for q in run.q) < 1e-11
    np.testing.assert_allclose(run.q[0], found.q)
    np.testing.assert_allclose(run.q[-1], found.q, atol=1e-12)
    assert 0.05 < np.ptp(run.channel("crank_angle")) < 1.5
    document = json.loads((tmp_path / "modes.json").read_text())
    assert {"equilibrium", "residual", "modes", "answers", "max_difference"} <= set(document)
    assert {"frequency_hz", "omega", "damping", "kind", "shape"} <= set(document["modes"][0])
    assert (tmp_path / "modes.html").stat().st_size > 1e5 and ml.load_recording(tmp_path / "modes.npz").t[-1] == run.t[
        -1
    ]
    with pytest.raises(MechlabError, match="mode 7 does not exist"):
        mode_motion(found, [7])


def test_a_wheel_balanced_on_its_axis_rests_anywhere() -> None:
    """Where the axis goes through the centre of mass, the only unbalanced torque is rounding of the weight, about 1e-17 N m."""
    b = Builder("wheel")
    axis = np.array((0.48, 0.6, 0.64))
    inertia = Inertia(0.3, tuple(0.07 * axis), (1e-4, 2e-4, 2.5e-4, 0.0, 0.0, 0.0))
    found = ml.modes(b.body("wheel", revolute("turn", axis=tuple(axis)), at=(0.013, 0.11, 0.029), inertia=inertia).build())
    assert [m.kind for m in found.modes] == ["rigid"]
    assert found.exit_code == 0


def test_the_witnesses_answer_for_the_same_rest_of_a_family() -> None:
    """At rest the pan and one wrist axis are vertical: any angle of them is a rest, and each has frequencies of its own."""
    b, parent = Builder("arm"), "ground"
    links = [
        ("pan", "z", (0.0, 0.0, 0.1), (0.0, 0.0, 0.0)), ("lift", "y", (0.0, 0.1, 0.0), (0.0, 0.0, 0.2)),
        ("elbow", "y", (0.0, -0.1, 0.4), (0.0, 0.0, 0.2)), ("wrist_1", "y", (0.0, 0.0, 0.4), (0.0, 0.1, 0.0)),
        ("wrist_2", "z", (0.0, 0.1, 0.0), (0.0, 0.0, 0.1)), ("wrist_3", "y", (0.0, 0.0, 0.1), (0.0, 0.1, 0.0)),
    ]  # fmt: skip
    for k, (name, axis, at, com) in enumerate(links):
        inertia = Inertia.axial(3.0 - 0.5 * k, 0.01, 0.02, com=com)
        b.body(f"{name}_link", revolute(name, axis), parent=parent, at=at, inertia=inertia)
        parent = f"{name}_link"
    found = ml.modes(b.build(), wrist_2_0=0.5)
    assert [m.kind for m in found.modes].count("rigid") == 2
    # in one pose rounding is left, 1e-13; the rests of two descents differ by their rounding, grown along the family: 2e-6
    assert found.exit_code == 0 and found.relative_difference is not None and found.relative_difference < 1e-9


@pytest.mark.parametrize("tilt", [1e-2, 1e-4, 1e-6])
def test_the_stated_error_of_a_soft_mode_covers_its_distance_from_the_closed_form(tilt: float) -> None:
    """omega^2 = m g l sin(tilt) / (I + m l^2) about an axis tilted from the vertical, beside a load 1e5 times heavier."""
    x, z = math.cos(tilt), math.sin(tilt)
    b = Builder("gate")
    b.body("gate", revolute("swing", (z, 0.0, x)), inertia=Inertia.axial(0.1, 1e-3, 1e-3, com=(0.1 * x, 0.0, -0.1 * z)))
    b.body("weight", revolute("heavy", "y"), inertia=Inertia.axial(1e4, 1.0, 1.0, com=(0.0, 0.0, -1.0)))
    found = ml.modes(b.build())
    truth = math.sqrt(0.1 * 9.81 * 0.1 * math.sin(tilt) / (1e-3 + 0.1 * 0.01))
    for witness in found.answering.values():
        soft = min(witness.modes, key=lambda m: m.omega)
        if soft.kind != "rigid":
            assert abs(soft.omega - truth) <= soft.error
        else:
            assert truth <= soft.error
    assert found.exit_code == 0


def test_a_floating_base_is_named_with_the_weld_that_holds_it() -> None:
    b = Builder("hopper")
    b.body("trunk", *floating("base"), inertia=Inertia.axial(3.0, 0.1, 0.1))
    b.body("leg", revolute("hip", "y"), parent="trunk", inertia=Inertia.axial(1.0, 0.01, 0.01, com=(0.0, 0.0, -0.2)))
    with pytest.raises(NoSolution, match=r"nothing carries trunk .*39\.24 N.*change_body\('trunk', joints=\(\)\)"):
        ml.modes(b.build())
    b.change_body("trunk", joints=())
    (mode,) = ml.modes(b.build()).modes
    assert mode.omega == pytest.approx(math.sqrt(9.81 * 0.2 / (0.01 + 0.04)), rel=1e-9)


def test_a_base_on_a_spring_does_not_fall() -> None:
    b = Builder("scales", gravity=(0.0, 0.0, -10.0))
    b.body("pan", prismatic("z", "z", stiffness=200.0), inertia=Inertia.axial(2.0, 0.1, 0.1))
    found = ml.modes(b.build())
    assert found.equilibrium["z"] == pytest.approx(-0.1) and found.modes[0].omega == pytest.approx(10.0)


def test_a_cam_at_the_beginning_of_its_rise_has_the_frequency_of_its_drive() -> None:
    """There f' = f'' = 0 and f''' jumps: omega^2 = c / J with the drive's 50 N m/rad and J = m r^2 / 2 of the cam (2 kg, 40 mm). The
    difference quotients are of first order across the kink, and each witness states it."""
    found = ml.modes("cam_follower")
    exact = math.sqrt(50.0 / (0.5 * 2.0 * 0.04**2))
    for witness in found.witnesses.values():
        (mode,) = witness.modes
        # error: of the eigenvalues; of a mode with .88 of critical damping omega moves less than they do
        assert abs(mode.omega - exact) < max(1e-9 * exact, mode.error) < 1e-4 * exact
    assert found.exit_code == 0 and not any("jumps" in n for n in found.notes)


def test_a_jump_of_the_second_derivative_at_the_rest_is_noted() -> None:
    """Simple harmonic rise: f'' = h pi^2 / (2 beta^2) begins at once. The spring's V = k (f + h)^2 / 2 adds k h f'' on one side."""
    found = ml.modes("cam_follower", law="harmonic")
    c = 50.0 + 0.5 * 2000.0 * 0.02 * 0.02 * math.pi**2 / (2.0 * 2.0**2)
    assert found.modes[0].omega == pytest.approx(math.sqrt(c / (0.5 * 2.0 * 0.04**2)), rel=1e-6)
    assert any("jumps at cam = 0" in n for n in found.notes)
