"""The springs of a mechanism in pictures and films: coils as long as their ends are apart; without stiffness a straight line."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.viewer.framing import Framing
from mechlab.viewer.story import Color, Story

Array = NDArray[np.float64]

COLOR: Color = (0.36, 0.40, 0.45, 1.0)
TURNS, SIDES = 9, 12
STRAIGHT = 0.12
"""Share of the length that is straight at either end."""
COIL, WIRE = 0.032, 0.006
"""Radii of the coil and of its wire, relative to that of the mechanism."""


def coil(length: float, radius: float) -> Array:
    """(k, 3) points of a coil along z from 0 to `length` [m], as the page draws it."""
    inner = np.linspace(0.0, 1.0, TURNS * SIDES + 1)
    out = radius * np.minimum(1.0, 12.0 * np.minimum(inner, 1.0 - inner))
    angle = 2.0 * np.pi * TURNS * inner
    along = STRAIGHT + (1.0 - 2.0 * STRAIGHT) * inner
    middle = np.column_stack([out * np.cos(angle), out * np.sin(angle), along * length])
    return np.vstack([[0.0, 0.0, 0.0], middle, [0.0, 0.0, length]])


class Springs:
    """The springs of the story's model. `most`: upper limit of their pieces."""

    def __init__(self, story: Story, framing: Framing) -> None:
        self.story, self.radius = story, framing.radius
        known = set(story.bodies)
        springs = () if story.model is None else story.model.springs
        self.springs = [s for s in springs if {s.body_a, s.body_b} <= known]
        self.most = len(self.springs) * (TURNS * SIDES + 2)

    def at(self, frame: int) -> list[Array]:
        """The wire of each spring, (k, 3) points in the world, at a recorded frame."""
        wires = []
        for spring in self.springs:
            a, b = (
                pose[:3, :3] @ point + pose[:3, 3]
                for pose, point in (
                    (self.story.poses[frame, self.story.bodies.index(body)], np.array(p))
                    for body, p in ((spring.body_a, spring.point_a), (spring.body_b, spring.point_b))
                )
            )
            length = float(np.linalg.norm(b - a))
            if length < 1e-9:
                continue
            if spring.stiffness == 0.0:
                wires.append(np.array([a, b]))
                continue
            axis = (b - a) / length
            side = np.cross(axis, [0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
            side /= np.linalg.norm(side)
            local = coil(length, min(COIL * self.radius, 0.2 * length))
            wires.append(a + local @ np.array([side, np.cross(axis, side), axis]))
        return wires

    def draw(self, mujoco: Any, scene: Any, frame: int) -> None:
        """Adds the wires to a scene with space for them."""
        kind = mujoco.mjtGeom.mjGEOM_CAPSULE
        for wire in self.at(frame):
            for start, end in zip(wire[:-1], wire[1:], strict=True):
                geom = scene.geoms[scene.ngeom]
                mujoco.mjv_initGeom(
                    geom, kind, np.zeros(3), np.zeros(3), np.eye(3).reshape(-1), np.array(COLOR, dtype=np.float32)
                )
                mujoco.mjv_connector(geom, kind, WIRE * self.radius, start, end)
                geom.category = mujoco.mjtCatBit.mjCAT_STATIC
                scene.ngeom += 1
