"""Units of channels: a shaft over slides alone is a length, in every engine, observation and drive."""

import pytest

import mechlab as ml


def elevator() -> ml.Mechanism:
    """Two sliding blocks of 1 kg; a shaft, the sum of their ways, is driven by 3 N."""
    b = ml.Builder("elevator", gravity=(0.0, 0.0, 0.0))
    for name in "ab":
        b.body(f"block_{name}", ml.prismatic(name, "x"), inertia=ml.Inertia(1.0, tensor=(1, 1, 1, 0, 0, 0)))
    b.shaft("cable", {"a": 1, "b": 1})
    b.drive("cable")
    return b.build()


@pytest.mark.parametrize("engine", ["mujoco", "pinocchio"])
def test_a_shaft_over_slides_is_a_length(engine: str) -> None:
    run = ml.simulate(elevator(), cable_force=3.0, duration=0.5, engine=engine)
    assert [run.units[f"cable{x}"] for x in ("", "_rate", "_accel", "_force")] == ["m", "m/s", "m/s2", "N"]
    assert run["cable"][-1] == pytest.approx(2 * 0.5 * 3.0 * 0.5**2, rel=1e-6)  # each block by F t^2 / 2
    assert "constant force 3 N on cable" in run.acts


def test_a_session_commands_it_in_newton() -> None:
    with ml.session(elevator(), observe=["cable", "cable_rate"]) as s:
        assert (s.action_units, s.observation_units) == (("N",), ("m", "m/s"))
        s.step([3.0])
