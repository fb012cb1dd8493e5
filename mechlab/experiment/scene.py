"""Scenes and their settings, and the initial state of a scene.

A scene says what acts on a mechanism, for how long, and which channels are wanted. Settings say how it is computed:
engine, integrator, timestep, hardness of the constraints. The initial state follows from given values and rates and
from closure.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from mechlab.errors import MechlabError, NoSolution, explained, unknown
from mechlab.experiment.laws import Law, laws_of
from mechlab.experiment.model_file import ModelFile
from mechlab.experiment.motion import PrescribedMotion
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.assembly import close
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.newton import Assembly

ENGINES = ("mujoco", "file", "pinocchio", "analytic", "hybrid", "one_freedom")
PEER_ENGINES = ("exudyn", "drake", "opensim", "mujoco_warp", "newton")
"""Engines of other projects, for the comparison in charts; they do not run scenes."""
MUJOCO_INTEGRATORS = ("RK4", "implicitfast", "implicit", "Euler", "discrete")
PINOCCHIO_INTEGRATORS = ("RK4", "DOP853", "semi_implicit_Euler")
TRACE_INTEGRATORS = ("LSODA",)
"""Integrators for traces of charts and error control, on the equations of either engine; runs of scenes do not use
them."""


@explained
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
        allowed = {"mujoco": MUJOCO_INTEGRATORS, "file": MUJOCO_INTEGRATORS, "pinocchio": PINOCCHIO_INTEGRATORS}.get(self.engine)
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
        """A sentence of warning for settings that are not accurate; None for others."""
        if self.preset == "draft":
            return "draft: first-order integration; energy and phase may be wrong by several per cent, only the look is meant"
        if self.timeconst is None and self.engine != "file":
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
    """Settings of a preset, with changes; raises MechlabError, listing the presets, for an unknown name."""
    if name not in PRESETS:
        raise unknown("preset", name, PRESETS)
    return replace(PRESETS[name], **changes)  # type: ignore[arg-type]


NEEDS = ("poses", "drive_forces", "tooth_loads", "reactions")
DRIVES = ("hold", "free")
"""Behaviour of declared drives without a law in the scene: they hold their targets, or give no force."""


@explained
@dataclass(frozen=True)
class Scene:
    """A scene. fidelity: "" for the one that the mechanism has by default; duration [s]; initial: physical values of joints at
    t = 0, the others follow by assembly from the reference pose; initial_rates: rates of joints or shafts, the others follow
    from the constraints (minimum norm).
    `needs`, `tolerance` [m or rad]: what the run must answer, and its largest error; `settings`: the recommended way to
    compute it. `keep_mode`: joints or shafts for which the assembly mode must not change; a run that changes it stops
    there with an error.

    drives: behaviour of declared drives without a law on their joint or shaft: "hold" their targets, or "free"
    (no force). A law on a driven joint or shaft replaces its drive; see `mechlab.experiment.acting`. Raises
    MechlabError for another word. file: the model file that the engine `file` runs as it is; its own actuators act, those of
    `controls` under the command (in the units of the file's control) that stands there by the actuator's name; MechlabError for
    controls without a file.
    """

    name: str = "own"
    fidelity: str = ""
    duration: float = 2.0
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
    file: ModelFile | None = None
    controls: Mapping[str, PrescribedMotion] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.drives not in DRIVES:
            raise unknown(f"scene {self.name}: drives", self.drives, DRIVES)
        if self.controls and self.file is None:
            raise MechlabError(
                f"scene {self.name}: controls are of the actuators of a file that is run as it is; this scene has no file. Give drives."
            )
        object.__setattr__(self, "laws", laws_of(self.laws))


PATH_STEPS = 10


def initial_state(mechanism: Mechanism, scene: Scene) -> tuple[Array, Array]:
    """Coordinates q (nq,) and rates v (nv,) at t = 0, on all constraints.

    `scene.initial` (physical values of joints or shafts) is approached from the reference pose by path continuation, so
    the assembly mode of the reference is kept. `scene.initial_rates` are met exactly, the other rates are the smallest
    ones that the constraints allow. Raises MechlabError for an unknown name, NoSolution when the pose does not close or
    the rates contradict the constraints, naming the row or value that is not met.
    """
    q, v = _start(mechanism, tuple(scene.initial.items()), tuple(scene.initial_rates.items()), scene.name)
    return q.copy(), v.copy()


@lru_cache(maxsize=32)
def _start(
    mechanism: Mechanism, values: tuple[tuple[str, float], ...], rates: tuple[tuple[str, float], ...], scene: str
) -> tuple[Array, Array]:
    """`initial_state`, found once for all runs of a scene."""
    what = f"{mechanism.name}, scene {scene!r}"
    q = initial_pose(mechanism, dict(values), what)
    return q, initial_rates(mechanism, q, dict(rates), what)


def initial_pose(mechanism: Mechanism, values: Mapping[str, float], what: str) -> Array:
    """(nq,) assembled coordinates with these physical values of joints or shafts; raises NoSolution where there are
    none."""
    q = mechanism.reference()
    _finite(values, what, "initial value")
    if all(float(mechanism.value(name, q)) == x for name, x in values.items()):
        return q
    found = _closed(mechanism, tuple(values.items()))
    if found.closed:
        return found.q.copy()
    tree, constraints = TreeKinematics(mechanism, found.q), ConstraintSet(mechanism)
    open_ends = [
        f"{n} = {float(mechanism.value(n, found.q)):.6g} instead of {x:.6g}"
        for n, x in values.items()
        if abs(float(mechanism.value(n, found.q)) - x) > 1e-9
    ]
    residual = np.abs(constraints.residual(tree))
    if len(residual) and residual.max() > 1e-9:
        k = int(np.argmax(residual))
        open_ends.append(f"{constraints.rows[k]} open by {residual[k]:.3g}")
    raise NoSolution(
        f"{what}: the initial pose does not close ({found.status.value}): "
        f"{', '.join(open_ends) or 'another assembly mode'}. "
        "Give fewer initial values, or values nearer the reference pose."
    )


@lru_cache(maxsize=32)
def _closed(mechanism: Mechanism, values: tuple[tuple[str, float], ...]) -> Assembly:
    """The assembled pose with these values; cached, for studies that run one scene many times."""
    return close(mechanism, None, dict(values), steps=PATH_STEPS)


def initial_rates(mechanism: Mechanism, q: Array, rates: Mapping[str, float], what: str) -> Array:
    """(nv,) minimum-norm rates with J v = 0 and the given rates of joints or shafts; raises NoSolution if they
    contradict."""
    _finite(rates, what, "initial rate")
    names = list(rates)
    rows = np.array([mechanism.row(n) for n in names]).reshape(len(names), mechanism.nv)
    if not any(rates.values()):
        return np.zeros(mechanism.nv)
    constraints, jacobian = ConstraintSet(mechanism), _jacobian(mechanism, tuple(q.tolist()))
    matrix = np.vstack([jacobian, rows])
    wanted = np.concatenate([np.zeros(len(jacobian)), [float(rates[n]) for n in names]])
    v = np.linalg.lstsq(matrix, wanted, rcond=1e-11)[0]
    gap = np.abs(matrix @ v - wanted)
    if gap.max() > 1e-9 * max(1.0, float(np.abs(wanted).max())):
        k = int(np.argmax(gap))
        culprit = (list(constraints.rows) + names)[k]
        raise NoSolution(
            f"{what}: the initial rates {', '.join(names)} contradict the constraints "
            f"({culprit} is missed by {gap[k]:.3g}). Give as many rates as there are degrees of freedom."
        )
    return np.asarray(v)


@lru_cache(maxsize=32)
def _jacobian(mechanism: Mechanism, q: tuple[float, ...]) -> Array:
    """(rows, nv) constraint Jacobian of a start, which every run of a scene asks for."""
    return ConstraintSet(mechanism).jacobian(TreeKinematics(mechanism, np.array(q)))


def _finite(values: Mapping[str, float], what: str, kind: str) -> None:
    for name, x in values.items():
        if not np.isfinite(x):
            raise MechlabError(f"{what}: {kind} of {name!r}: expected a finite number, got {x!r}.")


def sample_grid(duration: float, timestep: float, times: ArrayLike | None = None) -> Array:
    """(n,) sample times [s] from 0 to the duration: the given `times` with both ends added; by default a regular grid
    of whole timesteps, at most 10 ms apart, with at least 200 samples if the timestep allows it.

    Raises MechlabError for a duration that is not positive or times outside it.
    """
    if not np.isfinite(duration) or duration <= 0:
        raise MechlabError(f"duration: expected a number > 0 s, got {duration!r}.")
    if times is None:
        step = min(0.01, duration / 200.0)
        stride = max(1, int(step / timestep + 1e-9))
        count = max(1, int(np.ceil(duration / (stride * timestep) - 1e-9)))
        return np.append(np.arange(count) * (stride * timestep), duration)
    asked = np.unique(np.asarray(times, dtype=float))
    if not np.all(np.isfinite(asked)) or (len(asked) and (asked[0] < 0 or asked[-1] > duration * (1 + 1e-12))):
        raise MechlabError(f"sample times: expected times from 0 to {duration:g} s, got {asked.tolist()}.")
    inner = asked[(asked > 0) & (asked < duration)]
    return np.concatenate([[0.0], inner, [duration]])
