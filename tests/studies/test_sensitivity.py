"""Sensitivity of answers: against derivatives taken by hand, a second witness, and finite changes; tolerances."""

import json
import math

import numpy as np
import pytest

import mechlab as ml
from mechlab.cli import main
from mechlab.errors import MechlabError
from mechlab.studies.sensitivity.derivatives import slope

ANGLE = 1.0


def fourbar_derivatives() -> dict[str, dict[str, float]]:
    """Implicit derivatives of the loop a e^i phi + b e^i psi = d + c e^i chi, at the angles of the mechanism."""
    a, b, c = 0.1, 0.3, 0.25
    said = ml.solve("fourbar", crank_angle=ANGLE)["analytic"]
    psi, chi = said["coupler_angle"], said["rocker_angle"]

    def unit(t: float) -> np.ndarray:
        return np.array([math.cos(t), math.sin(t)])

    def turned(t: float) -> np.ndarray:
        return np.array([-math.sin(t), math.cos(t)])

    matrix = np.column_stack([b * turned(psi), -c * turned(chi)])
    right = {"crank": -unit(ANGLE), "coupler": -unit(psi), "rocker": unit(chi), "ground": np.array([1.0, 0.0])}
    assert a * unit(ANGLE) + b * unit(psi) == pytest.approx(np.array([0.3, 0.0]) + c * unit(chi), abs=1e-12)
    out: dict[str, dict[str, float]] = {"coupler_angle": {}, "rocker_angle": {}}
    for name, column in right.items():
        solved = np.linalg.solve(matrix, column)
        out["coupler_angle"][name], out["rocker_angle"][name] = float(solved[0]), float(solved[1])
    return out


def test_fourbar_derivatives_are_those_of_the_loop_equation_for_every_witness() -> None:
    found = ml.sensitivity("fourbar", crank_angle=ANGLE, tolerance={"coupler": 1e-4, "crank": 2e-4})
    for answer, row in fourbar_derivatives().items():
        size = float(found.answers["analytic"][answer])
        for parameter, expected in row.items():
            cell = found[answer][parameter]
            assert set(cell.witnesses) == {"analytic", "pinocchio", "mujoco"}
            for value in cell.witnesses.values():
                assert value == pytest.approx(expected, rel=1e-8)  # Richardson: 1e-9; MuJoCo's Newton: 1e-13 / 5e-4
            assert abs(cell.derivative - expected) <= max(10 * cell.error, 1e-9)
            p = {"crank": 0.1, "coupler": 0.3, "rocker": 0.25, "ground": 0.3}[parameter]
            assert cell.relative == pytest.approx(expected * p / size, rel=1e-8)
        spread = found.spreads[answer]
        parts = [abs(row["coupler"]) * 1e-4, abs(row["crank"]) * 2e-4]
        assert spread.worst_case == pytest.approx(sum(parts), rel=1e-8)
        assert spread.root_sum_square == pytest.approx(math.hypot(*parts), rel=1e-8)
    assert found["coupler_angle"]["gravity"].derivative == 0.0
    assert found.skipped == {"mode": "a whole number"}
    assert found.exit_code == 0 and found.max_difference is not None and found.max_difference < 1e-6


def test_delta_slider_against_the_derivative_of_its_height() -> None:
    """q = z + az + hs + sqrt(L^2 - |G|^2): dq/dL = L / h, and pinocchio and mujoco on every rod and cross agree."""
    pose = {"x": 0.07, "y": 0.02, "z": 0.01, "alpha": 0.1, "beta": 0.2, "gamma": -0.3}
    found = ml.sensitivity("delta6", pose, tolerance={"rod_length": 1e-4, "x": 1e-5}, only=("rod_length", "x"))
    p = ml.load("delta6").parameters
    for q in ("q1", "q2", "q3"):
        centre = pose["z"] + p.head_offset * math.sin(pose["beta"])
        rise = found.answers["analytic"][q] - centre - p.platform_height - p.slider_height
        for value in found[q]["rod_length"].witnesses.values():
            assert value == pytest.approx(p.rod_length / rise, rel=1e-8)
        assert len(found[q]["rod_length"].witnesses) == 3
        worst = abs(found[q]["rod_length"].derivative) * 1e-4 + abs(found[q]["x"].derivative) * 1e-5
        assert found.spreads[q].worst_case == pytest.approx(worst, rel=1e-12)
    assert found["phi3"]["rod_length"].derivative == pytest.approx(0.0, abs=1e-12)


