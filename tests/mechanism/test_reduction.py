"""Exact reduction: mass matrix against K^T M K and the closed form, names and values, looks, and what it refuses."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from mechlab.errors import MechlabError
from mechlab.mechanism import Builder, Inertia, Mechanism, Spring, TreeKinematics, revolute, shape
from mechlab.mechanism.angle_basis import dependent_angles
from mechlab.mechanism.geometry import axis_rotation
from mechlab.mechanism.reduction import Reduction, reduce
from mechlab.mechanism.statics import passive_force
from tests.mechanism.samples import fourbar, planetary
from tests.mechanism.trains import bevel_differential, closed_differential, disc, gearbox

TRAINS = {
    "closed differential": closed_differential(),
    "closed differential, one planet": closed_differential(1),
    "planetary": replace(planetary(3), gravity=(0.0, 0.0, -9.81)),  # along the axes: no work
    "bevel differential": bevel_differential(),
    "gearbox": gearbox(weld=True),
    "eccentric gear without gravity": gearbox(mass_offset=0.03),
    "balanced planets with gravity across": replace(planetary(3), gravity=(0.0, -9.81, 0.0)),
}


def closed_form() -> np.ndarray:
    """J of the specification, section 2, in (w1, w3)."""
    z1, z2, z3, z4, z5, z6 = 72, 18, 108, 18, 72, 162
    a, b = z1 / (z1 + z3), z4 / (z4 + z6)
    u1, u2 = np.array([a, 1 - a]), np.array([b, 1 - b])
    s2, s5 = np.array([-z1, z3]) / (2 * z2), np.array([-z4, z6]) / (2 * z5)
    out = (
        np.diag([0.03, 0.15]) + (0.02 + 3 * 0.3 * 0.04) * np.outer(u1, u1) + (0.02 + 3 * 4.0 * 0.04) * np.outer(u2, u2)
    )
    return out + 3 * 2.4e-4 * np.outer(s2, s2) + 3 * 0.0512 * np.outer(s5, s5)


def in_blocks(m: Mechanism, mass: np.ndarray) -> np.ndarray:
    """A mass matrix over the rates of blocks 14 and 36."""
    k = np.linalg.inv(np.array([m.row("block14"), m.row("block36")]))
    return k.T @ mass @ k


def states(r: Reduction, count: int = 5) -> list[tuple[np.ndarray, np.ndarray]]:
    rng = np.random.default_rng(2)
    q = rng.uniform(-3, 3, (count, r.mechanism.nv))
    return list(zip(q, r.expand(q), strict=True))


def matrix_between(r: Reduction) -> np.ndarray:
    """d(original coordinates) / d(reduced coordinates)."""
    return r.expand(np.eye(r.mechanism.nv)).T


@pytest.mark.parametrize("name", TRAINS)
def test_mass_matrix_is_that_of_the_train(name: str) -> None:
    original = TRAINS[name]
    r = reduce(original)
    k = matrix_between(r)
    assert not r.mechanism.relations and r.mechanism.nv == k.shape[1] == np.linalg.matrix_rank(k)
    for small, large in states(r):
        wanted = k.T @ TreeKinematics(original, large).mass_matrix() @ k
        got = TreeKinematics(r.mechanism, small).mass_matrix()
        assert np.max(np.abs(got - wanted)) < 1e-12 * np.max(np.abs(wanted))


@pytest.mark.parametrize("name", TRAINS)
def test_every_joint_keeps_its_name_and_value(name: str) -> None:
    original = TRAINS[name]
    r = reduce(original)
    for small, large in states(r):
        for n in original.scalar_names:
            assert float(r.mechanism.value(n, small)) == pytest.approx(float(original.value(n, large)), abs=1e-12)
        relations = [original.coefficient_row(x.coefficients) @ large for x in original.relations]
        assert np.max(np.abs(relations)) < 1e-12 * max(1.0, np.max(np.abs(large)))


@pytest.mark.parametrize("name", TRAINS)
def test_velocity_terms_springs_and_damping_are_the_same(name: str) -> None:
    original = TRAINS[name]
    r, rng = reduce(original), np.random.default_rng(4)
    k = matrix_between(r)
    for small, large in states(r):
        v = rng.standard_normal(r.mechanism.nv)
        a, b = TreeKinematics(r.mechanism, small, v), TreeKinematics(original, large, k @ v)
        assert np.allclose(a.bias_force(), k.T @ b.bias_force(), atol=1e-11)
        assert np.allclose(passive_force(a), k.T @ passive_force(b), rtol=1e-12, atol=1e-12)


def test_closed_differential_has_the_matrix_of_the_specification() -> None:
    r = reduce(TRAINS["closed differential"])
    got = in_blocks(r.mechanism, TreeKinematics(r.mechanism).mass_matrix())
    assert np.allclose(got, closed_form(), rtol=1e-12, atol=0)
    assert np.allclose(got, [[0.04924, 0.03252], [0.03252, 0.77604]], atol=5e-7)  # as printed there


def test_both_engines_keep_the_off_diagonal() -> None:
    """MuJoCo 4.0.0 drops the coupling of tendon armature between joints that are not nested; Pinocchio 4.1.0 is right."""
    from mechlab.engines.mujoco.model import MujocoMap, to_mujoco
    from mechlab.engines.mujoco.plant import MujocoPlant
    from mechlab.engines.pinocchio.dynamics import PinPlant

    m = reduce(TRAINS["closed differential"]).mechanism
    model, data = to_mujoco(m)
    mujoco = MujocoPlant(m, model, data, MujocoMap(m, model)).mass_matrix()
    pinocchio = PinPlant(m, m.reference(), np.zeros(m.nv)).mass_matrix()
    for mass in (mujoco, pinocchio):
        assert np.allclose(in_blocks(m, mass), closed_form(), rtol=1e-12, atol=0)


def test_constant_moments_run_as_the_specification_says() -> None:
    """S1: 100 and -200 N m from 100 and 50 rad/s for 0.5 s: (461.383100, -54.935543), DOP853 at 1e-12 in the specification."""
    from mechlab.engines.mujoco.runner import run
    from mechlab.experiment.laws import Constant
    from mechlab.experiment.scene import Scene

    laws = (Constant("H1", 100.0), Constant("H2", -200.0))
    scene = Scene("s1", "minimal", 0.5, laws, initial_rates={"H1": 100.0, "H2": 50.0})
    done = run(reduce(TRAINS["closed differential"]).mechanism, scene)
    assert done.channel("block14_rate")[-1] == pytest.approx(461.383100, abs=1e-6)
    assert done.channel("block36_rate")[-1] == pytest.approx(-54.935543, abs=1e-6)


def test_bevel_planet_counts_across_its_axis_too() -> None:
    """Cage at unit rate, side gears held to it: the planet does not spin, its moment across and m R^2 ride along."""
    for across in (0.5, 0.9):
        r = reduce(bevel_differential(across))
        m = r.mechanism
        k = np.linalg.inv(np.array([m.row("left"), m.row("cage")]))
        mass = k.T @ TreeKinematics(m).mass_matrix() @ k
        # left = cage = 1 gives right = 1: three side parts of 0.01 and the planet. com at R = 0.05 on its own axis (y).
        assert np.ones(2) @ mass @ np.ones(2) == pytest.approx(0.03 + across * 2e-3 + 0.4 * 0.05**2, rel=1e-12)


def test_angles_are_exact_fractions() -> None:
    basis = dependent_angles(closed_differential(1), ("block14", "block36"))
    assert basis.independent == ("block14", "block36")
    assert basis.rows["H1"] == (Fraction(72, 180), Fraction(108, 180))
    assert basis.rows["p5_0"] == (Fraction(-18, 144) - Fraction(18, 180), Fraction(162, 144) - Fraction(162, 180))
    assert dependent_angles(closed_differential(3)).rows["H1"][0].denominator < 1000


def test_any_independent_joints_give_the_same_motion() -> None:
    m = closed_differential(2)
    matrices = []
    for pair in (("H1", "H2"), ("block14", "block36"), ("H2", "block14"), ("block36", "H1")):
        reduced = reduce(m, pair).mechanism
        matrices.append(in_blocks(reduced, TreeKinematics(reduced).mass_matrix()))
    assert np.ptp(np.array(matrices), axis=0).max() < 1e-14


def test_pictures_stand_where_the_parts_stand() -> None:
    """Every shape of the original at a random pose: same place from the body or shaft of the reduced model."""
    b = Builder("train", gravity=(0, 0, 0))
    looks = lambda: [shape("cylinder", radius=0.01, length=0.03)]  # noqa: E731
    b.body("arm", revolute("arm"), at=(0.1, 0.2, 0), inertia=disc(1.0), shapes=looks())
    b.body("sun", revolute("sun", "-z"), at=(0.1, 0.2, 0), inertia=disc(0.1), shapes=looks())
    b.body("planet", revolute("planet", "-z"), parent="arm", at=(0.5, 0, 0), inertia=disc(0.1), shapes=looks())
    b.gears("mesh", "sun", "planet", (30, 20), carrier="arm")
    m = b.build()
    r = reduce(m)
    assert {j.name for j in r.mechanism.joints} == {"arm", "sun_on_arm"}
    for small, large in states(r):
        old, new = TreeKinematics(m, large), TreeKinematics(r.mechanism, small)
        seen = {n: old.matrix(n) for n in ("arm", "sun", "planet")}
        for body in r.mechanism.bodies:
            assert np.allclose(new.matrix(body.name), seen[body.name], atol=1e-12)
        planet = next(s for s in r.mechanism.shafts if s.name == "planet")
        turn = np.eye(4)
        turn[:3, :3] = axis_rotation((0, 0, 1), float(r.mechanism.value("planet", small)))
        drawn = new.matrix(planet.body) @ planet.placement.matrix() @ turn @ planet.shapes[0].placement.matrix()
        assert np.allclose(drawn, seen["planet"], atol=1e-12)


def two_carriers() -> Mechanism:
    b = Builder("nested", gravity=(0, 0, 0))
    b.body("arm", revolute("arm"), inertia=disc(1.0))
    b.body("crank", revolute("crank"), parent="arm", at=(0.3, 0, 0), inertia=disc(0.1))
    b.body("tip", revolute("tip"), parent="crank", at=(0.1, 0, 0), inertia=disc(0.1))
    b.relation("fixed_ratio", crank=1, tip=2)
    return b.build()


def beside() -> Mechanism:
    b = Builder("beside", gravity=(0, 0, 0))
    for k, name in enumerate(("a", "b")):
        b.body(name, revolute(name), at=(0.5 * k, 0, 0), inertia=disc(1.0))
    b.shaft("sum", {"a": 1, "b": 1})
    b.body("sum_gear", revolute("sum_gear"), at=(0.2, 0.3, 0), inertia=disc(0.1))
    b.relation("adds", sum_gear=1, a=-1, b=-1)
    return b.build()


def ranged() -> Mechanism:
    m = gearbox()
    limited = tuple(replace(b, joints=(replace(b.joints[0], range=(-1.0, 1.0)),)) for b in m.bodies)
    return replace(m, bodies=limited)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: gearbox(0.03, gravity=9.81), "gravity acts across the axis on body 'b'"),
        (lambda: bevel_differential(lopsided=True), "body 'planet' is not constant.*not rotationally symmetric"),
        (two_carriers, "body 'tip' is not constant.*carrier on a carrier"),
        (beside, "'b' and 'sum_gear' are coupled.*one path.*independent="),
        (lambda: fourbar(), "loop 'pin'|revolutes only"),
        (ranged, "has a range and becomes a shaft"),
        (lambda: replace(gearbox(), springs=(Spring("s", "a", "b", stiffness=1.0),)), "spring 's' acts between points"),
    ],
)  # fmt: skip
def test_refuses_where_it_is_not_exact(make: object, words: str) -> None:
    assert callable(make)
    with pytest.raises(MechlabError, match=words):
        reduce(make())


def test_eccentric_planet_is_refused() -> None:
    m = planetary(1)
    bodies = tuple(
        replace(b, inertia=Inertia.cylinder(1.0, 0.05, 0.02, com=(0.01, 0, 0))) if b.name == "planet_0" else b
        for b in m.bodies
    )
    with pytest.raises(
        MechlabError, match="'planet_0' is not constant: its centre of mass stands 0.01 m off its own axis"
    ):
        reduce(replace(m, bodies=bodies, gravity=(0.0, 0.0, 0.0)))


def test_wrong_coordinates_are_refused() -> None:
    m = gearbox()
    with pytest.raises(MechlabError, match="no set of coordinates.*'a' follows"):
        dependent_angles(m, ("a", "b"))
    with pytest.raises(MechlabError, match="does not exist"):
        reduce(m, ("x",))


def test_files_of_a_reduced_model_are_read_back() -> None:
    from mechlab.formats import from_json, to_json

    m = reduce(TRAINS["closed differential"]).mechanism
    assert from_json(to_json(m)) == m


def test_random_trains(count: int = 40) -> None:
    """Random tooth counts, inertias and senses of the axes: reduction and row reduction agree."""
    rng = np.random.default_rng(9)
    for _ in range(count):
        sun, planet = (int(x) for x in rng.integers(12, 60, 2))
        b = Builder("random", gravity=(0, 0, 0))
        axes = ["z" if x > 0 else "-z" for x in rng.standard_normal(4)]
        for name, axis in zip(("sun", "carrier", "ring"), axes, strict=False):
            b.body(
                name,
                revolute(name, axis, armature=float(rng.uniform(0, 0.1))),
                inertia=disc(float(10 ** rng.uniform(-5, 1))),
            )
        b.body("planet", revolute("planet", axes[3]), parent="carrier", at=(0.4, 0.1, 0), inertia=disc(1e-3, 0.2))
        b.gears("inner", "sun", "planet", (sun, planet), carrier="carrier")
        b.gears("outer", "ring", "planet", (sun + 2 * planet, planet), carrier="carrier", kind="internal")
        m = b.build()
        r = reduce(m)
        k = matrix_between(r)
        wanted = k.T @ TreeKinematics(m).mass_matrix() @ k
        got = TreeKinematics(r.mechanism).mass_matrix()
        assert np.max(np.abs(got - wanted)) < 1e-12 * np.max(np.abs(wanted))


@pytest.mark.parametrize("ring", ["held", "free"])
@pytest.mark.parametrize("fidelity", ["parts", "full"])
def test_agrees_with_a_minimal_model_written_by_hand(ring: str, fidelity: str) -> None:
    from mechlab.catalog import planetary_stage

    p = planetary_stage.Parameters(ring=ring)
    names = ("sun",) if ring == "held" else ("sun", "carrier")
    masses = []
    for m in (planetary_stage.build(p, "minimal"), reduce(planetary_stage.build(p, fidelity)).mechanism):
        k = np.linalg.inv(np.array([m.row(n) for n in names]))
        masses.append(k.T @ TreeKinematics(m).mass_matrix() @ k)
    assert np.allclose(*masses, rtol=1e-12, atol=0)
