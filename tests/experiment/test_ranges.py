"""Joints at and beyond the end of their range: what each engine says of a rod that falls from the horizontal."""

import pytest

import mechlab as ml


def swing(low: float, high: float) -> ml.Mechanism:
    """A rod that starts along x at angle 0 under gravity along -y: it falls to negative angles, towards -pi/2 and beyond."""
    b = ml.Builder("swing", gravity=(0.0, -9.81, 0.0))
    b.body("rod", ml.revolute("angle", range=(low, high)), inertia=ml.Inertia.point(1.0, (0.3, 0.0, 0.0)))
    b.frame("tip", "rod", (0.3, 0.0, 0.0))
    return b.build()


def said(run: ml.Recording) -> dict[str, tuple[str, float]]:
    return {f.name: (f.severity, f.value) for f in run.health.findings if f.name.startswith("range")}


@pytest.mark.parametrize("how", [{"engine": "pinocchio"}, {"max_error": 1e-4, "engine": "pinocchio"}], ids=["steps", "max_error"])
def test_an_engine_without_stops_says_what_went_through_the_end(how: dict[str, object]) -> None:
    run = ml.simulate(swing(-0.5, 3.0), duration=0.4, **how)  # type: ignore[arg-type]
    deepest = -float(run["angle"].min()) - 0.5
    assert deepest > 0.1
    severity, value = said(run)["range"]
    # 5 %: the channel may hold finer samples
    assert severity == "error" and not run.health.trusted and value == pytest.approx(deepest, rel=0.05)
    assert "no stops" in next(f.sentence for f in run.health.findings if f.name == "range")


def test_a_range_that_is_kept_is_no_finding() -> None:
    assert said(ml.simulate(swing(-3.2, 3.0), duration=0.4, engine="pinocchio")) == {}
    assert said(ml.simulate(swing(-3.2, 3.0), duration=0.4)) == {}


def test_a_start_beyond_the_end_is_named_with_its_distance() -> None:
    run = ml.simulate(swing(0.2, 3.0), duration=0.05)
    assert said(run)["range_start"] == ("warning", pytest.approx(0.2, abs=1e-12))
    assert "angle_0=" in next(f.sentence for f in run.health.findings if f.name == "range_start")


def test_the_error_of_a_joint_that_its_stop_throws_back_names_the_stop() -> None:
    """A smaller timestep does not help; from inside the range the timestep is what is wrong."""

    def advice(m: ml.Mechanism, **how: float) -> str:
        run = ml.simulate(m, duration=0.3, timestep=0.02, **how)
        return next(f.sentence for f in run.health.findings if f.name == "step_error" and f.severity == "error")

    thrown = advice(swing(0.2, 3.0))
    assert "angle starts beyond the end" in thrown and "angle_0=" in thrown and "smaller timestep" not in thrown
    assert "smaller timestep" in advice(swing(-3.0, 3.0), angle_rate_0=30.0)
