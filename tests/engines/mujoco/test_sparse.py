"""Sparse steps: allowed only where accelerations are those of a dense solve with numpy, and no other constraint can appear."""

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mechlab as ml
from mechlab.analytic.benchmarks.planar import ParallelogramChain
from mechlab.catalog import entry
from mechlab.engines.mujoco import runner
from mechlab.engines.mujoco.closure import constraint_jacobian
from mechlab.engines.mujoco.model import to_mujoco
from mechlab.engines.mujoco.sparse import sparse_is_right, sparse_steps
from mechlab.engines.mujoco.stepping import grid, sparsely, take_steps
from mechlab.experiment.scene import Scene, Settings

DENSE = mujoco.mjtJacobian.mjJAC_DENSE


def random_text(seed: int) -> str:
    """A random tree of 62 to 74 hinges with point closures and tendons that couple several hinges."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(62, 75))
    parents = [-1] + [int(rng.integers(max(-1, k - 6), k)) for k in range(1, n)]

    def body(k: int) -> str:
        x, y, z = rng.normal(size=3)
        a = rng.normal(size=3)
        children = "".join(body(c) for c in range(n) if parents[c] == k)
        return (
            f'<body pos="{x} {y} {z}" name="b{k}"><joint name="j{k}" axis="{a[0]} {a[1]} {a[2]}"/>'
            f'<inertial pos=".1 0 0" mass="1" diaginertia=".1 .1 .1"/>{children}</body>'
        )

    bodies = "".join(body(c) for c in range(n) if parents[c] == -1)
    tendons = equalities = ""
    for i in range(int(rng.integers(3, 12))):
        joints = rng.choice(n, size=int(rng.integers(2, 5)), replace=False)
        terms = "".join(f'<joint joint="j{j}" coef="{rng.normal()}"/>' for j in joints)
        tendons += f'<fixed name="t{i}">{terms}</fixed>'
        equalities += f'<tendon tendon1="t{i}"/>'
    for _ in range(int(rng.integers(1, 8))):
        a, b = rng.choice(n, size=2, replace=False)
        equalities += f'<connect body1="b{a}" body2="b{b}" anchor="0 0 0"/>'
    return (
        f'<mujoco><option timestep="1e-3" jacobian="dense"/><worldbody>{bodies}</worldbody>'
        f"<tendon>{tendons}</tendon><equality>{equalities}</equality></mujoco>"
    )


def dense_acceleration(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """(M + J^T D J) a = M a_smooth + J^T D a_ref: the minimum that MuJoCo's solvers look for, with equalities alone."""
    model.opt.jacobian = DENSE
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    rows = constraint_jacobian(model, data)
    weighted = rows.T * data.efc_D
    return np.linalg.solve(mass + weighted @ rows, mass @ data.qacc_smooth + weighted @ data.efc_aref)


