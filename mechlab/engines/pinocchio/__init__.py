"""Pinocchio: Mechanism to pin.Model; assembly and inverse kinematics, Jacobians, constrained dynamics, runner.

Names are imported when they are first used, so that `import mechlab.engines.pinocchio` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from mechlab.errors import EngineMissing

if TYPE_CHECKING:
    from mechlab.engines.pinocchio.closer import Closer
    from mechlab.engines.pinocchio.constraints import PinConstraints
    from mechlab.engines.pinocchio.dynamics import PinPlant, accelerations
    from mechlab.engines.pinocchio.inverse import Solved, assemble
    from mechlab.engines.pinocchio.jacobians import (
        OutputJacobian,
        accelerations_of,
        output_jacobian,
        quantity_rates,
        rates,
    )
    from mechlab.engines.pinocchio.kinematics import PinKinematics, frame_motion
    from mechlab.engines.pinocchio.model import PinModel, to_pinocchio
    from mechlab.engines.pinocchio.quantities import Quantities, resolve
    from mechlab.engines.pinocchio.reactions import InverseDynamics, Wrench, inverse_dynamics
    from mechlab.engines.pinocchio.runner import run

_WHERE = {
    "PinConstraints": "constraints",
    "PinPlant": "dynamics",
    "accelerations": "dynamics",
    "Closer": "closer",
    "Solved": "inverse",
    "assemble": "inverse",
    "OutputJacobian": "jacobians",
    "accelerations_of": "jacobians",
    "output_jacobian": "jacobians",
    "quantity_rates": "jacobians",
    "rates": "jacobians",
    "PinKinematics": "kinematics",
    "PinModel": "model",
    "frame_motion": "kinematics",
    "to_pinocchio": "model",
    "Quantities": "quantities",
    "resolve": "quantities",
    "InverseDynamics": "reactions",
    "Wrench": "reactions",
    "inverse_dynamics": "reactions",
    "run": "runner",
}

__all__ = [
    "Closer", "InverseDynamics", "OutputJacobian", "PinConstraints", "PinKinematics", "PinModel", "PinPlant",
    "Quantities", "Solved", "Wrench", "accelerations", "accelerations_of", "assemble", "frame_motion",
    "inverse_dynamics", "output_jacobian", "quantity_rates", "rates", "resolve", "run", "to_pinocchio",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _WHERE:
        raise AttributeError(f"module 'mechlab.engines.pinocchio' has no attribute {name!r}")
    try:
        module = import_module(f"mechlab.engines.pinocchio.{_WHERE[name]}")
    except ModuleNotFoundError as problem:
        if problem.name != "pinocchio":
            raise
        raise EngineMissing(
            "Pinocchio is not installed; `pip install pin` (there is no wheel for Windows: use WSL)."
        ) from None
    return getattr(module, name)
