"""An assembly mode of a class III or IV group over a cycle of the crank: its rates and accelerations, and its identity from one
crank angle to the next. Steps are halved where modes come near each other; arcs without an assembly are never crossed.
"""

from __future__ import annotations

import numpy as np

from mechlab.analytic.assur.folds import Family, Fold, solve_fold
from mechlab.analytic.assur.plane import Complex, Flags, Real, Scalar, cross, dot
from mechlab.analytic.assur.two_loops import Modes, TwoLoops, all_modes, closure_jacobian
from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass

SINGULAR = 1e-12  # |det J| over the fourth power of the size of the group


@dataclass(frozen=True)
class GroupMotion:
    """theta_t, theta_u with rates and accelerations; det J; links: the closing links z (2, ...), with rates as Scalars.

    Where |det J| is below 1e-12 of the fourth power of the group's size, two modes merge and rates are NaN.
    """

    theta_t: Scalar
    theta_u: Scalar
    det: Real
    z: Complex
    links: tuple[Scalar, Scalar]
    regular: Flags


def mode_rates(group: TwoLoops, theta_t: Real, theta_u: Real) -> GroupMotion:
    """J (w_t, w_u) = -Re conj(z) wd;  J (e_t, e_u) = -Re conj(z)(wdd - p t w_t^2 - q u w_u^2) - |zd|^2."""
    a, b, c, d, z = closure_jacobian(group, theta_t, theta_u)
    _, pt, qu = group.z(theta_t, theta_u)
    det = a * d - b * c
    regular = np.abs(det) > SINGULAR * group.scale**2
    by = 1.0 / np.where(regular, det, np.nan)
    f = -dot(z, group.wd)
    wt, wu = (d * f[0] - b * f[1]) * by, (a * f[1] - c * f[0]) * by
    zd = group.wd + 1j * (pt * wt + qu * wu)
    rest = group.wdd - pt * wt**2 - qu * wu**2
    g = -dot(z, rest) - dot(zd, zd)
    et, eu = (d * g[0] - b * g[1]) * by, (a * g[1] - c * g[0]) * by
    zdd = rest + 1j * (pt * et + qu * eu)
    square = group.l**2
    turn = [Scalar(np.angle(z[i]), cross(z[i], zd[i]) / square[i], cross(z[i], zdd[i]) / square[i]) for i in (0, 1)]
    t, u = np.broadcast_arrays(np.asarray(theta_t, dtype=float), np.asarray(theta_u, dtype=float))
    return GroupMotion(Scalar(t, wt, et), Scalar(u, wu, eu), det, z, (turn[0], turn[1]), np.asarray(regular))


_DEEPEST = 40  # halvings of a step before the branch counts as ended
_CLEAR = 0.2  # a mode is taken within this share of the distance to the nearest other mode
_LARGEST = 0.3  # [rad] largest predicted change of an angle in one step


@dataclass(frozen=True)
class Branch:
    """One mode over crank angles: crank (n,), theta_t, theta_u (n,) continuous, det (n,) of one sign.

    fold: the limit position where the mode ended; None when it reached the last crank angle.
    """

    crank: Real
    theta_t: Real
    theta_u: Real
    det: Real
    fold: Fold | None

    @property
    def complete(self) -> bool:
        """True when the branch reached the last crank angle."""
        return self.fold is None


def follow(family: Family, crank: Real, theta_t: float, theta_u: float) -> Branch:
    """The mode that is (theta_t, theta_u) at crank[0], followed through the angles `crank` (n,).

    At each angle all modes are solved. The next one is that nearest to the extrapolation by rates and accelerations, of the
    same sign of det J; it is taken only when it is clearly nearer than any other, else the step is halved. Where no such
    mode is left the branch ends, and the fold there is solved exactly. Raises MechlabError when nothing is near the start.
    """
    crank = np.asarray(crank, dtype=float)
    modes = all_modes(family(crank))
    k = _nearest(modes, 0, np.array([theta_t, theta_u]), 0.0)
    if k is None or _distance(modes, 0, k, theta_t, theta_u) > 1e-3:
        raise MechlabError(
            f"no mode lies at ({theta_t:.6g}, {theta_u:.6g}) rad at the crank angle {crank[0]:.6g} rad; "
            f"there are {int(modes.count[0])} modes: use all_modes."
        )
    here = np.array([theta_t, theta_u]) + _wrap(
        np.array([modes.theta_t[0, k], modes.theta_u[0, k]]) - [theta_t, theta_u]
    )
    path, dets = [here], [float(modes.det[0, k])]
    for i in range(1, len(crank)):
        found = _advance(family, crank[i - 1], crank[i], path[-1], np.sign(dets[-1]), (modes, i))
        if isinstance(found, Fold):
            return _branch(crank[:i], path, dets, found)
        path.append(found[0])
        dets.append(found[1])
    return _branch(crank, path, dets, None)


