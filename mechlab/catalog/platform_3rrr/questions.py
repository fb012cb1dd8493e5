"""Drives to every pose of the platform; pose to drives in every working mode."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np

from mechlab.analytic import assur
from mechlab.catalog.platform_3rrr.build import (
    DRIVES,
    MERGING,
    POSE,
    PlatformParameters,
    build,
    elbows,
    group,
    inverse,
    mode_of,
    order,
)
from mechlab.experiment.question import Answer, Question, Witness, with_rates
from mechlab.kit.questions import RATES, Start, by_engines, with_orders
from mechlab.mechanism import Mechanism, Status
from mechlab.mechanism.geometry import Array

START_OFFSET = 1e-3
FRAMES = {"x": "centre_x", "y": "centre_z", "alpha": "alpha"}
"""Names of the pose in the engines: z of the world is y of the plane."""
UNITS = with_rates({"x": "m", "y": "m", "alpha": "rad"} | dict.fromkeys(DRIVES, "rad")) | {"mode_count": ""}


def _stack(given: Mapping[str, Any], names: tuple[str, ...], suffix: str) -> Array:
    return np.stack(np.broadcast_arrays(*(np.asarray(given[f"{n}{suffix}"], dtype=float) for n in names)))


def _pins(p: PlatformParameters, given: Mapping[str, Any]) -> tuple[assur.Point, ...]:
    return elbows(p, *(_stack(given, DRIVES, s) for s in RATES))


def _forward(p: PlatformParameters, given: Mapping[str, Any]) -> Answer:
    pins = _pins(p, given)
    g = group(p, pins)
    modes = assur.all_modes(g)
    ranks = order(p, pins, modes)
    if np.any(modes.count < p.mode):
        least = int(np.min(modes.count))
        text = f"the platform has {least} assembly modes at these drive angles; mode {p.mode} does not exist"
        return Answer(status=Status.NO_ASSEMBLY, notes=(text,))
    index = ranks[..., p.mode - 1 : p.mode]
    leg, alpha = (np.take_along_axis(x, index, axis=-1)[..., 0] for x in (modes.theta_t, modes.theta_u))
    chosen = mode_of(p, pins, leg, alpha)
    merging = np.abs(chosen.det) < MERGING * g.scale**2
    status = Status.BOUNDARY if np.any(merging) else Status.SOLVED
    notes = ("two modes merge here: rates do not exist",) if np.any(merging) else ()
    if leg.ndim:
        return Answer({**chosen.values(), "mode_count": modes.count}, status, notes)
    listed = []
    for rank, k in enumerate(ranks[: int(modes.count)]):
        one = mode_of(p, pins, modes.theta_t[k], modes.theta_u[k])
        values = {n: float(v) for n, v in one.values().items()}
        listed.append({"label": f"mode {rank + 1}", **values, "det": float(one.det)})
    return Answer(chosen.values(), status, (f"{len(listed)} modes", *notes), modes=tuple(listed))


def _start(p: PlatformParameters, m: Mechanism, given: Mapping[str, Any]) -> Array | None:
    """Coordinates of the chosen mode, a little off."""
    pins = _pins(p, given)
    modes = assur.all_modes(group(p, pins))
    if int(modes.count) < p.mode:
        return None
    k = int(order(p, pins, modes)[p.mode - 1])
    found = assur.mode_rates(group(p, pins), modes.theta_t[k], modes.theta_u[k])
    legs = [found.theta_t.x, found.links[0].x, found.links[1].x]
    value: dict[str, float] = {}
    for i, name in enumerate(DRIVES):
        value[name] = float(given[name])
        value[f"leg_{i + 1}_joint"] = float(legs[i]) - float(given[name])
    value["platform_joint"] = float(found.theta_u.x - found.theta_t.x)
    q = np.array([value[j.name] - j.zero for j in m.joints])
    driven = np.array([j.name in DRIVES for j in m.joints])
    return np.where(driven, q, (q + np.pi) % (2 * np.pi) - np.pi) + START_OFFSET


def _inverse(p: PlatformParameters, given: Mapping[str, Any]) -> Answer:
    x, v, a = (_stack(given, POSE, s) for s in RATES)
    centre = assur.Point(x[0] + 1j * x[1], v[0] + 1j * v[1], a[0] + 1j * a[1])
    alpha = assur.Scalar(x[2], v[2], a[2])
    k = p.elbow or 1
    own = (k, k, k)
    listed = []
    values: dict[str, Any] = {}
    for one_elbow, two, three in product((1, -1), repeat=3):
        signs = (one_elbow, two, three)
        chains = inverse(p, centre, alpha, signs)
        if not all(np.all(d.assembles) for d in chains):
            gap = max(float(np.max(d.gap)) for d in chains)
            return Answer(status=Status.OUT_OF_REACH, notes=(f"a chain is {gap:.6g} m short",), details={"gap": gap})
        one: dict[str, Any] = {}
        for name, d in zip(DRIVES, chains, strict=True):
            one |= {f"{name}{s}": y for s, y in zip(RATES, (d.angles[0].x, d.angles[0].v, d.angles[0].a), strict=True)}
        if signs == own:
            values = one
        if x.ndim == 1:
            label = " ".join(f"{s:+d}" for s in signs)
            listed.append({"label": f"elbows {label}", **{k: float(y) for k, y in one.items() if np.isfinite(y)}})
    regular = all(np.all(d.regular) for d in inverse(p, centre, alpha, own))
    if not regular:
        values = {n: values[n] for n in DRIVES}
        return Answer(values, Status.BOUNDARY, ("a chain is stretched: rates do not exist",), modes=tuple(listed))
    return Answer(values, modes=tuple(listed))


def _question(
    name: str, given: tuple[str, ...], answers: tuple[str, ...], analytic: Witness, start: Start | None, text: str
) -> Question:
    optional: dict[str, float | None] = {f"{n}{s}": 0.0 for n in given for s in RATES[1:]}
    asked, wanted = (with_orders({n: FRAMES.get(n, n) for n in names}) for names in (given, answers))
    return Question(
        name, given=given, optional=optional, answers=tuple(wanted),
        witnesses={"analytic": analytic} | by_engines(build, asked, wanted, start, output="centre"),
        angles=("alpha", *DRIVES), units=UNITS, text=text,
    )  # fmt: skip


QUESTIONS = (
    _question("forward", DRIVES, POSE, _forward, _start, "every pose of the platform for given drive angles"),
    _question("inverse", POSE, DRIVES, _inverse, None, "drive angles for a pose, in all eight working modes"),
)
