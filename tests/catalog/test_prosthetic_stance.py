"""The leg in stance: springs fitted to a stated stiffness, rest on the floor by hand, by engines, and at the end of a damped run."""

import numpy as np
import pytest

from mechlab import api
from mechlab.catalog.prosthetic_leg.build import Parameters, body
from mechlab.catalog.prosthetic_leg.stance import at_rest, statics
from mechlab.cli import main
from mechlab.engines.protocol import WITNESSES
from mechlab.errors import MechlabError, NoSolution


def test_springs_fitted_to_a_stiffness() -> None:
    """In series they have the stated stiffness; their shares stay."""
    p = Parameters(stance_stiffness=25e3)
    fitted = np.array(p.fitted_springs)
    assert 1.0 / (1.0 / fitted).sum() == pytest.approx(25e3, rel=1e-14)
    np.testing.assert_allclose(fitted / fitted[0], np.array([2e4, 2e5, 1.5e5]) / 2e4, rtol=1e-14)
    assert Parameters().fitted_springs == (2e4, 2e5, 1.5e5)
    with pytest.raises(MechlabError, match="above 0"):
        _ = Parameters(stance_stiffness=1e4, C_thigh=0.0).fitted_springs


@pytest.mark.parametrize(("stated", "load"), [(0.0, 0.0), (25e3, 300.0), (12e3, -200.0), (0.0, 800.0)])
def test_rest_by_hand_and_by_engines(stated: float, load: float) -> None:
    """Each slide carries the weight above it; the engines find the stated stiffness by another newton."""
    found = api.solve("prosthetic_leg", stance_load=load, stance_stiffness=stated)
    p = Parameters(stance_stiffness=stated)
    b = body(p)
    trunk, thigh, shin = 0.678 * 75.0, 0.1 * 75.0, 0.0465 * 75.0
    assert (b.trunk.mass, b.thigh.mass, b.shin.mass) == pytest.approx((trunk, thigh, shin))
    above = load + 9.81 * np.array([trunk, trunk + 1.0 + thigh / 2.0, trunk + 1.0 + thigh + shin / 2.0])
    slides = above / p.fitted_springs * [1.0, -1.0, -1.0]
    stiffness = stated or 1.0 / (1 / 2e4 + 1 / 2e5 + 1 / 1.5e5)
    for name in ("analytic", *WITNESSES):
        values = found[name]
        np.testing.assert_allclose([values[n] for n in ("hitch", "thigh", "shin")], slides, atol=1e-9)
        # the locks of hip and knee let the leg lean by 1e-4 rad: of second order
        assert values["leg_stiffness"] == pytest.approx(stiffness, rel=1e-6)
        assert values["stiffness_on_floor"] < values["leg_stiffness"]
        # of first order in the lean, 4e-7 measured
        assert values["ankle"] == pytest.approx(found["pinocchio"]["ankle"], rel=1e-6)
        # the lean lowers the trunk in second order: 2.0e-8 m with 800 N measured
        assert values["trunk_z"] == pytest.approx(found["mujoco"]["trunk_z"], abs=4e-8)


def test_a_damped_run_ends_where_statics_say() -> None:
    rest = api.solve("prosthetic_leg", stance_load=0.0, stance_stiffness=25e3)["analytic"]
    final = api.simulate("prosthetic_leg", scene="stance", stance_stiffness=25e3, slider_damping=1500.0, timestep=5e-4).final()
    for name in ("trunk_z", "hitch", "thigh", "shin"):
        assert final[name] == pytest.approx(rest[name], abs=1e-6)
    # the foot still creeps forwards through the viscous grip of the floor, 0.6 s against the locks of hip and knee
    assert final["ankle"] == pytest.approx(rest["ankle"], abs=3e-4)


def test_the_load_at_which_the_leg_buckles() -> None:
    """By hand: thigh and shin of one length l, locks h (hip, in series with that of the trunk) and k (knee), a load P at the end:
    (h - 2 P l)(k - P l) = (P l)^2. Parts of the weight that act above the end, and the ankle, change this by 2 %."""
    p = Parameters()
    b = body(p)
    weight = p.gravity * (b.trunk.mass + b.hitch_mass + b.thigh.mass + b.shin.mass)
    low, high = 1000.0, 10000.0
    while high - low > 1.0:
        middle = 0.5 * (low + high)
        try:
            statics(p, middle)
            low = middle
        except NoSolution:
            high = middle
    length = 0.5 * (b.thigh.length + b.shin.length) - 0.5 * sum((low + weight) / np.array(p.fitted_springs[1:]))
    hip, knee = 1.0 / (1.0 / 5e3 + 1.0 / 5e4), 5e3
    assert low + weight == pytest.approx(min(np.roots([1.0, -hip - 2.0 * knee, hip * knee])) / length, rel=0.03)
    for name in WITNESSES:  # below it the engines stand, above they find no rest
        assert at_rest(name, p, 0.98 * low)[0]["ankle"] > 0.0
        with pytest.raises(NoSolution):
            at_rest(name, p, 1.05 * low)


@pytest.mark.parametrize(("keys", "word"),
                         [("stance_load=-5000", "nothing presses"), ("stance_load=0 C_shin=0", "without a spring"),
                          ("stance_load=5000", "it buckles"), ("stance_load=1e6", "more than 0.5 rad")])  # fmt: skip
def test_no_rest(keys: str, word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", "prosthetic_leg", *keys.split()]) == 4
    said = capsys.readouterr()
    assert word in said.out + said.err and "Traceback" not in said.err