def sparse_acceleration(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    with sparse_steps(model):
        data.qacc_warmstart[:] = 0.0
        mujoco.mj_forward(model, data)
    return data.qacc.copy()


@pytest.mark.parametrize("seed", [3, 40, 41, 63, 148, 0, 1, 2, 5])
def test_sparse_is_allowed_only_where_it_gives_the_dense_acceleration(seed: int) -> None:
    """With MuJoCo 4.0.0 the sparse accelerations of the first five are off by 0.9 to 2.5 of the largest."""
    model = mujoco.MjModel.from_xml_string(random_text(seed))
    data = mujoco.MjData(model)
    data.qvel[:] = np.random.default_rng(1).normal(size=model.nv)
    allowed = sparse_is_right(model, data)
    wanted = dense_acceleration(model, data)
    off = np.max(np.abs(sparse_acceleration(model, data) - wanted)) / np.max(np.abs(wanted))
    if allowed:
        assert off < 1e-8  # the condition of these random matrices is up to 1e8
    if off > 1e-3:
        assert not allowed


def test_a_large_chain_of_four_bars_is_stepped_alike() -> None:
    """Two hundred steps of 121 rates; rounding of 1e-13 a step grows at most a thousandfold."""
    found = entry("n_fourbar")
    mechanism = found.build(found.parameters(N=60), "full")
    ends = []
    for step in (take_steps, sparsely()):
        model, data = to_mujoco(mechanism)
        data.qvel[:] = np.where([j.name.startswith("rocker") for j in mechanism.joints], -1.0, 1.0)
        assert sparse_is_right(model, data)
        step(model, data, grid(0.2, 1e-3), 0, 200)
        assert model.opt.jacobian == DENSE
        ends.append(data.qpos.copy())
    assert np.max(np.abs(ends[0])) > 0.1
    assert np.max(np.abs(ends[0] - ends[1])) < 1e-10


@pytest.mark.parametrize(
    "change",
    ['<joint range="-1 1" limited="true"/>', '<joint frictionloss="0.1"/>', '<geom contype="1" conaffinity="1"/>'],
)
def test_rows_that_come_and_go_keep_the_dense_jacobian(change: str) -> None:
    body = '<body><joint/><geom type="sphere" size=".1" contype="0" conaffinity="0"/>'
    if "geom" in change:
        body = '<body><joint/><geom type="sphere" size=".1"/>'
    text = f'<mujoco><default>{change}</default><worldbody>{body * 70}{"</body>" * 70}</worldbody></mujoco>'
    model = mujoco.MjModel.from_xml_string(text)
    assert not sparse_is_right(model, mujoco.MjData(model))
    plain = '<body><joint/><geom type="sphere" size=".1" contype="0" conaffinity="0"/>'
    free = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{plain * 70}{'</body>' * 70}</worldbody></mujoco>")
    assert sparse_is_right(free, mujoco.MjData(free))


def test_small_models_stay_dense() -> None:
    model, data = to_mujoco(entry("fourbar").build(entry("fourbar").parameters(), "minimal"))
    assert not sparse_is_right(model, data)


def test_a_recorded_large_chain_is_that_of_its_one_freedom(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every sample of 40 parallelograms: against the equation of their one freedom, and all channels against dense rows."""
    found = entry("n_fourbar")
    p = found.parameters(N=40, duration=0.2)
    mechanism = found.build(p, "full")
    scene = Scene("fall", "full", 0.2, initial_rates={f"rocker_{k}": -1.0 for k in range(41)}, settings=Settings(timestep=1e-3))
    run = runner.run(mechanism, scene)
    own = ParallelogramChain(p.N, p.rocker_length, p.rocker_mass, p.coupler_mass, p.gravity)
    sign = np.array([-1.0 if j.name.startswith("rocker") else 1.0 for j in mechanism.joints])
    exact = solve_ivp(own.slope, (0.0, 0.2), [0.0, 1.0], t_eval=run.t, method="DOP853", rtol=1e-12, atol=1e-13).y
    # the rows are hard to 1e-4 of the forces: 4e-9 rad at this step in half a second
    assert np.max(np.abs(run.q - exact[0][:, None] * sign)) < 1e-8
    bent = np.array([own.slope(t, y)[1] for t, y in zip(run.t, exact.T, strict=True)])
    for joint, s in (("rocker_0", -1.0), ("coupler_21", 1.0), ("rocker_40", -1.0)):
        assert run.channels[f"{joint}_accel"] == pytest.approx(s * bent, abs=1e-3 * np.max(np.abs(bent)))
    monkeypatch.setattr(runner, "sparse_is_right", lambda model, data: False)
    dense = runner.run(mechanism, scene)
    assert run.channels.keys() == dense.channels.keys()
    for name, values in dense.channels.items():
        # accelerations at a state agree to 1e-9, states after 200 steps to 1e-10
        assert run.channels[name] == pytest.approx(values, rel=1e-6, abs=1e-6), name


def test_a_session_of_a_large_chain_is_that_of_its_one_freedom() -> None:
    with ml.session("n_fourbar", N=40) as s:
        for _ in range(20):
            s.step()
        assert s.model.opt.jacobian == DENSE
        q, t = s.state[0], s.time
    p = entry("n_fourbar").parameters(N=40)
    own = ParallelogramChain(p.N, p.rocker_length, p.rocker_mass, p.coupler_mass, p.gravity)
    exact = solve_ivp(own.slope, (0.0, t), [0.0, p.start_speed], method="DOP853", rtol=1e-12, atol=1e-13).y[0, -1]
    # the rows are hard to 1e-4 of the forces: 4e-9 rad at twice this step in half a second
    assert np.abs(q) == pytest.approx(np.full(81, exact), abs=1e-8)
