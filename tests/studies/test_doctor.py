"""The doctor on small files, each seeded with one trap, beside a healthy twin. MuJoCo 4.0.0."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

import mechlab as ml
from mechlab.cli import main
from mechlab.engines.mujoco.model_file.options import settings_to_paste
from mechlab.engines.mujoco.model_file.softness import equality_default
from mechlab.formats.mjcf.write import to_mjcf
from mechlab.studies.doctor.case import Diagnosis
from tests.engines.test_universal_joints import BEND, cardan
from tests.studies.patients import HARD, NO_CONTACT, OPTION, arm, fourbar, planetary


def look(tmp_path: Path, text: str, suffix: str = "xml") -> Diagnosis:
    path = tmp_path / f"patient.{suffix}"
    path.write_text(text)
    return ml.doctor(path)


def graver(d: Diagnosis) -> dict[str, str]:
    """Name -> severity of what is more than a note."""
    return {f.name: f.severity for f in d.findings if f.severity != "note"}


def test_a_healthy_four_bar(tmp_path: Path) -> None:
    d = look(tmp_path, fourbar())
    assert (d.coordinates, d.rows, d.freedoms, d.exit_code) == (3, 3, 1, 0)
    # The bars turn about y: the row along it is void.
    assert [x.sentence for x in d.redundant] == ["pin.y is void: no motion can violate it"]
    assert d.gap is not None and d.gap < 1e-15 and graver(d) == {}


def test_default_softness_and_the_settings_to_paste_cure_it(tmp_path: Path) -> None:
    sick = look(tmp_path, fourbar(option="", equality=""))
    assert sick.exit_code == 3
    found = graver(sick)
    assert found["soft_equalities"] == "error" and found["first_order"] == "warning" and "autoreset" not in found
    assert found["trial"] == "error"  # the run itself is wrong, by more than a hundredth of its motion
    option, default = sick.paste.split("</option>")
    text = fourbar(option=f"{option}</option>", equality="", defaults=NO_CONTACT + default.split("<!--")[0])
    assert graver(look(tmp_path, text)) == {}


def test_refsafe_and_direct_stiffness(tmp_path: Path) -> None:
    quick = fourbar(equality=HARD.replace("0.002", "0.0005"))
    assert graver(look(tmp_path, quick))["refsafe"] == "warning"
    # Measured: implicitfast blows up at every timestep with refsafe off and a time constant below the timestep.
    unsafe = quick.replace('autoreset="disable"', 'autoreset="disable" refsafe="disable"').replace(
        "RK4", "implicitfast"
    )
    found = graver(look(tmp_path, unsafe))
    assert found["refsafe"] == "error" and found["trial"] == "error"
    direct = fourbar(option=OPTION.replace("RK4", "implicitfast"), equality=HARD.replace("0.002 1", "-1e7 -2e3"))
    found = graver(look(tmp_path, direct))
    assert found["stiff_equalities"] == "error" and found["trial"] == "error"


def test_a_gap_in_the_reference_pose(tmp_path: Path) -> None:
    d = look(tmp_path, fourbar(shift=1e-3))
    assert d.gap == pytest.approx(1e-3, rel=1e-9) and graver(d)["gap"] == "error"
    small = look(tmp_path, fourbar(shift=1e-7))
    assert graver(small) == {"gap": "warning"} and small.exit_code == 0


def test_a_tilted_axis_locks_and_is_told(tmp_path: Path) -> None:
    tilted = fourbar().replace('name="rocker" axis="0 -1 0"', 'name="rocker" axis="1e-4 -1 0"')
    d = look(tmp_path, tilted)
    assert (
        d.freedoms == 0
        and graver(d)["nearly_redundant"] == "error"
        and "1 freedoms" in d.finding("nearly_redundant").sentence
    )


def test_redundant_gears_by_name_and_an_inconsistent_one(tmp_path: Path) -> None:
    good = look(tmp_path, planetary("20"))
    assert good.freedoms == 1 and [x.sentence for x in good.redundant] == ["sun2 = +1 sun1"] and graver(good) == {}
    bad = look(tmp_path, planetary("20.02"))  # a ratio off by a thousandth: no warning of the engine, the train locks
    assert bad.freedoms == 0 and graver(bad)["nearly_redundant"] == "error" and bad.exit_code == 3


def test_tendons_across_branches(tmp_path: Path) -> None:
    def rub(extra: str, integrator: str = "RK4") -> dict[str, str]:
        line = f'<fixed name="rub" {extra}><joint joint="sun" coef="1"/><joint joint="planet1" coef="-1"/></fixed>'
        d = look(tmp_path, planetary("20", line).replace("RK4", integrator))
        return {f.name: f.severity for f in d.findings}

    assert rub('armature="1e-4"')["armature_across_branches"] == "error"
    assert rub('damping="1e-4"')["damping_across_branches"] == "note"
    assert rub('damping="1e-4"', "implicitfast")["damping_across_branches"] == "error"
    along = (
        '<fixed name="rub" armature="1e-4"><joint joint="carrier" coef="1"/><joint joint="planet1" coef="-1"/></fixed>'
    )
    assert graver(look(tmp_path, planetary("20", along))) == {}
    # The trap itself: the mass matrix lacks the product that J^T armature J has off its diagonal.
    text = planetary("20", along.replace('"carrier"', '"sun"'))
    model = mujoco.MjModel.from_xml_string(text)
    data, mass = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, mass)
    sun, planet = (model.joint(n).dofadr[0] for n in ("sun", "planet1"))
    assert mass[sun, planet] == 0.0  # expected: -1e-4


def test_sparse_jacobian(tmp_path: Path) -> None:
    found = graver(look(tmp_path, fourbar(option=OPTION.replace("dense", "sparse"))))
    assert found.keys() == ({"sparse_jacobian"} if mujoco.mj_versionString() == "4.0.0" else set())


def test_pins_between_masses_that_stand_still(tmp_path: Path) -> None:
    """A cardan joint: MuJoCo's row has the softness 1e-15 (its least), and the free joint does not keep its energy."""
    text = to_mjcf(cardan())
    assert "still_masses" not in graver(look(tmp_path, text))
    bare = re.sub(r'(<body name="pin:holder">\s*<inertial pos)="[^"]*"', r'\1="0 0 0"', text)
    found = look(tmp_path, bare).finding("still_masses")
    assert found.severity == "error" and "diagexact" in found.paste and "pin" in found.sentence
    kept = []
    for file in (text, bare):
        model = mujoco.MjModel.from_xml_string(file)
        data = mujoco.MjData(model)
        data.qvel[:] = [6.0, 0.0, 6.0 * math.cos(BEND)]
        for _ in range(300):
            mujoco.mj_step(model, data)
        kept.append(abs(data.qvel[0]))
    assert 4.0 < kept[0] < 9.0 and not 4.0 < kept[1] < 9.0


