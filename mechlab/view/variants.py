"""Parameters that the page of explore mode can change: designs that are solved beforehand, one parameter at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.parameters import describe
from mechlab.study.design import Design, design
from mechlab.values import Range, in_unit
from mechlab.view.story import Story, Variation

MOST_KEYS, COUNT, MOST_COUNT = 2, 9, 41
SPREAD = 0.2
"""A parameter is varied by this share of its value either way, unless a range is given."""


def variations(
    d: Design, vary: Mapping[str, Range | Sequence[float] | None], story: Story, tell: Callable[[Design], Story]
) -> tuple[Variation, ...]:
    """Variants of a design whose own exploration is `story`: key -> range, values, or None for SPREAD about its value.

    tell(design) -> the Story of a variant. A value without a mechanism becomes the sentence that says why. Raises
    MechlabError for a parameter that is not a number, and for more than two.
    """
    if len(vary) > MOST_KEYS:
        raise MechlabError(
            f"{d.name}: {len(vary)} parameters to vary; expected at most {MOST_KEYS}: {', '.join(vary)}."
        )
    known = {i.name: i for i in describe(d.entry.parameters)}
    out = []
    for key, asked in vary.items():
        if key not in known or known[key].kind not in ("number", "integer"):
            numbers = [n for n, i in known.items() if i.kind in ("number", "integer")]
            what = f"is a {known[key].kind}" if key in known else "does not exist"
            raise MechlabError(f"{d.name}: parameter {key} {what}; can be varied: {', '.join(numbers) or 'none'}.")
        own = float(getattr(d.parameters, key))
        values = _values(d.name, key, own, in_unit(f"{d.name}: {key}", asked, known[key].unit))
        home = int(np.argmin(np.abs(values - own)))
        stories = [story if k == home else _variant(d, key, float(x), story, tell) for k, x in enumerate(values)]
        values[home] = own
        out.append(Variation(key, known[key].unit, tuple(map(float, values)), home, tuple(stories)))
    return tuple(out)


def _values(name: str, key: str, own: float, asked: Range | Sequence[float] | None) -> np.ndarray:
    """Increasing values, the design's own among them."""
    if isinstance(asked, Range):
        found = np.array(asked.points(COUNT))
    elif asked is not None:
        found = np.array([float(x) for x in asked])
    else:
        found = own * np.linspace(1.0 - SPREAD, 1.0 + SPREAD, COUNT)
    found = np.unique(found[~np.isclose(found, own, rtol=1e-9)])
    found = np.unique(np.append(found, own))
    if not 2 <= len(found) <= MOST_COUNT:
        raise MechlabError(f"{name}: {key} has {len(found)} values to vary over; expected 2 to {MOST_COUNT}.")
    return found


def _variant(d: Design, key: str, value: float, story: Story, tell: Callable[[Design], Story]) -> Story | str:
    try:
        told = tell(design(d.entry, dict(d.given) | {key: value}))
    except MechlabError as error:
        return str(error)
    if told.bodies != story.bodies or told.explore is None or story.explore is None:
        return f"with {key} = {value:g} the mechanism has other parts"
    names = [s.name for s in story.explore.sweeps]
    if [s.name for s in told.explore.sweeps] != names:
        return f"with {key} = {value:g} the mechanism is driven otherwise"
    return replace(told, explore=replace(told.explore, reach=None))
