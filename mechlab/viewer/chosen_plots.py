"""The plots of a run: first what the mechanism is for (its entry says so), then its drives, their forces, and its points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mechlab.experiment.entry import PlotRecipe
from mechlab.experiment.recording import Recording
from mechlab.mechanism import GROUND, Mechanism
from mechlab.mechanism.geometry import Array
from mechlab.viewer.story import Plot

MAX_PLOTS, MAX_SERIES = 7, 6
NOISE = 1e-9
"""Values below this share of the largest one in their plot are rounding, drawn as 0; the data keep them."""
TITLES = {
    "m": ("linear drives", "slides"),
    "rad": ("rotary drives", "joint angles"),
    "N": ("forces of linear drives", "forces"),
    "N m": ("torques of rotary drives", "torques"),
}
"""Unit -> title of a plot of drives, and of joints that nothing drives."""


def chosen_plots(
    recording: Recording, keep: Array, recipes: Sequence[PlotRecipe] = (), asked: Sequence[str] = ()
) -> tuple[Plot, ...]:
    """Plots of a run at its samples `keep` (k,): those of `recipes`, the channels `asked`, then values and forces of the drives
    (of all joints where nothing is driven), outputs where there is no recipe, loads, and the points that move. A channel stands
    in one plot."""
    plots = [made for recipe in recipes if (made := _of_recipe(recording, keep, recipe))]
    known = {name for plot in plots for name in plot.series}
    groups: dict[tuple[str, str], list[str]] = {}
    for title, name in _wanted(recording, asked, bool(plots)):
        if name in recording.channels and name not in known:
            known.add(name)
            groups.setdefault((title, recording.units.get(name, "")), []).append(name)
    for (title, unit), names in groups.items():
        plots.append(_plot(title, unit, {n: recording.channels[n][keep] for n in names}))
    return tuple(plots[:MAX_PLOTS])


def _of_recipe(recording: Recording, keep: Array, recipe: PlotRecipe) -> Plot | None:
    known = [n for n in recipe.channels if n in recording.channels]
    if not known or (recipe.over and recipe.over not in recording.channels):
        return None
    series = {n: recording.channels[n][keep] for n in known}
    if not recipe.over:
        return _plot(recipe.title, recording.units.get(known[0], ""), series)
    below = recording.channels[recipe.over][keep]
    small = np.abs(below) <= NOISE * np.max(np.abs(below), initial=0.0)
    ratios = {
        f"{n} / {recipe.over}": np.where(small, np.nan, v / np.where(small, 1.0, below)) for n, v in series.items()
    }
    return _plot(recipe.title, "", ratios)


def _wanted(recording: Recording, asked: Sequence[str], has_purpose: bool) -> list[tuple[str, str]]:
    """(title, channel) in the order of the plots; has_purpose: a recipe has shown the outputs already."""
    m = recording.mechanism
    driven = [d.on for d in m.drives]
    place = 0 if driven else 1
    joints = driven or [j.name for j in m.joints if j.nv == 1]
    pushed = [n for n in m.scalar_names if f"{n}_force" in recording.channels]
    pairs = [("channels", n) for n in asked]
    for name in joints:
        for channel in (name, f"{name}_force"):
            pairs.append((TITLES.get(recording.units.get(channel, ""), ("drives", "joints"))[place], channel))
    if not has_purpose:
        pairs += [("outputs", name) for name in _outputs(m, driven, pushed)]
    pairs += [("loads", f"{name}_force") for name in pushed if name not in joints]
    for frame in m.frames:
        for axis in "xyz":
            name = f"{frame.name}_{axis}"
            if name in recording.channels and np.ptp(recording.channels[name]) > NOISE * m.length_scale:
                pairs.append(("points", name))
    return pairs


def _outputs(m: Mechanism, driven: Sequence[str], pushed: Sequence[str]) -> list[str]:
    """Joints and shafts that a law acts on and no drive holds; without any, the joints of the frame that follow the drives."""
    loaded = [n for n in pushed if n not in driven]
    if loaded or not driven:
        return loaded
    return [b.joints[-1].name for b in m.bodies if b.parent == GROUND and b.joints and b.joints[-1].nv == 1
            and b.joints[-1].name not in driven]  # fmt: skip


def _plot(title: str, unit: str, series: Mapping[str, Array]) -> Plot:
    return Plot(title, unit, snapped(dict(list(series.items())[:MAX_SERIES])))


def snapped(series: Mapping[str, Array]) -> dict[str, Array]:
    """Curves (n,) that share an axis, with what is only rounding on that axis as 0."""
    finite = [np.abs(v[np.isfinite(v)]) for v in series.values()]
    largest = max((float(x.max()) for x in finite if len(x)), default=0.0)
    return {name: np.where(np.abs(v) < NOISE * largest, 0.0, v) for name, v in series.items()}