def _branch(crank: Real, path: list[Real], dets: list[float], fold: Fold | None) -> Branch:
    x = np.array(path)
    return Branch(crank, x[:, 0], x[:, 1], np.array(dets), fold)


def _advance(
    family: Family, a: float, b: float, x: Real, sign: float, known: tuple[Modes, int] | None
) -> tuple[Real, float] | Fold:
    """The state at crank angle b from x at a; a Fold when the branch ends between."""
    target, last = b, b
    for _ in range(10_000):
        modes, row = known if known is not None and target == b else (all_modes(family(np.array([target]))), 0)
        found = _accept(family, a, target, x, sign, modes, row)
        if found is not None:
            x, det = found
            if target == b:
                return x, det
            a, target = target, min(b, target + 2.0 * (target - a)) if b > a else max(b, target + 2.0 * (target - a))
            last = b
            continue
        last = target
        target = 0.5 * (a + target)
        if abs(target - a) < abs(b - a) * 0.5**_DEEPEST or abs(target - a) < 1e-13:
            break
    del last
    try:
        return solve_fold(family, a, float(x[0]), float(x[1]), -1)
    except MechlabError:
        return Fold(float(a), float(x[0]), float(x[1]), -1)


def _accept(
    family: Family, a: float, b: float, x: Real, sign: float, modes: Modes, row: int
) -> tuple[Real, float] | None:
    motion = mode_rates(family(np.array([a])), np.array([x[0]]), np.array([x[1]]))
    if not motion.regular[0]:
        return None
    h = b - a
    rate = np.array([motion.theta_t.v[0], motion.theta_u.v[0]])
    bend = np.array([motion.theta_t.a[0], motion.theta_u.a[0]])
    if np.max(np.abs(h * rate)) > _LARGEST or np.max(np.abs(0.5 * h * h * bend)) > 0.5 * _LARGEST:
        return None
    guess = x + h * rate + 0.5 * h * h * bend
    k = _nearest(modes, row, guess, sign)
    if k is None:
        return None
    gap = _distance(modes, row, k, *guess)
    others = [_distance(modes, row, j, *guess) for j in range(int(modes.count[row])) if j != k]
    if gap > _CLEAR * min([*others, _LARGEST / _CLEAR]) or gap > 0.5 * np.max(np.abs(h * rate)) + 1e-6:
        return None
    there = guess + _wrap(np.array([modes.theta_t[row, k], modes.theta_u[row, k]]) - guess)
    det = float(modes.det[row, k])
    if abs(det) < 0.5 * abs(float(motion.det[0])) and abs(h) > 1e-9:  # nearing a merge: smaller steps
        return None
    return there, det


def _nearest(modes: Modes, row: int, guess: Real, sign: float) -> int | None:
    fit = [k for k in range(int(modes.count[row])) if sign == 0.0 or np.sign(modes.det[row, k]) == sign]
    return min(fit, key=lambda k: _distance(modes, row, k, guess[0], guess[1])) if fit else None


def _distance(modes: Modes, row: int, k: int, t: float, u: float) -> float:
    d = _wrap(np.array([modes.theta_t[row, k] - t, modes.theta_u[row, k] - u]))
    return float(np.max(np.abs(d)))


def _wrap(angle: Real) -> Real:
    return (angle + np.pi) % (2 * np.pi) - np.pi
