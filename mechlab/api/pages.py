"""The pages and stories of designs, runs, modes and workspaces. Imports the viewer; the verbs import this when they show something."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mechlab import catalog
from mechlab.errors import MechlabError
from mechlab.experiment.entry import PlotRecipe, WorkspaceMap
from mechlab.experiment.parameters import describe
from mechlab.experiment.recording import Recording
from mechlab.files import write
from mechlab.formats import load_recording
from mechlab.formats.mechanism_json import to_json
from mechlab.lab.design import Design, design
from mechlab.lab.fidelity.choose import chosen_scene
from mechlab.mechanism import GROUND
from mechlab.mechanism.geometry import Array
from mechlab.studies.modes.eigen import RIGID, UNSTABLE, VibrationMode
from mechlab.studies.modes.motion import shown_modes
from mechlab.studies.modes.result import ModesResult
from mechlab.studies.workspace.plan import WorkspacePlan
from mechlab.studies.workspace.study import WorkspaceResult, WorkspaceSurface, surface
from mechlab.studies.workspace.survey import survey
from mechlab.viewer import Part, Story, story_to_html, write_page
from mechlab.viewer.facts import unit_words, value_words
from mechlab.viewer.from_recording import exploration_story, mechanism_story, recording_story
from mechlab.viewer.html_page import framed
from mechlab.viewer.named_numbers import flat, named_numbers, numbers_of
from mechlab.viewer.reach import BorderSurface, border
from mechlab.viewer.story import Clip, ColorField, Severity
from mechlab.viewer.witnessed import witnessed

FIRST, SECOND = (0.20, 0.47, 0.75, 0.45), (0.90, 0.55, 0.15, 0.45)
"""Colours (red, green, blue, opacity) of the workspaces of two designs."""


def recording_of(source: object) -> Recording | None:
    """The run behind a Recording or the path of its .npz; None for everything else."""
    if isinstance(source, Recording):
        return source
    if isinstance(source, str | Path) and str(source).endswith(".npz"):
        return load_recording(source)
    return None


def recording_page(recording: Recording) -> str:
    """The offline page of a run in a frame, for a notebook. Raises MechlabError where it is too large."""
    story = run_story(recording)
    return framed(story_to_html(story), story.title)


def still_story(d: Design) -> Story:
    """A mechanism that stands still, in its richest fidelity."""
    return replace(mechanism_story(d.drawn(), d.entry.title, _facts(d)), summary=d.entry.summary)


class LivePages:
    """The pages of a design that a browser may change: with the named numbers that its edits are made of, and, once it has been
    changed, with what all witnesses say of its poses."""

    def __init__(self, d: Design, rebuild: bool) -> None:
        self.design, self.rebuild = d, rebuild
        self.checked: tuple[tuple[Severity, str], ...] = ()

    def still(self, d: Design) -> Story:
        """The page of a design that a browser has asked for."""
        found = witnessed(d)
        self.design, self.checked = d, () if found is None else (found,)
        return self.shown(still_story(d))

    def final(self, recording: Recording) -> Story:
        """The page of its finished run."""
        return self.shown(run_story(recording, rebuild=self.rebuild))

    def shown(self, story: Story) -> Story:
        """A page of the present design."""
        told = replace(story, health=(*story.health, *self.checked))
        same = story.model is not None and flat(json.loads(to_json(story.model))) == numbers_of(self.design)
        return replace(told, named=named_numbers(self.design)) if same else told


def explored_story(d: Design) -> Story:
    """A mechanism whose drives can be moved in the page."""
    rates = chosen_scene(d).initial_rates
    made = exploration_story(d.mechanism(list(d.entry.fidelities)[-1]), d.entry.title, _facts(d), rates, _reach(d))
    return replace(made, summary=d.entry.summary)


def _reach(d: Design) -> BorderSurface | None:
    """The border of the region that an entry states in x, y, z."""
    recipe = d.entry.workspace
    if recipe is None or set(recipe.grid) != set("xyz"):
        return None
    region, box = recipe.make(d.parameters, {}), [recipe.grid[a] for a in "xyz"]
    low, high = np.array([r.low for r in box]), np.array([r.high for r in box])
    return border(recipe.text, lambda x, y, z: region.margin({"x": x, "y": y, "z": z}), low, high)


def at_fidelity(d: Design, fidelity: str | None) -> Design:
    """The design with this fidelity alone, which every scene runs in and every picture shows; None: as it is. Raises MechlabError
    that lists the fidelities with a mechanism."""
    if fidelity is None:
        return d
    d.mechanism(fidelity)
    entry = d.entry
    scenes = {name: replace(recipe, fidelity=fidelity) for name, recipe in entry.scenes.items()}
    only = {fidelity: entry.fidelities[fidelity]}
    return replace(d, entry=replace(entry, expand=None, fidelities=only, default_fidelity=fidelity, scenes=scenes))


def _catalogued(recording: Recording) -> Design | None:
    """The design of the catalog that a run is of; None for a mechanism that only has the name of one."""
    if recording.name not in catalog.NAMES or not recording.parameters:
        return None
    d = design(catalog.entry(recording.name), {k: v for k, v in recording.parameters.items() if v is not None})
    return d if d.mechanism(recording.fidelity) == recording.mechanism else None


def run_story(recording: Recording, rebuild: bool = True) -> Story:
    """A run, drawn in the richest fidelity where its entry can rebuild that from it; without `rebuild` in its own."""
    drawn, title, facts = None, "", {"scene": recording.scene, "fidelity": recording.fidelity}
    summary, plots = "", tuple[PlotRecipe, ...]()
    s = recording.settings
    facts |= {"engine": f"{s.engine}, {s.integrator}, step {s.timestep:g} s"}
    if recording.acts:
        facts["what acts"] = recording.acts
    d = _catalogued(recording)
    if d is not None:
        entry = d.entry
        title, summary, plots = entry.title, entry.summary, entry.plots
        facts |= _facts(d)
        if rebuild and entry.expand is not None:
            drawn = partial(entry.expand, d.parameters)
    channels = tuple(n for n in recording.channels if n.startswith("error_"))
    story = recording_story(recording, drawn, title, summary, facts=facts, channels=channels, plots=plots)
    if not story.reconstructed:
        return story
    told = f"{recording.fidelity}; drawn with all parts, {len(story.reconstructed)} of them rebuilt from the run"
    return replace(story, facts=tuple((k, told if k == "fidelity" else x) for k, x in story.facts))


def write_run_page(d: Design, recording: Recording, path: Path) -> Path:
    """Write the page of a run: the last step of the pipeline."""
    return write_page(run_story(recording), path)


def modes_story(d: Design, result: ModesResult, motion: Recording, only: Sequence[int] = ()) -> Story:
    """The swinging modes, drawn in the richest fidelity where the entry can expand; a button plays one of them."""
    drawn = partial(d.entry.expand, d.parameters) if d.entry.expand is not None else None
    facts = {"about": result.scene, "fidelity": result.fidelity}
    for k, m in enumerate(result.modes, 1):
        ratio = "" if m.damping is None else f", damping {m.damping:.4g}"
        facts[f"mode {k}"] = f"{m.kind}, {m.frequency_hz:.6g} Hz{ratio}"
    names = tuple(n for n in motion.channels if n.startswith("mode_"))
    summary = f"{result.message}. A button shows one mode; tempo and size are chosen for the eye."
    story = recording_story(motion, drawn, f"{d.entry.title}: modes", summary, facts, names)
    return replace(story, clips=tuple(_mode_clip(k, result.modes[k - 1], a, b) for k, a, b in shown_modes(result, only)))


def _mode_clip(number: int, mode: VibrationMode, start: float, end: float) -> Clip:
    value = {UNSTABLE: f"grows, {mode.growth:.4g} 1/s", RIGID: "no stiffness"}.get(mode.kind, f"{mode.frequency_hz:.4g} Hz")
    damping = "" if mode.damping is None else f", damping ratio {mode.damping:.3g}"
    return Clip(f"mode {number}", value, f"Mode {number}: {mode.kind}{damping}", start, end)


def _facts(d: Design) -> dict[str, str]:
    values = {i.name: (getattr(d.parameters, i.name), i.unit) for i in describe(d.entry.parameters)}
    return {name: value_words(value, unit) for name, (value, unit) in values.items() if value != ""}


def write_workspace_page(
    result: WorkspaceResult, first: WorkspaceSurface, second: WorkspacePlan | None, path: str | Path
) -> Path:
    """The mechanism in its reference pose inside its workspace, whose border is `first`; `second`: the design compared with."""
    d = result.plan.design
    if set(result.survey.grid.names) != set("xyz"):
        raise MechlabError(
            f"{d.name}: a page of the workspace needs the axes x, y, z, got {', '.join(result.survey.grid.names)}."
        )
    order = [result.survey.grid.names.index(a) for a in "xyz"]
    even = -1 if order in ([0, 2, 1], [1, 0, 2], [2, 1, 0]) else 1  # an odd exchange of axes turns the faces inside out
    shapes = [(first, "workspace", FIRST)]
    if second is not None:
        found = survey(second.region, second.grid, second.slab)
        if found.voxels:
            shapes.append((surface(second.region, second.grid, found), "workspace of the other design", SECOND))
    data = result.to_dict()
    facts = {
        "nodes": data["nodes"],
        "voxels": str(data["voxels"]),
        "volume": f"{data['volume']:.6g} {unit_words(result.volume_unit)}",
    }
    facts |= {
        f"{k}, smallest to largest": f"{m.smallest:.4g} to {m.largest:.4g} {unit_words(m.unit)}".strip() for k, m in result.maps.items()
    }
    if result.comparison is not None:
        facts |= {k: f"{v:.6g} {unit_words(result.volume_unit)}" for k, v in data["against"]["volumes"].items()}
    still = mechanism_story(d.mechanism(list(d.entry.fidelities)[-1]), f"{d.entry.title}: workspace", facts)
    parts = [Part(GROUND, name, s.vertices[:, order], s.faces[:, ::even], color) for s, name, color in shapes]
    maps = {name: item for name, item in result.plan.maps.items() if name in result.maps}
    fields = [_field(name, item, first.vertices, result.survey.grid.names) for name, item in maps.items()]
    return write_page(replace(still, parts=(*still.parts, *parts), fields=tuple(fields)), path)


def _field(name: str, item: WorkspaceMap, vertices: Array, axes: Sequence[str]) -> ColorField:
    """A map over the workspace at the vertices (n, 3) of its border, whose columns are the coordinates of `axes`."""
    points = {a: vertices[:, k] for k, a in enumerate(axes)}
    values = np.asarray(item.function({a: points[a] for a in item.axes}), dtype=np.float64)
    return ColorField("workspace", name.replace("_", " "), item.unit, item.text, np.broadcast_to(values, len(vertices)))


def write_maps(result: WorkspaceResult, path: Path) -> Path:
    """Each map over the coordinates of its axes, NaN outside, as NAME, NAME_x, NAME_y in a .npz file."""
    if path.suffix != ".npz":
        raise MechlabError(f"maps: expected a file name that ends in .npz, got {path}.")
    if not result.maps:
        raise MechlabError(
            f"{result.plan.design.name}: there are no maps over this workspace; expected a closed-form region that is not empty."
        )
    arrays: dict[str, Any] = {}
    for name, m in result.maps.items():
        arrays |= {name: m.values} | {f"{name}_{a}": v for a, v in m.nodes.items()}
    content = io.BytesIO()
    np.savez_compressed(content, **arrays)
    return write(path, content.getvalue())
