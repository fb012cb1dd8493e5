"""Each script of examples/ runs, and its mechanism agrees with a second derivation, other than the formula that the script prints."""

from __future__ import annotations

import math
import re
import runpy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mechlab as ml

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "examples"
FUNCTIONS = {
    "six_bar": "shaper",
    "peaucellier": "inversor",
    "double_cardan": "drive_line",
    "car_differential": "differential",
    "stewart_platform": "platform",
    "palletizer": "palletizer",
    "ravigneaux": "ravigneaux",
    "motor_and_friction": "pump",
    "biped_leg": "leg",
    "gripper": "gripper",
}
NUMBER = r"-?\d+\.\d+(?:e[-+]\d+)?"
SOLVED = 1e-9
"""Positions [m, rad] are solved until the loops close to 1e-12; the matrices of these linkages make 1e3 of it at most."""


def names_of(name: str) -> dict[str, Any]:
    """The functions of an example, without what it prints."""
    return runpy.run_path(str(FOLDER / f"{name}.py"))


def printed(name: str, capsys: pytest.CaptureFixture[str]) -> dict[str, list[float]]:
    """Runs an example as `python examples/NAME.py` does; first word of a line -> the last numbers that such lines print."""
    runpy.run_path(str(FOLDER / f"{name}.py"), run_name="__main__")
    lines = capsys.readouterr().out.splitlines()
    assert 2 <= len(lines) <= 12
    return {line.split(" ")[0]: [float(x) for x in re.findall(NUMBER, line)] for line in lines}


def answers(source: ml.Mechanism, **given: float) -> list[Mapping[str, Any]]:
    """Pinocchio's and MuJoCo's answers."""
    found = ml.solve(source, given)
    return [found["pinocchio"], found["mujoco"]]


def test_all_are_listed_and_load() -> None:
    assert {p.stem for p in FOLDER.glob("*.py")} == FUNCTIONS.keys()
    page = (ROOT / "docs" / "howto" / "examples.md").read_text(encoding="utf-8")
    for name, function in FUNCTIONS.items():
        assert f"examples/{name}.py" in page
        assert ml.load(f"{FOLDER / name}.py:{function}").structure().freedoms >= 1


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_script_is_short(name: str) -> None:
    assert 20 <= len((FOLDER / f"{name}.py").read_text(encoding="utf-8").splitlines()) <= 70


def test_shaper(capsys: pytest.CaptureFixture[str]) -> None:
    """Rates of the arm at mid-stroke: the die moves across the arm with crank x rate, at d +- r from the pivot."""
    shown = printed("six_bar", capsys)
    assert shown["pinocchio"] == pytest.approx(shown["by"][:1], abs=1e-8)  # nine digits are printed
    m = names_of("six_bar")["shaper"]()
    for angle, expected in ((math.pi / 2, 0.1 / 0.35), (-math.pi / 2, -0.1 / 0.15)):
        for got in answers(m, crank_angle=angle, crank_angle_rate=1.0):
            assert float(got["arm_angle_rate"]) == pytest.approx(expected, abs=SOLVED)
            assert float(got["ram_x_rate"]) == pytest.approx(-0.5 * expected, abs=SOLVED)  # the arm is upright: its end goes level


def test_peaucellier(capsys: pytest.CaptureFixture[str]) -> None:
    """O, A and P in line: y of P is the line's distance times the slope of O-A, half of the crank's angle."""
    printed("peaucellier", capsys)
    m = names_of("peaucellier")["inversor"]()
    line = (0.25**2 - 0.1**2) / 0.16
    for angle in (-0.5, 0.2, 0.7):
        for got in answers(m, crank_angle=angle):
            assert float(got["P_x"]) == pytest.approx(line, abs=SOLVED)
            assert float(got["P_y"]) == pytest.approx(line * math.tan(angle / 2), abs=SOLVED)


