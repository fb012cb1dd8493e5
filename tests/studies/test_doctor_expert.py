"""The doctor judges as an expert of MuJoCo: each finding on a small file, and its absence on a healthy twin. MuJoCo 4.0.0."""

from __future__ import annotations

import json
import time
from pathlib import Path

import mujoco
import numpy as np
import pytest

import mechlab as ml
from mechlab.cli import main
from mechlab.engines.mujoco.control import engine
from mechlab.engines.mujoco.model_file import rows
from mechlab.mechanism.redundancy import Redundancy
from mechlab.studies.doctor.case import Diagnosis
from tests.studies.patients import HARD, NO_CONTACT, OPTION, arm, fourbar

INERTIA = '<inertial pos="0 0 -0.1" mass="1" diaginertia="0.01 0.01 0.002"/>'


def look(tmp_path: Path, text: str, name: str = "patient.xml") -> Diagnosis:
    path = tmp_path / name
    path.write_text(text)
    return ml.doctor(path)


def severities(d: Diagnosis) -> dict[str, str]:
    return {f.name: f.severity for f in d.findings}


def hinge(joint: str = "", rest: str = "", head: str = '<compiler angle="radian"/>', option: str = OPTION) -> str:
    return f'<mujoco>{head}{option}<worldbody><body><joint name="a" axis="0 1 0" {joint}/>{INERTIA}</body></worldbody>{rest}</mujoco>'


# -- angles -----------------------------------------------------------------------------------------------------------------


def test_the_compiler_line_of_an_included_file_counts(tmp_path: Path) -> None:
    (tmp_path / "unit.xml").write_text('<mujocoinclude><compiler angle="radian"/></mujocoinclude>')
    included = hinge('range="-1.57 1.57"', head='<include file="unit.xml"/>')
    assert "degrees" not in severities(look(tmp_path, included))
    assert severities(look(tmp_path, hinge('range="-1.57 1.57"', head="")))["degrees"] == "error"


def test_the_type_of_a_joint_may_come_from_its_class(tmp_path: Path) -> None:
    def found(kind: str) -> dict[str, str]:
        return severities(look(tmp_path, hinge('range="-0.29 0.29"', head=f'<default><joint type="{kind}"/></default>')))

    assert "degrees" not in found("slide") and found("hinge")["degrees"] == "warning"


# -- the start --------------------------------------------------------------------------------------------------------------


def test_a_run_starts_at_the_keyframe(tmp_path: Path) -> None:
    outside = look(tmp_path, hinge('range="0.5 1"'))
    finding = outside.finding("beyond_range")
    # The number is what the stop adds to the acceleration, by two evaluations of the engine.
    model = mujoco.MjModel.from_xml_string(hinge('range="0.5 1"'))
    data, found = mujoco.MjData(model), []
    for off in (0, int(mujoco.mjtDisableBit.mjDSBL_LIMIT)):
        model.opt.disableflags |= off
        mujoco.mj_forward(model, data)
        found.append(float(data.qacc[0]))
    assert finding.severity == "warning" and finding.number == pytest.approx(abs(found[0] - found[1]), rel=1e-9)
    inside = hinge('range="0.5 1"', '<keyframe><key qpos="0.7"/></keyframe>')
    assert "beyond_range" not in severities(look(tmp_path, inside))


def test_a_urdf_has_no_start_pose(tmp_path: Path) -> None:
    text = arm().replace('lower="-1"', 'lower="0.5"')
    assert 'lower="0.5"' in text and "beyond_range" not in severities(look(tmp_path, text, "patient.urdf"))


# -- runs -------------------------------------------------------------------------------------------------------------------


def test_drift_of_a_model_with_contacts_is_no_error(tmp_path: Path) -> None:
    """A box that tumbles on the floor: paths depend on the step. The twin, a pendulum at 50 steps a turn, is wrong by its step alone."""
    box = (
        '<mujoco><option timestep="0.005"/><worldbody><geom type="plane" size="2 2 1"/><body pos="0 0 0.12" euler="20 35 0"><freejoint/>'
        '<geom type="box" size="0.1 0.1 0.1"/></body></worldbody></mujoco>'
    )
    d = look(tmp_path, box)
    assert d.run is not None and "contacts" in d.run.touched and d.run.error > 1e-6
    assert d.exit_code == 0 and severities(d).get("trial", "note") == "note" and d.paste == ""
    coarse = hinge(option='<option timestep="0.02" gravity="40 0 0"/>')
    found = look(tmp_path, coarse)
    assert severities(found)["trial"] in ("warning", "error") and "RK4" in found.paste