def test_first_order_agrees_with_a_finite_change_and_arrays_keep_their_shape() -> None:
    angles = np.array([0.4, 1.0, 2.5])
    found = ml.sensitivity("fourbar", crank_angle=angles, only=("rocker",))
    cell = found["rocker_angle"]["rocker"]
    assert cell.derivative.shape == angles.shape
    moved, back = (
        ml.solve("fourbar", crank_angle=angles, rocker=0.25 + d)["analytic"]["rocker_angle"] for d in (1e-6, -1e-6)
    )
    assert cell.derivative == pytest.approx((moved - back) / 2e-6, rel=1e-7)  # rounding 1e-16 / 1e-6, truncation 1e-12


def test_entries_of_lists_are_inputs() -> None:
    """A leg that is turned about the axis: dq/dpsi = -G . (z x g) / h; the other legs do not move."""
    pose = {"x": 0.09, "y": 0.0, "z": 0.0, "alpha": 0.0, "beta": 0.0, "gamma": 0.0}
    found = ml.sensitivity("delta6", pose, only=("leg_azimuths[0]",))
    with pytest.raises(MechlabError, match=r"leg_azimuths\[0\], leg_azimuths\[1\], leg_azimuths\[2\]"):
        ml.sensitivity("delta6", pose, only=("leg_azimuths[3]",))
    p = ml.load("delta6").parameters
    o, psi = pose["x"] - p.head_offset, p.leg_azimuths[0]
    g = np.array([-p.radial_offset * math.cos(psi), -p.radial_offset * math.sin(psi)])
    g += p.tangential_offset * np.array([-math.sin(psi), math.cos(psi)])
    height = math.sqrt(p.rod_length**2 - (o + g[0]) ** 2 - g[1] ** 2)
    assert found["q1"]["leg_azimuths[0]"].derivative == pytest.approx(o * g[1] / height, rel=1e-8)
    assert found["q2"]["leg_azimuths[0]"].derivative == pytest.approx(0.0, abs=1e-12)


def test_a_gear_ratio_has_no_inputs_that_matter() -> None:
    found = ml.sensitivity("planetary", sun_rate=1.0, tolerance=0.01)
    assert found.exit_code == 0
    assert "depend on none of" in found.message and "teeth" in found.skipped
    assert all(s.worst_case == 0.0 for s in found.spreads.values())


def test_one_sided_where_no_answer_exists_beyond() -> None:
    one = slope(lambda d: np.array([math.exp(d) - 1.0 if d >= 0 else np.nan]), 1.0, np.ones(1))
    assert one.sides == 1
    assert one.value[0] == pytest.approx(1.0, abs=1e-9)
    assert abs(one.value[0] - 1.0) <= 10 * one.error[0]
    none = slope(lambda d: np.array([np.nan]), 1.0, np.ones(1))
    assert none.sides == 0 and np.isnan(none.value[0])


@pytest.mark.parametrize("function,expected", [(math.sin, 1.0), (math.expm1, 1.0), (lambda d: 1e3 * d + d**3, 1e3)])
def test_richardson_knows_its_error(function: object, expected: float) -> None:
    found = slope(lambda d: np.array([function(d)]), 1.0, np.zeros(1))  # type: ignore[operator]
    assert abs(found.value[0] - expected) <= max(found.error[0], 1e-13 * expected)
    assert found.error[0] <= 1e-8 * expected


def test_bad_requests_name_the_culprit() -> None:
    for wrong, word in (
        ({"rod": 1e-3}, "rod"), ({"mode": 1.0}, "whole number"), ({"crank": -1.0}, "at least 0"), ({"crank": "x"}, "number"),
    ):  # fmt: skip
        with pytest.raises(MechlabError, match=word):
            ml.sensitivity("fourbar", crank_angle=ANGLE, tolerance=wrong)
    with pytest.raises(MechlabError, match="Existing: coupler"):
        ml.sensitivity("fourbar", crank_angle=ANGLE, only=("cranc",))


