"""Figures 12, 13 and table 1 of the thesis abstract: one tooth contact as it moves along the line of action, and the torques
through all meshes while they turn. Gears as in `elements`: driver about A = (-r, 0), turning by +1 rad/s, driven about C."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic import delta6 as closed
from mechlab.catalog.bibliography import THESIS
from mechlab.catalog.delta6.claims_mesh import FRICTION, PRINTED_CONTACT, PRINTED_RADIUS, PRINTED_SLIDING
from mechlab.experiment.figure import Curve, Drawing, Mark, Panel, Reading, SourceFigure
from mechlab.mechanism.geometry import Array
from mechlab.shapes.involute import Teeth, spur_outline
from mechlab.shapes.phases import external_phase

TEETH, MODULE = 20, 2.0 * PRINTED_RADIUS / 20
"""Of the gears of figures 12 and 13: 20 teeth on the printed radius give the printed sliding velocity (C38)."""
ALONG = np.array([math.sin(closed.PRESSURE_ANGLE), math.cos(closed.PRESSURE_ANGLE)])
ACROSS = np.array([ALONG[1], -ALONG[0]])
"""Unit vectors: of the line of action, and the way in which the driver's tooth slides on the driven one in approach."""
END = closed.tip_distance(TEETH, MODULE)
"""Half the way of the contact on the line of action [m]; it is the same on both sides of the pitch point."""
WINDOW = (-0.12, 0.12)


def _polyline(*points: Array) -> tuple[Array, Array]:
    xy = np.array(points)
    return xy[:, 0], xy[:, 1]


def _arrow(start: Array, vector: Array, head: float = 0.012) -> tuple[Array, Array]:
    """The outline of an arrow."""
    tip, unit = start + vector, vector / np.linalg.norm(vector)
    side = np.array([-unit[1], unit[0]])
    return _polyline(start, tip, tip - head * (unit + 0.45 * side), tip - head * (unit - 0.45 * side), tip)


def reaction(s: float, friction: float = FRICTION) -> Array:
    """(2,) force on the driven tooth for a normal force of 1, with the contact at s on the line of action: its friction acts
    the way the driver's tooth slides, which turns round at the pitch point."""
    return np.asarray(ALONG - np.sign(s) * friction * ACROSS)


def _gears(s: float) -> tuple[Curve, ...]:
    """Teeth of both gears near the pitch point with their contact at s [m], tip circles, line of action."""
    teeth = Teeth(TEETH, MODULE)
    turn = s / teeth.base
    phase = turn - 0.5 * math.pi / TEETH
    out = []
    for x, at, color in ((-PRINTED_RADIUS, phase, 0), (PRINTED_RADIUS, external_phase(TEETH, phase, TEETH), 4)):
        outline = spur_outline(teeth, at, finer=6) + np.array([x, 0.0])
        outline = np.concatenate([outline, outline[:1]])
        near = (np.abs(outline) < 2.0 * WINDOW[1]).all(axis=1)
        outline = np.where(near[:, None], outline, np.nan)
        label = ("driver" if x < 0 else "driven gear") + f", {TEETH} teeth"
        out.append(Curve(outline[:, 0], outline[:, 1], label, "solid", color))
    line = np.array([[-1.25 * END], [1.25 * END]]) * ALONG
    return (*out, Curve(line[:, 0], line[:, 1], "line of action", "dotted", 4))


def _at_contact(s: float, title: str) -> Panel:
    """Both gears with the contact at s, its normal force and its reaction with friction."""
    b, size = s * ALONG, 0.06
    curves = (
        *_gears(s), Curve(*_arrow(b, size * ALONG), "reaction without friction", "solid", 2),
        Curve(*_arrow(b, size * reaction(s)), f"reaction with friction, f = {FRICTION:g}", "thick", 1),
    )  # fmt: skip
    return Panel(title, "x [m]", "y [m]", curves, x_range=WINDOW, y_range=WINDOW, equal=True)


def film(phase: float) -> Drawing:
    """The contact at a share `phase` of its way: the reaction leans to one side, then, past the pitch point, to the other."""
    s = (2.0 * phase - 1.0) * END
    way = np.linspace(-END, END, 201)
    torque = Panel(
        f"driver torque over that without friction: {float(_loss_here(s)):.4f}", "contact on the line of action, s [m]", "M1 / M1(f = 0)",
        (Curve(way, _loss_here(way), "", "solid", 0), Curve([s], [float(_loss_here(s))], "now", "crosses", 1)),
    )  # fmt: skip
    side = "approach" if s < 0 else "recess"
    return Drawing((_at_contact(s, f"{side}, s = {1e3 * s:.0f} mm"), torque))