def test_double_cardan(capsys: pytest.CaptureFixture[str]) -> None:
    """Pins of the first cross stay at right angles: that of the driver turned by Rodrigues' formula, that of the middle about x."""
    printed("double_cardan", capsys)
    m = names_of("double_cardan")["drive_line"](bend=0.7)
    axis, pin = np.array([math.cos(0.7), math.sin(0.7), 0.0]), np.array([-math.sin(0.7), math.cos(0.7), 0.0])
    for angle in (0.4, 1.2, 2.6):
        turned = pin * math.cos(angle) + np.cross(axis, pin) * math.sin(angle)
        for got in answers(m, driver_angle=angle):
            middle = float(got["middle_angle"])
            assert turned @ (0.0, -math.sin(middle), math.cos(middle)) == pytest.approx(0.0, abs=SOLVED)
            assert float(got["follower_angle"]) == pytest.approx(angle, abs=SOLVED)


def test_car_differential(capsys: pytest.CaptureFixture[str]) -> None:
    """Rates of every wheel in a curve; and the work of the pinion's torque is the energy of all that turns at the end of the run."""
    shown = printed("car_differential", capsys)
    assert shown["pinocchio"] == pytest.approx([12.0], abs=1e-11)  # linear in the rates, twelve digits are printed
    m = names_of("car_differential")["differential"]()
    for got in answers(m, pinion_angle_rate=41.0, left_angle_rate=8.0):
        assert float(got["cage_angle_rate"]) == pytest.approx(10.0, abs=SOLVED)
        # seen from the cage the left wheel turns by -2, the planet by 16/10 of it
        assert abs(float(got["planet_angle_rate"])) == pytest.approx(3.2, abs=SOLVED)
    rate = shown["run"][0]
    energy = 0.5 * rate**2 * (0.03 + 0.3 * (3 * 0.02**2 + 0.02**2) / 12 + 2.4 + 0.00045 * 4.1**2)
    turned = 0.5 * 4.1 * rate  # of the pinion in 1 s from rest, evenly accelerated
    assert energy == pytest.approx(50.0 * turned, rel=1e-4)  # the run may be wrong by 1e-3 of 84 rad/s


def test_stewart_platform(capsys: pytest.CaptureFixture[str]) -> None:
    """Differences of the lengths by hand along a small motion are the rates that both witnesses give."""
    shown = printed("stewart_platform", capsys)
    assert shown["pinocchio"] == pytest.approx(shown["by"], abs=2e-9) == shown["mujoco"]
    names = names_of("stewart_platform")
    pose = {"x": 0.02, "y": 0.01, "z": 0.48, "roll": -0.1, "pitch": 0.05, "yaw": 0.15}
    rates = {"x_rate": 0.1, "y_rate": 0.0, "z_rate": -0.2, "roll_rate": 0.3, "pitch_rate": 0.1, "yaw_rate": -0.4}
    h = 1e-5
    sides = [names["lengths"](**{k: v + s * h * rates[f"{k}_rate"] for k, v in pose.items()}) for s in (1, -1)]
    for got in answers(names["platform"](), **pose, **rates):
        found = [float(got[f"leg_{k}_rate"]) for k in range(6)]
        assert found == pytest.approx((sides[0] - sides[1]) / (2 * h), abs=1e-8)  # h^2 of the differences


def test_palletizer(capsys: pytest.CaptureFixture[str]) -> None:
    """The pin B closes the parallelogram: it lies at crank e^(i crank) from the elbow, so the wrist lies opposite."""
    printed("palletizer", capsys)
    m = names_of("palletizer")["palletizer"]()
    for got in answers(m, arm_angle=1.1, crank_angle=2.6, arm_angle_rate=0.5, crank_angle_rate=-0.3):
        wrist = 0.5 * np.exp(1.1j) - 0.45 * np.exp(2.6j)
        rate = 0.5j * np.exp(1.1j) * 0.5 + 0.45j * np.exp(2.6j) * 0.3
        assert [float(got["wrist_x"]), float(got["wrist_y"])] == pytest.approx([wrist.real, wrist.imag], abs=SOLVED)
        assert [float(got["tip_x_rate"]), float(got["tip_y_rate"])] == pytest.approx([rate.real, rate.imag], abs=SOLVED)


