"""Verbs that compute: answers, runs, cycles, portraits, charts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechlab.api.finding import Source, load
from mechlab.errors import MechlabError, unknown
from mechlab.experiment.question import Answers
from mechlab.experiment.recording import Recording
from mechlab.lab.ask import ask, parameters_and_rest
from mechlab.lab.design import without_effect
from mechlab.values import one_number

if TYPE_CHECKING:
    from mechlab.kit.portrait import PortraitResult
    from mechlab.studies.chart.data import Chart
    from mechlab.studies.cycle.cycle import CycleResult


def solve(source: Source, **values: Any) -> Answers:
    """Answers of all witnesses; keyword arguments are parameters and given quantities, numbers or arrays."""
    return solve_values(source, values)


def solve_values(source: Source, values: Mapping[str, Any]) -> Answers:
    """As `solve`, from a mapping. The source "toolpath" is no mechanism: it asks about the curve of a file."""
    if source == "toolpath":
        from mechlab.studies.toolpath import solve_toolpath

        return solve_toolpath(values)
    base = load(source)
    parameters, given = parameters_and_rest(base.entry.parameters, values)
    return ask(load(base, **parameters), given)


def simulate(source: Source, scene: str | None = None, at: Sequence[float] = (), **options: Any) -> Recording:
    """Run a scene and return its Recording.

    options: parameters, X_0, X_rate_0 (initial values), X_force (constant loads), and duration [s], timestep [s],
    max_error, engine, fidelity, settings, order_check as of `simulate_values`. Nothing is raised for a run that cannot be trusted:
    look at `recording.health.trusted`.
    """
    names = ("duration", "timestep", "max_error", "engine", "fidelity", "settings", "order_check")
    how = {k: options.pop(k) for k in names if k in options}
    return simulate_values(source, options, scene=scene, at=at, **how)


def simulate_values(
    source: Source,
    values: Mapping[str, Any] | None = None,
    scene: str | None = None,
    duration: float | None = None,
    timestep: float | None = None,
    max_error: float | None = None,
    engine: str | None = None,
    fidelity: str | None = None,
    at: Sequence[float] | None = None,
    settings: Any = None,
    order_check: bool = False,
) -> Recording:
    """Run a scene; the recording's `samples` are read at the times `at` [s].

    values: parameters, X_0, X_rate_0 (initial), X_force (constant loads). settings: a Settings or the name of a preset.
    order_check: measure the order of the error in the timestep; the finding "order" names it and the expected one.
    """
    from mechlab.lab.fidelity.choose import run_chosen

    base = load(source)
    parameters, extra = parameters_and_rest(base.entry.parameters, dict(values or {}))
    chosen = load(base, **parameters)
    numbers = {k: one_number(k, v) for k, v in extra.items()}
    recording = run_chosen(
        chosen, scene, engine=engine, fidelity=fidelity, duration=duration, timestep=timestep, max_error=max_error,
        settings=settings, at=tuple(at or ()), extra=numbers,
    )  # fmt: skip
    if order_check and recording.settings.engine == "analytic":
        raise MechlabError(
            f"{chosen.name}: order_check: the engine analytic takes no steps, so that its error has no order."
        )
    if order_check:
        from mechlab.lab.order_check import with_order

        if recording.settings.engine == "analytic":
            raise MechlabError(f"{base.name}: order_check: the engine analytic takes no steps; leave it out.")
        lived = chosen.for_scene(scene)
        recording = with_order(recording, lived.scene(scene, recording.fidelity or fidelity, duration, numbers))
    return replace(recording, sample_times=tuple(at or ()), notes=chosen.warnings)


def portrait(
    source: Source, kind: str, values: Mapping[str, Any] | None = None, out: str | Path | None = None, **more: Any
) -> PortraitResult:
    """A portrait of a mechanism (see its `portraits`); values: parameters (numbers), and what the portrait takes, numbers
    or ranges. Arrays and a figure go to the folder `out`. Raises MechlabError for an unknown kind, listing them."""
    from mechlab.kit.portrait import write
    from mechlab.lab.ask import in_si, numeric

    base = load(source)
    if kind not in base.entry.portraits:
        raise unknown(f"{base.name}: portrait", kind, base.entry.portraits)
    given = dict(values or {}) | more
    parameters, rest = parameters_and_rest(base.entry.parameters, given)
    many = {k: numeric(k, v) for k, v in in_si(base, rest).items()}
    for key in [k for k, v in parameters.items() if hasattr(v, "points") or isinstance(v, list | tuple)]:
        many[key] = numeric(key, parameters.pop(key))
    chosen = load(base, **parameters)
    many |= {k: numeric(k, v) for k, v in parameters.items() if k.endswith("_0")}
    made = base.entry.portraits[kind](chosen.parameters, many)
    return write(base.name, made, None if out is None else Path(out), chosen.warnings)


def cycle(
    source: Source, values: Mapping[str, Any] | None = None, fidelity: str | None = None, **more: Any
) -> CycleResult:
    """One turn of the drive of a mechanism with one freedom. Values (a mapping or keywords): parameters, X_rate and X_accel of
    the drive X, X_force (constant loads). Options: drive, output, points, span; see `mechlab.studies.cycle.cycle.run_cycle`."""
    from mechlab.studies.cycle.cycle import run_cycle

    options = {k: x for k in ("drive", "output", "points", "span") if (x := more.pop(k, None)) is not None}
    base = load(source)
    parameters, motion = parameters_and_rest(base.entry.parameters, dict(values or {}) | more)
    chosen = load(base, **parameters)
    idle = without_effect(base, parameters, fidelity)
    if idle:
        raise MechlabError(
            f"{base.name}: {', '.join(idle)}: a parameter of scenes changes nothing in a cycle. Give X_rate, X_accel of the drive, "
            "X_force as a load, or leave it out."
        )
    return run_cycle(
        chosen.mechanism(fidelity), chosen.name, {k: one_number(k, v) for k, v in motion.items()}, **options
    )


def chart(
    source: Source,
    values: Mapping[str, Any] | None = None,
    scene: str | None = None,
    duration: float | None = None,
    target: float | None = None,
    fidelity: str | None = None,
    peers: bool = False,
    **parameters: Any,
) -> Chart:
    """Speed against accuracy of every method on a scene: points, Pareto front, recommended setting.

    An .xml file is charted as MuJoCo loads it, whatever it holds; see `mechlab.studies.chart.of_file`.
    target [m or rad]: the error to meet, by default that of the scene. peers: also other people's engines, as far as they
    are installed, and what `max_error` costs against the fastest of them.
    """
    if isinstance(source, str | Path) and Path(source).suffix.lower() == ".xml":
        from mechlab.studies.chart.of_file import chart_file

        for name, given in {"scene": scene, "fidelity": fidelity, **dict(values or {}), **parameters}.items():
            if given is not None:
                raise MechlabError(f"chart {source}: an MJCF file has no {name}; --duration and --target can be given.")
        if peers:
            raise MechlabError(
                f"chart {source}: peers are given a mechanism of the catalog or a Python file, not an MJCF file."
            )
        return chart_file(Path(source), duration, target)
    from mechlab.studies.chart.chart import chart as work

    d = load(source, **(dict(values or {}) | parameters))
    return work(d, scene, fidelity=fidelity, duration=duration, target=target, peers=peers)
