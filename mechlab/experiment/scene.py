"""A scene: what happens to a mechanism, for how long, and what one wants to know of it."""

from __future__ import annotations

from dataclasses import dataclass, field

from mechlab.errors import unknown
from mechlab.experiment.laws import Law
from mechlab.experiment.settings import Settings

NEEDS = ("poses", "drive_forces", "tooth_loads", "reactions")
DRIVES = ("hold", "free")
"""What the declared drives of a mechanism do in a scene that has no law for them: hold their targets, or nothing."""


@dataclass(frozen=True)
class Scene:
    """initial: physical values of joints at t = 0, the others follow by assembly from the reference pose; initial_rates:
    rates of joints or shafts, the others follow from the constraints (minimum norm). `needs` and `tolerance` [m or rad]
    say what the run must answer and how well; `settings` is the recommended way to compute it. `keep_mode`: joints or
    shafts with respect to which the assembly mode must not change; a run that changes it stops there, not to be trusted.

    drives: what the declared drives do whose joint or shaft has no law here: "hold" their targets (0, the reference pose)
    or "free", released. A law on a driven joint or shaft takes the place of its drive; see `mechlab.experiment.acting`.
    Raises MechlabError for another word.
    """

    name: str
    fidelity: str
    duration: float
    laws: tuple[Law, ...] = ()
    initial: dict[str, float] = field(default_factory=dict)
    initial_rates: dict[str, float] = field(default_factory=dict)
    channels: tuple[str, ...] = ()
    needs: tuple[str, ...] = ("poses",)
    tolerance: float = 1e-4
    settings: Settings = Settings()
    text: str = ""
    keep_mode: tuple[str, ...] = ()
    drives: str = "hold"

    def __post_init__(self) -> None:
        if self.drives not in DRIVES:
            raise unknown(f"scene {self.name}: drives", self.drives, DRIVES)
