"""The verb that leads a mechanism along a path."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from mechlab.api.arguments import Error, File, Plain, Progress, Seconds, Values, key_values, silent
from mechlab.api.finding import Source, design_and_rest
from mechlab.errors import MechlabError, explained
from mechlab.values import one_number

if TYPE_CHECKING:
    from mechlab.studies.track.result import Track
    from mechlab.studies.track.tasks import Limit, Row, Target, Task


@explained
def track(
    source: Source,
    values: Mapping[str, Target] | None = None,
    /,
    tasks: Sequence[Task | Limit] = (),
    *,
    times: Row | None = None,
    duration: Seconds = 1.0,
    wishes: Sequence[str] = (),
    tolerance: Error | None = None,
    max_rate: Values | None = None,
    clearance: Plain | None = None,
    fidelity: str | None = None,
    out: File | None = None,
    progress: Progress = silent,
    **given: Target,
) -> Track:
    """Lead frames, joints or shafts of a closed mechanism along a path; all loops, gears and joint ranges hold.

    Keys: parameters; targets FRAME_x, FRAME_y, FRAME_z, FRAME_rotation (3, 3) or (n, 3, 3), joints and shafts, one value a time or
    one for all; X_0 (a joint or shaft of the pose from which the first target is approached). In Python also a frame:
    positions (3,), (n, 3), poses (4, 4), (n, 4, 4), or functions of time, and `tasks` with weights and priorities: FrameTask,
    PostureTask, CenterOfMassTask, RangeLimit, RateLimit, SingularityLimit. times (n,) [s]: default even over `duration`.

    At each time, with null-space basis N of the closed rows J(q), velocities N z (one size of the mechanism counts as 1 rad):

        priority k:   min |A_k N z - b_k|^2   subject to the priorities before it, joint ranges, rates, clearance

    and last the least motion from the pose before; then Newton closes all loops to 1e-12 of the size, and the step is repeated
    until nothing is gained, so that there is no drift. Exit 3 where a target that is no wish is missed; `message` says where,
    by how much, and which limit holds it. Raises NoSolution where the start does not close.

    Options:
        duration=T: time of the whole path [s]
        wishes=KEY,...: targets that may yield: met as far as the others allow
        tolerance=E: largest error that counts as met [m or rad]; default 1e-9 of the size, 1e-9 rad
        max_rate=JOINT=V,...: largest rates of joints or shafts [rad/s or m/s]
        clearance=D: least distance from singularity of the loops, the smallest singular value of their rows
        fidelity=F: level of fidelity: minimal, parts, full
        out=FILE.npz: the motion as a recording, which `view` opens; or all numbers as FILE.json
    """
    from mechlab.engines.protocol import engine
    from mechlab.lab.ask import asked_mechanism, in_si
    from mechlab.studies.track.closed import usual_engine
    from mechlab.studies.track.read import goals_of, tasks_of_keys, times_of, wanted_of
    from mechlab.studies.track.study import track as study
    from mechlab.studies.track.tasks import Limit, RateLimit, SingularityLimit

    if not isinstance(tasks, Sequence):
        raise MechlabError(f"tasks: expected a list of tasks and limits, got {tasks!r}.")
    design, rest = design_and_rest(source, key_values(values, given))  # type: ignore[arg-type]
    m = asked_mechanism(design) if fidelity is None else design.mechanism(fidelity)
    of_keys, start = tasks_of_keys(m, in_si(design, rest), wishes)
    limits: list[Limit] = [x for x in tasks if isinstance(x, Limit)]
    if max_rate:
        rates = in_si(design, {f"{k}_rate": x for k, x in key_values(max_rate, {}).items()})
        limits.append(RateLimit({k.removesuffix("_rate"): one_number(k, x) for k, x in rates.items()}))
    if clearance is not None:
        limits.append(SingularityLimit(clearance))
    asked: list[Task] = [*of_keys, *(x for x in tasks if not isinstance(x, Limit))]
    wanted = wanted_of(m, asked)
    t = times_of(m, wanted, times, duration)
    name = usual_engine()
    found = study(
        m, lambda unit: goals_of(m, wanted, t, tolerance, unit), t, limits,
        {k: one_number(k, x) for k, x in start.items()}, engine=name, progress=progress, name=design.name,
        parameters=dict(design.given), versions=engine(name).versions() if name != "numpy" else {}, notes=design.warnings,
    )  # fmt: skip
    found = replace(found, recording=replace(found.recording, fidelity=fidelity or design.entry.default_fidelity))
    return found if out is None else replace(found, files={"written": str(found.save(out))})
