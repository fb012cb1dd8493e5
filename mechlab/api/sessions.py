"""Loops in which the user commands the drives: a session, and environments for reinforcement learning."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from mechlab.api.arguments import Seconds, Values, Whole, key_values
from mechlab.api.finding import Source, design_and_rest
from mechlab.values import Value, one_number

if TYPE_CHECKING:
    from mechlab.engines.mujoco.session import Session, Start
    from mechlab.experiment.scene import Settings


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
    **given: Value,
) -> Session:
    """A step loop on MuJoCo in which you command the drives, with the health record of a run.

        with ml.session("fourbar", hold=0.01) as s:
            observation = s.step([1.2])                 # or s.step({"crank_angle": 1.2})
        ml.view(s.recording())

    An action is an array over the declared drives in their order (`s.action_names`, `s.action_units`): the target of a servo
    [rad or m], the force of a motor [N m or N], the voltage of a winding [V]. It is held for `hold` seconds, in whole timesteps
    (the timestep is shortened to divide it); None: one timestep. An observation is an array (`s.observation_names`): all joints
    and their rates, or what `observe` names: joints, shafts, X_rate, and frames (X_x, X_y, X_z). `s.action_low`, `s.action_high`:
    ranges of joints and force limits; commands beyond are not clipped.

    scene: gives the start, the loads, the settings; its laws on driven joints give way to your commands. start: a function
    rng -> {"X_0": ..., "X_rate_0": ...} for the initial values of every reset, with the generator of `seed`, also in `s.rng`. Keys
    are those of `simulate`. `s.reset()` begins anew; `s.health` and `s.recording()` tell of the motion since the reset.

    Raises MechlabError for a command that is not finite, naming the drive; Untrustworthy from `step` when the motion blew up or a
    loop opened. Closing warns (UntrustedSession) when the motion must not be trusted.
    """
    from mechlab.lab.session import open_session

    design, rest = design_and_rest(source, key_values(values, given))
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
    )
