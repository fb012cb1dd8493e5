"""Inertia J and potential energy V of a mechanism with one freedom phi, whose forces depend on the position alone.

J(phi) phi'^2 / 2 + V(phi) = E,    J = u^T M u,    u = dq/dphi;    V: weight, springs, constant loads
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from mechlab.experiment.prices import price_of_poses
from mechlab.experiment.scene import Scene
from mechlab.integrate import count_work
from mechlab.mechanism import Joint, Mechanism, Shaft
from mechlab.mechanism.batch_tree import BatchTree, crossed
from mechlab.mechanism.geometry import Array


class EnergyFunction(Protocol):
    """The energies of a mechanism."""

    def __call__(self, q: Array, u: Array) -> tuple[Array, Array, Array]:
        """J (P,), V (P,) and dV/dphi (P,) at poses q (P, nv) with tangents u (P, nv)."""
        ...

    def size(self, q: Array) -> float:
        """What the rounding of V [J] at a pose q (nv,) is a share of: weights times distances from the origin, springs. They may cancel."""
        ...


def joints_and_shafts(mechanism: Mechanism) -> list[Joint | Shaft]:
    """All joints and shafts."""
    return [*mechanism.joints, *mechanism.shafts]


def why_energy_is_not_enough(mechanism: Mechanism, scene: Scene) -> str:
    """Why the energy alone does not determine the motion, in words; empty when it does."""
    m = mechanism
    if any(j.nv != 1 for j in m.joints):
        return "a spherical joint"
    lossy = [x.name for x in joints_and_shafts(m) if x.damping or x.friction]
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


class TreeEnergies:
    """J [kg m2 or kg] and V [J] of a mechanism under the constant loads of a scene."""

    def __init__(self, tree: BatchTree, scene: Scene) -> None:
        self.tree = tree
        m = self.mechanism = tree.mechanism
        self.load = np.zeros(m.nv)
        for law in scene.laws:
            self.load += law.value * m.row(law.on)  # type: ignore[attr-defined]
        self.armature = np.array([j.armature for j in m.joints])
        self.shafts = [(s.inertia, m.row(s.name)) for s in m.shafts if s.inertia]
        sprung = [x for x in joints_and_shafts(m) if x.stiffness]
        self.sprung = [(x.stiffness, m.row(x.name), x.spring_rest - x.zero) for x in sprung]
        self.ends = (
            tree.points([(s.body_a, np.array(s.point_a)) for s in m.springs]),
            tree.points([(s.body_b, np.array(s.point_b)) for s in m.springs]),
        )
        self.stiffness = np.array([s.stiffness for s in m.springs])
        self.rest = np.array([s.rest_length for s in m.springs])[:, None]

    def __call__(self, q: Array, u: Array) -> tuple[Array, Array, Array]:
        """J (P,), V (P,) and dV/dphi (P,) at poses q (P, nv) with tangents u (P, nv)."""
        count_work(price_of_poses(len(q), self.mechanism.nv, solved=False))
        tree = self.tree
        poses = tree.at(q)
        screws = tree.screws(poses)
        links = tree.mass_at[0]
        points = tree.positions(poses, tree.mass_at)
        linear, angular = tree.twists(screws, links, u)
        linear = linear + crossed(angular, points)
        local = angular[:, :, None, :] @ poses.frames[links, :, :3, :3]
        spin = local @ tree.tensors @ np.swapaxes(local, 2, 3)
        inertia = tree.masses @ np.sum(linear * linear, axis=2) + np.sum(spin, axis=(0, 2, 3)) + u**2 @ self.armature
        height = -tree.masses @ (points @ tree.gravity) - q @ self.load
        slope = -tree.masses @ (linear @ tree.gravity) - u @ self.load
        for size, row in self.shafts:
            inertia = inertia + size * (u @ row) ** 2
        for stiffness, row, rest in self.sprung:
            stretch = q @ row - rest
            height = height + 0.5 * stiffness * stretch**2
            slope = slope + stiffness * stretch * (u @ row)
        if len(self.stiffness):
            a, b = tree.positions(poses, self.ends[0]), tree.positions(poses, self.ends[1])
            d = b - a
            length = np.sqrt(np.sum(d * d, axis=2))
            (la, wa), (lb, wb) = (tree.twists(screws, x[0], u) for x in self.ends)
            # d . (velocity of B - of A); the velocity of A may be taken at B, since both points lie on the line d
            rate = np.sum(d * (lb - la + crossed(wb - wa, b)), axis=2) / np.maximum(length, 1e-300)
            height = height + 0.5 * self.stiffness @ (length - self.rest) ** 2
            slope = slope + self.stiffness @ ((length - self.rest) * rate)
        return inertia, height, slope

    def size(self, q: Array) -> float:
        """Sum of all parts of V [J] at a pose q (nv,), each as large as its rounding has it."""
        tree, poses = self.tree, self.tree.at(q[None])
        places = np.linalg.norm(tree.positions(poses, tree.mass_at)[:, 0], axis=1)
        weight = float(tree.masses @ places) * float(np.linalg.norm(tree.gravity))
        loads = float(np.abs(q * self.load).sum())
        sprung = sum(0.5 * k * float(q @ row - rest) ** 2 for k, row, rest in self.sprung)
        a, b = (tree.positions(poses, x)[:, 0] for x in self.ends)
        length = np.linalg.norm(b - a, axis=1)
        return weight + loads + sprung + float(self.stiffness @ (length * np.abs(length - self.rest[:, 0])))


class OneJointEnergies:
    """`Energies` of a tree of one joint, in closed form: J is constant, points are linear in sin q and 1 - cos q (or in q)."""

    def __init__(self, tree: BatchTree, scene: Scene) -> None:
        whole = TreeEnergies(tree, scene)
        self.size = whole.size
        self.turns = bool(tree.revolute[0])
        self.load = float(whole.load[0])
        self.inertia = float(whole(np.zeros((1, 1)), np.ones((1, 1)))[0][0])
        self.springs = [(k, float(row[0]), rest) for k, row, rest in whole.sprung]
        self.stiffness, self.rest = whole.stiffness, whole.rest
        links, places = tree.mass_at
        weight = -(tree.shape(links, places)[..., :3] @ tree.gravity) @ tree.masses
        self.fixed, self.by_sine, self.by_rest = weight.tolist()
        a, b = (tree.shape(*x) for x in whole.ends)
        self.between = (b - a)[..., :3]
        self.lines = self.between.transpose(1, 2, 0).tolist()
        self.sizes = [(float(k), float(x)) for k, x in zip(self.stiffness, self.rest[:, 0], strict=True)]

    def __call__(self, q: Array, u: Array) -> tuple[Array, Array, Array]:
        """J (P,), V (P,) and dV/dq (P,) at q (P, 1); the tangents u are 1."""
        x = q[:, 0]
        s, c = (np.sin(x), np.cos(x)) if self.turns else (x, 1.0)
        r, ds = 1.0 - c, s if self.turns else 0.0
        height = self.fixed + self.by_sine * s + self.by_rest * r
        slope = self.by_sine * c + self.by_rest * ds + 0.0 * x
        if self.load:
            height, slope = height - self.load * x, slope - self.load
        for stiffness, factor, rest in self.springs:
            stretch = factor * x - rest
            height, slope = height + 0.5 * stiffness * stretch**2, slope + stiffness * stretch * factor
        for stiffness, rest, (d0, d1, d2) in zip(
            self.stiffness, self.rest[:, 0], self.between.transpose(1, 0, 2), strict=True
        ):
            d = (
                d0 + np.multiply.outer(s, d1) + np.multiply.outer(r, d2)
                if self.turns
                else d0 + np.multiply.outer(s, d1)
            )
            rate = np.multiply.outer(c, d1) + np.multiply.outer(ds, d2) if self.turns else d1
            length = np.sqrt(np.sum(d * d, axis=1))
            force = stiffness * (length - rest)
            height = height + 0.5 * force * (length - rest)
            slope = slope + force * np.sum(d * rate, axis=1) / np.maximum(length, 1e-300)
        return np.full(len(x), self.inertia), height, slope

    def at(self, x: float) -> tuple[float, float, float]:
        """J, V and dV/dq at one q."""
        s, c = (math.sin(x), math.cos(x)) if self.turns else (x, 1.0)
        r, ds = (1.0 - c, s) if self.turns else (0.0, 0.0)
        height = self.fixed + self.by_sine * s + self.by_rest * r - self.load * x
        slope = self.by_sine * c + self.by_rest * ds - self.load
        for stiffness, factor, rest in self.springs:
            stretch = factor * x - rest
            height += 0.5 * stiffness * stretch * stretch
            slope += stiffness * stretch * factor
        for (stiffness, rest), line in zip(self.sizes, self.lines, strict=True):
            d = [d0 + s * d1 + r * d2 for d0, d1, d2 in line]
            length = math.sqrt(sum(y * y for y in d))
            force = stiffness * (length - rest)
            rate = sum(y * (c * d1 + ds * d2) for y, (_, d1, d2) in zip(d, line, strict=True))
            height += 0.5 * force * (length - rest)
            slope += force * rate / max(length, 1e-300)
        return self.inertia, height, slope


def energies_of(tree: BatchTree, scene: Scene) -> EnergyFunction:
    """J, V and dV/dphi of a mechanism under the constant loads of a scene."""
    return OneJointEnergies(tree, scene) if tree.ground == 1 else TreeEnergies(tree, scene)
