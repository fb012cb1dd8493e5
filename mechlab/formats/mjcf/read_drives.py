"""Tendons and actuators of an MJCF text: shafts, springs, drives."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import field, replace

import numpy as np

from mechlab.errors import unknown
from mechlab.formats.json_text import exact
from mechlab.formats.mjcf.control import LinearActuator, drive_of
from mechlab.formats.mjcf.read_tree import BodyTree
from mechlab.formats.mjcf.source import MjcfText, Names, fail, one, refuse
from mechlab.formats.xml_text import floats, label
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.parts import Coefficients, Drive, Shaft, Spring, Winding

Terms = tuple[tuple[str, float], ...]


def coupled(first: Terms, other: Terms, ratio: float) -> Coefficients:
    """The coefficients of first - ratio x other, without those that are 0."""
    total: dict[str, float] = {}
    for name, c in (*first, *((n, -ratio * c) for n, c in other)):
        total[name] = total.get(name, 0.0) + c
    return tuple((n, exact(c)) for n, c in total.items() if c != 0.0)


@dataclass
class Tendons:
    """The tendons of a text as parts of a Mechanism, by their MJCF names."""

    fixed: dict[str, Terms] = field(default_factory=dict)
    shafts: dict[str, Shaft] = field(default_factory=dict)
    springs: dict[str, Spring] = field(default_factory=dict)
    distances: dict[str, tuple[str, str]] = field(default_factory=dict)

    def terms(self, name: str | None, element: ET.Element) -> Terms:
        """((joint, coefficient), ...) of a fixed tendon that `element` refers to."""
        if name not in self.fixed:
            raise unknown(f"{label(element)}: fixed tendon", name, self.fixed)
        return self.fixed[name]


def read_tendons(source: MjcfText, tree: BodyTree) -> Tendons:
    """All tendons. A fixed one that only an equality uses is a relation, any other is a shaft."""
    out = Tendons()
    held = {e.get(k) for e in source.items("equality") if e.tag == "tendon" for k in ("tendon1", "tendon2")}
    driven = {e.get("tendon") for e in source.items("actuator")}
    shaft_names = Names("shaft")
    for joint in tree.joint_names.given.values():
        shaft_names.add(joint)
    for child in source.items("tendon"):
        e = source.attributes(child)
        refuse(e, "springyield", "actuatorfrcrange")
        name = child.get("name") or f"tendon_{len(out.fixed) + len(out.springs) + 1}"
        if e.tag == "fixed":
            out.fixed[name] = tuple((tree.joint_names.find(j.get("joint"), e), one(j, "coef")) for j in child)
            passive = any(one(e, k) for k in ("damping", "armature", "frictionloss", "stiffness")) or _stops(source, e)
            if passive or name in driven or name not in held:
                out.shafts[name] = _shaft(source, tree, e, shaft_names.add(name), out.fixed[name])
        elif e.tag == "spatial":
            _spatial(source, tree, e, child, name, out, name in held)
        else:
            raise fail(e, "mechlab does not read this kind of tendon.")
    return out


def _shaft(source: MjcfText, tree: BodyTree, e: ET.Element, name: str, terms: Terms) -> Shaft:
    start = sum(c * tree.ref[j] for j, c in terms)
    user = floats(e, "user") or ()
    zero = user[0] if source.ours and user else start
    rest = floats(e, "springlength")
    if rest is not None and len(set(rest)) > 1:
        raise fail(e, "a spring with a dead band is not read.")
    at = sum(c * tree.spring_at[j] for j, c in terms) if rest is None or rest[0] == -1.0 else rest[0]
    stiffness = one(e, "stiffness")
    coefficients = tuple((j, exact(c)) for j, c in terms)
    return Shaft(
        name, coefficients, zero, one(e, "armature"), one(e, "damping"), one(e, "frictionloss"), stiffness,
        at - start + zero if stiffness else 0.0, range=_shifted(_stops(source, e), zero - start),
    )  # fmt: skip


def _stops(source: MjcfText, e: ET.Element) -> tuple[float, float] | None:
    """The range of a tendon, None where it is not limited."""
    limits, limited = floats(e, "range", 2), e.get("limited", "auto")
    if limits is None or limited == "false" or (limited == "auto" and not source.autolimits):
        return None
    return limits[0], limits[1]


def _shifted(limits: tuple[float, float] | None, by: float) -> tuple[float, float] | None:
    return None if limits is None else (limits[0] + by, limits[1] + by)


def _spatial(
    source: MjcfText, tree: BodyTree, e: ET.Element, child: ET.Element, name: str, out: Tendons, held: bool
) -> None:
    refuse(e, "armature", "frictionloss")
    sites = [s.get("site", "") for s in child]
    if len(sites) != 2 or any(s.tag != "site" for s in child):
        raise fail(e, "only spatial tendons between two sites are read.")
    for site in sites:
        if site not in tree.sites:
            raise unknown(f"{label(e)}: site", site, tree.sites)
    if held:
        out.distances[name] = (sites[0], sites[1])
    stiffness, damping = one(e, "stiffness"), one(e, "damping")
    stops = _stops(source, e)
    if not (stiffness or damping or stops):
        return
    rest = floats(e, "springlength") or ((0.0,) if not stiffness else None)
    if rest is None or rest[0] == -1.0 or len(set(rest)) > 1:
        raise fail(e, "a spring needs one springlength.")
    (body_a, at_a), (body_b, at_b) = tree.sites[sites[0]], tree.sites[sites[1]]
    out.springs[name] = Spring(name, body_a, body_b, at_a.position, at_b.position, stiffness, damping, rest[0], stops)


def read_drives(source: MjcfText, tree: BodyTree, tendons: Tendons) -> tuple[Drive, ...]:
    """Motors, position and velocity servos, and general actuators that are one of them, on joints and fixed tendons.

    The target of a servo is what it holds in MuJoCo at the control 0. Raises MechlabError for what a Drive cannot
    represent.
    """
    clamped = not any(f.get("clampctrl") == "disable" for o in source.section("option") for f in o.findall("flag"))
    names = Names("actuator")
    out = []
    for child in source.items("actuator"):
        e = source.attributes(child)
        if e.tag not in ("motor", "position", "velocity", "dcmotor", "general"):
            raise fail(e, "only motors, DC motors, position and velocity servos are read.")
        refuse(e, "armature", "dampratio", "timeconst", "delay")
        on = _target(tree, tendons, e)
        gear = np.array(floats(e, "gear") or (1.0,))
        if np.any(gear[1:]) or gear[0] == 0.0:
            raise fail(e, "only a scalar gear other than 0 is read.")
        g = float(gear[0])
        name = names.add(child.get("name"), on)
        start, zero = _reference(tree, tendons, e)
        if e.tag == "dcmotor":
            limits = floats(e, "forcerange", 2)
            if limits is not None and limits[0] != -limits[1]:
                raise fail(
                    e, f"the force range {limits} of a DC motor is not symmetric, which a Drive has no place for."
                )
            limit = None if limits is None else limits[1] * abs(g)
            out.append(Drive(name, on, limit=limit, winding=_winding(e, g)))
            continue
        own = source.ours and e.get("user") is None
        actuator = _linear(source, tree, e, clamped, g)
        drive = drive_of(name, on, actuator, start if own or not source.ours else zero)
        if own:  # lengths count from the reference pose, and the control has no units of its own
            target = None if drive.target is None else drive.target - start + zero
            drive = replace(drive, target=target, control=None)
        out.append(drive)
    return tuple(out)


def _linear(source: MjcfText, tree: BodyTree, e: ET.Element, clamped: bool, gear: float) -> LinearActuator:
    """An actuator before its gear: force = gain x control + push - stiffness x length - damping x rate."""
    gain, push, stiffness, damping = _line(e)
    user = floats(e, "user")
    if source.ours and user:
        push = user[0]
    forces = floats(e, "forcerange", 2)
    if e.get("forcelimited", "auto") == "false" or (e.get("forcelimited", "auto") == "auto" and not source.autolimits):
        forces = None
    damping += one(e, "damping")
    bounds = _control_range(source, tree, e, clamped)
    return LinearActuator(
        gain, push, stiffness, damping, gear, bounds, None if forces is None else (forces[0], forces[1])
    )


def _line(e: ET.Element) -> tuple[float, float, float, float]:
    """Gain, push, stiffness and damping of an actuator."""
    if e.tag == "position":
        kp = one(e, "kp", 1.0)
        return kp, 0.0, kp, one(e, "kv")
    if e.tag == "velocity":
        kv = one(e, "kv", 1.0)
        return kv, 0.0, 0.0, kv
    if e.tag == "motor":
        return 1.0, 0.0, 0.0, 0.0
    refuse(e, "actdim", "dynprm", "actrange", "actearly")
    kinds = (e.get("dyntype", "none"), e.get("gaintype", "fixed"), e.get("biastype", "none"))
    bias = (*(floats(e, "biasprm") or ()), 0.0, 0.0, 0.0)[:3] if kinds[2] == "affine" else (0.0, 0.0, 0.0)
    if kinds[:2] != ("none", "fixed") or kinds[2] not in ("none", "affine") or bias[1] > 0.0 or bias[2] > 0.0:
        raise fail(e, f"a general actuator of dyntype, gaintype, biastype {kinds} and bias {bias} is no Drive.")
    gain = (floats(e, "gainprm") or (1.0,))[0]
    return gain, bias[0], -bias[1] or 0.0, -bias[2] or 0.0


def _control_range(source: MjcfText, tree: BodyTree, e: ET.Element, clamped: bool) -> tuple[float, float] | None:
    """The range that MuJoCo clamps the control to, its own or inherited; None where it does not."""
    bounds: Sequence[float] | None = floats(e, "ctrlrange", 2)
    limited, share = e.get("ctrllimited", "auto"), one(e, "inheritrange")
    if share and e.tag == "position" and e.get("joint") is not None:
        low, high = tree.range.get(tree.joint_names.find(e.get("joint"), e), (0.0, 0.0))
        bounds = (0.5 * (low + high) - 0.5 * share * (high - low), 0.5 * (low + high) + 0.5 * share * (high - low))
    if bounds is None or not clamped or limited == "false" or (limited == "auto" and not source.autolimits):
        return None
    return float(bounds[0]), float(bounds[1])


def _reference(tree: BodyTree, tendons: Tendons, e: ET.Element) -> tuple[float, float]:
    """Length of a joint or tendon in the reference pose, in the coordinates of the file, and its physical value there."""
    if e.get("joint") is not None:
        name = tree.joint_names.find(e.get("joint"), e)
        return tree.ref[name], tree.zero[name]
    start = sum(c * tree.ref[j] for j, c in tendons.terms(e.get("tendon"), e))
    return start, tendons.shafts[e.get("tendon", "")].zero


def _winding(e: ET.Element, gear: float) -> Winding:
    """The electrical side of a DC motor; a gear multiplies torque and back-EMF."""
    refuse(e, "nominal", "saturation", "cogging", "controller", "thermal", "lugre", "damping")
    if e.get("input", "voltage") != "voltage":
        raise fail(e, "only DC motors whose input is the voltage are read.")
    constants = floats(e, "motorconst") or (0.0,)
    if len(set(constants)) > 1:
        raise fail(e, "a torque constant that differs from the back-EMF constant has no place in a Winding.")
    inductance = floats(e, "inductance") or (0.0,)
    return Winding(constants[0] * gear, one(e, "resistance"), inductance[0])


def _target(tree: BodyTree, tendons: Tendons, e: ET.Element) -> str:
    if e.get("joint") is not None:
        return tree.joint_names.find(e.get("joint"), e)
    if e.get("tendon") in tendons.shafts:
        return tendons.shafts[e.get("tendon", "")].name
    raise fail(e, "it must act on a joint or on a fixed tendon.")
