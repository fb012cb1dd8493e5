"""A third witness where there is one freedom: J phi'' - Q(phi, phi') = 0 along the closed path, J the generalised inertia."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechlab.errors import NoSolution
from mechlab.experiment.laws import Law, applied_force
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.study.modes.dynamics import Linear
from mechlab.study.modes.eigen import Mode, modes
from mechlab.study.one_freedom import OneFreedom

STEP = 1e-3


@dataclass(frozen=True)
class _Balance:
    """Along the path at phi: inertia J, push Q, its slopes in phi and phi', tangent u (nv,), coordinates q (nq,)."""

    inertia: float
    push: float
    stiffness: float
    damping: float
    u: Array
    q: Array


def one_freedom_modes(mechanism: Mechanism, laws: tuple[Law, ...], q: Array) -> tuple[Array, tuple[Mode, ...]]:
    """Coordinates (nq,) of the rest reached downhill from q, and its one mode: omega^2 = V''(phi) / J(phi).

    Raises NoSolution where the path ends or no rest is found, MechlabError for other than one freedom.
    """
    path = OneFreedom(mechanism, laws, q)
    phi, load, last = path.path.start.phi, 0.0, np.inf
    for _ in range(300):
        now = _balance(path, phi)
        load = max(load, abs(now.push), abs(now.stiffness))
        if abs(now.push) <= 1e-15 * load or (abs(now.push) < 1e-9 * load and abs(now.push) >= 0.5 * last):
            linear = Linear(
                now.u[:, None] / np.sqrt(now.inertia), np.array([[now.damping / now.inertia]]),
                np.array([[now.stiffness / now.inertia]]), np.zeros(1), load, load,
            )  # fmt: skip
            return now.q, modes(linear, lambda x: x)
        last = abs(now.push)
        step = now.push / max(abs(now.stiffness), 1e-9 * load)
        phi += float(np.clip(step, -0.3, 0.3)) / max(1.0, float(np.max(np.abs(now.u))))
    raise NoSolution(f"no rest along {path.coordinate}: {last:.3g} stays unbalanced")


def _balance(path: OneFreedom, phi: float) -> _Balance:
    def push(at: float, rate: float) -> tuple[float, float, Array, Array]:
        q, u, _, (inertia, _, weight, damping) = path.split(path.columns(at))
        path.plant.set(0.0, q, u, rate)
        force = applied_force(path.mechanism, path.laws, 0.0, path.plant)[0]
        return float(force @ u) + float(weight) + float(damping) * rate, float(inertia), u, q

    h = STEP
    (q1, *_), (q2, *_), (q3, *_), (q4, *_) = (push(phi + k * h, 0.0) for k in (1, -1, 2, -2))
    now, inertia, u, q = push(phi, 0.0)
    damping = (push(phi, -h)[0] - push(phi, h)[0]) / (2 * h)
    return _Balance(inertia, now, -(8 * (q1 - q2) - q3 + q4) / (12 * h), damping, u, q)
