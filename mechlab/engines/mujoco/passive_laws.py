"""Laws of a scene that are springs and dampers of a joint or shaft, put into the model: then no Python is called between the steps.

    stiffness (target - value) - damping rate + feedforward,    a servo that holds, without a limit
    -coefficient rate,                                          a viscous load

With RK4, which takes what is in the model at its stages as it takes forces from outside, the motion is the same to rounding. Methods
that are implicit in dampers of the model would make another one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from mechlab.engines.mujoco.model import MujocoMap
from mechlab.experiment.laws import Law, Servo, Viscous
from mechlab.experiment.motion import Hold
from mechlab.experiment.scene import Settings


@dataclass(frozen=True)
class PassiveLaw:
    """Spring and damper on a joint or shaft `on`: stiffness [N m/rad or N/m] towards the physical value `target`, damping, and a
    constant force besides."""

    on: str
    stiffness: float
    target: float
    damping: float
    force: float = 0.0


def passive_laws(laws: Sequence[Law], settings: Settings) -> dict[Law, PassiveLaw]:
    """Those of the laws that can be put into the model, but for declared drives, which have actuators in it."""
    out: dict[Law, PassiveLaw] = {}
    for law in laws if settings.integrator == "RK4" else ():
        if isinstance(law, Viscous):
            out[law] = PassiveLaw(law.on, 0.0, 0.0, law.coefficient)
        elif isinstance(law, Servo) and not law.drive and isinstance(law.motion, Hold) and np.isinf(law.limit):
            out[law] = PassiveLaw(law.on, law.stiffness, law.motion.value, law.damping, law.feedforward)
    return out


def put_into_model(map_: MujocoMap, law: PassiveLaw) -> None:
    """Add the spring and damper to those that the joint or shaft has; the constant force is left to the caller."""
    model, rest = map_.model, law.target - map_.mechanism.zero(law.on)
    if law.on in map_.mechanism.v_slice:
        joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, law.on)
        stiffness, places, at = model.jnt_stiffness, model.qpos_spring, int(model.jnt_qposadr[joint])
        model.dof_damping[model.jnt_dofadr[joint]] += law.damping
    else:
        joint = at = map_.tendons[law.on]
        stiffness, places = model.tendon_stiffness, model.tendon_lengthspring
        model.tendon_damping[joint] += law.damping
    before, whole = float(stiffness[joint]), float(stiffness[joint]) + law.stiffness
    if whole:
        places[at] = (before * places[at] + law.stiffness * rest) / whole
    stiffness[joint] = whole
