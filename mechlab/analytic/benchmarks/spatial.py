"""Benchmark problems in space.

A04: Bricard's overconstrained loop of six hinges on the edges of a cube, by screws in world axes and the null vector
of the loop equation. The state holds angles and rates of all six hinges; the motion stays on the curve of closed poses.
A05: a flyball governor with stiff spring-dampers between slider and arms; both arms move alike.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import NoSolution

Array = NDArray[np.float64]
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, -1, 0], [1, -1, 1], [0, -1, 1], [0, 0, 1]], dtype=float)
AXES = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 0]], dtype=float)
"""Hinge k stands at CORNERS[k] (edge length 1) along AXES[k]; bar k runs from corner k to corner k + 1."""


def _cross(w: Array) -> Array:
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


_STILL = np.eye(3)
_TURNS = np.array([_cross(a) for a in AXES])
_SQUARES = _TURNS @ _TURNS
_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


def _crossed(a: Array, b: Array) -> Array:
    """a x b of rows (n, 3), without the checks that cost numpy twenty times as much."""
    return np.asarray(a[:, _NEXT] * b[:, _LAST] - a[:, _LAST] * b[:, _NEXT])


def _along(matrices: Array, rows: Array) -> Array:
    """(n, 3) products of matrices (n, 3, 3) with rows (n, 3)."""
    return np.asarray((matrices @ rows[:, :, None])[:, :, 0])


@dataclass(frozen=True)
class Bricard:
    """length of the edges [m], masses (5,) of the square bars [kg], `section` [m] their width, gravity (3,) [m/s2].

    Twists are (velocity of the point at the world's origin, angular velocity). A unit twist of hinge k in the present
    pose is (p x n, n). Closed loop: sum S_k rate_k = 0 (6 x 6 of rank 5).
    """

    length: float
    masses: tuple[float, ...]
    section: float
    gravity: tuple[float, float, float]

    @cached_property
    def _bars(self) -> tuple[Array, Array, Array]:
        """Masses (5,) [kg], and in the first pose centres (5, 3) [m] and inertia tensors (5, 3, 3) about them [kg m2] of the bars."""
        masses, axes = np.array(self.masses), CORNERS[1:] - CORNERS[:-1]
        along = masses * self.section**2 / 6.0
        across = masses * (self.length**2 + self.section**2) / 12.0
        outer = axes[:, :, None] * axes[:, None, :]
        tensors = across[:, None, None] * np.eye(3) + (along - across)[:, None, None] * outer
        return masses, 0.5 * self.length * (CORNERS[:-1] + CORNERS[1:]), tensors

    def poses(self, q: Array) -> tuple[Array, Array]:
        """Rotation (6, 3, 3) and displacement (6, 3) of every bar from the first pose, x -> R x + d: bars 0 to 4, then the body
        behind hinge 5, whose pose is the identity when the loop is closed."""
        angles, corners = q[:, None, None], self.length * CORNERS
        step = np.zeros((6, 4, 4))
        step[:, :3, :3] = _STILL + np.sin(angles) * _TURNS + (1.0 - np.cos(angles)) * _SQUARES
        step[:, :3, 3] = corners - _along(step[:, :3, :3], corners)
        step[:, 3, 3] = 1.0
        for k in range(1, 6):
            step[k] = step[k - 1] @ step[k]
        return step[:, :3, :3], step[:, :3, 3]

    def corner(self, q: Array, k: int) -> Array:
        """World position (3,) of corner k (1 to 5)."""
        rotation, shift = self.poses(q)
        return np.asarray(rotation[k - 1] @ (self.length * CORNERS[k]) + shift[k - 1])

    def screws(self, poses: tuple[Array, Array]) -> Array:
        """(6, 6) unit twists of the hinges, one a row; each hinge moves with the body before it."""
        rotation = np.concatenate([_STILL[None], poses[0][:5]])
        shift = np.concatenate([np.zeros((1, 3)), poses[1][:5]])
        n = _along(rotation, AXES)
        return np.concatenate([_crossed(_along(rotation, self.length * CORNERS) + shift, n), n], axis=1)

    def slope(self, t: float, y: Array) -> Array:
        """Rate (12,) of y = (angles (6,), rates (6,)). Raises NoSolution where the loop has more than one freedom."""
        poses = self.poses(y[:6])
        screws = self.screws(poses)
        u, sizes, vt = np.linalg.svd(screws.T)
        if sizes[4] < 1e-9:
            raise NoSolution("bricard: the loop is at a bifurcation, where its motion is not determined.")
        null = vt[5]
        speed = float(null @ y[6:])
        rate = speed * null
        twists, units = np.cumsum(rate[:, None] * screws, axis=0), np.cumsum(null[:, None] * screws, axis=0)
        # the screw of hinge k moves with the body before it: dS/dt = ad(V) S
        v, w = np.zeros((6, 3)), np.zeros((6, 3))
        v[1:], w[1:] = twists[:5, :3], twists[:5, 3:]
        moved = np.concatenate([_crossed(w, screws[:, :3]) + _crossed(v, screws[:, 3:]), _crossed(w, screws[:, 3:])], axis=1)
        carried = np.cumsum(rate[:, None] * moved, axis=0)
        bend = -vt[:5].T @ ((u[:, :5].T @ carried[5]) / sizes[:5])
        inertia, force = self._reduced(poses, twists[:5], units[:5], (np.cumsum(bend[:, None] * screws, axis=0) + carried)[:5])
        return np.concatenate([rate, bend + null * (force / inertia)])

    def _reduced(self, poses: tuple[Array, Array], twists: Array, units: Array, total: Array) -> tuple[float, float]:
        """Reduced inertia and force of the bars at the loop's one freedom, whose unit motion has the twists `units` (5, 6); twists
        and accelerations `total` (5, 6) without a change of speed."""
        masses, centres, tensors = self._bars
        rotation = poses[0][:5]
        c = _along(rotation, centres) + poses[1][:5]
        spatial = rotation @ tensors @ rotation.transpose(0, 2, 1)
        w, wu, turn = twists[:, 3:], units[:, 3:], total[:, 3:]
        v, vu = twists[:, :3] + _crossed(w, c), units[:, :3] + _crossed(wu, c)
        # classical acceleration of the centre: spatial part at c, and w x v of that point
        a = total[:, :3] + _crossed(turn, c) + _crossed(w, v)
        moment = _along(spatial, turn) + _crossed(w, _along(spatial, w))
        inertia = masses @ (vu * vu).sum(axis=1) + (wu * _along(spatial, wu)).sum()
        force = (vu * (masses[:, None] * (np.array(self.gravity) - a))).sum() - (wu * moment).sum()
        return float(inertia), float(force)


@dataclass(frozen=True)
class Governor:
    """Coordinates: arm angle alpha below the horizontal, slider height s, shaft angle phi. The angular momentum
    I(alpha) phi' = H is constant, which leaves

        2 (I_a) alpha'' = I'(alpha) phi'^2 / 2 + gravity + spring,    m_s s'' = -m_s g + spring

    SI units. pivot: distance of the arm pivots (and of the spring ends on the slider) from the axis; height: of the pivots;
    arm moments about its centre: `along`, `across` its axis; upright: moments of shaft and slider about the axis, summed.
    """

    pivot: float
    height: float
    arm_length: float
    arm_mass: float
    arm_along: float
    arm_across: float
    ball_mass: float
    slider_mass: float
    upright: float
    spring_stiffness: float
    damping: float
    spring_length: float
    gravity: float

    def moment(self, alpha: float) -> tuple[float, float]:
        """Moment of inertia about the axis and its derivative by alpha."""
        c, s, a, half = math.cos(alpha), math.sin(alpha), self.pivot, 0.5 * self.arm_length
        one = self.arm_along * s * s + self.arm_across * c * c
        one += self.arm_mass * (a + half * c) ** 2 + self.ball_mass * (a + 2.0 * half * c) ** 2
        slope = 2.0 * (self.arm_along - self.arm_across) * s * c
        slope -= 2.0 * self.arm_mass * (a + half * c) * half * s
        slope -= 4.0 * self.ball_mass * (a + 2.0 * half * c) * half * s
        return self.upright + 2.0 * one, 2.0 * slope

    def slope(self, t: float, y: Array) -> Array:
        """Rate (6,) of y = (alpha, s, phi, alpha', s', H)."""
        alpha, s, _, dalpha, ds, momentum = y.tolist()
        sine, cosine, half = math.sin(alpha), math.cos(alpha), 0.5 * self.arm_length
        moment, bend = self.moment(alpha)
        spin = momentum / moment
        x, z = half * cosine, self.height - half * sine - s
        length = math.hypot(x, z)
        by_alpha = (-half * sine * x - half * cosine * z) / length
        by_s = -z / length
        tension = self.spring_stiffness * (length - self.spring_length)
        tension += self.damping * (by_alpha * dalpha + by_s * ds)
        own = self.arm_across + self.arm_mass * half**2 + self.ball_mass * self.arm_length**2
        weight = self.gravity * cosine * (self.arm_mass * half + self.ball_mass * self.arm_length)
        accel = (0.25 * bend * spin * spin + weight - tension * by_alpha) / own
        return np.array([dalpha, ds, spin, accel, -self.gravity - 2.0 * tension * by_s / self.slider_mass, 0.0])
