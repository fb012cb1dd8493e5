"""Charts of MJCF files: against the swing of a physical pendulum, with a push where nothing moves. MuJoCo 4.0.0."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from mechlab.engines.mujoco.model_file.trace import FileModel, read_model, trace_file
from mechlab.errors import MechlabError
from mechlab.studies.chart.mjcf_file import PUSH, chart_of_mjcf_file
from mechlab.studies.chart.run import Budget

SMALL = Budget(one=0.004, method=0.05, repeat=0.0, repeats=1)

ROD = """<mujoco><option gravity="0 0 {g}"/><compiler angle="radian"/><worldbody><body pos="0 0 2">
<joint name="j" axis="0 1 0"/><inertial pos="0.5 0 0" mass="1" diaginertia="0.01 0.0833 0.0833"/></body></worldbody></mujoco>"""

GEARS = """<mujoco><option gravity="0 0 0"/><worldbody>
<body name="a"><joint name="a" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 2"/></body>
<body name="b" pos="1 0 0"><joint name="b" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 2"/></body>
</worldbody><equality><joint joint1="a" joint2="b" polycoef="0 -2 0 0 0"/></equality></mujoco>"""

FIXED = """<mujoco><worldbody><body><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""


def written(folder: Path, text: str) -> Path:
    path = folder / "model.xml"
    path.write_text(text)
    return path


def test_a_rod_from_the_horizontal(tmp_path: Path) -> None:
    """The reference against the integral of the energy: w^2 = 2 m g (l/2) sin(angle) / J, J about the pin."""
    model = read_model(written(tmp_path, ROD.format(g=-9.81)))
    fine = trace_file(model, "RK4", False, 0.4, 100, 64)
    angle = np.arcsin((2.0 - fine.points[-1, 1, 2]) / 0.5)  # the pin stands at 2 m, the centre of mass 0.5 m from it
    pull = 2.0 * 9.81 * 0.5 / (0.0833 + 0.25)
    # angle = u^2 takes the root at the start out of the integrand
    time = quad(lambda u: 2.0 * u / np.sqrt(pull * np.sin(u * u)), 0.0, np.sqrt(angle), epsabs=1e-12)[0]
    assert time == pytest.approx(0.4, abs=1e-10)
    found = chart_of_mjcf_file(written(tmp_path, ROD.format(g=-9.81)), 0.5, budget=SMALL)
    assert found.reference_error < 1e-9
    assert found.recommendation.met and "<option" in found.recommendation.paste


def test_what_nothing_moves_is_pushed_along_its_gears(tmp_path: Path) -> None:
    path = written(tmp_path, GEARS)
    found = chart_of_mjcf_file(path, 0.5, budget=SMALL)
    assert any("Nothing moves it" in note for note in found.notes)
    trace = trace_file(FileModel(read_model(path).model, push=PUSH), "RK4", True, 0.5, 100, 4)
    beside = trace.points[:, 4:] - trace.points[:, 1:3]  # the gears turn by t and -t / 2 at constant speed
    turned = np.arctan2(beside[..., 1], beside[..., 0])
    turned = np.unwrap(turned - turned[0], axis=0)[-1]
    assert turned[0] == pytest.approx(-2.0 * turned[1], abs=1e-4)  # the hard row's own slip
    assert np.abs(turned).max() == pytest.approx(0.5 * PUSH, abs=1e-4)


def test_what_cannot_move_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MechlabError, match="nothing in it can move"):
        chart_of_mjcf_file(written(tmp_path, FIXED), 0.1, budget=SMALL)
