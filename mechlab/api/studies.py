"""Verbs that study a mechanism across runs: modes, fidelities, stability."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechlab.api.finding import Source, load
from mechlab.errors import MechlabError
from mechlab.experiment.parameters import describe
from mechlab.files import whole_folder, write
from mechlab.lab.ask import parameters_and_rest
from mechlab.values import one_number

if TYPE_CHECKING:
    from mechlab.experiment.recording import Recording
    from mechlab.lab.design import Design
    from mechlab.lab.fidelity.result import Fidelities
    from mechlab.studies.modes import ModesResult
    from mechlab.studies.stability import Stability
    from mechlab.viewer.story import Story


def modes(
    source: Source,
    values: Mapping[str, Any] | None = None,
    scene: str | None = None,
    fidelity: str | None = None,
    free: bool = False,
    out: str | Path | None = None,
    html: str | Path | None = None,
    only: Sequence[int] = (),
    **more: Any,
) -> ModesResult:
    """Equilibrium, eigenfrequencies, damping and mode shapes on the constraint manifold, from each engine on its own.

    values (or keywords): parameters, X_0 (where the search for the equilibrium starts), X_force (constant loads). Without a
    scene the drives hold their targets from the reference pose; with one what acts in it; free: neither. html: a page that
    swings through the modes (`only`: their numbers); out: a folder for modes.json, modes.npz and modes.html. See
    `mechlab.studies.modes`.
    """
    from mechlab.studies.modes import find_modes, mode_motion

    if only and html is None and out is None:
        raise MechlabError("only: it chooses the modes that the page shows: give html or out, or leave it out.")
    d, extra = _split(source, dict(values or {}) | more)
    result = find_modes(d, scene, fidelity, extra, free)
    if html is None and out is None:
        return result
    import json

    from mechlab.formats import save_recording
    from mechlab.viewer import write_page

    lived = d if scene is None else d.for_scene(scene)
    motion = mode_motion(result, only)
    told = _modes_story(lived, result, motion)
    files: dict[str, str] = {}
    if html is not None:
        files["page"] = str(write_page(told, html))
    if out is not None:
        with whole_folder(out) as stage:
            if html is None:
                files["page"] = str(Path(out) / write_page(told, stage / "modes.html").name)
            write(stage / "modes.json", json.dumps(result.to_dict(), indent=1, default=str))
            save_recording(motion, stage / "modes.npz")
        files |= {"json": str(Path(out) / "modes.json"), "recording": str(Path(out) / "modes.npz")}
    return replace(result, files=files)


def fidelities(
    source: Source,
    values: Mapping[str, Any] | None = None,
    scene: str | None = None,
    duration: float | None = None,
    needs: Sequence[str] | None = None,
    **more: Any,
) -> Fidelities:
    """The fidelities of a mechanism side by side on a scene: what each answers, its error against the richest, its cost, and
    which one `fidelity="auto"` takes. needs: what must be answered (default: the scene's). See `mechlab.lab.fidelity`."""
    from mechlab.lab.fidelity.compare import compare

    d, extra = _split(source, dict(values or {}) | more)
    return compare(d, scene, duration, extra, needs)


def _split(source: Source, values: Mapping[str, Any]) -> tuple[Design, dict[str, float]]:
    """The design with its parameters, and the other keys as numbers."""
    base = load(source)
    parameters, rest = parameters_and_rest(base.entry.parameters, values)
    return load(base, **parameters), {key: one_number(key, value) for key, value in rest.items()}


def _modes_story(d: Design, result: ModesResult, motion: Recording) -> Story:
    """The Story of the swinging modes, drawn in the richest fidelity where the entry can expand."""
    from mechlab.viewer.from_recording import recording_story

    drawn = d.entry.expand(d.parameters, motion) if d.entry.expand is not None else None
    facts = {"about": result.scene, "fidelity": result.fidelity}
    for k, m in enumerate(result.modes, 1):
        ratio = "" if m.damping is None else f", damping {m.damping:.4g}"
        facts[f"mode {k}"] = f"{m.kind}, {m.frequency_hz:.6g} Hz{ratio}"
    names = tuple(n for n in motion.channels if n.startswith("mode_"))
    summary = f"{result.message}. The modes swing one after another; tempo and size are chosen for the eye."
    return recording_story(motion, drawn, f"{d.entry.title}: modes", summary, facts, names)


def stability(
    source: Source,
    values: Mapping[str, Any] | None = None,
    scene: str | None = None,
    kinds: Sequence[str] = (),
    methods: Sequence[str] = (),
    fidelity: str | None = None,
    out: str | Path | None = None,
    budget: float | None = None,
    progress: Callable[[str], None] = lambda line: None,
    **more: Any,
) -> Stability:
    """Maps of where methods fail: timestep against stiffness, mass ratio, distance to a singular position, redundancy,
    softness, gear ratio, light parts, friction; those that the structure calls for, or `kinds`.

    values (or keywords): parameters; a range (`mechlab.values.Range`; also (low, high) or (low, high, count)) of a
    parameter, of BODY_mass, X_stiffness or friction makes a map over it. methods: names or parts of names. budget: counted
    work [s], about seconds of CPU. out: a folder for the JSON and a picture of each map.
    Raises MechlabError for unknown names and for a map that does not fit the mechanism, saying why.
    """
    from mechlab.studies.stability import BUDGET, study
    from mechlab.values import Range

    given = dict(values or {}) | more
    names = {i.name: i for i in describe(load(source).entry.parameters)}
    ranges = {k: v for k, v in given.items() if isinstance(v, Range)}
    for key, value in given.items():
        listed = key in names and names[key].kind in ("numbers", "integers")
        if isinstance(value, tuple | list) and len(value) in (2, 3) and not listed:
            ranges[key] = Range(float(value[0]), float(value[1]), int(value[2]) if len(value) == 3 else None)
    d = load(source, **{k: v for k, v in given.items() if k not in ranges})
    found = study(
        d, scene, kinds=tuple(kinds), methods=tuple(methods), ranges=ranges, fidelity=fidelity,
        budget=BUDGET if budget is None else budget, progress=progress,
    )  # fmt: skip
    if out is not None:
        found.save(out)
    return found
