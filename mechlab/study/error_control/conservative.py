"""Energy along a branch: what one freedom under forces of position alone needs to know of its mechanism.

J(phi) phi'^2 / 2 + V(phi) = E        J = u^T M u        V: weight, springs, constant loads
"""

from __future__ import annotations

import numpy as np

from mechlab.experiment.scene import Scene
from mechlab.mechanism import Joint, Mechanism, Shaft
from mechlab.mechanism.geometry import Array
from mechlab.study.error_control.batch import BatchTree


def scalars(mechanism: Mechanism) -> list[Joint | Shaft]:
    """All joints and shafts."""
    return [*mechanism.joints, *mechanism.shafts]


def why_not(mechanism: Mechanism, scene: Scene) -> str:
    """Why the energy alone does not decide the motion; empty when it does."""
    m = mechanism
    if any(j.nv != 1 for j in m.joints):
        return "a spherical joint"
    lossy = [x.name for x in scalars(m) if x.damping or x.friction]
    lossy += [s.name for s in m.springs if s.damping]
    if lossy:
        return f"damping or friction of {lossy[0]}"
    changing = [law.kind for law in scene.laws if law.kind != "constant"]
    if changing:
        return f"a load of kind {changing[0]}"
    extra = set(scene.needs) - {"poses", "drive_forces"}
    if extra or scene.keep_mode:
        return f"the scene needs {', '.join(sorted(extra)) or 'its assembly mode watched'}"
    return ""


class Energies:
    """J [kg m2 or kg] and V [J] of a mechanism under the constant loads of a scene."""

    def __init__(self, tree: BatchTree, scene: Scene) -> None:
        self.tree = tree
        m = self.mechanism = tree.mechanism
        self.load = np.zeros(m.nv)
        for law in scene.laws:
            self.load += law.value * m.row(law.on)  # type: ignore[attr-defined]
        self.armature = np.array([j.armature for j in m.joints])
        self.shafts = [(s.inertia, m.row(s.name)) for s in m.shafts if s.inertia]
        sprung = [x for x in scalars(m) if x.stiffness]
        self.sprung = [(x.stiffness, m.row(x.name), x.spring_rest - x.zero) for x in sprung]
        self.ends = (
            tree.points([(s.body_a, np.array(s.point_a)) for s in m.springs]),
            tree.points([(s.body_b, np.array(s.point_b)) for s in m.springs]),
        )
        self.stiffness = np.array([s.stiffness for s in m.springs])
        self.rest = np.array([s.rest_length for s in m.springs])

    def __call__(self, q: Array, u: Array) -> tuple[Array, Array, Array]:
        """J (P,), V (P,) and dV/dphi (P,) at poses q (P, nv) with tangents u (P, nv)."""
        tree = self.tree
        poses = tree.at(q)
        points = tree.positions(poses, tree.mass_at)
        linear, angular = tree.velocities(poses, tree.mass_at[0], points, u)
        local = np.swapaxes(poses.rotations[:, tree.mass_at[0]], 2, 3) @ angular[..., None]
        spin = np.sum(local * (tree.tensors @ local), axis=(2, 3))
        inertia = np.sum(linear * linear, axis=2) @ tree.masses + np.sum(spin, axis=1) + u**2 @ self.armature
        height = -(points @ tree.gravity) @ tree.masses - q @ self.load
        slope = -(linear @ tree.gravity) @ tree.masses - u @ self.load
        for size, row in self.shafts:
            inertia = inertia + size * (u @ row) ** 2
        for stiffness, row, rest in self.sprung:
            stretch = q @ row - rest
            height = height + 0.5 * stiffness * stretch**2
            slope = slope + stiffness * stretch * (u @ row)
        if len(self.stiffness):
            (la, _), (lb, _) = self.ends
            a, b = tree.positions(poses, self.ends[0]), tree.positions(poses, self.ends[1])
            d = b - a
            length = np.sqrt(np.sum(d * d, axis=2))
            relative = tree.velocities(poses, lb, b, u)[0] - tree.velocities(poses, la, a, u)[0]
            rate = np.sum(d * relative, axis=2) / np.maximum(length, 1e-300)
            height = height + 0.5 * (length - self.rest) ** 2 @ self.stiffness
            slope = slope + ((length - self.rest) * rate) @ self.stiffness
        return inertia, height, slope
