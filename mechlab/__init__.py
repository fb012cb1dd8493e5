"""mechlab: a mechanism lab. Describe a mechanism once; get model files, answers, motion and a page, each with witnesses.

>>> import mechlab as ml
>>> ml.solve("fourbar", crank_angle=1.0).max_difference < 1e-9
True
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mechlab.api import (
        chart,
        check,
        claims,
        cycle,
        doctor,
        explore,
        fidelities,
        find,
        generate,
        list_entries,
        load,
        load_recording,
        modes,
        optimize,
        portrait,
        run,
        sensitivity,
        show,
        simulate,
        solve,
        stability,
        story,
        sweep,
        synthesize,
        view,
        workspace,
    )
    from mechlab.errors import MechlabError
    from mechlab.experiment.parameters import parameter
    from mechlab.experiment.scene import Settings
    from mechlab.formats import save_recording
    from mechlab.mechanism import (
        Builder,
        Inertia,
        Mechanism,
        Placement,
        prismatic,
        revolute,
        shape,
        spherical,
        universal,
    )

_HOMES = {
    "mechlab.api": (
        "chart", "check", "claims", "cycle", "doctor", "explore", "fidelities", "find", "generate", "list_entries", "load",
        "load_recording", "modes", "optimize", "portrait",
        "run", "sensitivity", "show", "simulate", "solve", "stability", "story", "sweep", "synthesize", "view", "workspace",
    ),
    "mechlab.errors": ("MechlabError",),
    "mechlab.experiment.parameters": ("parameter",),
    "mechlab.experiment.scene": ("Settings",),
    "mechlab.formats": ("save_recording",),
    "mechlab.mechanism": (
        "Builder", "Inertia", "Mechanism", "Placement", "prismatic", "revolute", "shape", "spherical", "universal",
    ),
}  # fmt: skip
_HOME = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "Builder", "Inertia", "Mechanism", "MechlabError", "Placement", "Settings", "chart", "check", "claims", "cycle",
    "doctor", "explore", "fidelities", "find", "generate", "list_entries", "load", "load_recording", "modes", "optimize",
    "parameter", "portrait", "prismatic", "revolute", "run", "save_recording", "sensitivity", "shape", "show", "simulate", "solve",
    "spherical", "stability", "story", "sweep", "synthesize", "universal", "view", "workspace",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """Public names are imported when they are first used: `import mechlab` stays fast."""
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'mechlab' has no attribute {name!r}")


class _Package(ModuleType):
    """Verbs and rooms share names (solve, simulate, view): `mechlab.engines.pinocchio` is the verb, rooms are imported from."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _HOME and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
