"""Verbs that look at many states, runs or designs of a mechanism: modes, stability, sweeps, workspaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mechlab.api.arguments import (
    Engine,
    File,
    Progress,
    Seconds,
    Stages,
    Values,
    Whole,
    as_range,
    key_values,
    silent,
)
from mechlab.api.finding import Source, design_and_rest, load_design, open_source, sweep_command, travelling
from mechlab.api.suggestions import suggesting
from mechlab.errors import UsageError, explained, warn
from mechlab.files import whole_folder, write
from mechlab.values import Range, Value, in_unit, one_number

if TYPE_CHECKING:
    from mechlab.studies.modes.result import ModesResult
    from mechlab.studies.stability.data import Stability
    from mechlab.studies.sweep.result import SweepResult
    from mechlab.studies.workspace.plan import WorkspacePlan
    from mechlab.studies.workspace.study import WorkspaceResult

LISTS = ("numbers", "integers")
"""Kinds of parameters that are lists themselves: a list of values is one of them, and no range."""


@explained
@suggesting
def modes(
    source: Source,
    values: Values | None = None,
    /,
    *,
    scene: str | None = None,
    fidelity: str | None = None,
    free: bool = False,
    html: File | None = None,
    only: Sequence[Whole] = (),
    out: File | None = None,
    **given: Value,
) -> ModesResult:
    """Equilibrium, eigenfrequencies, damping and mode shapes on the constraint manifold, from each engine on its own.

    Keys: parameters, X_0 (where the search for the equilibrium starts), X_force (constant loads). See `mechlab.studies.modes`.

    Options:
        scene=S: start and laws of a scene (default: the drives hold their targets, from the reference pose)
        fidelity=F: level of fidelity: minimal, parts, full
        free: neither drives nor laws: weight, springs and dampers alone
        html=F: write a page that swings through the modes
        only=K,...: numbers of the modes that the page shows
        out=DIR: folder for modes.json, modes.npz and modes.html
    """
    from mechlab.studies.modes.motion import mode_motion
    from mechlab.studies.modes.study import find_modes

    if only and html is None and out is None:
        raise UsageError("`only` chooses what the page shows: add `html` or `out`.")
    design, rest = design_and_rest(source, key_values(values, given))
    result = find_modes(design, scene, fidelity, {k: one_number(k, v) for k, v in rest.items()}, free)
    if html is None and out is None:
        return result
    import json

    from mechlab.api.pages import modes_story
    from mechlab.formats import save_recording
    from mechlab.viewer import write_page

    motion = mode_motion(result, only)
    story = modes_story(design if scene is None else design.for_scene(scene), result, motion, only)
    files: dict[str, str] = {}
    if html is not None:
        files["page"] = str(write_page(story, html))
    if out is not None:
        with whole_folder(out) as stage:
            if html is None:
                files["page"] = str(Path(out) / write_page(story, stage / "modes.html").name)
            write(stage / "modes.json", json.dumps(result.to_dict(), indent=1, default=str))
            save_recording(motion, stage / "modes.npz")
        files |= {"json": str(Path(out) / "modes.json"), "recording": str(Path(out) / "modes.npz")}
    return replace(result, files=files)


@explained
@suggesting
def stability(
    source: Source,
    values: Values | None = None,
    /,
    *,
    scene: str | None = None,
    kinds: Sequence[str] = (),
    methods: Sequence[str] | str = (),
    fidelity: str | None = None,
    budget: Seconds | None = None,
    out: File | None = None,
    progress: Stages = silent,
    **given: Value,
) -> Stability:
    """Maps of where methods fail, by measurement, with the boundaries of theory; those that the structure calls for, or `kinds`.

    Keys are parameters; a range of a parameter, of BODY_mass, X_stiffness or friction makes a map over it. Raises MechlabError
    for unknown names, and for a map that does not fit the mechanism, saying why.

    Options:
        scene=S: name of a scene; `mechlab show NAME` lists them
        kinds=KIND,...: only these maps: stiffness, mass-ratio, singularity, redundancy, softness, gear-ratio, light-parts,
            sticking
        methods=A,B: methods by name or part of a name, such as RK4,discrete
        fidelity=F: level of fidelity
        budget=T: work to do [s]: about seconds of CPU, counted, so that every machine makes the same map
        out=DIR: folder for the data (.json) and a picture (.png) a map
    """
    from mechlab.experiment.parameters import describe
    from mechlab.studies.stability.study import BUDGET, study

    asked, base = key_values(values, given), load_design(source, {})
    lists = {i.name for i in describe(base.entry.parameters) if i.kind in LISTS}
    ranges = {k: r for k, v in asked.items() if k not in lists and (r := _counted_range(k, v)) is not None}
    names = tuple(n for text in ([methods] if isinstance(methods, str) else methods) for n in _method_names(text))
    found = study(
        load_design(base, {k: v for k, v in asked.items() if k not in ranges}), scene, kinds=tuple(kinds), methods=names,
        ranges=ranges, fidelity=fidelity, budget=BUDGET if budget is None else budget, progress=progress,
    )  # fmt: skip
    if out is not None:
        found.save(out)
    return found


def _counted_range(key: str, value: Value) -> Range | None:
    """The range of a value; (low, high, count) as three values is an old way to write one."""
    if isinstance(value, tuple) and len(value) == 3 and isinstance(value[2], int | float):
        low, high, count = (float(x) for x in value)
        if count.is_integer() and count >= 2:
            warn(f"{key}: write Range({low:g}, {high:g}, {count:g})", DeprecationWarning)
            return Range(low, high, int(count))
    return as_range(key, value)


def _method_names(text: str) -> tuple[str, ...]:
    """Names of methods; a comma with a space behind it belongs to a name such as "MuJoCo RK4, hard"."""
    names = tuple(x.strip().replace("\0", ", ") for x in text.replace(", ", "\0").split(","))
    if not all(names):
        raise UsageError(f"`methods` takes names with commas between them, got {text!r}.")
    return names


@explained
@suggesting
def sweep(
    source: Source,
    values: Values | None = None,
    /,
    quantities: Sequence[str] | str = (),
    *,
    witness: str | None = None,
    scene: str | None = None,
    duration: Seconds | None = None,
    timestep: Seconds | None = None,
    engine: Engine | None = None,
    fidelity: str | None = None,
    backend: str | None = None,
    out: File | None = None,
    plot: File | None = None,
    resume: bool = False,
    scheduler: str | None = None,
    workers: int | None = None,
    command: str = "",
    progress: Progress = silent,
    **given: Value,
) -> SweepResult:
    """A quantity, or many, over ranges of parameters, given quantities, initial values X_0, X_rate_0 or constant loads X_force.

    Keys are numbers, or axes: ranges, lists, arrays (n,). Quantities are by default all answers of the question that the given
    keys make, or the final channels of the scene. A point without a number is a gap, with its reason. command: what the dataset
    remembers as its command line. Raises MechlabError for unknown keys and quantities.

    Options:
        quantities=A,B,...: answers, channels (final; max(ch), min, mean, rms), checks by id (passed(id)), findings of the
            health record, trusted
        witness=W: who answers a question: analytic, pinocchio, mujoco
        scene=S: scene of the simulations
        duration=T: simulated time [s]
        timestep=H: timestep [s]
        engine=E: who computes
        fidelity=F: level of fidelity
        backend=B: who steps runs that go together: mujoco (the default), or warp: MuJoCo Warp, on a GPU where there is one, in single
            precision, whose error is stated
        out=FILE.nc: the dataset as netCDF; with --portrait a folder
        plot=F: picture of a sweep over one or two ranges (.png, .svg, .pdf)
        resume: go on where an interrupted sweep into the same FILE.nc was
        scheduler=ADDRESS: compute on an existing Dask cluster, such as tcp://host:8786
        workers=N: processes on this machine; default: one for each core
    """
    from mechlab.studies.sweep.plan import plan
    from mechlab.studies.sweep.study import sweep as study

    asked = key_values(values, given)
    wanted = [quantities] if isinstance(quantities, str) else list(quantities)
    if (more := asked.pop("quantity", None)) is not None:
        wanted += [str(x) for x in more] if isinstance(more, tuple) else [str(more)]
    duration, timestep = (
        x if x is None else float(in_unit(what, one_number(what, x), "s"))
        for what, x in (("duration", duration), ("timestep", timestep))
    )
    sent, identity = travelling(source)
    request = plan(
        open_source(sent), asked, wanted, load=open_source, source=sent, identity=identity, witness=witness,
        scene=scene, engine=engine, fidelity=fidelity, duration=duration, timestep=timestep, backend=backend,
    )  # fmt: skip
    return study(
        request, out=None if out is None else Path(out), plot=None if plot is None else Path(plot), resume=resume,
        scheduler=scheduler, workers=workers, command=command or sweep_command(source, asked, wanted), progress=progress,
    )  # fmt: skip


@explained
@suggesting
def workspace(
    source: Source,
    values: Values | None = None,
    /,
    *,
    against: Values | None = None,
    witness: str | None = None,
    stl: File | None = None,
    glb: File | None = None,
    html: File | None = None,
    maps: File | None = None,
    progress: Progress = silent,
    **given: Value,
) -> WorkspaceResult:
    """Where a mechanism can be, counted on a grid; keys are parameters, axes (ranges), fixed coordinates and limits.

    Raises EngineMissing where a surface is wanted and scikit-image is not installed, NoSolution where it would be empty.

    Options:
        against=key=value,...: a second design, on the same grid: what both have, and each alone
        witness=W: who is asked at every node: analytic, pinocchio, mujoco
        stl=F: the surface as STL
        glb=F: the surface as GLB
        html=F: a page with the mechanism in its workspace
        maps=FILE.npz: the maps (dexterity, margins) as arrays
    """
    from mechlab.lab.ask import parameters_and_rest
    from mechlab.studies.workspace.study import compared, with_surfaces
    from mechlab.studies.workspace.study import workspace as study

    base = load_design(source, {})
    parameters, rest = parameters_and_rest(base.entry.parameters, key_values(values, given))
    asked = {k: as_range(k, v) or v for k, v in rest.items()}
    result = study(load_design(base, parameters), asked, witness, progress)
    second: WorkspacePlan | None = None
    if against is not None:
        changed, other = parameters_and_rest(base.entry.parameters, key_values(against, {}))
        result, second = compared(result, load_design(base, parameters | changed), asked | other, against)
    if maps is not None:
        from mechlab.api.pages import write_maps

        result = replace(result, files=dict(result.files) | {"maps": write_maps(result, Path(maps))})
    if result.survey.voxels and (stl is not None or glb is not None or html is not None):
        result, border = with_surfaces(result, stl, glb)
        if html is not None:
            from mechlab.api.pages import write_workspace_page

            result = replace(
                result, files=dict(result.files) | {"page": write_workspace_page(result, border, second, html)}
            )
    return result