def test_no_push_where_the_file_is_judged_as_it_is(tmp_path: Path) -> None:
    """Without gravity the four-bar stands still: nothing may be said of a run as the file says, only of one under a push."""
    still = OPTION.replace("<option ", '<option gravity="0 0 0" ').replace("RK4", "implicitfast")
    soft = look(tmp_path, fourbar(option=still, equality='solref="0.5 1"'))
    assert soft.run is not None and soft.run.pushed == 0.0 and soft.run.moved == pytest.approx(0.0, abs=1e-9)
    assert soft.run.follow is not None and soft.run.follow.pushed > 0
    assert "trial" not in severities(soft) and severities(soft)["pushed"] == "warning"
    assert "which the file does not do" in soft.finding("pushed").sentence
    assert "pushed" not in severities(look(tmp_path, fourbar(option=still.replace("implicitfast", "RK4"))))


def test_rates_that_only_the_step_makes(tmp_path: Path) -> None:
    """A spinning body between two stops a hundredth of a degree apart, at 20 ms."""
    narrow = look(tmp_path, hinge('range="-1e-5 1e-5" solreflimit="-1e7 0"', option='<option timestep="0.02" gravity="9 0 0"/>'))
    wide = look(tmp_path, hinge('range="-1 1"', option='<option timestep="0.02" gravity="9 0 0"/>'))
    assert "trial" in severities(narrow) and severities(wide).get("trial") != "error"


def test_defaults_are_notes(tmp_path: Path) -> None:
    d = look(tmp_path, hinge(option=""))
    assert severities(d)["autoreset"] == "note" and d.verdict == "healthy"
    assert "autoreset" not in severities(look(tmp_path, hinge()))
    scaled = look(tmp_path, hinge(head='<compiler settotalmass="3"/>'))
    assert severities(scaled)["masses_changed"] == "note" and scaled.finding("masses_changed").number == 3.0


def test_a_weld_to_a_mocap_body_is_meant_to_be_soft(tmp_path: Path) -> None:
    def weld(kind: str) -> dict[str, str]:
        text = (
            f'<mujoco>{OPTION}<worldbody><body name="hand" {kind}><geom size="0.05" contype="0"/></body><body name="tool" pos="0 0 0.5">'
            f'<freejoint/><geom size="0.05"/></body></worldbody><equality><weld body1="hand" body2="tool"/></equality></mujoco>'
        )
        return severities(look(tmp_path, text))

    dragged, fixed = weld('mocap="true"'), weld("")
    assert dragged["mocap_weld"] == "note" and "soft_equalities" not in dragged
    assert fixed["soft_equalities"] == "error" and "mocap_weld" not in fixed


# -- what was missed --------------------------------------------------------------------------------------------------------


def rod(joint: str, inner: bool = False) -> str:
    """A crank, a rod of 0.5 m with `joint` at its upper end, and a slider at its lower end; inner: the slider is the rod's child."""
    low = '<inertial pos="0 0 0" mass="0.2" diaginertia="1e-4 1e-4 1e-4"/>'
    bar = '<inertial pos="0 0 -0.25" mass="0.3" diaginertia="6e-3 6e-3 1e-4"/><site name="tip" pos="0 0 -0.5"/>'
    slider = f'<body name="slider" pos="0.3 0 -0.5"><joint name="slide" type="slide" axis="0 0 1"/>{low}<site name="eye"/></body>'
    end, closing = slider, '<connect site1="tip" site2="eye"/>'
    if inner:
        end = ""
        bar += f'<body name="slider" pos="0 0 -0.5"><joint name="eye" type="ball"/>{low}<site name="tail"/></body>'
        closing = '<weld site1="tail" site2="rail"/>'
    rail = '<body name="guide" pos="0.3 0 -0.5"><joint name="slide" type="slide" axis="0 0 1"/>' + low + '<site name="rail"/></body>'
    return (
        f'<mujoco>{OPTION}<worldbody><body name="crank"><joint name="crank" axis="0 1 0"/><inertial pos="0.15 0 0" mass="0.2" '
        f'diaginertia="1e-3 1e-3 1e-3"/><body name="rod" pos="0.3 0 0">{joint}{bar}</body></body>{rail if inner else end}</worldbody>'
        f"<equality>{closing.replace('/>', f' {HARD}/>')}</equality></mujoco>"
    )


