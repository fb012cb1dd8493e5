"""Pinocchio's algorithms on a tree of joints, branch by branch where it is large.

A pin.Data takes 44 bytes times the cube of its rates, for derivatives of second order that nobody here asks for: 2.8 GB and 7 s for
the 401 joints of 200 four-bars. Branches of the tree that start at the ground do not feel each other outside of loops and relations,
so that a model of its own for each few of them gives the same poses, Jacobians, forces, and diagonal blocks of the mass matrix.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from mechlab.errors import EngineMissing
from mechlab.experiment.tree_plant import MassShare
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array

LARGE = 60
"""Rates up to which a tree is one model."""
PART = 30
"""Rates of a part, unless one branch has more: 1.2 MB."""
MOST_RATES = 450
"""Largest number of rates of a workspace: 4 GB."""


@dataclass(frozen=True)
class Part:
    """Some branches as a model of their own: its places among the coordinates, rates and joints of the whole."""

    model: pin.Model
    data: pin.Data
    q: slice
    v: slice
    joints: range


@dataclass(frozen=True)
class Placed:
    """As pin.Data: placements oMi of all joints, the ground first; columns J (6, nv) and their rates dJ."""

    oMi: list[pin.SE3]
    J: Array
    dJ: Array


def split(model: pin.Model) -> list[range]:
    """The joints of each part of a model: consecutive branches from the ground, of at most PART rates together."""
    first = [j for j in range(1, model.njoints) if model.parents[j] == 0]
    out: list[range] = []
    for start, end in zip(first, [*first[1:], model.njoints], strict=True):
        begin = out[-1].start if out else start
        if out and (model.nv <= LARGE or _rates(model, range(begin, end)) <= PART):
            out[-1] = range(begin, end)
        else:
            out.append(range(start, end))
    return out


def _rates(model: pin.Model, joints: range) -> int:
    return int(sum(model.nvs[j] for j in joints))


def refuse_long_branches(name: str, model: pin.Model) -> None:
    """Raise EngineMissing where the workspace of a branch would not fit into memory."""
    refuse_large(name, max((_rates(model, joints) for joints in split(model)), default=0), " of one branch")


def refuse_large(name: str, rates: int, of: str = "") -> None:
    """Raise EngineMissing where the workspace of a model would not fit into memory."""
    if rates > MOST_RATES:
        raise EngineMissing(
            f"Pinocchio cannot take {name!r}: its workspace for {rates} rates{of} would be {44e-9 * rates**3:.0f} GB "
            f"(it grows with the cube of the rates; limit {MOST_RATES} rates). Ask another engine."
        )


def parts_of(model: pin.Model) -> list[Part]:
    """A model as its parts, each with a new workspace."""
    ranges = split(model)
    if len(ranges) <= 1:
        return [Part(model, model.createData(), slice(0, model.nq), slice(0, model.nv), range(1, model.njoints))]
    return [_part(model, joints) for joints in ranges]


def _part(model: pin.Model, joints: range) -> Part:
    own = pin.Model()
    own.gravity = model.gravity
    a, b = joints.start, joints.stop - 1
    v = slice(model.idx_vs[a], model.idx_vs[b] + model.nvs[b])
    q = slice(model.idx_qs[a], model.idx_qs[b] + model.nqs[b])
    for j in joints:
        parent = model.parents[j]
        own.addJoint(parent - a + 1 if parent else 0, model.joints[j], model.jointPlacements[j], model.names[j])
        own.inertias[j - a + 1] = model.inertias[j]
    own.armature = model.armature[v]
    return Part(own, own.createData(), q, v, joints)


class Workspace:
    """Pinocchio's algorithms on all parts of a model. Coordinates q and rates v are Pinocchio's; a result is kept by the engine until
    the next call, copy it before."""

    def __init__(self, model: pin.Model, parts: list[Part]) -> None:
        self.nv, self.njoints, self.parts = model.nv, model.njoints, parts
        self.alone = parts[0] if len(parts) == 1 else None

    def place(self, q: Array, v: Array | None = None) -> Any:
        """Placements and columns of the joints; with v the rates of the columns, too. pin.Data or Placed."""
        if self.alone is not None:
            return _place(self.alone, q, v)
        found = [_place(p, q[p.q], None if v is None else v[p.v]) for p in self.parts]
        placements = [pin.SE3.Identity()]
        for data in found:
            placements += list(data.oMi)[1:]
        columns = np.hstack([data.J.reshape(6, -1) for data in found])
        rates = columns if v is None else np.hstack([data.dJ.reshape(6, -1) for data in found])
        return Placed(placements, columns, rates)

    def mass(self, q: Array) -> Array:
        """(nv, nv) mass matrix; only its upper triangle holds."""
        if self.alone is not None:
            pin.crba(self.alone.model, self.alone.data, q)
            return np.asarray(self.alone.data.M.copy())
        out = np.zeros((self.nv, self.nv))
        for p in self.parts:
            out[p.v, p.v] = pin.crba(p.model, p.data, q[p.q])
        return out

    def nonlinear(self, q: Array, v: Array) -> Array:
        """(nv,) forces of velocity and weight."""
        return self._each(lambda p: pin.nonLinearEffects(p.model, p.data, q[p.q], v[p.v]))

    def forward(self, q: Array, v: Array, tau: Array) -> Array:
        """(nv,) accelerations of the tree under the forces tau (nv,)."""
        return self._each(lambda p: pin.aba(p.model, p.data, q[p.q], v[p.v], tau[p.v]))

    def through_joints(self, q: Array, v: Array, a: Array, external: list[pin.Force]) -> list[pin.Force]:
        """Forces through all joints, the ground first, at accelerations a (nv,) under `external` ones, each in its joint's axes."""
        out = [pin.Force.Zero()]
        for p in self.parts:
            own = pin.StdVec_Force()
            own.append(pin.Force.Zero())
            for j in p.joints:
                own.append(external[j])
            pin.rnea(p.model, p.data, q[p.q], v[p.v], a[p.v], own)
            out += list(p.data.f)[1:]
        return out

    def moving(self, q: Array, v: Array) -> list[MassShare]:
        """All that moves, a part as one body: composite inertia and momentum about the centre of mass."""
        out = []
        for p in self.parts:
            data = p.model.createData()
            pin.ccrba(p.model, data, q[p.q], v[p.v])
            pin.centerOfMass(p.model, data, q[p.q])
            out.append(MassShare(data.Ig.mass, data.com[0], data.Ig.inertia, data.hg.linear, data.hg.angular))
        return out

    def _each(self, call: Any) -> Array:
        if self.alone is not None:
            return np.asarray(call(self.alone))
        return np.concatenate([np.atleast_1d(call(p)) for p in self.parts])


def _place(part: Part, q: Array, v: Array | None) -> pin.Data:
    if v is None:
        pin.computeJointJacobians(part.model, part.data, q)
    else:
        pin.computeJointJacobiansTimeVariation(part.model, part.data, q, v)
    return part.data
