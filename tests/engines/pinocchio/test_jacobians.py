"""Output Jacobians, rates and accelerations against finite differences along closed motions."""

import numpy as np
import pytest
from samples import fourbar, planetary, scara

from mechlab.engines.pinocchio.given_rates import accelerations_of, quantity_rates, rates
from mechlab.engines.pinocchio.inverse import assemble
from mechlab.engines.pinocchio.kinematics import frame_motion
from mechlab.engines.pinocchio.quantities import output_jacobian
from mechlab.errors import MechlabError, NoSolution
from mechlab.mechanism import TreeKinematics
from mechlab.mechanism.geometry import rotation_log


def pose(m, q, frame):
    tree = TreeKinematics(m, q)
    place = m.frame(frame)
    rotation, origin = tree.pose(place.body)
    return rotation @ place.placement.rotation, origin + rotation @ place.placement.translation


@pytest.mark.parametrize(("m", "frame"), [(fourbar(), "point"), (scara(), "tip")])
def test_output_jacobian_against_differences(m, frame):
    names = [d.on for d in m.drives]
    values = {n: float(m.value(n, m.reference())) for n in names}
    found = output_jacobian(m, m.reference(), frame)
    h = 1e-5
    for k, name in enumerate(names):
        (r1, p1), (r0, p0) = (pose(m, assemble(m, values | {name: values[name] + s * h}).q, frame) for s in (1, -1))
        expected = np.concatenate([(p1 - p0) / (2 * h), rotation_log(r1 @ r0.T) / (2 * h)])
        assert np.allclose(found.matrix[:, k], expected, atol=1e-8)
    assert found.free == 0 and found.singularities == ()
    assert np.allclose(found.inverse @ found.matrix, np.eye(len(names)), atol=1e-10)


def test_a_singular_arm_is_told():
    m = scara()
    q = assemble(m, {"shoulder": 0.3, "elbow": 0.0}, keep_mode=False).q
    found = output_jacobian(m, q, "tip")
    arm = found.matrix[:2]
    assert np.linalg.matrix_rank(arm, tol=1e-9) == 1
    assert np.isfinite(found.condition)  # the turning of the tip still tells the two drives apart


def test_rates_and_accelerations_along_a_motion():
    m = fourbar()
    w, e, h = 3.0, -2.0, 1e-4

    def at(t):
        return assemble(m, {"crank_angle": 1.2 + w * t + e * t * t / 2}, steps=10).q

    q = at(0.0)
    v = rates(m, q, {"crank_angle": w})
    a = accelerations_of(m, q, v, {"crank_angle": e})
    assert np.allclose(v, (at(h) - at(-h)) / (2 * h), atol=1e-6)
    assert np.allclose(a, (at(h) - 2 * q + at(-h)) / h**2, atol=1e-4)
    first, second = quantity_rates(m, q, v, a, ["rocker_angle", "point_x", "point_wz"])
    p = [pose(m, at(s * h), "point")[1][0] for s in (-1, 0, 1)]
    assert first["point_x"] == pytest.approx((p[2] - p[0]) / (2 * h), abs=1e-6)
    assert second["point_x"] == pytest.approx((p[2] - 2 * p[1] + p[0]) / h**2, abs=1e-4)
    assert first["rocker_angle"] == v[2]
    assert first["point_wz"] == pytest.approx(v[0] + v[1], abs=1e-12)
    _, twist, acceleration = frame_motion(m, "point", q, v, a)
    assert twist[0] == pytest.approx(first["point_x"]) and acceleration[0] == pytest.approx(second["point_x"])
    back = rates(m, q, {"point_x": first["point_x"]})
    assert np.allclose(back, v, atol=1e-9)


def test_contradicting_rates_are_refused():
    m = fourbar()
    with pytest.raises(NoSolution, match="no rates of the mechanism agree"):
        rates(m, m.reference(), {"crank_angle": 1.0, "rocker_angle": 1.0})
    with pytest.raises(NoSolution, match="no accelerations"):
        accelerations_of(m, m.reference(), np.zeros(3), {"crank_angle": 1.0, "rocker_angle": 10.0})
    with pytest.raises(MechlabError, match="does not exist"):
        rates(m, m.reference(), {"crank": 1.0})
    with pytest.raises(MechlabError, match="no drives"):
        output_jacobian(planetary(), np.zeros(6), "x")
