"""Benchmark problems in space.

A04: Bricard's overconstrained loop of six hinges on the edges of a cube, by screws in world axes and the null vector
of the loop equation. The state holds angles and rates of all six hinges; the motion stays on the curve of closed poses.
A05: a flyball governor with stiff spring-dampers between slider and arms; both arms move alike.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import NoSolution
from mechlab.lazy_dataclass import dataclass

Array = NDArray[np.float64]
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, -1, 0], [1, -1, 1], [0, -1, 1], [0, 0, 1]], dtype=float)
AXES = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 0]], dtype=float)
"""Hinge k stands at CORNERS[k] (edge length 1) along AXES[k]; bar k runs from corner k to corner k + 1."""


def _cross(w: Array) -> Array:
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


_STILL = np.eye(3)
_TURNS = np.array([_cross(a) for a in AXES])
_SQUARES = _TURNS @ _TURNS
_SKEW = np.array([_cross(a).ravel() for a in np.eye(3)])
"""(3, 9): w @ _SKEW is the matrix of w x, row by row."""


def _crossing() -> Array:
    """(6, 36): V @ it is the matrix of ad(V) S = (w x s + v x n, w x n) for twists V = (v, w), S = (s, n), row by row."""
    out = np.zeros((6, 6, 6))
    out[3:, :3, :3] = out[3:, 3:, 3:] = out[:3, :3, 3:] = _SKEW.reshape(3, 3, 3)
    return out.reshape(6, 36)


_CROSSING = _crossing()


def _along(matrices: Array, rows: Array) -> Array:
    """(n, k) products of matrices (n, k, k) with rows (n, k)."""
    return np.asarray((matrices @ rows[:, :, None])[:, :, 0])


def _columns(*rows: Array) -> Array:
    """(n, k, m) of m arrays of rows (n, k), each a column; numpy's `stack` takes ten times as long."""
    out = np.empty((*rows[0].shape, len(rows)))
    for i, x in enumerate(rows):
        out[:, :, i] = x
    return out


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
    def _bars(self) -> Array:
        """(5, 6, 6) inertia of each bar in the first pose: V . it V = m |v_c|^2 + w . tensor w, with centre c and the tensor about it."""
        masses, axes = np.array(self.masses), CORNERS[1:] - CORNERS[:-1]
        along = masses * self.section**2 / 6.0
        across = masses * (self.length**2 + self.section**2) / 12.0
        outer = axes[:, :, None] * axes[:, None, :]
        tensors = across[:, None, None] * np.eye(3) + (along - across)[:, None, None] * outer
        arm = ((0.5 * self.length * (CORNERS[:-1] + CORNERS[1:])) @ _SKEW).reshape(-1, 3, 3)
        weight = masses[:, None, None]
        return np.block([[weight * np.eye(3), -weight * arm], [weight * arm, tensors - weight * arm @ arm]])

    @cached_property
    def _first_screws(self) -> Array:
        """(6, 6) unit twists of the hinges in the first pose."""
        return np.hstack([np.cross(self.length * CORNERS, AXES), AXES])

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
        return self._screws(self._moved(poses))

    def _moved(self, poses: tuple[Array, Array]) -> Array:
        """(5, 6, 6) what takes a twist of each bar's first pose to its present one: (R v + d x R w, R w)."""
        rotation = poses[0][:5]
        out = np.zeros((5, 6, 6))
        out[:, :3, :3] = out[:, 3:, 3:] = rotation
        out[:, :3, 3:] = (poses[1][:5] @ _SKEW).reshape(5, 3, 3) @ rotation
        return out

    def _screws(self, moved: Array) -> Array:
        return np.concatenate([self._first_screws[:1], _along(moved, self._first_screws[1:])])

    def slope(self, t: float, y: Array) -> Array:
        """Rate (12,) of y = (angles (6,), rates (6,)). Raises NoSolution where the loop has more than one freedom."""
        moved = self._moved(self.poses(y[:6]))
        screws = self._screws(moved)
        u, sizes, vt = np.linalg.svd(screws.T)
        if sizes[4] < 1e-9:
            raise NoSolution("bricard: the loop is at a bifurcation, where its motion is not determined.")
        null = vt[5]
        rate = float(null @ y[6:]) * null
        units = (null[:, None] * screws).cumsum(0)[:5]
        twists = (rate[:, None] * screws).cumsum(0)[:5]
        # the screw of hinge k moves with the body before it: dS/dt = ad(V) S
        crossed = (twists @ _CROSSING).reshape(5, 6, 6) @ _columns(screws[1:], units)
        carried = (rate[1:, None] * crossed[:, :, 0]).cumsum(0)  # of hinges 1 to 5; hinge 0 stands still
        bend = -vt[:5].T @ ((u[:, :5].T @ carried[4]) / sizes[:5])
        total = (bend[:, None] * screws).cumsum(0)[:5]
        total[1:] += carried[:4]
        inertia, force = self._reduced(moved, twists, units, total, crossed[:, :, 1])
        return np.concatenate([rate, bend + null * (force / inertia)])

    def _reduced(self, moved: Array, twists: Array, units: Array, total: Array, turned: Array) -> tuple[float, float]:
        """Reduced inertia and force of the bars at the loop's one freedom, whose unit motion has the twists `units` (5, 6), from the
        bars' twists, their rates without a change of speed (`total`) and ad(twists) units (`turned`), each (5, 6):

            inertia = sum U . I U,    force = sum (ad(V) U) . I V - U . I (A - gravity),    all in the first pose of each bar."""
        falling = total.copy()
        falling[:, :3] -= self.gravity
        back = np.zeros((5, 6, 6))
        back[:, :3, :3] = back[:, 3:, 3:] = moved[:, :3, :3].transpose(0, 2, 1)
        back[:, :3, 3:] = moved[:, :3, 3:].transpose(0, 2, 1)
        at_home = back @ _columns(units, twists, falling, turned)
        loads = self._bars @ at_home[:, :, :3]
        inertia = np.vdot(at_home[:, :, 0], loads[:, :, 0])
        force = np.vdot(at_home[:, :, 3], loads[:, :, 1]) - np.vdot(at_home[:, :, 0], loads[:, :, 2])
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

    def moment(self, alpha: Any) -> tuple[Any, Any]:
        """Moment of inertia about the axis and its derivative by alpha: floats of a float, else arrays."""
        of = math if isinstance(alpha, float) else np
        c, s, a, half = of.cos(alpha), of.sin(alpha), self.pivot, 0.5 * self.arm_length
        one = self.arm_along * s * s + self.arm_across * c * c
        one += self.arm_mass * (a + half * c) ** 2 + self.ball_mass * (a + 2.0 * half * c) ** 2
        slope = 2.0 * (self.arm_along - self.arm_across) * s * c
        slope -= 2.0 * self.arm_mass * (a + half * c) * half * s
        slope -= 4.0 * self.ball_mass * (a + 2.0 * half * c) * half * s
        return self.upright + 2.0 * one, 2.0 * slope

    def slope(self, t: float, y: Array) -> Array:
        """Rate (..., 6) of y = (alpha, s, phi, alpha', s', H)."""
        # a single state, in the loop of an integration, is much faster when it stays floats
        of: Any = math if y.ndim == 1 else np
        alpha, s, _, dalpha, ds, momentum = y.tolist() if y.ndim == 1 else np.moveaxis(y, -1, 0)
        sine, cosine, half = of.sin(alpha), of.cos(alpha), 0.5 * self.arm_length
        moment, bend = self.moment(alpha)
        spin = momentum / moment
        x, z = half * cosine, self.height - half * sine - s
        length = of.hypot(x, z)
        by_alpha = (-half * sine * x - half * cosine * z) / length
        by_s = -z / length
        tension = self.spring_stiffness * (length - self.spring_length)
        tension += self.damping * (by_alpha * dalpha + by_s * ds)
        own = self.arm_across + self.arm_mass * half**2 + self.ball_mass * self.arm_length**2
        weight = self.gravity * cosine * (self.arm_mass * half + self.ball_mass * self.arm_length)
        accel = (0.25 * bend * spin * spin + weight - tension * by_alpha) / own
        fall = -self.gravity - 2.0 * tension * by_s / self.slider_mass
        return np.moveaxis(np.array([dalpha, ds, spin, accel, fall, 0.0 * momentum]), 0, -1)
