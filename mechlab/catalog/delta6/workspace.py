"""The workspace of the head centre O: the source's grid and test (check A6), the limits that the source leaves out, maps, and
the question of the margin at a point."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial, reduce
from typing import Any

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.analytic.regions import Region, any_of, r_functions
from mechlab.catalog.delta6.build import build
from mechlab.catalog.delta6.parameters import ANGLES, CENTRE, SLIDERS, SOURCE, Delta6Parameters
from mechlab.catalog.delta6.poses import coordinates
from mechlab.catalog.delta6.questions import START_OFFSET
from mechlab.experiment.entry import Check, CheckResult, Coordinates, WorkspaceLimit, WorkspaceMap, WorkspaceRecipe
from mechlab.experiment.question import Answer, Question
from mechlab.kit.questions import by_name, for_engines, stacked
from mechlab.kit.witness import engine_answer
from mechlab.mechanism import Mechanism, TreeKinematics
from mechlab.mechanism.geometry import Array
from mechlab.values import Range

Given = Mapping[str, Any]


def limits_of(p: Delta6Parameters, limits: Mapping[str, float]) -> closed.WorkspaceLimits:
    """The limits of a design and those that were given."""
    return closed.WorkspaceLimits(p.slider_min, p.slider_max, p.bend_limit, **limits)


def region(p: Delta6Parameters, limits: Mapping[str, float]) -> Region:
    """The positions of O that keep every limit; see `mechlab.analytic.delta6.workspace_region`."""
    return closed.workspace_region(p.geometry, limits_of(p, limits), p.rod_spacing)


def maps(p: Delta6Parameters) -> dict[str, WorkspaceMap]:
    """Dexterity, reach, bend and clearance over (x, y)."""
    g = p.geometry

    def bend(centre: Array) -> Array:
        reach = g.rod_length - closed.reach_margin(g, centre)
        return np.asarray(np.arcsin(np.minimum(reach / g.rod_length, 1.0)))

    def over_plane(of: Callable[[Array], Array], unit: str, text: str) -> WorkspaceMap:
        def at(points: Coordinates) -> Array:
            x, y = np.broadcast_arrays(points["x"], points["y"])
            return of(np.stack([x, y, np.zeros(x.shape)], axis=-1))

        return WorkspaceMap(at, ("x", "y"), unit, text)

    return {
        "inverse_condition": over_plane(
            partial(closed.inverse_condition, g), "",
            "dexterity: smallest singular value of the slider Jacobian over its largest",
        ),
        "reach_margin": over_plane(
            partial(closed.reach_margin, g), "m", "horizontal distance to a rod that lies horizontal"
        ),
        "largest_bend": over_plane(bend, "rad", "largest bend of a cardan"),
        "clearance": over_plane(
            partial(closed.clearance, g, rod_spacing=p.rod_spacing), "m",
            "distance of centre lines of rods of different legs, and of rods and the guides of other legs",
        ),
    }  # fmt: skip


WORKSPACE = WorkspaceRecipe(
    make=region,
    grid=dict.fromkeys("xyz", Range(-1.0, 1.0, 201)),
    units=dict.fromkeys("xyz", "m"),
    limits={
        "least_condition": WorkspaceLimit("", "smallest inverse condition of the slider Jacobian that is allowed"),
        "least_clearance": WorkspaceLimit("m", "smallest distance of centre lines that is allowed"),
    },
    maps=maps,
    text="positions of the head centre O",
)

LIMITS = ("least_condition", "least_clearance")
CLAUSES = ("reach", "slider_min", "slider_max", "bend", "condition", "clearance")
MARGINS = tuple(f"{n}_margin" for n in CLAUSES)
JOINED = ("margin", "any_margin", "r_conjunction", "r_disjunction")
NO_CLEARANCE = "the clearance of the rods is known to the closed form alone, so is the margin of all limits"


def _limits(given: Given) -> dict[str, float]:
    return {k: float(given[k]) for k in LIMITS if k in given}


def _margins_analytic(p: Delta6Parameters, given: Given) -> Answer:
    """The region of the workspace, evaluated."""
    inside = region(p, _limits(given))
    centre = stacked(given, CENTRE)
    points = by_name("xyz", centre)
    smooth = r_functions(float(given["r_alpha"]))
    either = any_of(inside.clauses)
    shape = points["x"].shape
    margins = {f"{c.name}_margin": c.margin(points) for c in inside.clauses}
    margins |= {"margin": inside.margin(points), "any_margin": either.margin(points)}
    margins |= {"r_conjunction": inside.margin(points, smooth), "r_disjunction": either.margin(points, smooth)}
    values: dict[str, Any] = {k: np.broadcast_to(x, shape).copy() for k, x in margins.items()}
    notes: tuple[str, ...] = ()
    if not shape:
        verdict = inside.decide(points)
        where = "inside" if bool(verdict.inside) else "outside"
        notes = (f"{where} the workspace; {verdict.binding()} decides",)
    found = closed.inverse_position(p.geometry, centre)
    if np.all(found.reachable):
        values |= by_name(SLIDERS, found.drives)
    return Answer(values, notes=notes)


def _margins_engine(engine: str, p: Delta6Parameters, given: Given) -> Answer:
    """Margins measured on the pose that an engine assembles, and R-functions by their defining formula."""
    centre = np.array([float(given[k]) for k in CENTRE])
    if not bool(closed.inverse_position(p.geometry, centre).reachable):
        return Answer(cannot="no pose has its head centre here, so that there is none to measure")
    pose = dict(zip(CENTRE, centre.tolist(), strict=True)) | dict.fromkeys(ANGLES, 0.0)
    start = coordinates(p, "minimal", centre, np.zeros(3))[0] + START_OFFSET
    m = build(p, "minimal")
    found = engine_answer(engine, m, pose, SLIDERS, start=start, steps=1)
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
        sizes = np.linalg.svd(_slider_jacobian(engine, m, pose, start), compute_uv=False)
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


def _slider_jacobian(engine: str, m: Mechanism, pose: Mapping[str, float], start: Array) -> Array:
    """(3, 3) slider rates per rate of O_x, O_y, O_z, the angles held."""
    still = {f"{n}_rate": 0.0 for n in (*CENTRE, *ANGLES)}
    columns = []
    for n in CENTRE:
        asked = {**pose, **still, f"{n}_rate": 1.0}
        rates = engine_answer(engine, m, asked, [f"{s}_rate" for s in SLIDERS], start=start, steps=1).values
        columns.append([rates[f"{s}_rate"] for s in SLIDERS])
    return np.array(columns).T


MARGIN = Question(
    "margins of the workspace",
    given=CENTRE,
    optional=dict.fromkeys(LIMITS) | {"r_alpha": 0.0},
    answers=(*MARGINS, *JOINED, *SLIDERS),
    witnesses={"analytic": _margins_analytic} | for_engines(_margins_engine),
    units=dict.fromkeys((*CENTRE, *MARGINS, *JOINED, *SLIDERS, "least_clearance"), "m")
    | dict.fromkeys(("least_condition", "r_alpha"), ""),
    text="how far the head centre is inside every limit of the workspace (negative: outside), inside all and any of them, "
    "and the R-functions R_alpha of the same",
)


def _count_from_parts(bend_limit: float | None) -> list[int]:
    """Workspace counts from where the crosses of the `full` mechanism stand, node by node."""
    tree = TreeKinematics(build(SOURCE, "full"))
    nodes = np.arange(-100, 101) / 100.0
    x, y = np.meshgrid(nodes, nodes, indexing="ij")
    tops = []
    for i in (1, 2, 3):
        upper, lower = tree.pose(f"cross_{i}")[1], tree.pose(f"half_{i}")[1]
        span = lower - upper
        radicand = span @ span - (x + span[0]) ** 2 - (y + span[1]) ** 2
        height = np.sqrt(np.where(radicand >= 0.0, radicand, np.nan))
        if bend_limit is not None:
            height[np.arccos(height / np.sqrt(span @ span)) > bend_limit] = np.nan
        zero = tree.mechanism.zero(f"q{i}")
        tops.append(height + zero + span[2])
    stacked = np.array(tops)
    reached = np.isfinite(stacked).all(axis=0)
    drives = stacked[:, reached][:, :, None] + nodes
    inside = ((drives >= SOURCE.slider_min) & (drives <= SOURCE.slider_max)).all(axis=0)
    return [int(reached.sum()), int(inside.sum())]


def a6(p: Delta6Parameters) -> CheckResult:
    """The workspace on the source's grid, without and with a bend limit of the cardans."""
    values: dict[str, list[int]] = {"analytic": [], "numpy": []}
    for bend in (None, math.radians(45.0), math.radians(60.0)):
        counts = closed.workspace_counts(SOURCE.geometry, SOURCE.slider_min, SOURCE.slider_max, bend)
        values["analytic"] += [counts.xy_nodes, counts.voxels]
        values["numpy"] += _count_from_parts(bend)
    expected = [811, 18_724, 55, 2_003, 362, 10_885]
    return CheckResult(
        values, 0.0, expected, "nodes (x, y) and voxels: no bend limit, 45 deg, 60 deg; sliders 0.25 to 0.65 m"
    )


A6 = Check(
    "A6", "workspace counts on the grid of 0.01 m (source's parameters)", a6,
    "thesis abstract, chapter 3, workspace; counts of the grid",
)  # fmt: skip
