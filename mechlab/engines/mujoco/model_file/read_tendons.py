"""Tendons of a compiled MuJoCo model: shafts, springs, and what a Mechanism cannot say of them."""

from __future__ import annotations

from dataclasses import field

import mujoco
import numpy as np

from mechlab.engines.mujoco.model_file.compiled import OBJECT, given_name, key
from mechlab.engines.mujoco.model_file.read_tree import CompiledTree, actuators_on, site_place, switched_off
from mechlab.formats.json_text import exact
from mechlab.formats.mjcf.read_drives import Terms
from mechlab.formats.mjcf.source import Names
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Placement
from mechlab.mechanism.parts import Shaft, Spring

WRAP, DISABLE = mujoco.mjtWrap, mujoco.mjtDisableBit


@dataclass
class Tendons:
    """Tendons by their number in the model: `fixed` sums of joints, `shafts` those that are a part of their own, `straight` the
    two ends of a spatial tendon."""

    fixed: dict[int, Terms] = field(default_factory=dict)
    shafts: dict[int, Shaft] = field(default_factory=dict)
    straight: dict[int, tuple[tuple[str, Placement], tuple[str, Placement]]] = field(default_factory=dict)
    springs: dict[int, Spring] = field(default_factory=dict)

    def of(self, model: mujoco.MjModel) -> dict[str, str]:
        """The file's tendon -> shaft or spring."""
        parts: dict[int, Shaft | Spring] = {**self.shafts, **self.springs}
        return {key(model, OBJECT.mjOBJ_TENDON, k): x.name for k, x in parts.items()}


@dataclass(frozen=True)
class Passive:
    """Passive properties of a tendon, without those that the file switches off."""

    stiffness: float
    damping: float
    armature: float
    friction: float
    rest: tuple[float, float]
    range: tuple[float, float] | None

    @property
    def acts(self) -> bool:
        """True for a tendon that exerts a force."""
        return bool(self.stiffness or self.damping or self.armature or self.friction or self.range)


def passive(model: mujoco.MjModel, k: int) -> Passive:
    """Passive properties of a tendon."""
    limited = bool(model.tendon_limited[k]) and not switched_off(model, DISABLE.mjDSBL_LIMIT, DISABLE.mjDSBL_CONSTRAINT)
    on = actuators_on(model, mujoco.mjtTrn.mjTRN_TENDON, k)
    damping = float(model.tendon_damping[k]) + sum(g * g * float(model.actuator_damping[a]) for a, g in on)
    armature = float(model.tendon_armature[k]) + sum(g * g * float(model.actuator_armature[a]) for a, g in on)
    rubs = not switched_off(model, DISABLE.mjDSBL_FRICTIONLOSS, DISABLE.mjDSBL_CONSTRAINT)
    return Passive(
        0.0 if switched_off(model, DISABLE.mjDSBL_SPRING) else float(model.tendon_stiffness[k]),
        0.0 if switched_off(model, DISABLE.mjDSBL_DAMPER) else damping,
        armature,
        float(model.tendon_frictionloss[k]) if rubs else 0.0,
        (float(model.tendon_lengthspring[k, 0]), float(model.tendon_lengthspring[k, 1])),
        (float(model.tendon_range[k, 0]), float(model.tendon_range[k, 1])) if limited else None,
    )