def _loss_here(s: Array | float) -> Array:
    return closed.contact_loss(TEETH, TEETH, FRICTION, np.asarray(s) / MODULE)


def figure_12() -> Drawing:
    """The contact at M, its sliding velocity, and the velocity all the way from M to M1."""
    at, velocity = END * ALONG, closed.sliding_velocity(END * ALONG, PRINTED_RADIUS, PRINTED_RADIUS).velocity
    contact = Panel(
        "contact at the end of the line of action", "x [m]", "y [m]",
        (*_gears(END), Curve(*_arrow(at, 0.6 * velocity), "sliding velocity, 0.6 m for 1 m/s", "thick", 1)),
        marks=(Mark("(0.024, 0.065) m", *PRINTED_CONTACT),), x_range=WINDOW, y_range=WINDOW, equal=True,
    )  # fmt: skip
    s = np.linspace(-END, END, 201)
    along = closed.sliding_velocity(closed.contact_point(s), PRINTED_RADIUS, PRINTED_RADIUS).velocity
    rates = Panel(
        "sliding velocity for 1 rad/s", "contact on the line of action, s [m]", "velocity [m/s]",
        (Curve(s, along[:, 0], "x"), Curve(s, along[:, 1], "y")),
        marks=tuple(Mark(f"{v:g} m/s", float(np.hypot(*PRINTED_CONTACT)), v) for v in PRINTED_SLIDING),
        x_range=(-0.08, 0.115),
    )  # fmt: skip
    printed = closed.sliding_velocity(PRINTED_CONTACT, PRINTED_RADIUS, PRINTED_RADIUS).velocity
    readings = (
        Reading(f"contact at the tip of {TEETH} teeth", PRINTED_CONTACT, at.tolist(), "m"),
        Reading("sliding velocity there", PRINTED_SLIDING, velocity.tolist(), "m/s"),
        Reading("sliding velocity from the printed contact", PRINTED_SLIDING, printed.tolist(), "m/s"),
    )
    return Drawing((contact, rates), readings, "`-o FILE.gif` shows the contact in motion, with the reaction of figure 13.")


def figure_13() -> Drawing:
    """The reaction at the beginning of the contact with its levers about both axes, and in recess."""
    panels, readings = [], []
    for s, name in ((-END, "approach: tip of the driven gear"), (END, "recess: tip of the driver")):
        b, force = s * ALONG, reaction(s)
        unit, curves, levers = force / np.linalg.norm(force), [], []
        for centre, color in ((np.array([-PRINTED_RADIUS, 0.0]), 0), (np.array([PRINTED_RADIUS, 0.0]), 4)):
            foot = b + float((centre - b) @ unit) * unit
            levers.append(float(np.linalg.norm(foot - centre)))
            gear = "driven gear" if color else "driver"
            curves.append(Curve(*_polyline(centre, foot), f"lever of {gear}: {levers[-1]:.4f} m", "thick", color))
        line = _polyline(b - 0.3 * unit, b + 0.3 * unit)
        angle = math.degrees(math.acos(float(unit @ ALONG)))
        lines = (
            Curve(*_polyline(-0.3 * ALONG, 0.3 * ALONG), "line of action", "dotted", 2),
            Curve(*line, "line of the reaction, f = 0.16", "dashed", 1), Curve(*_arrow(b, 0.12 * unit, 0.02), "reaction", "thick", 1),
        )  # fmt: skip
        panels.append(Panel(name, "x [m]", "y [m]", (*lines, *curves), equal=True))
        side = name.split(":")[0]
        readings.append(Reading(f"tilt of the reaction against the line of action, {side}", "arctan f", angle, "deg"))
        readings.append(Reading(f"lever of driver over lever of driven gear, {side}", "h_R1 / h_R2", levers[0] / levers[1]))
    return Drawing(tuple(panels), tuple(readings))


PAIRS = ((22, 34), (19, 19), (31, 30))
"""Driver and driven gear of meshes 1 to 3 from the output link on: teeth of ours with the ratios of table 1 (C42, C47, C48)."""
OUTPUT = float(closed.SOURCE_TABLE_FRICTION[0])
RATIOS = closed.SOURCE_STAGE_RATIOS


