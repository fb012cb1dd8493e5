"""Crank angle to every assembly mode: closed form; Pinocchio and MuJoCo in the mode of the parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mechlab.analytic import assur
from mechlab.catalog.class4_linkage.build import START_OFFSET, build, pose
from mechlab.catalog.class4_linkage.geometry import (
    THETAS,
    Class4Parameters,
    Mode,
    arcs,
    at,
    describe_mode,
    group,
    label,
    solve_all,
)
from mechlab.errors import NoSolution
from mechlab.experiment.question import Answer, Question, with_rates
from mechlab.kit.questions import by_engines, with_orders
from mechlab.mechanism import Mechanism, Status
from mechlab.mechanism.geometry import Array

ANSWERS = tuple(with_orders({n: n for n in THETAS}))
GIVEN = {"crank_angle": "crank_angle", "crank_rate": "crank_angle_rate", "crank_accel": "crank_angle_accel"}
MERGING = 1e-9
"""|det J| relative to the size of the group to the fourth, below which two modes are reported to merge."""


def _flat(mode: Mode) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for name in THETAS:
        s = mode.angles[name]
        out |= {name: s.x, f"{name}_rate": s.v, f"{name}_accel": s.a}
    return out


def _one(mode: Mode, title: str) -> dict[str, Any]:
    values = {k: float(v) for k, v in _flat(mode).items()}
    points = {n: [float(p.p.real), float(p.p.imag)] for n, p in mode.points.items()}
    return {"label": title, **values, "points": points, "K1": int(mode.k1), "K2": int(mode.k2), "det": float(mode.det)}


def _no_assembly(p: Class4Parameters, angle: np.ndarray) -> Answer:
    """The answer where a crank angle has no assembly; it names the arc around the first such angle."""
    flat = np.atleast_1d(angle)
    bad = next((float(a) for a in flat.ravel() if solve_all(p, float(a)).chosen < 0), float(flat.ravel()[0]))
    for low, high in arcs(p):
        if (bad - low) % (2 * np.pi) <= high - low:
            turns = 2 * np.pi * np.floor((bad - low) / (2 * np.pi))
            a, b = low + turns, high + turns
            text = (
                f"no assembly exists between the crank angles {np.degrees(a):.7f} deg and {np.degrees(b):.7f} deg, where two "
                f"modes merge (det J = 0); {np.degrees(bad):.6g} deg lies inside"
            )
            return Answer(status=Status.NO_ASSEMBLY, notes=(text,), details={"gap": [a, b], "modes": []})
    return Answer(status=Status.NO_ASSEMBLY, notes=("no mode closes here",), details={"modes": []})


def analytic(p: Class4Parameters, given: Mapping[str, Any]) -> Answer:
    """Every mode by the polynomial of degree 6; over arrays of crank angles the chosen mode, and how many there are."""
    angle, rate, accel = (np.asarray(given[k], dtype=float) for k in ("crank_angle", "crank_rate", "crank_accel"))
    angle, rate, accel = np.broadcast_arrays(angle, rate, accel)
    found = solve_all(p, angle)
    if np.any(found.chosen < 0):
        return _no_assembly(p, angle)
    chosen = at(p, angle, rate, accel)
    scale = group(p, angle).scale
    merging = np.abs(chosen.det) < MERGING * scale**2
    status = Status.BOUNDARY if np.any(merging) else Status.SOLVED
    if angle.ndim:
        return Answer({**_flat(chosen), "mode_count": found.modes.count}, status)
    g, pin = group(p, angle, rate, accel), assur.driver(assur.fixed(), p.OA, angle, rate, accel)
    modes, taken = [], list[str]()
    for k in range(int(found.modes.count)):
        mode = describe_mode(p, g, pin, found.modes.theta_t[k], found.modes.theta_u[k])
        taken.append(label(float(mode.k1), float(mode.k2), taken))
        modes.append(_one(mode, taken[-1]))
    name = taken[int(found.chosen)]
    notes: tuple[str, ...] = (f"{len(modes)} modes; the witnesses compare {name}",)
    if np.any(merging):
        notes += ("two modes merge here: rates do not exist",)
    return Answer(_flat(chosen), status, notes, modes=tuple(modes))


def _start(p: Class4Parameters, m: Mechanism, given: Mapping[str, Any]) -> Array | None:
    """(nq,) START_OFFSET off the closed form of the chosen mode; None where it does not assemble."""
    try:
        return pose(p, m, float(given["crank_angle"])) + START_OFFSET
    except NoSolution:
        return None


QUESTION = Question(
    "modes", given=("crank_angle",), optional={"crank_rate": 0.0, "crank_accel": 0.0}, answers=ANSWERS,
    witnesses={"analytic": analytic} | by_engines(build, GIVEN, {k: k for k in ANSWERS}, _start), angles=THETAS,
    units=with_rates(dict.fromkeys(THETAS, "rad"))
    | {"crank_angle": "rad", "crank_rate": "rad/s", "crank_accel": "rad/s2", "mode_count": ""},
    text="every assembly mode at a crank angle, with rates and accelerations",
)  # fmt: skip
