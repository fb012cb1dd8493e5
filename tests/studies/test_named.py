"""Named numbers of a design: reductions against closed forms, answers at many points in parts, forces by two engines."""

import math

import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.protocol import engine
from mechlab.errors import EngineMissing, MechlabError, NoSolution
from mechlab.experiment.question import Answer
from mechlab.mechanism import Status
from mechlab.studies.named.answers import answer_in_parts, nodes_at
from mechlab.studies.named.number import OF_COURSE, OF_TIME, reduced, reduced_finite


def test_reductions_of_a_sine_over_uneven_times() -> None:
    """Over a whole period a + b sin has the mean a and the rms sqrt(a^2 + b^2 / 2)."""
    t = np.sort(np.concatenate([np.linspace(0.0, 2.0 * np.pi, 4001), np.linspace(1.0, 1.5, 777)]))
    x = -1.0 + 3.0 * np.sin(t)
    expected = {
        "final": -1.0, "max": 2.0, "largest": 2.0, "min": -4.0, "least": -4.0, "peak": 4.0, "span": 6.0,
        "mean": -1.0, "rms": math.sqrt(1.0 + 4.5),
    }  # fmt: skip
    assert set(expected) == {*OF_TIME, *OF_COURSE}
    for how, value in expected.items():
        assert reduced(how, t, x) == pytest.approx(value, abs=2e-6)  # trapezoid: b h^2 / 12 with h = 1.6e-3


def test_reductions_skip_gaps_only_where_they_are_asked_to() -> None:
    t, x = np.array([0.0, 1.0, 2.0, 3.0]), np.array([1.0, 5.0, 3.0, np.nan])
    assert math.isnan(reduced("final", t, x)) and reduced_finite("final", t, x) == 3.0
    assert reduced_finite("mean", t, x) == (3.0 + 4.0) / 2.0
    with pytest.raises(MechlabError, match="no finite value"):
        reduced_finite("peak", t, np.full(4, np.inf))
    with pytest.raises(MechlabError, match="a rms over time needs a run that lasts"):
        reduced("rms", t[:1], x[:1])


@pytest.mark.parametrize("says_which", [True, False])
def test_every_point_is_taken_or_refused_once(says_which: bool) -> None:
    """The square root of x exists for x >= 0; at x > 9 the witness raises."""
    x = np.array([4.0, -1.0, 0.0, 16.0, 9.0, -2.0, 1.0, 25.0, 2.25, 6.25, -3.0])
    found: dict[int, object] = {}
    asked = []

    def keep(points: np.ndarray, values: object) -> None:
        for k, value in zip(points.tolist(), np.broadcast_to(np.asarray(values), points.shape), strict=True):
            assert k not in found
            found[k] = value if isinstance(value, str) else float(value)

    def ask(points: np.ndarray) -> Answer:
        asked.append(len(points))
        here = np.asarray(nodes_at({"x": x}, points)["x"])
        if np.any(here > 9.0):
            raise NoSolution("too large")
        if np.any(here < 0.0):
            return Answer(status=Status.OUT_OF_REACH, solved=here >= 0.0 if says_which else None)
        return Answer({"root": np.sqrt(here)})

    answer_in_parts(
        np.arange(len(x)), ask, lambda answer: "root" in answer.values,
        lambda points, answer: keep(points, answer.values["root"]),
        lambda points, answer: keep(points, answer.status.value),
        lambda points, cause: keep(points, str(cause)),
    )  # fmt: skip
    expected = ["too large" if a > 9.0 else Status.OUT_OF_REACH.value if a < 0.0 else math.sqrt(a) for a in x]
    assert [found[k] for k in range(len(x))] == expected
    assert max(asked) == len(x)


def test_a_missing_engine_ends_the_search_for_parts() -> None:
    def ask(points: np.ndarray) -> Answer:
        raise EngineMissing("not installed")

    seen: list[int] = []

    def refuse(points: np.ndarray, answer: Answer) -> None:
        raise AssertionError(answer)

    answer_in_parts(np.arange(8), ask, lambda _: True, refuse, refuse, lambda points, cause: seen.append(len(points)))
    assert seen == [8]


def test_both_engines_need_the_same_forces_for_a_motion() -> None:
    m = ml.load("fourbar").mechanism()
    found = ml.cycle("fourbar", crank_angle_rate=7.0, points=72)
    names = m.scalar_names
    q = np.array([found[n] - m.zero(n) for n in names]).T[:, : m.nq]
    v = np.array([found[f"{n}_rate"] for n in names]).T[:, : m.nv]
    first, second = (
        engine(w).motion_forces(m, q, v, "crank_angle", 2.0, np.zeros(m.nv)) for w in ("pinocchio", "mujoco")
    )
    # both solve the same rigid equations densely: rounding of forces of up to 1e2 N
    assert second.drive == pytest.approx(first.drive, abs=1e-9)
    for name, forces in second.loops.items():
        assert forces[:, :3] == pytest.approx(first.loops[name][:, :3], abs=1e-9)
    for name, wrenches in second.joints.items():
        assert wrenches == pytest.approx(first.joints[name], abs=1e-9)
    # at a constant rate the energy is the same after a turn: the work of the drive over it vanishes
    even = engine("pinocchio").motion_forces(m, q, v, "crank_angle", 0.0, np.zeros(m.nv)).drive[:-1]
    assert np.max(np.abs(even)) > 1e-3
    assert abs(float(np.mean(even))) < 1e-9 * float(np.max(np.abs(even)))  # 72 points: the sum converges exponentially
    with pytest.raises(MechlabError, match="numpy answers for no reactions"):
        engine("numpy").motion_forces(m, q, v, "crank_angle", 2.0, np.zeros(m.nv))