def mesh_losses(output: Array) -> tuple[Array, Array]:
    """(n, 3) loss of each mesh at angles (n,) of the output link [rad]: the pair of teeth that came in last carries all; and the
    pairs in contact press with equal normal forces."""
    pitch = math.pi * math.cos(closed.PRESSURE_ANGLE)
    turn, last, shared = output, [], []
    for driver, driven in PAIRS:
        begin, end = -closed.tip_distance(driven), closed.tip_distance(driver)
        base = 0.5 * driven * math.cos(closed.PRESSURE_ANGLE)
        s = begin + np.asarray(base * turn) % pitch
        last.append(closed.contact_loss(driver, driven, FRICTION, s))
        contacts = np.stack([s, s + pitch])
        above, below = closed.contact_levers(driver, driven, FRICTION, contacts)
        acts = contacts <= end
        shared.append((above * acts).sum(axis=0) / (below * acts).sum(axis=0))
        turn = turn * driven / driver
    return np.stack(last, axis=-1), np.stack(shared, axis=-1)


def table_1() -> Drawing:
    """Torques behind each mesh over a turn of the output link by 40 deg, and the loss of each mesh over the way of its contact."""
    degrees = np.linspace(0.0, 40.0, 1601)
    last, shared = mesh_losses(np.radians(degrees))
    free = OUTPUT * np.cumprod(RATIOS[:3])
    torques, means = free * np.cumprod(last, axis=1), free * np.cumprod(shared, axis=1)
    curves = (
        *(Curve(degrees, torques[:, k], f"mesh {k + 1}, the last pair carries all", "solid", k) for k in range(3)),
        Curve(degrees, means[:, 2], "mesh 3, pairs in contact with equal forces", "dotted", 4),
    )
    printed = closed.SOURCE_TABLE_FRICTION[1:4].tolist()
    marks = tuple(Mark(f"mesh {k + 1}: {v:g}", y=v) for k, v in enumerate(printed))
    motion = Panel("torques, 50 N m at the output link, f = 0.16", "turn of the output link [deg]", "torque [N m]", curves, marks)
    losses, factors = [], closed.SOURCE_TABLE_FRICTION[1:4] / closed.SOURCE_TABLE_FRICTION[:3] / RATIOS[:3]
    for k, (driver, driven) in enumerate(PAIRS):
        s = np.linspace(-closed.tip_distance(driven), closed.tip_distance(driver), 401)
        losses.append(Curve(s, closed.contact_loss(driver, driven, FRICTION, s), f"mesh {k + 1}, {driver}:{driven} teeth", "solid", k))
    at = [Mark(f"mesh {k + 1}: {v:.4f}", -closed.tip_distance(PAIRS[k][1]), float(v)) for k, v in enumerate(factors)]
    loss = Panel("loss of one pair of teeth", "contact on the line of action, s / module", "M1 / M1(f = 0)", tuple(losses), tuple(at))
    largest, mean = torques.max(axis=0), means.mean(axis=0)
    readings = (
        *(Reading(f"torque behind mesh {k + 1}: printed; largest, and mean with equal shares", printed[k],
                  [float(largest[k]), float(mean[k])], "N m") for k in range(3)),
        Reading("torque of the drive without friction", float(closed.SOURCE_TABLE_FRICTIONLESS[-1]), float(free[-1] * RATIOS[3]), "N m"),
        Reading("cost of friction in the worst case", 23, float(100 * (last.prod(axis=1).max() - 1.0)), "%"),
        Reading("mean cost of friction with equal shares", "-", float(100 * (shared.prod(axis=1).mean() - 1.0)), "%"),
    )  # fmt: skip
    text = "Printed marks in red. The teeth are ours: no numbers of teeth are printed, and those of meshes 1 and 3 do not fit (C48)."
    return Drawing((motion, loss), readings, text)


MESH_FIGURES = (
    SourceFigure("figure 12", "One tooth contact on its line of action, and how the teeth slide.", THESIS, figure_12,
                 claims=("C38", "C39", "C40"), film=film),
    SourceFigure("figure 13", "The reaction of a tooth with friction, tilted by arctan f.", THESIS, figure_13,
                 claims=("C40", "C41"), film=film),
    SourceFigure("table 1", "Friction through all meshes while they turn.", THESIS, table_1,
                 claims=("C42", "C43", "C44", "C45", "C46", "C47", "C48")),
)  # fmt: skip