def test_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    command = "solve fourbar crank_angle=1 --sensitivity --of coupler,crank --tolerance coupler=0.1mm --json"
    assert main(command.split()) == 0
    document = json.loads(capsys.readouterr().out)
    cell = document["sensitivity"]["rocker_angle"]["coupler"]
    assert cell["derivative"] == pytest.approx(fourbar_derivatives()["rocker_angle"]["coupler"], rel=1e-8)
    assert {"derivative", "relative", "error", "witnesses"} <= cell.keys()
    assert document["tolerance"]["rocker_angle"]["worst_case"] == pytest.approx(
        1e-4 * abs(cell["derivative"]), rel=1e-12
    )
    assert document["answers"]["pinocchio"]["rocker_angle"] == pytest.approx(
        document["answers"]["analytic"]["rocker_angle"]
    )
    assert main(["solve", "fourbar", "crank_angle=1", "coupler=0.9", "--sensitivity"]) == 4
    assert main(["solve", "fourbar", "crank_angle=1", "--tolerance", "coupler"]) == 2
    assert main(["solve", "fourbar", "crank_angle=1", "--tolerance", "coupler=1deg"]) == 1


def rocker_angle(crank: float, coupler: float, phi: float = ANGLE, rocker: float = 0.25, ground: float = 0.3) -> float:
    """The dyad by the law of cosines, C above the diagonal from B to D; nan where it cannot be assembled."""
    diagonal = complex(ground, 0.0) - crank * complex(math.cos(phi), math.sin(phi))
    cosine = (diagonal.real**2 + diagonal.imag**2 + rocker**2 - coupler**2) / (2.0 * abs(diagonal) * rocker)
    if abs(cosine) > 1.0:
        return math.nan
    return math.atan2(diagonal.imag, diagonal.real) + math.pi - math.acos(cosine)


def test_the_corners_of_the_tolerances_are_solved() -> None:
    given = {"crank": 0.05, "coupler": 0.05}
    found = ml.sensitivity("fourbar", crank_angle=ANGLE, tolerance=given, only=tuple(given))
    at = rocker_angle(0.1, 0.3)
    assert found.answers["analytic"]["rocker_angle"] == pytest.approx(at, abs=1e-12)
    box = [rocker_angle(0.1 + a, 0.3 + b) - at for a in (-0.05, 0.0, 0.05) for b in (-0.05, 0.0, 0.05)]
    spread = found.spreads["rocker_angle"]
    assert spread.at_corners == pytest.approx(max(map(abs, box)), abs=1e-12) and spread.at_corners > spread.worst_case
    assert found.box is not None and found.box.whole and not found.box.missing
    bent = found.spreads["transmission_angle"]  # 0.2015 at the corners, 0.1784 to first order
    assert not bent.is_linear and found.exit_code == 3 and "transmission_angle" in found.message


def test_an_end_that_cannot_be_assembled_is_named_with_exit_code_3(capsys: pytest.CaptureFixture[str]) -> None:
    """At crank angle pi the bars reach: coupler <= crank + ground + rocker = 0.65 is all there is."""
    words = "solve fourbar crank_angle=3.141592653589793 coupler=0.6499 --tolerance coupler=2e-4 --of coupler --json"
    assert main(words.split()) == 3
    captured = capsys.readouterr()
    document = json.loads(captured.out)
    assert document["corners"]["missing"] == ["coupler plus 0.0002"] and "coupler plus 0.0002" in captured.err
    true = abs(rocker_angle(0.1, 0.6497, math.pi) - rocker_angle(0.1, 0.6499, math.pi))
    spread = document["tolerance"]["rocker_angle"]
    assert spread["at_corners"] == pytest.approx(true, abs=1e-9) and abs(spread["worst_case"] - true) > 0.1 * true
    assert main("solve fourbar crank_angle=1 --tolerance crank=50 --of crank".split()) == 3
