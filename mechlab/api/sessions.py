"""Loops in which the user commands the drives: a session, and environments for reinforcement learning."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Literal

from mechlab.api.arguments import Seconds, Values, Whole, key_values
from mechlab.api.finding import Source, design_and_rest
from mechlab.api.suggestions import suggesting
from mechlab.errors import EngineMissing, explained, install_extra
from mechlab.values import Value, one_number

if TYPE_CHECKING:
    from mechlab.engines.mujoco.step_loop import Start, StepLoop
    from mechlab.experiment.scene import Settings
    from mechlab.lab.environment import Environment, Environments, Reward, Terminated
    from mechlab.studies.modes.controlled import LinearModel


@explained
@suggesting
def session(
    source: Source,
    values: Values | None = None,
    /,
    *,
    scene: str | None = None,
    seed: Whole | None = None,
    hold: Seconds | None = 0.01,
    observe: Sequence[str] = (),
    start: Start | None = None,
    fidelity: str | None = None,
    settings: Settings | str | None = None,
    engine: Literal["mujoco", "file"] | None = None,
    **given: Value,
) -> StepLoop:
    """A step loop on MuJoCo in which you command the drives, with the health record of a run.

        with ml.session("fourbar", hold=0.01) as s:
            observation = s.step([1.2])                 # or s.step({"crank_angle": 1.2})
        ml.view(s.recording())

    An action is an array over the declared drives in their order (`s.action_names`, `s.action_units`): the target of a servo
    [rad or m], the target rate of a drive with damping alone, the force of a motor [N m or N], the voltage of a winding [V]; of a drive
    read from a file, the control of that file. It is held for `hold` seconds, in whole timesteps
    (the timestep is shortened to divide it); None: one timestep. An observation is an array (`s.observation_names`): all joints
    and their rates, or what `observe` names: joints, shafts, X_rate, and frames (X_x, X_y, X_z). `s.action_low`, `s.action_high`:
    ranges of joints and force limits; commands beyond are not clipped.

    scene: gives the start, the loads, the settings; its laws on driven joints give way to your commands. start: a function
    rng -> {"X_0": ..., "X_rate_0": ...} for the initial values of every reset, with the generator of `seed`, also in `s.rng`. Keys
    are those of `simulate`. `s.reset()` begins anew; `s.health` and `s.recording()` tell of the motion since the reset.

    Somebody's MJCF file is stepped as it is, with its contacts, softness and timestep: an action is its `data.ctrl`, of which some whole
    timesteps make `hold`, and the Recording is a run of the same motion. engine="mujoco", settings of it or another scene than `as-is`
    step mechlab's model of the file: hard loops, no contacts, its drives. `acts` of a recording says which.

    Raises MechlabError for a command that is not finite, naming the drive; Untrustworthy from `step` when the motion blew up or a
    loop opened. Closing warns (UntrustedSession) when the motion must not be trusted.
    """
    return _opened(source, key_values(values, given), scene, hold, observe, start, fidelity, settings, seed, engine)


def _opened(
    source: Source,
    given: Mapping[str, Value],
    scene: str | None,
    hold: float | None,
    observe: Sequence[str],
    start: Start | None,
    fidelity: str | None,
    settings: Settings | str | None,
    seed: int | None = None,
    engine: str | None = None,
) -> StepLoop:
    """See `session`."""
    from mechlab.lab.session import open_session

    design, rest = design_and_rest(source, given)
    extra = {k: one_number(k, v) for k, v in rest.items()}
    return open_session(
        design,
        scene,
        fidelity=fidelity,
        settings=settings,
        hold=hold,
        observe=observe,
        start=start,
        seed=seed,
        extra=extra,
        engine=engine,
    )


@explained
@suggesting
def environment(
    source: Source,
    values: Values | None = None,
    /,
    *,
    reward: Reward,
    terminated: Terminated | None = None,
    seconds: Seconds | None = None,
    scene: str | None = None,
    hold: Seconds | None = 0.01,
    observe: Sequence[str] = (),
    start: Start | None = None,
    fidelity: str | None = None,
    settings: Settings | str | None = None,
    engine: Literal["mujoco", "file"] | None = None,
    **given: Value,
) -> Environment:
    """A gymnasium.Env of a mechanism: its drives are the action, physical units in both spaces; see `session` for the options.

        def reward(observation, action, session):
            return -abs(observation[0] - 1.5)

        env = ml.environment("fourbar", reward=reward, terminated=lambda o, s: o[0] > 3, seconds=2)

    The action space holds ranges of joints and limits of forces, the observation space ranges of joints (a tenth wider, as stops
    give way) and rates below 1e6. An episode is truncated after `seconds` (default: the duration of the scene) and where the motion
    cannot go on; then info["untrusted"] says why. gymnasium's wrappers rescale and clip: RescaleAction, ClipAction, NormalizeObservation.

    Needs gymnasium: the extra `[rl]`. Raises EngineMissing without it, MechlabError for a mechanism without drives.
    """
    made = _with_gymnasium()
    one = _opened(source, key_values(values, given), scene, hold, observe, start, fidelity, settings, engine=engine)
    return made.Environment(one, reward, terminated, one.scene.duration if seconds is None else seconds)


@explained
@suggesting
def environments(
    source: Source,
    values: Values | None = None,
    /,
    *,
    count: Whole,
    reward: Reward,
    terminated: Terminated | None = None,
    seconds: Seconds | None = None,
    threads: Whole = 0,
    scene: str | None = None,
    hold: Seconds | None = 0.01,
    observe: Sequence[str] = (),
    start: Start | None = None,
    fidelity: str | None = None,
    settings: Settings | str | None = None,
    engine: Literal["mujoco", "file"] | None = None,
    **given: Value,
) -> Environments:
    """A gymnasium.vector.VectorEnv: `count` copies of `environment`, stepped inside MuJoCo on `threads` threads (0: all cores).

    Seeded with n, copy k moves as `environment` seeded with n + k. `reward` and `terminated` are called for each copy; their
    third argument has time, state, mechanism and names of a session. The scene may have constant loads only. Raises as `environment`.

    It is for free cores and for short actions. The engine shares the copies evenly among its threads, so the physics of an action (of a
    four-bar 0.4 ms in 10 ms) takes as many times less as cores are free, and no less where none is. One call of Python steps all copies:
    at one timestep an action 64 four-bars cost 12 us each and single environments 17, four of them 19.
    """
    made = _with_gymnasium()
    from mechlab.engines.mujoco.fleet import Fleet

    one = _opened(source, key_values(values, given), scene, hold, observe, start, fidelity, settings, engine=engine)
    fleet = Fleet(one, count, threads)
    return made.Environments(fleet, reward, terminated, one.scene.duration if seconds is None else seconds)


@explained
@suggesting
def linearize(
    source: Source,
    values: Values | None = None,
    /,
    *,
    fidelity: str | None = None,
    witness: Literal["pinocchio", "mujoco"] = "pinocchio",
    **given: Value,
) -> LinearModel:
    """The linear equations x' = A x + B u of a mechanism about a pose that its drives hold, on the motions that its loops allow.

        model = ml.linearize("my.py:cart", lean_0=0)
        P = scipy.linalg.solve_continuous_are(model.A, model.B, Q, R)
        gain = np.linalg.solve(R, model.B.T @ P)
        with ml.session("my.py:cart") as s:
            s.step(model.at_rest - gain @ model.state(*s.state))

    Keys: parameters, X_0 (values of the pose; the rest closes from the reference pose), X_force (constant loads). u: commands of
    the drives as of `session`, less those that hold the pose; force limits and the currents' delay are left out. witness: whose
    forces and rows. Raises NoSolution where the drives cannot hold the pose, Untrustworthy at a singular position.
    """
    from mechlab.studies.modes.controlled import linear_model

    design, rest = design_and_rest(source, key_values(values, given))
    return linear_model(design, fidelity, {k: one_number(k, v) for k, v in rest.items()}, witness)


def _with_gymnasium() -> ModuleType:
    """The module of the environments. Raises EngineMissing where gymnasium is not installed."""
    try:
        return import_module("mechlab.lab.environment")
    except ModuleNotFoundError as problem:
        if problem.name != "gymnasium":
            raise
        raise EngineMissing(
            f"gymnasium is not installed, which environments are made for; {install_extra('rl')}."
        ) from None
