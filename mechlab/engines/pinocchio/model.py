"""Mechanism to pin.Model, directly: joints depth-first, names kept, coordinates converted by name."""

from __future__ import annotations

from dataclasses import field
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from mechlab.engines.pinocchio.workspace import Part, Workspace, parts_of, refuse_long_branches
from mechlab.errors import MechlabError, Untrustworthy
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array, Placement
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import GROUND, Joint
from mechlab.mechanism.tree import no_joints

_AXES = {(1.0, 0.0, 0.0): "X", (0.0, 1.0, 0.0): "Y", (0.0, 0.0, 1.0): "Z"}


@dataclass(frozen=True)
class PinModel:
    """A Mechanism as a pin.Model, and what connects the two.

    model: Pinocchio's model; every Joint is one pin joint of the same name, every Body and Frame a pin frame of its
    name. joint_of: body -> index of the pin joint that carries it (0: ground); offset_of: body -> its placement in
    that joint (rotation (3, 3), translation (3,)). quaternions: first coordinate of each spherical joint, the same on
    both sides.
    """

    mechanism: Mechanism
    model: pin.Model
    joint_of: dict[str, int]
    offset_of: dict[str, tuple[Array, Array]]
    quaternions: tuple[int, ...]
    unused: list[list[Part]] = field(default_factory=list, compare=False, repr=False)
    """The workspace that the check of the model left."""

    def workspace(self) -> Workspace:
        """A fresh workspace for the model."""
        return Workspace(self.model, self.unused.pop() if self.unused else parts_of(self.model))

    def to_pin(self, q: ArrayLike) -> Array:
        """(nq,) Pinocchio's coordinates, quaternions (x, y, z, w) normalized, of a Mechanism's, (w, x, y, z)."""
        out = np.array(q, dtype=float)
        if out.shape != (self.model.nq,):
            raise MechlabError(
                f"{self.mechanism.name}: coordinates have shape {out.shape}, expected ({self.model.nq},)."
            )
        for k in self.quaternions:
            w, x, y, z = out[k : k + 4].tolist()
            norm = (w * w + x * x + y * y + z * z) ** 0.5
            out[k : k + 4] = (x / norm, y / norm, z / norm, w / norm)
        return out

    def from_pin(self, q: ArrayLike) -> Array:
        """(nq,) the Mechanism's coordinates, quaternions (w, x, y, z), of Pinocchio's."""
        out = np.array(q, dtype=float)
        for k in self.quaternions:
            out[k : k + 4] = np.roll(out[k : k + 4], 1)
        return out


_KEPT: list[PinModel] = []


def to_pinocchio(mechanism: Mechanism) -> PinModel:
    """The PinModel of a Mechanism: see `build`. The last few are kept, by identity."""
    for found in _KEPT:
        if found.mechanism is mechanism:
            return found
    made = build(mechanism)
    _KEPT.insert(0, made)
    del _KEPT[16:]
    return made


def build(mechanism: Mechanism) -> PinModel:
    """The pin.Model of a Mechanism's tree; loops, relations and shafts are added by `mechlab.engines.pinocchio.dynamics`.

    Several joints of a body become a chain of pin joints at one point, the last of which carries the inertia; the
    inertia of a body without joints goes to its parent. Raises Untrustworthy when Pinocchio's own check of the model
    fails (its mass matrix would be wrong), EngineMissing for a branch of the tree that is too large for its workspace.
    """
    if not mechanism.nv:
        raise no_joints(mechanism.name)
    model = pin.Model()
    model.name = mechanism.name
    model.gravity = pin.Motion(np.array(mechanism.gravity), np.zeros(3))
    joint_of: dict[str, int] = {GROUND: 0}
    offset_of: dict[str, tuple[Array, Array]] = {GROUND: (np.eye(3), np.zeros(3))}
    quaternions: list[int] = []
    for body in mechanism.bodies:
        joint = joint_of[body.parent]
        placement = _se3(offset_of[body.parent]) * _se3_of(body.placement)
        for item in body.joints:
            joint = model.addJoint(joint, _pin_joint(item), placement, item.name)
            model.addJointFrame(joint)
            _check_place(mechanism, model, item, joint)
            _set_joint(model, item, mechanism.q_slice[item.name].start, mechanism.v_slice[item.name])
            if item.kind == "spherical":
                quaternions.append(mechanism.q_slice[item.name].start)
            placement = pin.SE3.Identity()
        joint_of[body.name] = joint
        offset_of[body.name] = (placement.rotation.copy(), placement.translation.copy())
        if body.inertia.mass:
            inertia = pin.Inertia(body.inertia.mass, np.array(body.inertia.com), body.inertia.matrix())
            model.appendBodyToJoint(joint, inertia, placement)
        model.addFrame(pin.Frame(body.name, joint, placement, pin.FrameType.BODY), False)
    for frame in mechanism.frames:
        placement = _se3(offset_of[frame.body]) * _se3_of(frame.placement)
        model.addFrame(pin.Frame(frame.name, joint_of[frame.body], placement, pin.FrameType.OP_FRAME), False)
    refuse_long_branches(mechanism.name, model)
    parts = parts_of(model)
    if not all(p.model.check(p.data) for p in parts):
        raise Untrustworthy(
            f"{mechanism.name}: Pinocchio refuses the order of the joints; its mass matrix would be silently wrong. "
            "Sort the bodies with mechlab.mechanism.tree."
        )
    return PinModel(mechanism, model, joint_of, offset_of, tuple(quaternions), [parts])


def _check_place(mechanism: Mechanism, model: pin.Model, joint: Joint, index: int) -> None:
    if (
        model.idx_qs[index] != mechanism.q_slice[joint.name].start
        or model.idx_vs[index] != mechanism.v_slice[joint.name].start
    ):
        raise Untrustworthy(
            f"{mechanism.name}: Pinocchio gave joint {joint.name!r} another place among the coordinates."
        )


def _pin_joint(joint: Joint) -> pin.JointModel:
    if joint.kind == "spherical":
        return pin.JointModelSpherical()
    letter = _AXES.get(joint.axis)
    kind = "R" if joint.kind == "revolute" else "P"
    if letter:
        return getattr(pin, f"JointModel{kind}{letter}")()
    unaligned = pin.JointModelRevoluteUnaligned if kind == "R" else pin.JointModelPrismaticUnaligned
    return unaligned(np.array(joint.axis))


def _set_joint(model: pin.Model, joint: Joint, q: int, v: slice) -> None:
    model.armature[v] = joint.armature
    model.damping[v] = joint.damping
    model.upperDryFrictionLimit[v] = joint.friction
    model.lowerDryFrictionLimit[v] = -joint.friction
    if joint.range is not None and joint.nv == 1:
        model.lowerPositionLimit[q] = joint.range[0] - joint.zero
        model.upperPositionLimit[q] = joint.range[1] - joint.zero


def _se3(pair: tuple[Array, Array]) -> pin.SE3:
    return pin.SE3(pair[0], pair[1])


def _se3_of(placement: Placement) -> pin.SE3:
    return pin.SE3(placement.rotation, placement.translation)


def file_size(path: Path) -> tuple[float, int]:
    """Mass [kg] of everything that moves in a URDF file, and the number of rates, as Pinocchio reads it. Raises MechlabError."""
    try:
        tree = pin.buildModelFromUrdf(str(path))
    except ValueError as error:
        raise MechlabError(f"Pinocchio refuses {path.name}: {error}") from None
    return float(pin.computeTotalMass(tree)), int(tree.nv)
