"""The squeezer as a Mechanism."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from mechlab.catalog.andrews.parameters import JOINTS, Parameters, own
from mechlab.kit import benchmark_parts as parts
from mechlab.kit import palette
from mechlab.mechanism import Builder, Mechanism, Placement, Spring, revolute, shape
from mechlab.mechanism.geometry import axis_rotation


@lru_cache(maxsize=32)
def build(p: Parameters, fidelity: str) -> Mechanism:
    """Seven bars as a tree (K2 on K1, K4 on K5, K6 on K7) and three pins in E; the reference pose is that of the start."""
    b = Builder("andrews", gravity=(0.0, -p.gravity, 0.0), summary="Andrews' squeezer, benchmark A03")
    k = {n: j.value.real for n, j in own(p).pose(p.start_angle)[0].items()}
    values = dict(zip(JOINTS, own(p).states(np.array([[p.start_angle, 0.0]]))[0][0], strict=True))
    a, pivot = (*p.a, 0.0), (*p.b, 0.0)
    rows: tuple[tuple[str, str, str, tuple[float, ...], float, tuple[float, float], float], ...] = (
        ("K1", "beta", "ground", (0.0, 0.0, 0.0), p.rr, (p.ra, 0.0), 0.0),
        ("K2", "Theta", "K1", (p.rr, 0.0, 0.0), p.d, (p.da, 0.0), 1.0),
        ("K3", "gamma", "ground", pivot, p.ss, (p.sa, p.sb), 0.0),
        ("K5", "delta", "ground", a, p.zt, (p.ta, p.tb), 0.0),
        ("K4", "Phi", "K5", (p.zt, 0.0, 0.0), p.e, (p.e - p.ea, 0.0), 2.0),
        ("K7", "epsilon", "ground", a, p.u, (p.ua, p.ub), -1.0),
        ("K6", "Omega", "K7", (p.u, 0.0, 0.0), p.zf, (p.zf - p.fa, 0.0), 3.0),
    )
    c = palette
    paints = (c.ROSE, c.ORANGE, c.TEAL, c.GOLD, c.BLUE, c.GOLD, c.BLUE)
    colors = {f"K{i}": paint for i, paint in enumerate(paints, 1)}
    for name, joint, parent, at, length, centre, layer in rows:
        angle = k[name] - (k[parent] if parent != "ground" else 0.0)
        b.bar(name, revolute(joint, "z", zero=float(values[joint])), length, parent=parent, at=at, width=0.003,
              color=colors[name], layer=0.0013 * layer)  # fmt: skip
        number = int(name[1]) - 1
        parts.with_inertia(b, parts.planar(p.masses[number], p.inertias[number], *centre))
        _turn(b, angle)
    ends = {"K2": p.d, "K3": p.ss, "K4": p.e, "K6": p.zf}
    for name in ("K3", "K4", "K6"):
        b.loop(f"E_{name}", "K2", name, (ends["K2"], 0.0, 0.0), (ends[name], 0.0, 0.0))
    b.spring(Spring("spring", "ground", "K3", (*p.c, 0.0), (p.sc, p.sd, 0.0), p.spring_stiffness, 0.0, p.spring_length))
    b.frame("F", "K1", (p.rr, 0.0, 0.0)).frame("E", "K2", (p.d, 0.0, 0.0)).frame("D", "K3", (p.sc, p.sd, 0.0))
    b.ground(shape("cylinder", Placement((*p.c, 0.0)), palette.SLATE, "anchor", radius=0.0015, length=0.004))
    return b.build()


def _turn(b: Builder, angle: float) -> None:
    body = b.bodies[-1]
    turned = Placement.of(axis_rotation((0.0, 0.0, 1.0), angle), body.placement.translation)
    b.bodies[-1] = replace(body, placement=turned)