BALL = '<joint name="ball" type="ball"/>'
UNIVERSAL = '<joint name="u" axis="1 0 0"/><joint name="v" axis="0 1 0"/>'


def test_a_rod_that_spins_between_two_balls_is_counted_apart(tmp_path: Path) -> None:
    """Kutzbach in space: crank 1, ball 3, slider 1, less 3 rows of the connect: 2, of which one is the spin."""
    d = look(tmp_path, rod(BALL))
    assert d.freedoms == 2 and d.finding("spins").number == 1 and "rod" in d.finding("spins").sentence
    assert "The mechanism has 1." in d.finding("spins").sentence
    twin = look(tmp_path, rod(UNIVERSAL))
    assert twin.freedoms == 1 and "spins" not in severities(twin)
    inner = look(tmp_path, rod(BALL, inner=True))  # 1 + 3 + 3 + 1 - 6 = 2: the rod hangs inside the tree
    assert inner.freedoms == 2 and "rod" in inner.finding("spins").sentence
    assert "spins" not in severities(look(tmp_path, rod(UNIVERSAL, inner=True)))


def test_a_pendulum_hung_in_a_loop_does_not_spin(tmp_path: Path) -> None:
    text = (
        f'<mujoco>{OPTION}<worldbody><site name="hook" pos="0 0 0.1"/><body name="bob"><freejoint/>{INERTIA}'
        f'<site name="eye" pos="0 0 0.1"/></body></worldbody><equality><connect site1="eye" site2="hook" {HARD}/></equality></mujoco>'
    )
    d = look(tmp_path, text)
    assert d.freedoms == 3 and "spins" not in severities(d)


def test_commands_beyond_the_range_of_a_joint(tmp_path: Path) -> None:
    def servo(low: float, high: float, gear: float = 1.0) -> Diagnosis:
        line = f'<actuator><position name="m" joint="a" kp="10" gear="{gear}" ctrlrange="{low} {high}"/></actuator>'
        return look(tmp_path, hinge('range="-1 1"', line))

    assert "control_beyond_range" not in severities(servo(-1, 1))
    wide = servo(-3, 3).finding("control_beyond_range")
    assert wide.severity == "warning" and wide.number == pytest.approx(1.0) and "-3 to 3 rad" in wide.sentence
    assert "degrees" in servo(-180, 180).finding("control_beyond_range").sentence
    assert "control_beyond_range" not in severities(servo(-5, 5, gear=5.0))  # the servo holds gear q at the command
    # The trap itself: commanded to 3 with a stop at 1, the servo presses with kp (3 - 1).
    model = mujoco.MjModel.from_xml_string(
        hinge('range="-1 1"', '<actuator><position joint="a" kp="10" ctrlrange="-3 3"/></actuator>', option="")
    )
    model.opt.gravity[:], model.dof_damping[:] = 0.0, 1.0
    data = mujoco.MjData(model)
    data.ctrl[:] = 3.0
    for _ in range(4000):
        mujoco.mj_step(model, data)
    assert data.qfrc_constraint[0] == pytest.approx(-20.0, rel=0.01)  # the stop gives way by less than .02 rad


def test_redundancy_in_words() -> None:
    terms = tuple((f"row{k}", float(k)) for k in range(1, 9))
    assert Redundancy("r", terms).sentence == "r repeats what row8, row7, row6 and 5 more rows say together"
    alike = tuple((f"row{k}", 1.0 + 1e-15 * k) for k in range(4))  # rounding does not choose the names
    assert Redundancy("r", alike).sentence == "r repeats what row0, row1, row2 and 1 more row say together"
    assert Redundancy("r", terms[:2]).sentence == "r = +1 row1 +2 row2"


# -- no crash, bounded work ---------------------------------------------------------------------------------------------------


def test_actuators_with_several_controls(tmp_path: Path) -> None:
    line = '<actuator><dcmotor name="m" joint="a" motorconst="1" resistance="1" input="pos vel" controller="10 0 5"/></actuator>'
    model = mujoco.MjModel.from_xml_string(hinge(rest=line))
    assert model.nu == 2 and len(model.actuator_dyntype) == 1  # nu is not the number of actuators
    assert look(tmp_path, hinge(rest=line)).freedoms == 1