def test_a_damper_too_stiff_for_the_integrator(tmp_path: Path) -> None:
    """A disc of inertia J with damping c: RK4 is stable up to c h / J = 2.785 (Hairer & Wanner), 'discrete' at any."""

    def disc(rate: float, integrator: str) -> Diagnosis:
        text = (
            f'<mujoco><option timestep="0.001" integrator="{integrator}"><flag autoreset="disable"/></option><worldbody><body>'
            f'<joint name="hub" damping="{rate * 1e3 * 0.01}"/><inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>'
            "</body></worldbody></mujoco>"
        )
        return look(tmp_path, text)

    assert "unstable_step" not in graver(disc(2.7, "RK4")) and "unstable_step" not in graver(disc(50, "discrete"))
    assert "unstable_step" not in graver(disc(50, "Euler"))  # which takes joint damping implicitly
    bad = disc(2.9, "RK4")
    assert bad.finding("unstable_step").severity == "error" and "hub" in bad.finding("unstable_step").sentence


def test_a_spring_too_stiff_for_the_integrator(tmp_path: Path) -> None:
    """omega h = 2.1 is beyond the 2 of symplectic Euler and within the 2.83 of RK4."""
    stiffness = 0.01 * 2100.0**2

    def found(integrator: str) -> dict[str, str]:
        text = (
            f'<mujoco><option timestep="0.001" integrator="{integrator}"><flag autoreset="disable"/></option><worldbody><body>'
            f'<joint name="hub" stiffness="{stiffness}"/><inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>'
            "</body></worldbody></mujoco>"
        )
        return graver(look(tmp_path, text))

    assert "unstable_step" in found("Euler") and "unstable_step" not in found("RK4")


