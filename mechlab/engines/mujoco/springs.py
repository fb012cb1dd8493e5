"""Laws that a step of RK4 needs no call for: constant forces, and springs and dampers of single joints and shafts.

    force = constant - stiffness x coordinate - damping x rate

A servo that holds, a motor, a viscous load. In a model of a run's own they become springs and dampers of joints and of the tendons
of shafts, or a constant applied force: the engine evaluates them at every stage. RK4 takes damping explicitly, other methods of the
engine do not: there they stay laws.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np

from mechlab.engines.mujoco.model import MujocoMap
from mechlab.experiment.laws import Law
from mechlab.experiment.laws.compiled import formulas_of
from mechlab.experiment.laws.formula import Affine
from mechlab.experiment.motion import Hold
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism


@dataclass(frozen=True)
class SpringDamper:
    """The force constant - stiffness x coordinate - damping x rate on a joint or shaft; see the module."""

    on: str
    constant: float
    stiffness: float
    damping: float

    @property
    def load(self) -> float:
        """The part of the constant force that is no matter of where a spring is at rest."""
        return 0.0 if self.stiffness else self.constant


def spring_dampers(mechanism: Mechanism, laws: Sequence[Law], rk4: bool) -> tuple[SpringDamper, ...] | None:
    """The laws as springs and dampers; None where one of them is something else, or needs another method than RK4."""
    out = []
    for law in laws:
        found = formulas_of(law)
        if found is None or any(f.shape is not None for f in found):
            return None
        made = [_spring_damper(mechanism, f.on, f.arguments[0]) for f in found]
        if any(x is None or not rk4 and (x.stiffness or x.damping) for x in made):
            return None
        out += [x for x in made if x is not None]
    return tuple(out)


def _spring_damper(mechanism: Mechanism, on: str, a: Affine) -> SpringDamper | None:
    if a.state or any(name != on for name, _ in (*a.values, *a.rates)):
        return None
    constant = a.constant + sum(gain for _, gain in a.values) * mechanism.zero(on)
    for motion, gains in a.motions:
        if type(motion) is not Hold:  # a class derived of it may move
            return None
        constant += gains[0] * motion.value
    stiffness, damping = -sum(gain for _, gain in a.values), -sum(gain for _, gain in a.rates)
    good = math.isfinite(constant) and 0.0 <= stiffness < math.inf and 0.0 <= damping < math.inf
    return SpringDamper(on, constant, stiffness, damping) if good else None


def put_springs(map_: MujocoMap, springs: Sequence[SpringDamper]) -> Array:
    """Put stiffness and damping into the model, beside what its joints and tendons have, springs at rest where their force is 0; returns
    the constant force (engine nv,) of what has no stiffness."""
    model, m = map_.model, map_.mechanism
    force = np.zeros(model.nv)
    for s in springs:
        force[map_.dof] += s.load * m.row(s.on)
        if not (s.stiffness or s.damping):
            continue
        if s.on in map_.tendons:
            k = map_.tendons[s.on]
            model.tendon_damping[k] += s.damping
            rest = float(model.tendon_lengthspring[k, 0])
            model.tendon_stiffness[k], model.tendon_lengthspring[k] = _together(model.tendon_stiffness[k], rest, s)
        else:
            k = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, s.on)
            at = model.jnt_qposadr[k]
            model.dof_damping[model.jnt_dofadr[k]] += s.damping
            model.jnt_stiffness[k], model.qpos_spring[at] = _together(model.jnt_stiffness[k], model.qpos_spring[at], s)
    return force


def _together(stiffness: float, rest: float, s: SpringDamper) -> tuple[float, float]:
    """Stiffness and rest of two springs side by side."""
    both = float(stiffness) + s.stiffness
    return both, (float(stiffness) * float(rest) + (s.constant - s.load)) / both if both else float(rest)