def test_the_work_is_bounded_and_what_is_left_out_is_said(tmp_path: Path) -> None:
    chain = "".join(f'<body pos="0 0 {0.05 * (k > 0)}"><joint axis="{k % 2} {(k + 1) % 2} 0"/><geom size=".01"/>' for k in range(220))
    text = f"<mujoco>{NO_CONTACT}<worldbody>{chain}{'</body>' * 220}</worldbody></mujoco>"
    began = time.process_time()
    d = look(tmp_path, text)
    assert time.process_time() - began < 30.0  # 3 s on one core
    assert d.freedoms == 220 and any("stability of a step: 220 coordinates" in x for x in d.not_examined)
    assert look(tmp_path, hinge()).not_examined == ()


def test_large_systems_of_rows_are_examined_at_the_start_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rows, "MOST_ENTRIES", 8)  # the four-bar has 9 entries
    d = look(tmp_path, fourbar())
    assert d.freedoms == 1 and any("rows beyond the start" in x for x in d.not_examined)


# -- ranks, consequences, cures -------------------------------------------------------------------------------------------------


def test_every_finding_has_its_place_and_its_consequence(tmp_path: Path) -> None:
    d = look(tmp_path, fourbar(option="", equality="", defaults="", crank='range="0.5 1" frictionloss="0.01"'))
    order = [("error", "warning", "note").index(f.severity) for f in d.findings]
    assert order == sorted(order) and len(set(order)) == 3
    assert all(f.consequence for f in d.findings)
    names = [f.name for f in look(tmp_path, fourbar(option="", equality="")).findings]
    assert names.index("trial") < names.index("soft_equalities") < names.index("first_order") < names.index("autoreset")


def test_overlapping_shapes_are_cured_by_an_exclude(tmp_path: Path) -> None:
    finding = look(tmp_path, fourbar(defaults="")).finding("contacts")
    assert finding.severity == "error" and '<exclude body1="coupler" body2="rocker"/>' in finding.paste
    cured = fourbar(defaults="").replace("</mujoco>", f"{finding.paste}</mujoco>")
    assert severities(look(tmp_path, cured)).get("contacts") in (None, "note")
    assert np.isfinite(finding.number or np.nan)


# -- memory -----------------------------------------------------------------------------------------------------------------------


def crowd(memory: str) -> str:
    boxes = "".join(
        f'<body pos="0 0 {0.1 + 0.19 * k}"><freejoint/><geom type="box" size=".1 .1 .1"/></body>' for k in range(12)
    )
    floor = '<geom type="plane" size="2 2 .1"/>'
    return f'<mujoco><size memory="{memory}"/><worldbody>{floor}{boxes}</worldbody></mujoco>'


@pytest.mark.parametrize(("memory", "words"), [("30K", "for contacts"), ("60K", "for rows")])
def test_contacts_that_do_not_fit_the_memory_are_found(tmp_path: Path, memory: str, words: str) -> None:
    """MuJoCo leaves them out and goes on; its counters are read here from a run of our own."""
    path = tmp_path / "crowd.xml"
    finding = look(tmp_path, crowd(memory), path.name).finding("memory")
    assert finding.severity == "error" and words in finding.sentence and f"{int(memory[:-1]) / 1024:.3g} MiB" in finding.sentence
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    with engine():  # writes no log file
        for _ in range(50):
            mujoco.mj_step(model, data)
    full = [data.warning[w].number for w in (mujoco.mjtWarning.mjWARN_CONTACTFULL, mujoco.mjtWarning.mjWARN_CNSTRFULL)]
    assert max(full) >= 50 and (full[0] > 0) == ("for contacts" in finding.sentence)
    cured = ml.cure(path, tmp_path / "cured.xml")
    assert "memory" in cured.cured and finding.paste == '<size memory="1M"/>' and 'memory="1M"' in cured.path.read_text()
    assert "memory" not in severities(look(tmp_path, crowd("4M")))


def test_a_document_of_a_sick_file_does_not_say_answered(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "crowd.xml"
    path.write_text(crowd("60K"))
    assert main(["doctor", str(path), "--json"]) == 3
    document = json.loads(capsys.readouterr().out)
    assert document["status"] == "not to be trusted" and "memory of 0.0586 MiB was full" in document["message"]
