"""How a scene is computed: engine, integrator, timestep, hardness of the constraints. Presets are data."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from mechlab.errors import MechlabError, unknown

ENGINES = ("mujoco", "pinocchio", "analytic", "hybrid", "one_freedom")
PEER_ENGINES = ("exudyn", "drake", "opensim")
"""Other people's engines, which charts compare with; scenes are not run by them."""
MUJOCO_INTEGRATORS = ("RK4", "implicitfast", "implicit", "Euler", "discrete")
PINOCCHIO_INTEGRATORS = ("RK4", "DOP853", "semi_implicit_Euler")
TRACE_INTEGRATORS = ("LSODA",)
"""On the equations of either engine, for the traces that charts and error control make; its runner does not have them."""


@dataclass(frozen=True)
class Settings:
    """Settings of a run. `timestep` [s]; `timeconst` is the constraint time constant in timesteps (solref = timeconst * h, 1);
    `impedance` the constraint impedance d (solimp d d .001 .5 2); None for both: the engine's own default softness.
    `tolerance`: of engines with step control."""

    engine: str = "mujoco"
    integrator: str = "RK4"
    timestep: float = 1e-3
    timeconst: float | None = 2.0
    impedance: float | None = 0.9999
    tolerance: float = 1e-9
    preset: str = "accurate"

    def __post_init__(self) -> None:
        if self.engine not in ENGINES + PEER_ENGINES:
            raise unknown("engine", self.engine, ENGINES)
        allowed = {"mujoco": MUJOCO_INTEGRATORS, "pinocchio": PINOCCHIO_INTEGRATORS}.get(self.engine)
        if allowed and self.integrator not in allowed + TRACE_INTEGRATORS:
            raise unknown(f"integrator of {self.engine}", self.integrator, allowed)
        if not math.isfinite(self.timestep) or self.timestep <= 0:
            raise MechlabError(f"timestep: expected a number > 0 s, got {self.timestep!r}.")

    @property
    def solref(self) -> tuple[float, float] | None:
        """MuJoCo's solref (time constant [s], damping ratio), or None for the engine's default."""
        return None if self.timeconst is None else (self.timeconst * self.timestep, 1.0)

    @property
    def solimp(self) -> tuple[float, float, float, float, float] | None:
        """MuJoCo's solimp, or None for the engine's default."""
        return None if self.impedance is None else (self.impedance, self.impedance, 0.001, 0.5, 2.0)

    @property
    def warning(self) -> str | None:
        """What the user must know of a preset that is not accurate."""
        if self.preset == "draft":
            return "draft: first-order integration; energy and phase may be wrong by several per cent, only the look is meant"
        if self.timeconst is None:
            return "the engine's default softness does not converge at any timestep"
        return None


PRESETS: dict[str, Settings] = {
    "accurate": Settings(),
    "stiff": Settings(integrator="discrete", timestep=2.5e-4, preset="stiff"),
    "draft": Settings(integrator="implicitfast", timestep=2e-3, preset="draft"),
    "defaults": Settings(integrator="Euler", timestep=2e-3, timeconst=None, impedance=None, preset="defaults"),
}
"""`accurate`: rigid loops and gears. `stiff`: springs, friction, servos. `draft`: a quick look. `defaults`: for charts only."""


def preset(name: str, **changes: object) -> Settings:
    """Settings of a preset, with changes; raises MechlabError that lists the presets."""
    if name not in PRESETS:
        raise unknown("preset", name, PRESETS)
    return replace(PRESETS[name], **changes)  # type: ignore[arg-type]
