"""Verbs that compute one thing: answers and what they depend on, runs, cycles, portraits, charts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mechlab.api.arguments import (
    AnyError,
    Engine,
    Error,
    File,
    Progress,
    Seconds,
    Travel,
    Values,
    Whole,
    key_values,
    silent,
)
from mechlab.api.finding import Source, design_and_rest, load_design
from mechlab.api.suggestions import suggesting
from mechlab.clock import costed, spent_on
from mechlab.errors import MechlabError, explained, unknown, warn
from mechlab.studies.direct import NAMES as DIRECT_QUESTIONS
from mechlab.values import Value, in_unit, one_number

if TYPE_CHECKING:
    from mechlab.experiment.laws import Laws
    from mechlab.experiment.question import Answers
    from mechlab.experiment.recording import Recording
    from mechlab.experiment.scene import Scene, Settings
    from mechlab.kit.portrait import PortraitResult
    from mechlab.lab.own_scene import Commands
    from mechlab.studies.chart.data import Chart
    from mechlab.studies.cycle.cycle import CycleResult
    from mechlab.studies.fidelity.result import Fidelities
    from mechlab.studies.sensitivity.result import Sensitivity


@explained
@suggesting
def solve(source: Source, values: Values | None = None, /, **given: Value) -> Answers:
    """Answers of all witnesses; keys are parameters and given quantities, numbers or arrays that broadcast.

    Four sources are no mechanisms: "toolpath" and "bspline" ask about the curve of a file, its length and travel along it, "regions"
    about points of a region of functions, "assur" about all assembly modes of a linkage in a file.
    """
    asked = key_values(values, given)
    if isinstance(source, str) and source in DIRECT_QUESTIONS:
        from mechlab.studies.direct.table import DIRECT

        return DIRECT[source].solve(asked)
    from mechlab.lab.ask import ask

    return ask(*design_and_rest(source, asked))


@explained
@suggesting
def sensitivity(
    source: Source,
    values: Values | None = None,
    /,
    *,
    tolerance: Mapping[str, Value] | float | None = None,
    only: Sequence[str] = (),
    progress: Progress = silent,
    **given: Value,
) -> Sensitivity:
    """First-order sensitivity of every answer to every parameter that is a number, from each witness, and tolerances.

    Keys as of `solve`. A given quantity with a tolerance is an input too.

    Options:
        tolerance=key=t,... or share: half widths of parameters (or t / p of all): tolerances of the answers
        only=key,...: only the sensitivity to these parameters
    """
    from mechlab.studies.sensitivity.inputs import Tolerances
    from mechlab.studies.sensitivity.study import sensitivity as study

    if isinstance(source, str) and source in DIRECT_QUESTIONS:
        raise MechlabError(f"{source}: it has no parameters to vary; sensitivity is for mechanisms.")
    design, asked = design_and_rest(source, key_values(values, given))
    return study(design, asked, Tolerances.of(tolerance), only, progress)


@explained
@suggesting
def simulate(
    source: Source,
    values: Values | str | None = None,
    /,
    *,
    scene: str | Scene | None = None,
    laws: Laws = (),
    drives: Commands | None = None,
    duration: Seconds | None = None,
    timestep: Seconds | None = None,
    max_error: AnyError | None = None,
    budget: Seconds | None = None,
    engine: Engine | None = None,
    order_check: bool = False,
    fidelity: str | None = None,
    at: Sequence[Seconds] | None = None,
    settings: Settings | str | None = None,
    out: File | None = None,
    **given: Value,
) -> Recording:
    """Run a scene and return its Recording; keys are parameters, X_0, X_rate_0 (initial values) and X_force (constant loads).

    Nothing is raised for a run that cannot be trusted: look at `health.trusted`. settings: a Settings or the name of a preset
    ("accurate", "stiff", "draft").

    scene: also a Scene of your own. laws: what acts in addition, as a list of laws or joint -> function(t, plant) that gives a
    force [N m or N] (or a constant number); a function is called at every stage of a step. drives: drive -> what it follows: a
    number, a function of time, a motion (`Hold`, `Ramp`, `Sine`, `Spline`) or (times, values), in the unit of the drive: target
    value of a servo, target rate of a drive with damping alone, voltage of a DC motor, else force. A law on a joint takes the place
    of its drive and of the scene's own law there. Of a file that is run as it is (scene as-is): actuator -> its control, in the
    file's units, set before each step as `data.ctrl` and clamped to its ctrlrange by MuJoCo; laws act in addition.

    Options:
        scene=S: name of a scene; `mechlab show NAME` lists them
        duration=T: simulated time [s]
        timestep=H: timestep [s]
        max_error=E: tolerated error of what the scene tracks, of its positions [m or rad], or with a unit (1W, 0.1mm, 1N, 1deg) of its
            channels in that unit; engine, method, step and constraint settings are chosen, and every channel states its own error
        budget=T: most CPU time that choosing them may take [s] (default: 3 s and 1.5 s for each second of the scene, at most 30)
        engine=E: who computes
        order_check: measure the order of the error in the timestep
        fidelity=F: level of fidelity: minimal, parts, full, or auto: the cheapest that answers
        at=T,...: times at which to sample the channels [s]
        out=FILE.npz: file for the recording
    """
    if isinstance(values, str):
        warn('the scene is an option now: simulate(source, scene="...")', DeprecationWarning)
        values, scene = None, values
    if out is not None and Path(out).suffix != ".npz" and not (Path(out).is_char_device() or Path(out).is_fifo()):
        table = "`mechlab view FILE.npz --csv FILE.csv` makes a table of it"
        raise MechlabError(f"out: a recording is a file whose name ends in .npz, got {out}; {table}.")
    recording = _simulated(
        source, key_values(values, given), scene, laws, drives, duration, timestep, max_error, budget, engine, order_check,
        fidelity, tuple(at or ()), settings,
    )  # fmt: skip
    if out is not None:
        recording.save(out)
    return recording


@costed
def _simulated(
    source: Source, given: Mapping[str, Value], scene: str | Scene | None, laws: Laws, drives: Commands | None, duration: Seconds | None,
    timestep: Seconds | None, max_error: AnyError | None, budget: Seconds | None, engine: Engine | None, order_check: bool,
    fidelity: str | None, times: tuple[Seconds, ...], settings: Settings | str | None,
) -> Recording:  # fmt: skip
    """See `simulate`."""
    with spent_on("imports"):
        from mechlab.lab.own_scene import with_laws, with_scene
        from mechlab.lab.run import engine_of, run_scene

    design, rest = design_and_rest(source, given)
    if scene is not None and not isinstance(scene, str):
        design, scene = with_scene(design, scene), None
    duration, timestep = (
        x if x is None else float(in_unit(what, one_number(what, x), "s"))
        for what, x in (("duration", duration), ("timestep", timestep))
    )
    error = None if max_error is None else one_number("max_error", max_error)
    most = None if budget is None else float(in_unit("budget", one_number("budget", budget), "s"))
    if laws or drives:
        design, scene = with_laws(design, scene or design.scene_for(engine or engine_of(settings)), laws, drives), None
    extra = {k: one_number(k, v) for k, v in rest.items()}
    recording = run_scene(
        design, scene, engine=engine, fidelity=fidelity, duration=duration, timestep=timestep, max_error=error,
        budget=most, settings=settings, at=times, extra=extra,
    )  # fmt: skip
    if order_check:
        if recording.settings.engine == "analytic":
            raise MechlabError(f"{design.name}: order_check: the engine analytic takes no steps; leave it out.")
        from mechlab.lab.order_check import with_order

        scene = scene or recording.scene
        of_scene = design.for_scene(scene).scene(scene, recording.fidelity or fidelity, duration, extra)
        with spent_on("check"):
            recording = with_order(recording, of_scene)
    return replace(recording, sample_times=times, notes=design.warnings)


@explained
@suggesting
def portrait(
    source: Source, kind: str, values: Values | None = None, /, *, out: File | None = None, **given: Value
) -> PortraitResult:
    """A portrait of a mechanism (see its `portraits`); keys are parameters (numbers), and what the portrait takes, numbers or
    ranges. Raises MechlabError for an unknown kind, listing them.

    Options:
        out=DIR: folder for the arrays and a figure
    """
    from mechlab.kit.portrait import write
    from mechlab.lab.ask import in_si, numeric, parameters_and_rest

    base = load_design(source, {})
    if kind not in base.entry.portraits:
        raise unknown(f"{base.name}: portrait", kind, base.entry.portraits)
    parameters, rest = parameters_and_rest(base.entry.parameters, key_values(values, given))
    many = {k: numeric(k, v) for k, v in in_si(base, rest).items()}
    for key in [k for k, v in parameters.items() if hasattr(v, "points") or hasattr(v, "__len__")]:
        many[key] = numeric(key, parameters.pop(key))
    design = load_design(base, parameters)
    many |= {k: numeric(k, v) for k, v in parameters.items() if k.endswith("_0")}
    made = base.entry.portraits[kind](design.parameters, many)
    return write(base.name, made, None if out is None else Path(out), design.warnings)


@explained
@suggesting
def cycle(
    source: Source,
    values: Values | None = None,
    /,
    *,
    drive: str | None = None,
    output: str | None = None,
    points: Whole | None = None,
    span: tuple[Travel, Travel] | None = None,
    fidelity: str | None = None,
    out: File | None = None,
    **given: Value,
) -> CycleResult:
    """One turn of the drive of a mechanism with one freedom; keys are parameters, X_rate and X_accel of the drive X, and X_force
    (constant loads). See `mechlab.studies.cycle.cycle.run_cycle`.

    Options:
        drive=X: joint or shaft that is driven (default: that of the drive, else the first that turns fully)
        output=X: joint whose load the transmission angle is about
        points=N: number of steps (default: 72)
        span=LO,HI: range of the drive (default: a turn, or what the limits allow)
        fidelity=F: level of fidelity: minimal, parts, full
        out=FILE: table .csv, charts .svg or curves .dxf
    """
    from mechlab.lab.ask import parameters_and_rest
    from mechlab.lab.design import without_effect
    from mechlab.studies.cycle.cycle import POINTS, run_cycle

    base = load_design(source, {})
    parameters, motion = parameters_and_rest(base.entry.parameters, key_values(values, given))
    design = load_design(base, parameters)
    if idle := without_effect(base, parameters, fidelity):
        raise MechlabError(
            f"{base.name}: {', '.join(idle)}: a parameter of scenes changes nothing in a cycle. Give X_rate, X_accel of the drive, "
            "X_force as a load, or leave it out."
        )
    numbers = {k: one_number(k, v) for k, v in motion.items()}
    result = run_cycle(
        design.mechanism(fidelity), design.name, numbers, drive, output, POINTS if points is None else points, span
    )
    if out is not None:
        result.save(Path(out))
    return result


@explained
@suggesting
def chart(
    source: Source,
    values: Values | None = None,
    /,
    *,
    scene: str | None = None,
    duration: Seconds | None = None,
    target: Error | None = None,
    fidelity: str | None = None,
    peers: bool = False,
    out: File | None = None,
    progress: Progress = silent,
    **parameters: Value,
) -> Chart:
    """Speed against accuracy of every method on a scene: points, Pareto front, recommended setting.

    An .xml file is charted as MuJoCo loads it, whatever it holds; see `mechlab.studies.chart.mjcf_file`. peers: as far as they
    are installed.

    Options:
        scene=S: name of a scene; `mechlab show NAME` lists them
        duration=T: simulated time [s]
        target=E: error that the recommended setting must meet [m or rad]
        fidelity=F: level of fidelity
        peers: beside Exudyn, Drake, OpenSim, MuJoCo Warp and Kamino, and what --max-error costs against them
        out=PATH: a .svg, .png, .csv or .json file, or a folder for all of them
    """
    given = key_values(values, parameters)
    if isinstance(source, str | Path) and Path(source).suffix.lower() == ".xml":
        from mechlab.studies.chart.mjcf_file import chart_of_mjcf_file

        for name in [k for k, x in {"scene": scene, "fidelity": fidelity, **given}.items() if x is not None]:
            raise MechlabError(f"chart {source}: an MJCF file has no {name}; --duration and --target can be given.")
        if peers:
            raise MechlabError(
                f"chart {source}: peers are given a mechanism of the catalog or a Python file, not an MJCF file."
            )
        result = chart_of_mjcf_file(Path(source), duration, target)
    else:
        from mechlab.studies.chart.run import chart as study

        design = load_design(source, given)
        result = study(design, scene, fidelity=fidelity, duration=duration, target=target, peers=peers, progress=progress)
    if out is not None:
        result.save(Path(out))
    return result


@explained
@suggesting
def fidelities(
    source: Source,
    values: Values | None = None,
    /,
    *,
    scene: str | None = None,
    duration: Seconds | None = None,
    needs: Sequence[str] | None = None,
    out: File | None = None,
    **given: Value,
) -> Fidelities:
    """The fidelities of a mechanism side by side on a scene: what each answers, its error against the richest, its cost, and
    which one `fidelity="auto"` takes. See `mechlab.lab.fidelity`.

    Options:
        scene=S: name of a scene; `mechlab show NAME` lists them
        duration=T: simulated time [s]
        needs=N,...: what must be answered (default: what the scene needs): poses, drive_forces, tooth_loads, reactions
        out=PATH: a .svg, .png, .csv or .json file, or a folder for all of them
    """
    from mechlab.studies.fidelity.compare import compare

    design, rest = design_and_rest(source, key_values(values, given))
    table = compare(design, scene, duration, {k: one_number(k, v) for k, v in rest.items()}, needs)
    if out is not None:
        table.save(Path(out))
    return table