def test_ravigneaux(capsys: pytest.CaptureFixture[str]) -> None:
    """Train values: of the two suns against the carrier -36/30, of ring and small sun 30/78, each relation checked by itself."""
    printed("ravigneaux", capsys)
    make = names_of("ravigneaux")["ravigneaux"]
    for gear, key in ((1, "small_angle_rate"), (2, "small_angle_rate"), (-1, "large_angle_rate")):
        for found in answers(make(gear), **{key: 7.0}):
            got = {key: 7.0, **found}
            small, large, ring, carrier = (float(got[f"{n}_angle_rate"]) for n in ("small", "large", "ring", "carrier"))
            assert (small - carrier) * 30 == pytest.approx((ring - carrier) * 78, abs=1e-7)
            assert (large - carrier) * 36 == pytest.approx(-(ring - carrier) * 78, abs=1e-7)
            assert (large if gear == 2 else carrier) == pytest.approx(0.0, abs=SOLVED)


def test_motor_and_friction(capsys: pytest.CaptureFixture[str]) -> None:
    """The line of the motor where its torque is the mean of the friction's over a turn; the ripple bounds what the run may differ."""
    shown = printed("motor_and_friction", capsys)
    hand = 30.0 * (1 - 10.0 / math.pi / 10.0)
    # ripple of the rate: torque 5 N m amplitude at twice the rate over 2 kg m2: 5 / (2 x 2 x 20) = 0.06 rad/s; 2 s are not whole turns
    assert shown["run"][-1] == pytest.approx(hand, abs=0.03)
    assert shown["by"][0] == pytest.approx(hand, abs=1e-3)


def test_biped_leg(capsys: pytest.CaptureFixture[str]) -> None:
    """The unstable poles against those of the same leg without its parallelogram, from its two-link mass and gravity matrices."""
    shown = printed("biped_leg", capsys)
    # held for 1 ms against poles of 21/s: some per cent of the cost; the integral by trapezoids is closer
    assert shown["run"][0] == pytest.approx(shown["by"][0], rel=0.02)
    names = names_of("biped_leg")
    model = ml.linearize(names["leg"]())
    assert model.at_rest[0] == pytest.approx(names["ankle_torque"](), rel=1e-9)
    shank, knee = 1.45, 3.3 - math.pi

    def potential(a: float, b: float) -> float:
        thigh = a + b
        lever = 0.06 * math.sin(a + b + math.pi)
        masses = [(3.0, 0.21 * math.sin(a)), (5.0, 0.42 * math.sin(a) + 0.2 * math.sin(thigh)), (0.1, lever / 2)]
        masses += [(20.0, 0.42 * math.sin(a) + 0.4 * math.sin(thigh)), (0.2, lever + 0.21 * math.sin(a))]
        return 9.81 * sum(m * y for m, y in masses)

    h = 1e-4
    e = h * np.eye(2)
    at = np.array([shank, knee])
    stiffness = np.array([[sum(s * u * potential(*(at + s * e[i] + u * e[j])) for s in (1, -1) for u in (1, -1)) for j in (0, 1)]
                          for i in (0, 1)]) / (4 * h * h)  # fmt: skip
    # light crank and rod left out of the mass matrix: 0.3 of 28 kg at short levers
    c = math.cos(knee)
    m22 = 5.0 * 0.4**2 / 3 + 20.0 * 0.4**2
    m12 = m22 + 0.42 * c * (5.0 * 0.2 + 20.0 * 0.4)
    m11 = 3.0 * 0.42**2 / 3 + 25.0 * 0.42**2 + m22 + 2 * 0.42 * c * (5.0 * 0.2 + 20.0 * 0.4)
    squares = np.linalg.eigvals(np.linalg.solve(np.array([[m11, m12], [m12, m22]]), -stiffness)).real
    found = np.sort(np.linalg.eigvals(model.A).real)[-2:]
    assert found == pytest.approx(np.sort(np.sqrt(squares)), rel=0.03)


def test_gripper(capsys: pytest.CaptureFixture[str]) -> None:
    """Where the slider stands: bisection of the sum of both forces, with the depth of the contact as the unknown."""
    shown = printed("gripper", capsys)

    def left(x: float) -> float:
        return 2e5 * (0.05 - x) - 40.0 * x / (2 * math.sqrt(0.1**2 - x * x))

    low, high = 0.049, 0.05
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if left(middle) > 0 else (low, middle)
    assert shown["run"][0] == pytest.approx(low, abs=2e-6)  # asked for 1e-6, six digits printed
    assert shown["run"][1] == pytest.approx(2e5 * (0.05 - low), rel=0.02)  # 2e5 N/m x 1e-6 m of 11.5 N
