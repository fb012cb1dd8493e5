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
_TURNS = [_cross(a) for a in AXES]
_SQUARES = [c @ c for c in _TURNS]


def _crossed(a: Array, b: Array) -> Array:
    """a x b of two vectors, without the checks that cost numpy twenty times as much."""
    (p, q, r), (x, y, z) = a.tolist(), b.tolist()
    return np.array((q * z - r * y, r * x - p * z, p * y - q * x))


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
    def _bars(self) -> list[tuple[float, Array, Array]]:
        """Mass [kg], and in the first pose centre (3,) [m] and inertia tensor (3, 3) about it [kg m2], of each bar."""
        out = []
        for k, mass in enumerate(self.masses):
            axis = CORNERS[k + 1] - CORNERS[k]
            along = mass * self.section**2 / 6.0
            across = mass * (self.length**2 + self.section**2) / 12.0
            tensor = across * np.eye(3) + (along - across) * np.outer(axis, axis)
            out.append((mass, 0.5 * self.length * (CORNERS[k] + CORNERS[k + 1]), tensor))
        return out

    def poses(self, q: Array) -> list[tuple[Array, Array]]:
        """Rotation and displacement of every bar from the first pose, x -> R x + d: bars 0 to 4, then the body
        behind hinge 5, whose pose is the identity when the loop is closed."""
        rotation, shift, out = np.eye(3), np.zeros(3), []
        for k in range(6):
            turn = _STILL + np.sin(q[k]) * _TURNS[k] + (1.0 - np.cos(q[k])) * _SQUARES[k]
            corner = self.length * CORNERS[k]
            shift = shift + rotation @ (corner - turn @ corner)
            rotation = rotation @ turn
            out.append((rotation, shift))
        return out

    def corner(self, q: Array, k: int) -> Array:
        """World position (3,) of corner k (1 to 5)."""
        rotation, shift = self.poses(q)[k - 1]
        return np.asarray(rotation @ (self.length * CORNERS[k]) + shift)

    def screws(self, poses: list[tuple[Array, Array]]) -> Array:
        """(6, 6) unit twists of the hinges, one a row."""
        before = [(np.eye(3), np.zeros(3)), *poses[:5]]
        rows = []
        for k, (rotation, shift) in enumerate(before):
            n = rotation @ AXES[k]
            rows.append(np.concatenate([_crossed(rotation @ (self.length * CORNERS[k]) + shift, n), n]))
        return np.array(rows)

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
        twist, unit, drift = np.zeros(6), np.zeros(6), np.zeros(6)
        twists, units, carried = [], [], []
        for k in range(6):
            # the screw of hinge k moves with the body before it: dS/dt = ad(V) S
            w, v, s = twist[3:], twist[:3], screws[k]
            moved = np.concatenate([_crossed(w, s[:3]) + _crossed(v, s[3:]), _crossed(w, s[3:])])
            drift = drift + rate[k] * moved
            twist, unit = twist + rate[k] * s, unit + null[k] * s
            twists.append(twist)
            units.append(unit)
            carried.append(drift)
        bend = -vt[:5].T @ ((u[:, :5].T @ carried[5]) / sizes[:5])
        inertia, force, accel = 0.0, 0.0, np.zeros(6)
        for k, (mass, centre, tensor) in enumerate(self._bars):
            accel = accel + bend[k] * screws[k]
            rotation, shift = poses[k]
            c, spatial = rotation @ centre + shift, rotation @ tensor @ rotation.T
            w, wu = twists[k][3:], units[k][3:]
            v, vu = twists[k][:3] + _crossed(w, c), units[k][:3] + _crossed(wu, c)
            total = accel + carried[k]
            # classical acceleration of the centre: spatial part at c, and w x v of that point
            a = total[:3] + _crossed(total[3:], c) + _crossed(w, v)
            moment = spatial @ total[3:] + _crossed(w, spatial @ w)
            inertia += mass * (vu @ vu) + wu @ spatial @ wu
            force += vu @ (mass * (np.array(self.gravity) - a)) - wu @ moment
        return np.concatenate([rate, bend + null * (force / inertia)])


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