def test_degrees(tmp_path: Path) -> None:
    sick = look(tmp_path, fourbar(compiler="", crank='range="-1.57 1.57"'))
    assert graver(sick)["degrees"] == "error" and 'angle="radian"' in sick.finding("degrees").paste
    sick = look(tmp_path, fourbar(crank='range="-90 90"'))
    assert graver(sick)["degrees"] == "error"
    assert "degrees" not in graver(look(tmp_path, fourbar(compiler="", crank='range="-90 90"')))
    assert "degrees" not in graver(look(tmp_path, fourbar(crank='range="-1.57 1.57"')))


def test_a_joint_without_a_range_is_not_in_degrees(tmp_path: Path) -> None:
    """A URDF says "no range" as 1e9 rad; the same joint with 180 is in degrees."""
    free = ml.to_urdf(ml.load("fourbar").mechanism())
    path = tmp_path / "free.urdf"
    path.write_text(free)
    assert "1000000000" in free and "degrees" not in {f.name for f in ml.doctor(path).findings}
    path.write_text(free.replace("1000000000", "180"))
    assert "degrees" in {f.name for f in ml.doctor(path).findings}


def test_contacts_limits_friction_activation_masses(tmp_path: Path) -> None:
    assert graver(look(tmp_path, fourbar(defaults="")))["contacts"] == "error"  # coupler and rocker meet in the pin
    assert graver(look(tmp_path, fourbar(crank='range="0.5 1"')))["beyond_range"] == "warning"
    assert look(tmp_path, fourbar(crank='frictionloss="0.01"')).finding("soft_friction").severity == "note"
    hard = 'frictionloss="0.01" solreffriction="0.002 1" solimpfriction=".9999 .9999 .001 .5 2"'
    assert "soft_friction" not in {f.name for f in look(tmp_path, fourbar(crank=hard)).findings}
    lag = '<actuator><general name="lag" joint="crank" dyntype="filter" dynprm="{}" gainprm="1e-4"/></actuator>'
    found = graver(look(tmp_path, fourbar(rest=lag.format(0.05))))
    assert found["first_order_activation"] == "warning" and "fast_activation" not in found
    assert graver(look(tmp_path, fourbar(rest=lag.format(0.0001))))["fast_activation"] == "error"
    boxed = fourbar(compiler='<compiler angle="radian" balanceinertia="true"/>')
    assert graver(look(tmp_path, boxed)) == {"masses_changed": "warning"}


def test_units(tmp_path: Path) -> None:
    body = '<body pos="{} 0 0"><joint name="a"/><inertial pos="0 0 0.2" mass="1" diaginertia="{} {} {}"/><geom size=".1"/></body>'

    def found(at: float, inertia: float) -> dict[str, str]:
        bodies = body.format(at, inertia, inertia, inertia) + body.replace('"a"', '"b"').format(0, 0.01, 0.01, 0.01)
        return graver(look(tmp_path, f"<mujoco>{OPTION}{NO_CONTACT}<worldbody>{bodies}</worldbody></mujoco>"))

    assert found(0.5, 0.01) == {}
    assert found(500.0, 0.01)["millimetres"] == "error" and found(0.5, 1e4)["inertia_unit"] == "error"


def test_sag_is_what_the_engine_settles_at(tmp_path: Path) -> None:
    """A mass of 1 kg hung by a soft weld: the predicted residual is that at which MuJoCo comes to rest."""
    text = (
        f'<mujoco>{OPTION}<worldbody><body name="lump"><joint type="slide" axis="0 0 1" name="z"/><geom size="0.1" mass="1"/>'
        '</body></worldbody><equality><joint name="hang" joint1="z" solref="0.2 1" solimp=".9 .9 .001 .5 2"/></equality></mujoco>'
    )
    d = look(tmp_path, text)
    said = float(d.finding("sag").sentence.split("gives way by ")[1].split()[0])
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    for _ in range(4000):
        mujoco.mj_step(model, data)
    assert said == pytest.approx(-data.qpos[0], rel=5e-3)  # printed with three digits


