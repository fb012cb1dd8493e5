"""Tendons, actuators, sensors and the keyframe of an MJCF file."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

from mechlab.errors import MechlabError
from mechlab.experiment.scene import Settings
from mechlab.formats.mjcf import write_loops as names
from mechlab.formats.mjcf.write_loops import ConnectorBody
from mechlab.formats.xml_text import add
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Coefficients, Drive, Shaft
from mechlab.mechanism.statics import hold_reference_pose


def write_tendons(root: ET.Element, m: Mechanism, s: Settings, size: float) -> None:
    """The <tendon> section: shafts and relations as fixed tendons, springs and distance loops as spatial ones."""
    distances = [x for x in m.loops if x.kind == "distance"]
    if not (m.shafts or m.relations or m.springs or distances):
        return
    section = add(root, "tendon")
    for shaft in m.shafts:
        _terms(add(section, "fixed", name=shaft.name, **_shaft(shaft, s)), shaft.coefficients)
    for relation in m.relations:
        _terms(add(section, "fixed", name=names.tendon_name(m, relation.name)), relation.coefficients)
    for spring in m.springs:
        passive: dict[str, object] = {"stiffness": spring.stiffness, "damping": spring.damping}
        if spring.range is not None:
            passive |= {"range": spring.range, "solreflimit": s.solref, "solimplimit": s.solimp}
        element = add(
            section, "spatial", name=names.tendon_name(m, spring.name), springlength=spring.rest_length, **passive,
            width=0.01 * size,
        )  # fmt: skip
        _ends(element, spring.name)
    for loop in distances:
        _ends(add(section, "spatial", name=names.tendon_name(m, loop.name), width=0.01 * size), loop.name)


def _shaft(shaft: Shaft, s: Settings) -> dict[str, object]:
    """Attributes of a shaft. Its tendon length is sum c q: the armature adds inertia c c^T to the mass matrix."""
    out: dict[str, object] = {}
    for key, value in (("armature", shaft.inertia), ("damping", shaft.damping), ("stiffness", shaft.stiffness)):
        if value:
            out[key] = value
    if shaft.stiffness:
        rest = shaft.spring_rest - shaft.zero
        # MuJoCo reads the springlength -1 as "not given"
        out["springlength"] = math.nextafter(-1.0, 0.0) if rest == -1.0 else rest
    if shaft.friction:
        out |= {"frictionloss": shaft.friction, "solreffriction": s.solref, "solimpfriction": s.solimp}
    if shaft.range is not None:
        out["range"] = (shaft.range[0] - shaft.zero, shaft.range[1] - shaft.zero)
        out |= {"solreflimit": s.solref, "solimplimit": s.solimp}
    if shaft.zero:
        out["user"] = shaft.zero
    return out


def _terms(element: ET.Element, coefficients: Coefficients) -> None:
    for joint, c in coefficients:
        add(element, "joint", joint=joint, coef=float(c))


def _ends(element: ET.Element, name: str) -> None:
    for site in names.site_names(name):
        add(element, "site", site=site)


def write_actuators(root: ET.Element, m: Mechanism, size: float, held: bool) -> dict[str, float]:
    """The <actuator> section; returns for each drive the control that holds the reference pose as well as it can, or, unless `held`,
    that of no force.

    A drive with stiffness is a position servo, force = kp (ctrl - coordinate) - kv rate, or with a target of its own
    kp (target + ctrl - coordinate) - kv rate; one without is a motor, force = ctrl, whose damping acts too, within the
    limit if there is one. Ranges of the controls are for the sliders of a viewer: clamping is off. A drive with units of its
    control is written in them, with its range.
    """
    controls: dict[str, float] = {}
    if not m.drives:
        return controls
    forces = hold_reference_pose(m).forces if held else dict.fromkeys((d.name for d in m.drives), 0.0)
    section = add(root, "actuator")
    joints = {j.name for j in m.joints}
    free = "false" if clamps(m) else None
    for drive in m.drives:
        if drive.limit == 0.0:
            raise MechlabError(
                f"{m.name}: drive {drive.name!r}: a force limit of 0 cannot be written as MJCF; leave it out."
            )
        target = {"joint" if drive.on in joints else "tendon": drive.on}
        limits = None if drive.limit is None else (-drive.limit, drive.limit)
        force = forces[drive.name]
        offset = 0.0 if drive.target is None else drive.target - m.zero(drive.on)
        value = float(f"{force / drive.stiffness - offset if drive.stiffness else force:.12g}")
        controls[drive.name] = value
        if drive.winding is not None:
            controls[drive.name] = _dc_motor(section, drive, target, force, limits)
            continue
        if drive.control is not None:
            controls[drive.name] = _in_file_units(section, m, drive, target, force, size)
            continue
        common: dict[str, object] = {"ctrlrange": _slider(m, drive, value, size), "forcerange": limits, "ctrllimited": free}
        if offset or (drive.damping and drive.limit is not None and not drive.stiffness):
            bias = (drive.stiffness * offset, -drive.stiffness, -drive.damping)
            affine = {"gainprm": drive.stiffness or 1.0, "biastype": "affine", "biasprm": bias}
            add(section, "general", name=drive.name, **target, **affine, **common)
        elif drive.stiffness:
            servo = {"kp": drive.stiffness, "kv": drive.damping or None}
            add(section, "position", name=drive.name, **target, **servo, **common)
        else:
            add(section, "motor", name=drive.name, **target, damping=drive.damping or None, **common)
    return controls


def clamps(m: Mechanism) -> bool:
    """True when a drive has a range that its control is clamped to."""
    return any(d.control is not None and d.control.range is not None for d in m.drives)


def _in_file_units(
    section: ET.Element, m: Mechanism, drive: Drive, target: dict[str, str], force: float, size: float
) -> float:
    """An actuator that makes of a control the force that `Control` says; returns the control that gives `force`.

    In the file, lengths are 0 in the reference pose: the bias is the force there at the control 0. The push itself, which
    counts from the physical value 0, is user[0].
    """
    c = drive.control
    assert c is not None
    stiffness, damping = drive.stiffness / c.gear**2, drive.damping / c.gear**2
    bias = c.push - stiffness * c.gear * m.zero(drive.on)
    attributes: dict[str, object] = {"name": drive.name, **target, "gear": c.gear if c.gear != 1.0 else None}
    forces = c.force_range or (None if drive.limit is None else (-drive.limit / abs(c.gear), drive.limit / abs(c.gear)))
    value = float(f"{(force / c.gear - bias) / c.gain:.12g}") if c.gain else 0.0
    if c.range is not None:
        value = min(max(value, c.range[0]), c.range[1])
        attributes["ctrlrange"] = c.range
    elif c.gain:
        ends = _slider(m, drive, force / drive.stiffness if drive.stiffness else force, size)
        scale = (stiffness * c.gear if drive.stiffness else 1.0 / c.gear) / c.gain
        low, high = sorted(x * scale - (0.0 if drive.stiffness else c.push / c.gain) for x in ends)
        shift = -bias / c.gain if drive.stiffness else 0.0
        attributes |= {"ctrlrange": (min(low + shift, value), max(high + shift, value))}
        attributes["ctrllimited"] = "false"
    attributes |= {"forcerange": forces, "user": c.push}
    if not (bias or stiffness or damping or c.gain != 1.0):
        add(section, "motor", **attributes)
    elif not bias and stiffness and c.gain == stiffness:
        add(section, "position", kp=stiffness, kv=damping or None, **attributes)
    elif not (bias or stiffness) and c.gain == damping:
        add(section, "velocity", kv=damping, **attributes)
    else:
        affine = {"biastype": "affine", "biasprm": (bias, -stiffness, -damping)} if bias or stiffness or damping else {}
        add(section, "general", gainprm=c.gain, **affine, **attributes)
    return value


def _dc_motor(
    section: ET.Element, drive: Drive, target: dict[str, str], force: float, limits: tuple[float, float] | None
) -> float:
    """A DC motor whose control is the voltage; returns the voltage that holds the force at standstill."""
    assert drive.winding is not None
    w = drive.winding
    value = float(f"{force * w.resistance / w.constant:.12g}") if w.constant else 0.0
    most = _round_up(max(4.0 * abs(value), 1e3 * abs(w.constant), 1e-6))
    add(
        section, "dcmotor", name=drive.name, **target, motorconst=w.constant, resistance=w.resistance,
        inductance=w.inductance or None, input="voltage", ctrlrange=(-most, most), forcerange=limits,
    )  # fmt: skip
    return value


def _slider(m: Mechanism, drive: Drive, value: float, size: float) -> tuple[float, float]:
    """Range of the control that a viewer offers; it contains the control of the keyframe."""
    if not drive.stiffness:
        most = _round_up(max(4.0 * abs(value), 0.1 * m.total_mass * 9.81 * size, 1e-6))
        return (-most, most) if drive.limit is None else (-drive.limit, drive.limit)
    joint = next((j for j in m.joints if j.name == drive.on), None)
    if joint is not None and joint.range is not None:
        low, high = joint.range[0] - joint.zero, joint.range[1] - joint.zero
    elif joint is not None and joint.kind == "prismatic":
        low, high = -size, size
    else:
        low, high = -math.pi, math.pi
    return (min(low, value), max(high, value))


def _round_up(x: float) -> float:
    """The next number of the series 1, 2, 5, 10."""
    if not math.isfinite(x):
        raise MechlabError("the holding force of a drive overflows. Are masses and lengths in kg and m?")
    power = math.floor(math.log10(x))
    for factor in (1, 2, 5):
        if float(f"{factor}e{power}") >= x:
            return float(f"{factor}e{power}")
    return float(f"1e{power + 1}")


def write_sensors(root: ET.Element, m: Mechanism) -> None:
    """The <sensor> section, by prefix: pos: and rate: of joints and shafts, force: of drives, gap: of loops and
    relations, length: of springs, at: of frames. Reactions of loops and gears have no sensor: they are in efc_force."""
    section = add(root, "sensor")
    for joint in m.joints:
        if joint.nv == 1:
            add(section, "jointpos", name=f"pos:{joint.name}", joint=joint.name)
            add(section, "jointvel", name=f"rate:{joint.name}", joint=joint.name)
        else:
            add(section, "ballquat", name=f"pos:{joint.name}", joint=joint.name)
            add(section, "ballangvel", name=f"rate:{joint.name}", joint=joint.name)
    for shaft in m.shafts:
        add(section, "tendonpos", name=f"pos:{shaft.name}", tendon=shaft.name)
        add(section, "tendonvel", name=f"rate:{shaft.name}", tendon=shaft.name)
    for drive in m.drives:
        add(section, "actuatorfrc", name=f"force:{drive.name}", actuator=drive.name)
    for loop in m.loops:
        a, b = names.site_names(loop.name)
        ends = {"objtype": "site", "objname": b, "reftype": "site", "refname": a}
        add(section, "framepos", name=f"gap:{loop.name}", **ends)
    for relation in m.relations:
        add(section, "tendonpos", name=f"gap:{relation.name}", tendon=names.tendon_name(m, relation.name))
    for spring in m.springs:
        add(section, "tendonpos", name=f"length:{spring.name}", tendon=names.tendon_name(m, spring.name))
    for frame in m.frames:
        add(section, "framepos", name=f"at:{frame.name}", objtype="site", objname=frame.name)
    if not len(section):
        root.remove(section)


def write_home(root: ET.Element, m: Mechanism, plan: tuple[ConnectorBody, ...], controls: dict[str, float]) -> None:
    """The keyframe `home`: the reference pose, with the controls that hold it."""
    qpos: list[float] = []
    for kind in _dof_order(m, plan):
        qpos += [1.0, 0.0, 0.0, 0.0] if kind == "spherical" else [0.0]
    attributes: dict[str, object] = {"qpos": qpos}
    if controls:
        attributes["ctrl"] = [controls[d.name] for d in m.drives]
    add(add(root, "keyframe"), "key", name="home", **attributes)


def _dof_order(m: Mechanism, plan: tuple[ConnectorBody, ...]) -> list[str]:
    """Kinds of all joints in the order of MuJoCo: depth-first, connectors after the other children."""
    children: dict[str, list[str]] = {}
    for body in m.bodies:
        children.setdefault(body.parent, []).append(body.name)
    out: list[str] = []

    def visit(name: str) -> None:
        for child in children.get(name, []):
            out.extend(j.kind for j in m.body(child).joints)
            visit(child)
        for c in plan:
            if c.host == name:
                out.extend(kind for kind, _ in c.joints)

    visit("ground")
    return out