def read_tendons(tree: CompiledTree, names: Names) -> Tendons:
    """All tendons. A fixed one that only an equality uses is a relation, any other is a shaft."""
    model = tree.model
    out = Tendons()
    held = _held(model)
    driven = set(model.actuator_trnid[model.actuator_trntype == mujoco.mjtTrn.mjTRN_TENDON, 0].tolist())
    shaft_names = Names("shaft")
    for joints in tree.joints_of.values():
        for joint in joints:
            shaft_names.reserve(joint)
    for k in range(model.ntendon):
        span = _span(model, k)
        label, of = key(model, OBJECT.mjOBJ_TENDON, k), passive(model, k)
        if (
            np.any(model.tendon_stiffnesspoly[k])
            or np.any(model.tendon_dampingpoly[k])
            or np.any(model.tendon_springyield[k])
        ):
            tree.remarks.lose("tendon spring", label, "it is nonlinear")
        if all(model.wrap_type[w] == WRAP.mjWRAP_JOINT for w in span):
            out.fixed[k] = _sum(tree, span)
            if of.acts or k in driven or k not in held:
                out.shafts[k] = _shaft(tree, k, shaft_names, out.fixed[k], of)
        elif len(span) == 2 and all(model.wrap_type[w] == WRAP.mjWRAP_SITE for w in span):
            _straight(tree, out, k, names, of, [site_place(tree, int(model.wrap_objid[w])) for w in span])
        elif of.acts or k in driven or k in held:
            tree.remarks.lose("spatial tendon", label, "it runs over more than two points")
        else:
            tree.remarks.keep("spatial tendon", label, "it only measures")
    return out


def _span(model: mujoco.MjModel, k: int) -> range:
    """The points or joints of a tendon."""
    return range(int(model.tendon_adr[k]), int(model.tendon_adr[k] + model.tendon_num[k]))


def _spring(tree: CompiledTree, label: str, of: Passive) -> tuple[float, float]:
    """Stiffness of a tendon and the length at which its spring rests; (0, 0) without a spring, and for one with a dead band, which
    is named as lost."""
    if of.stiffness and of.rest[0] != of.rest[1]:
        tree.remarks.lose("tendon spring", label, "it has a dead band")
        return 0.0, 0.0
    return of.stiffness, of.rest[0] if of.stiffness else 0.0


def _held(model: mujoco.MjModel) -> set[int]:
    kind = model.eq_type == mujoco.mjtEq.mjEQ_TENDON
    return {int(x) for ids in (model.eq_obj1id, model.eq_obj2id) for x in ids[kind] if x >= 0}


def _sum(tree: CompiledTree, span: range) -> Terms:
    model = tree.model
    return tuple((tree.joints_of[int(model.wrap_objid[w])][0], float(model.wrap_prm[w])) for w in span)


def _shaft(tree: CompiledTree, k: int, names: Names, terms: Terms, of: Passive) -> Shaft:
    model = tree.model
    label = key(model, OBJECT.mjOBJ_TENDON, k)
    stiffness, rest = _spring(tree, label, of)
    inertia, damping = of.armature, of.damping
    if (inertia or damping) and not _one_path(tree, k):
        tree.remarks.lose(
            "tendon inertia and damping", label, "its joints do not lie on one path from the root to a leaf"
        )
        inertia = damping = 0.0
    coefficients = tuple((j, exact(c)) for j, c in terms if c)
    zero = float(model.tendon_length0[k])
    return Shaft(
        names.add(given_name(model, OBJECT.mjOBJ_TENDON, k)), coefficients, zero, inertia, damping, of.friction,
        stiffness, rest,
        range=of.range,
    )  # fmt: skip


def _one_path(tree: CompiledTree, k: int) -> bool:
    """True when each of the bodies of a fixed tendon's joints carries, or is carried by, each other one."""
    model = tree.model
    bodies = sorted({int(model.jnt_bodyid[int(model.wrap_objid[w])]) for w in _span(model, k)})
    for below, above in zip(bodies[1:], bodies, strict=False):
        at = below
        while at > above:
            at = int(model.body_parentid[at])
        if at != above:
            return False
    return True


def _straight(
    tree: CompiledTree, out: Tendons, k: int, names: Names, of: Passive, ends: list[tuple[str, Placement]]
) -> None:
    model, label = tree.model, key(tree.model, OBJECT.mjOBJ_TENDON, k)
    a, b = ends
    out.straight[k] = (a, b)
    if of.armature or of.friction:
        tree.remarks.lose("tendon inertia and friction", label, "a spring between two points has none")
    stiffness, rest = _spring(tree, label, of)
    if stiffness or of.damping or of.range:
        name = names.add(given_name(model, OBJECT.mjOBJ_TENDON, k), f"tendon_{k + 1}")
        out.springs[k] = Spring(name, a[0], b[0], a[1].position, b[1].position, stiffness, of.damping, rest, of.range)
