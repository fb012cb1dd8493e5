"""What the readable part of the article shows: figure 3, the slide and its matrices (37) to (39); the force (40) of its spring; and what
the three slides of the conclusion do in a swing."""

from __future__ import annotations

import math

import numpy as np

from mechlab.analytic import transition_matrices as tm
from mechlab.catalog.bibliography import PROSTHESIS
from mechlab.catalog.prosthetic_leg.build import LEG, SWING_TIME, Parameters, build
from mechlab.catalog.prosthetic_leg.questions import ankle_path, hitch_sag, swing_paths, tree
from mechlab.experiment.figure import Curve, Drawing, Mark, Note, Panel, Reading, SourceFigure
from mechlab.mechanism.geometry import Array

SLIDE = tm.prismatic((1.0, 0.0))
"""Omega of (39): a slide along x."""
ORIGIN = np.array([0.1, 0.2])
POINT = np.array([0.05, 0.08, 1.0])
"""A point of the sliding link, in its own axes [m]."""


def _world(angle: float, q: float) -> Array:
    """(3, 3) A = B E(q), the slide's axis turned by `angle` against the parent's x."""
    return np.asarray(tm.placement((float(ORIGIN[0]), float(ORIGIN[1])), angle) @ tm.joint_motion(SLIDE, q))


def _slopes(angle: float, q: float = 0.2) -> tuple[Array, Array]:
    """dA/dq as printed, Omega A, and by a difference, exact here: A is linear in q."""
    return SLIDE @ _world(angle, q), (_world(angle, q + 0.5) - _world(angle, q - 0.5)) / 1.0


def figure_3() -> Drawing:
    """The sliding link at three places for an axis along x and for one turned by -90 deg, with the way of a point as (38) says; and the
    error of (38) over the direction of the axis."""
    panels = []
    for angle in (0.0, -0.5 * math.pi):
        curves = []
        for k, q in enumerate((0.0, 0.1, 0.2)):
            corners = np.array([[0, 0, 1], [0.12, 0, 1], POINT, [0, 0, 1]]).T
            x, y, _ = _world(angle, q) @ corners
            curves.append(Curve(x, y, "link at q = 0, 0.1, 0.2 m" if k == 0 else "", "solid", 4))
        at = (_world(angle, 0.2) @ POINT)[:2]
        looks = (("Omega A, as printed", "thick", 1), ("true dA/dq", "dashed", 0))
        for (label, style, color), slope in zip(looks, _slopes(angle), strict=True):
            way = 0.12 * (slope @ POINT)[:2]
            curves.append(Curve([at[0], at[0] + way[0]], [at[1], at[1] + way[1]], label, style, color))
        panels.append(Panel(f"axis of the slide at {math.degrees(angle):g} deg", "x [m]", "y [m]", tuple(curves), equal=True))
    angles = np.radians(np.linspace(-180.0, 180.0, 181))
    off = [float(np.linalg.norm((a - b) @ POINT)) for a, b in (_slopes(x) for x in angles)]
    error = Panel("error of (38)", "direction of the axis in the parent [deg]", "|Omega A r - dA/dq r|", (Curve(np.degrees(angles), off),),
                  marks=(Mark("(38): none", 0.0, 0.0),))  # fmt: skip
    straight, turned = (float(np.abs(np.subtract(*_slopes(x))).max()) for x in (0.0, -0.5 * math.pi))
    readings = (
        Reading("Omega A less dA/dq, axis along x of the parent", 0, straight), Reading("the same, axis turned by -90 deg", 0, turned),
    )  # fmt: skip
    return Drawing((*panels, error), readings, "A constant turn B before the slide needs B Omega B^-1 in the place of Omega.", columns=3)


DRAWN = 0.2
"""Length of a slide as drawn in the figure of (40) [m]; ours: none is printed."""


def equation_40() -> Drawing:
    """Spring and weight along the thigh's slide over its length."""
    p = Parameters()
    weight = float(tm.gravity_force(tree(p), np.zeros(len(LEG)))[2])
    s = np.linspace(0.0, 1.2 * DRAWN, 121)
    curves = (
        Curve(s, (weight - p.C_thigh * s) / 1e3, "(40): -C q and weight, q the length", "thick", 1),
        Curve(s, (weight - p.C_thigh * (s - DRAWN)) / 1e3, "-C (q - q0), q0 = 0.2 m", "solid", 0), Curve(s, 0.0 * s, "", "thin", 4),
    )  # fmt: skip
    sag = weight / p.C_thigh
    notes = (Note("equilibrium", 0.03, 12.0, (sag, 0.0)), Note("equilibrium", 0.15, 18.0, (DRAWN + sag, 0.0)))
    panel = Panel("force along the slide of the thigh", "length of the slide [m]", "force [kN]", curves, notes=notes)
    readings = (
        Reading("rest length in (40); length at which spring and weight balance", 0, sag, "m"),
        Reading("the same with the drawn length as rest length", "-", DRAWN + sag, "m"),
    )
    return Drawing((panel,), readings, "The stiffness is ours: the article prints no numbers.")


LOCKS = {"no slides in thigh and shin": ("thigh", "shin"), "no hitch": ("hitch",), "no slides at all": ("hitch", "thigh", "shin")}


def conclusion() -> Drawing:
    """The ankle's path in a swing with the three slides, and how far it is off without some of them."""
    p, times = Parameters(), np.linspace(0.0, SWING_TIME, 91)
    sag = hitch_sag(p)
    whole = ankle_path(p, swing_paths(p, "mujoco", LEG, times, sag))
    off, readings = [], []
    for k, (label, locked) in enumerate(LOCKS.items()):
        free = tuple(n for n in LEG if n not in locked)
        start = sag if "hitch" in free else 0.0
        path = ankle_path(p, swing_paths(p, "mujoco", free, times, start)) + np.array([0.0, sag - start])
        away = 1e3 * np.linalg.norm(path - whole, axis=1)
        off.append(Curve(times, away, label, "solid", k))
        readings.append(Reading(f"largest error of the ankle in a swing, {label}", "-", float(away.max()), "mm"))
    elastic = ", ".join(j.name for j in build(p, "full").joints if j.kind == "prismatic" and j.stiffness)
    readings.append(Reading("elastic slides of the conclusion; of the model", 3, elastic))
    panels = (
        Panel("the ankle in the swing", "x [m]", "z [m]", (Curve(whole[:, 0], whole[:, 1], "with all slides", "thick", 0),), equal=True),
        Panel("without some of the slides", "t [s]", "distance of the ankle [mm]", tuple(off)),
    )
    return Drawing(panels, tuple(readings), "For the slides of thigh and shin in stance see the scene stance.")


FIGURES = (
    SourceFigure("figure 3", "The slide, and its derivative by (38), (39).", PROSTHESIS, figure_3, claims=("T1", "T2", "T3")),
    SourceFigure("equation (40)", "The force of an elastic slide.", PROSTHESIS, equation_40, claims=("T4", "T5")),
    SourceFigure("conclusion", "Three elastic slides: what each does in a swing.", PROSTHESIS, conclusion, claims=("T6",)),
)
