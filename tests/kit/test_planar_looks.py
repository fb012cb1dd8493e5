"""What is drawn of planar linkages: joints have pins through both bars, blocks stay in their slots, carriages on their rails."""

from __future__ import annotations

import numpy as np
import pytest

from mechlab import api
from mechlab.mechanism import GROUND, Mechanism, Shape
from mechlab.mechanism.tree import reference_poses
from mechlab.shapes import mesh

FLAT = ("link", "plate_link", "slotted_link")


def shapes_of(m: Mechanism, body: str) -> tuple[Shape, ...]:
    return m.ground_shapes if body == GROUND else next(b.shapes for b in m.bodies if b.name == body)


def extent(item: Shape, rotation: np.ndarray, origin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The box (3,), (3,) of a shape in the world."""
    points = mesh(item.kind, item.parameters, item.data).vertices
    placed = points @ item.placement.rotation.T + item.placement.translation
    world = placed @ rotation.T + origin
    return world.min(axis=0), world.max(axis=0)


@pytest.mark.parametrize("name", ["quick_return", "class4_linkage", "platform_3rrr", "stephenson", "fivebar"])
def test_every_joint_has_a_pin_through_both_bars(name: str) -> None:
    """At the place of every revolute joint and loop a cylinder spans the flat bars that meet there."""
    m = api.load(name).mechanism()
    poses = reference_poses(m.bodies)
    places = [(poses[b.name][1], (b.name, b.parent)) for b in m.bodies if b.joints[-1].kind == "revolute"]
    places += [
        (poses[x.body_a][0] @ x.placement_a.translation + poses[x.body_a][1], (x.body_a, x.body_b)) for x in m.loops
    ]
    assert len(places) >= len(m.bodies) - 2
    for point, bodies in places:
        boxes = [(s.kind, *extent(s, *poses.get(b, (np.eye(3), np.zeros(3))))) for b in bodies for s in shapes_of(m, b)]
        here = [box for box in boxes if np.all(box[1][[0, 2]] < point[[0, 2]]) and np.all(point[[0, 2]] < box[2][[0, 2]])]
        bars = [(low[1], high[1]) for kind, low, high in here if kind in FLAT]
        middle = [box for box in here if np.allclose(box[1][[0, 2]] + box[2][[0, 2]], 2 * point[[0, 2]], atol=1e-9)]
        pins = [(low[1], high[1]) for kind, low, high in middle if kind == "cylinder"]
        assert bars and any(
            low <= min(b[0] for b in bars) and high >= max(b[1] for b in bars) for low, high in pins
        ), (bodies, pins, bars)


def test_the_block_stays_in_its_slot_and_the_ram_on_its_rail() -> None:
    """Over one turn of the crank of a shaper, by the closed form of its slides: the slot is as long as they need, no longer."""
    design = api.load("quick_return")
    p, m = design.parameters, design.mechanism()
    slot = next(s for s in shapes_of(m, "lever") if s.kind == "slotted_link").parameters
    # The turn is sampled every 5 degrees; near its ends slide^2 = distance^2 + crank^2 -+ 2 distance crank cos(angle).
    missed = p.distance * p.crank / (2.0 * (p.distance - p.crank)) * np.radians(2.5) ** 2
    assert slot["slot_low"] == pytest.approx(p.distance - p.crank, abs=missed)
    assert slot["slot_high"] == pytest.approx(p.distance + p.crank, abs=missed)
    # The ram: lever angle of a turn, then the law of cosines along its line.
    angle = np.linspace(0.0, 2.0 * np.pi, 721)
    pin = p.crank * np.exp(1j * angle) + 1j * p.distance
    tip = p.lever * pin / np.abs(pin)
    ram = tip.real + np.sqrt(p.rod**2 - (p.height + p.distance - tip.imag) ** 2)
    rail = next(s for s in m.ground_shapes if s.kind == "rail")
    low, high = extent(rail, np.eye(3), np.zeros(3))
    half = next(s for s in shapes_of(m, "D_slider") if s.kind == "carriage").parameters["length"] / 2
    assert low[0] < ram.min() - half and high[0] > ram.max() + half
    assert high[0] - low[0] < np.ptp(ram) + 4 * half


def test_offset_slots_stand_beside_the_pivot() -> None:
    design = api.load("quick_return", offset=0.03)
    lever = shapes_of(design.mechanism(), "lever")
    slot = next(s for s in lever if s.kind == "slotted_link")
    assert slot.placement.translation[2] == pytest.approx(0.03, abs=1e-12)
