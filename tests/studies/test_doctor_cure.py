"""Cured files: what `doctor --fix` writes, judged by plain MuJoCo runs; and what it leaves alone."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pytest

import mechlab as ml
from mechlab.cli import main
from mechlab.studies.doctor.mjcf_edit import MjcfText
from tests.studies.patients import HARD, NO_CONTACT, OPTION, arm, fourbar

EULER = '<option timestep="0.001"/>'


def crank_after(text: str, duration: float, timestep: float | None = None) -> float:
    """The crank angle that plain MuJoCo reaches [rad]."""
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep = timestep or model.opt.timestep
    data = mujoco.MjData(model)
    for _ in range(round(duration / model.opt.timestep)):
        mujoco.mj_step(model, data)
    return float(data.joint("crank").qpos[0])


def test_a_cured_four_bar_moves_right(tmp_path: Path) -> None:
    """Against the hard four-bar by RK4 at a tenth of the step: the soft file is wrong by a degree, the cured one by a ten-thousandth."""
    fine = fourbar(option=OPTION.replace('timestep="0.001"', 'timestep="0.0001"'), equality=HARD.replace("0.002", "0.0002"))
    soft = fourbar(option=EULER, equality="")
    path, out = tmp_path / "soft.xml", tmp_path / "cured.xml"
    path.write_text(soft)
    cure = ml.cure(path, out)
    truth = crank_after(fine, 0.5)
    before, after = abs(crank_after(soft, 0.5) - truth), abs(crank_after(out.read_text(), 0.5) - truth)
    assert before > 1e-3 and after < 1e-4 and after < before / 50
    assert cure.exit_code == 0 and cure.before.exit_code == 3 and "soft_equalities" in cure.cured and path.read_text() == soft
    gains = {name: (a, b) for name, _, a, b in cure.gains()}
    (wrong, right), (wide, narrow) = gains["error of the motion"], gains["largest gap of a loop"]
    assert wrong and right is not None and right < wrong / 50
    assert wide and narrow is not None and narrow < wide / 50


def test_everything_else_of_the_text_is_kept(tmp_path: Path) -> None:
    path, out = tmp_path / "soft.xml", tmp_path / "cured.xml"
    text = fourbar(option=EULER, equality="").replace("<worldbody>", "<!-- the bars -->\n  <worldbody>")
    text = f'<?xml version="1.0"?>\n<!-- a licence -->\n{text}\n<!-- the end -->\n'
    path.write_text(text)
    ml.cure(path, out)
    written = out.read_text()
    assert written.startswith('<?xml version="1.0"?>\n<!-- a licence -->\n<mujoco') and written.endswith("<!-- the end -->\n")
    assert "<!-- the bars -->" in written

    def rest(content: str) -> list[tuple[str, dict[str, str]]]:
        kept = ("option", "default", "equality")
        return [(e.tag, dict(e.attrib)) for e in ET.fromstring(content).iter() if e.tag not in kept and e.tag != "flag"]

    assert rest(written) == rest(text)


def test_values_of_single_equalities_give_way(tmp_path: Path) -> None:
    path, out = tmp_path / "own.xml", tmp_path / "cured.xml"
    path.write_text(fourbar(equality='solref="0.05 1" solimp=".9 .95 .001"'))
    ml.cure(path, out)
    model = mujoco.MjModel.from_xml_path(str(out))
    assert np.allclose(model.eq_solref[0], (0.002, 1.0)) and model.eq_solimp[0, 1] == 0.9999


def test_a_healthy_file_is_not_changed(tmp_path: Path) -> None:
    path, out = tmp_path / "healthy.xml", tmp_path / "cured.xml"
    path.write_text(fourbar())
    cure = ml.cure(path, out)
    assert cure.changes == () and "nothing" in cure.message
    assert ET.canonicalize(out.read_text(), strip_text=True) == ET.canonicalize(fourbar(), strip_text=True)


def test_degrees_commands_and_overlaps(tmp_path: Path) -> None:
    path, out = tmp_path / "sick.xml", tmp_path / "cured.xml"
    servo = '<actuator><position name="m" joint="crank" kp="1" ctrlrange="-5 5"/></actuator>'
    path.write_text(fourbar(compiler="", crank='range="-1.57 1.57"', rest=servo, defaults=""))
    cure = ml.cure(path, out)
    model = mujoco.MjModel.from_xml_path(str(out))
    assert {"degrees", "contacts"} <= set(cure.cured)
    assert np.allclose(model.jnt_range[model.joint("crank").id], (-1.57, 1.57))  # read in radians now
    assert np.allclose(model.actuator_ctrlrange[0], (-1.57, 1.57)) and model.nexclude == 1


def test_the_input_is_not_written_over_unless_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "soft.xml"
    path.write_text(fourbar(option=EULER, equality=""))
    assert main(["doctor", str(path), "--fix", "-o", str(path)]) == 1
    assert "--overwrite" in capsys.readouterr().err and path.read_text() == fourbar(option=EULER, equality="")
    assert main(["doctor", str(path), "--fix", "-o", str(path), "--overwrite"]) == 0
    assert 'integrator="RK4"' in path.read_text()
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(arm())
    assert main(["doctor", str(urdf), "--fix", "-o", str(tmp_path / "x.xml")]) == 1


def test_what_cannot_be_cured_keeps_the_exit_code(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = tmp_path / "open.xml", tmp_path / "cured.xml"
    path.write_text(fourbar(shift=1e-2))
    assert main(["doctor", str(path), "--fix", "-o", str(out), "--json"]) == 3
    document = json.loads(capsys.readouterr().out)
    assert document["after"]["verdict"] == "do not trust" and {"changes", "gains", "cured", "before"} <= document.keys()


def test_a_tie_to_a_mocap_body_stays_soft() -> None:
    text = MjcfText(
        '<mujoco><equality><weld body1="hand" body2="tool"/><connect name="pin" body1="a" body2="b" anchor="0 0 0"/></equality></mujoco>'
    )
    assert "1 of 2" in text.harden("0.002 1", ".9999 .9999", {"hand"})
    weld, connect = ET.fromstring(text.text()).find("equality") or ()
    assert weld.get("solref") is None and connect.get("solref") == "0.002 1"


def test_defaults_are_made_where_there_are_none() -> None:
    made = MjcfText("<mujoco>\n  <worldbody/>\n</mujoco>\n")
    made.harden("0.002 1", ".9 .9", set())
    made.setting("option", integrator="RK4")
    assert mujoco.MjModel.from_xml_string(made.text()).opt.integrator == mujoco.mjtIntegrator.mjINT_RK4
    assert NO_CONTACT not in made.text() and made.setting("option", integrator="RK4") == ""