def test_curved_and_switched_off_equalities(tmp_path: Path) -> None:
    curved = fourbar(equal=f'<joint name="cam" joint1="rocker" joint2="crank" polycoef="0 1 0.5 0 0" {HARD}/>')
    d = look(tmp_path, curved)
    assert d.finding("curved_equality").severity == "warning" and d.freedoms == 2
    off = look(tmp_path, fourbar(equality=f'{HARD} active="false"'))
    assert off.finding("switched_off").severity == "warning" and off.freedoms == 3


def test_what_pinocchio_would_lose(tmp_path: Path) -> None:
    text = (
        planetary("20").replace('<body name="base">', "").replace("</body></body></worldbody>", "</body></worldbody>")
    )
    d = look(tmp_path, text)
    note = d.finding("pinocchio_reader")
    assert note.severity == "note" and "every body of the world but the first" in note.sentence
    assert "4 joint and tendon equalities" in note.sentence
    import pinocchio

    path = tmp_path / "patient.xml"
    assert pinocchio.buildModelFromMJCF(str(path)).nv == 1 and d.coordinates == 4  # the trap itself


# -- URDF --------------------------------------------------------------------------------------------------------------


def test_urdf(tmp_path: Path) -> None:
    good = look(tmp_path, arm(), "urdf")
    assert good.freedoms == 2 and graver(good) == {} and good.findings == ()
    assert (
        "<option" in good.paste
        and mujoco.MjModel.from_xml_string(arm().replace("</robot>", f"{good.paste}</robot>")).nv == 2
    )
    mimic = look(tmp_path, arm(extra='<mimic joint="shoulder" multiplier="-2"/>'), "urdf")
    assert mimic.freedoms == 1 and graver(mimic) == {"mimic": "warning"}
    assert look(tmp_path, arm("continuous"), "urdf").finding("continuous").severity == "note"
    assert graver(look(tmp_path, arm(lower=1.0), "urdf")) == {"fixed_range": "warning"}
    for sick, name in ((arm(mass=0.0), "massless"), (arm(ixx=0.05), "triangle")):
        d = look(tmp_path, sick, "urdf")
        assert graver(d)[name] == "error" and d.exit_code == 3
        with pytest.raises(ValueError, match="mass|inertia"):  # the trap itself
            mujoco.MjModel.from_xml_string(sick)


# -- the verb --------------------------------------------------------------------------------------------------------------


def test_files_that_cannot_be_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, text in (("a.xml", "<mujoco>"), ("b.urdf", "<mujoco/>"), ("c.xml", "\0"), ("d.json", "{}")):
        (tmp_path / name).write_text(text)
        assert main(["doctor", str(tmp_path / name)]) == 1
        message = capsys.readouterr().err
        assert message.count("\n") == 1 and name in message and "internal" not in message
    assert main(["doctor", str(tmp_path / "none.xml")]) == 1 and main(["doctor", "fourbar", "x=1"]) == 2


def test_a_file_that_mujoco_refuses_is_diagnosed(tmp_path: Path) -> None:
    d = look(tmp_path, "<mujoco><worldbody><body><joint/></body></worldbody></mujoco>")
    assert (
        d.finding("refused").severity == "error"
        and "mass and inertia" in d.finding("refused").sentence
        and d.exit_code == 3
    )


def test_json_and_exit_codes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "soft.xml"
    path.write_text(fourbar(equality=""))
    assert main(["doctor", str(path), "--json"]) == 3
    document = json.loads(capsys.readouterr().out)
    assert {"freedoms", "redundant", "gap", "findings", "paste"} <= document.keys() and document["freedoms"] == 1
    assert {"name", "severity", "sentence", "paste", "number", "consequence"} == document["findings"][0].keys()
    assert main(["doctor", "pendulum", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["freedoms"] == 1
    path.write_text(fourbar())
    assert main(["doctor", str(path)]) == 0 and "1 degree of freedom" in capsys.readouterr().out


def test_settings_follow_the_timestep() -> None:
    assert 'solref="0.004 1"' in equality_default(0.002)
    model = mujoco.MjModel.from_xml_string(fourbar())
    assert "<default>" in settings_to_paste(model, None, ()) and 'integrator="discrete"' in settings_to_paste(
        model, None, ()
    )
