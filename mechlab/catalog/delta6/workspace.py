"""The workspace of the head centre O: the source's grid, its test, and the limits that the source leaves out.

The question of the workspace at a point: the margin of every limit, and all of them joined, exactly and by R-functions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial, reduce
from typing import Any

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.analytic.delta6 import inverse_position
from mechlab.analytic.regions import Region, any_of, r_functions
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.parameters import Delta6Parameters
from mechlab.catalog.delta6.poses import coordinates
from mechlab.catalog.delta6.parameters import ANGLES, CENTRE, SLIDERS
from mechlab.catalog.delta6.questions import START_OFFSET
from mechlab.experiment.question import Answer, Question
from mechlab.experiment.workspace import Coordinates, Limit, Map, WorkspaceRecipe
from mechlab.kit.witness import engine_answer
from mechlab.mechanism.geometry import Array
from mechlab.values import Range


def limits_of(p: Delta6Parameters, limits: Mapping[str, float]) -> closed.WorkspaceLimits:
    """The limits of a design and those that were given."""
    return closed.WorkspaceLimits(p.slider_min, p.slider_max, p.bend_limit, **limits)


def region(p: Delta6Parameters, limits: Mapping[str, float]) -> Region:
    """See `mechlab.analytic.delta6.workspace`."""
    return closed.workspace_region(p.geometry, limits_of(p, limits), p.rod_spacing)


def _plane(points: Coordinates) -> Array:
    x, y = np.broadcast_arrays(points["x"], points["y"])
    return np.stack([x, y, np.zeros(x.shape)], axis=-1)


def maps(p: Delta6Parameters) -> dict[str, Map]:
    """Dexterity, reach and clearance over (x, y)."""
    g = p.geometry

    def bend(points: Coordinates) -> Array:
        reach = g.rod_length - closed.reach_margin(g, _plane(points))
        return np.asarray(np.arcsin(np.minimum(reach / g.rod_length, 1.0)))

    plane = ("x", "y")
    return {
        "inverse_condition": Map(
            lambda q: closed.inverse_condition(g, _plane(q)), plane, "",
            "dexterity: smallest singular value of the slider Jacobian over its largest"
        ),
        "reach_margin": Map(
            lambda q: closed.reach_margin(g, _plane(q)), plane, "m", "horizontal distance to a rod that lies horizontal"
        ),
        "largest_bend": Map(bend, plane, "rad", "largest bend of a cardan"),
        "clearance": Map(
            lambda q: closed.clearance(g, _plane(q), p.rod_spacing), plane, "m",
            "distance of centre lines of rods of different legs, and of rods and the guides of other legs"
        )
    }  # fmt: skip


WORKSPACE = WorkspaceRecipe(
    make=region,
    grid=dict.fromkeys("xyz", Range(-1.0, 1.0, 201)),
    units=dict.fromkeys("xyz", "m"),
    limits={
        "least_condition": Limit("", "smallest inverse condition of the slider Jacobian that is allowed"),
        "least_clearance": Limit("m", "smallest distance of centre lines that is allowed"),
    },
    maps=maps,
    text="positions of the head centre O",
)

LIMITS = ("least_condition", "least_clearance")
CLAUSES = ("reach", "slider_min", "slider_max", "bend", "condition", "clearance")
MARGINS = tuple(f"{n}_margin" for n in CLAUSES)
JOINED = ("margin", "any_margin", "r_conjunction", "r_disjunction")
NO_CLEARANCE = "the clearance of the rods is known to the closed form alone, so is the margin of all limits"


def _limits(given: Mapping[str, Any]) -> dict[str, float]:
    return {k: float(given[k]) for k in LIMITS if k in given}


def _analytic(p: Delta6Parameters, given: Mapping[str, Any]) -> Answer:
    """The region of the workspace, evaluated."""
    where = region(p, _limits(given))
    points = dict(zip("xyz", np.broadcast_arrays(*(np.asarray(given[k], dtype=float) for k in CENTRE)), strict=True))
    smooth = r_functions(float(given["r_alpha"]))
    either = any_of(where.clauses)
    shape = points["x"].shape

    def at(margin: Array) -> Array:
        return np.broadcast_to(margin, shape).copy()

    values: dict[str, Any] = {f"{c.name}_margin": at(c.margin(points)) for c in where.clauses}
    values |= {
        "margin": at(where.margin(points)), "any_margin": at(either.margin(points)),
        "r_conjunction": at(where.margin(points, smooth)), "r_disjunction": at(either.margin(points, smooth))
    }  # fmt: skip
    notes: tuple[str, ...] = ()
    if not shape:
        verdict = where.decide(points)
        inside = "inside" if bool(verdict.inside) else "outside"
        notes = (f"{inside} the workspace; {verdict.binding()} decides",)
    centre = np.stack([points[k] for k in "xyz"], axis=-1)
    found = inverse_position(p.geometry, centre)
    if np.all(found.reachable):
        values |= {n: found.drives[..., k] for k, n in enumerate(SLIDERS)}
    return Answer(values, notes=notes)


def _engine(engine: str, p: Delta6Parameters, given: Mapping[str, Any]) -> Answer:
    """Margins measured on the pose that an engine assembles, and R-functions by their defining formula."""
    centre = np.array([float(given[k]) for k in CENTRE])
    if not bool(inverse_position(p.geometry, centre).reachable):
        return Answer(cannot="no pose has its head centre here, so that there is none to measure")
    asked = dict(zip(CENTRE, centre.tolist(), strict=True)) | dict.fromkeys(ANGLES, 0.0)
    start = coordinates(p, "minimal", centre, np.zeros(3))[0] + START_OFFSET
    m = build(p, "minimal")
    found = engine_answer(engine, m, asked, SLIDERS, start=start, steps=1)
    if not found.values:
        return found
    limits, g = limits_of(p, _limits(given)), p.geometry
    sliders = np.array([found.values[n] for n in SLIDERS])
    heights = sliders - g.slider_height - g.platform_height - centre[2]
    radius = float(np.sqrt(np.max(g.rod_length**2 - heights**2)))
    margins = {
        "reach": g.rod_length - radius,
        "slider_min": float(sliders.min()) - limits.slider_min,
        "slider_max": limits.slider_max - float(sliders.max()),
    }
    if limits.bend_limit is not None:
        margins["bend"] = g.rod_length * float(np.sin(limits.bend_limit)) - radius
    if limits.least_condition is not None:
        sizes = np.linalg.svd(_slider_jacobian(engine, m, asked, start), compute_uv=False)
        margins["condition"] = g.rod_length * float(sizes[-1] / sizes[0] - limits.least_condition)
    values: dict[str, Any] = {f"{k}_margin": x for k, x in margins.items()} | dict(found.values)
    if limits.least_clearance is not None:
        return Answer(values, found.status, (*found.notes, NO_CLEARANCE))
    alpha, each = float(given["r_alpha"]), list(margins.values())
    values |= {"margin": min(each), "any_margin": max(each)}
    values |= {"r_conjunction": reduce(_r(alpha, -1.0), each), "r_disjunction": reduce(_r(alpha, 1.0), each)}
    return Answer(values, found.status, found.notes)


def _r(alpha: float, sign: float) -> Callable[[float, float], float]:
    """R_alpha as it is defined: (x + y -+ sqrt(x^2 + y^2 - 2 alpha x y)) / (1 + alpha)."""
    return lambda x, y: (x + y + sign * float(np.sqrt(x * x + y * y - 2.0 * alpha * x * y))) / (1.0 + alpha)


def _slider_jacobian(engine: str, m: Any, pose: Mapping[str, float], start: Array) -> Array:
    """(3, 3) slider rates per rate of O_x, O_y, O_z, the angles held."""
    still = {f"{n}_rate": 0.0 for n in (*CENTRE, *ANGLES)}
    columns = []
    for n in CENTRE:
        asked = {**pose, **still, f"{n}_rate": 1.0}
        rates = engine_answer(engine, m, asked, [f"{s}_rate" for s in SLIDERS], start=start, steps=1).values
        columns.append([rates[f"{s}_rate"] for s in SLIDERS])
    return np.array(columns).T


REGION = Question(
    "margins of the workspace",
    given=CENTRE,
    optional=dict.fromkeys(LIMITS) | {"r_alpha": 0.0},
    answers=(*MARGINS, *JOINED, *SLIDERS),
    witnesses={"analytic": _analytic, "pinocchio": partial(_engine, "pinocchio"), "mujoco": partial(_engine, "mujoco")},
    units=dict.fromkeys((*CENTRE, *MARGINS, *JOINED, *SLIDERS, "least_clearance"), "m")
    | dict.fromkeys(("least_condition", "r_alpha"), ""),
    text="how far the head centre is inside every limit of the workspace (negative: outside), inside all and any of them, "
    "and the R-functions R_alpha of the same",
)
