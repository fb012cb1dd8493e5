"""Ground, sliders, rods and crosses of the delta."""

from __future__ import annotations

import numpy as np

from mechlab.catalog.delta6.looks.sizes import Shapes, at, columns
from mechlab.catalog.delta6.masses import vec
from mechlab.catalog.delta6.parameters import Delta6Parameters, Leg, legs
from mechlab.kit.palette import BLUE, DARK, ORANGE, PALE, STEEL, TEAL
from mechlab.mechanism import shape
from mechlab.mechanism.geometry import Array, frame_along

FLOOR = -0.17
"""Height of the base plate below the home head centre [m]."""
GUIDE_ARM = 0.05
"""How far the guide columns stand outside the shaft axis [m]."""


def ground(p: Delta6Parameters) -> Shapes:
    """Base plate, three pairs of guide columns, top ring."""
    top = p.slider_max - p.slider_height + 0.09
    reach = abs(p.platform_radius + p.radial_offset) + GUIDE_ARM
    out = [shape("disc", at((0.0, 0.0, FLOOR - 0.008)), PALE, "base", radius=reach + 0.04, thickness=0.016, bore=0.1)]
    out.append(
        shape("ring", at((0.0, 0.0, top)), PALE, "top", outer=reach + 0.016, inner=reach - 0.016, thickness=0.012)
    )
    for leg in legs(p):
        frame = columns(leg.tangent, -leg.radial)
        foot = leg.upper + GUIDE_ARM * leg.radial
        out.append(
            shape(
                "guide",
                at((foot[0], foot[1], FLOOR), frame),
                STEEL,
                f"guide_{leg.index}",
                length=top - FLOOR,
                radius=0.008,
                spacing=0.06,
            )
        )
    return tuple(out)


def slider(p: Delta6Parameters, leg: Leg) -> Shapes:
    """Carriage on the two columns, with the arm and the motor over the shaft."""
    frame = columns(leg.tangent, -leg.radial)
    z = p.slider_height
    carriage = leg.radial * GUIDE_ARM
    return (
        shape(
            "slider",
            at((carriage[0], carriage[1], z), frame),
            BLUE,
            "carriage",
            x=0.1,
            y=0.034,
            length=0.07,
            bore=0.0085,
            holes=2,
            spacing=0.06,
        ),
        shape("box", at((carriage[0] * 0.45, carriage[1] * 0.45, z), frame), BLUE, "arm", x=0.04, y=0.05, z=0.03),
        shape("cylinder", at((0.0, 0.0, z + 0.035)), DARK, "motor", radius=0.019, length=0.045, chamfer=0.003),
        shape(
            "box",
            at(tuple(0.5 * p.rod_spacing * leg.tangent + np.array([0.0, 0.0, z])), frame),
            BLUE,
            "bar",
            x=p.rod_spacing + 0.02,
            y=0.014,
            z=0.014,
        ),
        shape(
            "cylinder",
            at(tuple(p.rod_spacing * leg.tangent + np.array([0.0, 0.0, 0.5 * z]))),
            BLUE,
            "post",
            radius=0.005,
            length=z,
        ),
    )


def _along(leg: Leg) -> Array:
    return frame_along(leg.span / np.linalg.norm(leg.span))


def rods(p: Delta6Parameters, leg: Leg) -> Shapes:
    """Both rods of a leg, for the fidelities in which they are one body."""
    return (
        shape("rod", at((0.0, 0.0, 0.0), _along(leg)), ORANGE, "rod", length=p.rod_length, radius=0.006),
        shape(
            "rod", at(vec(p.rod_spacing * leg.tangent), _along(leg)), STEEL, "plain", length=p.rod_length, radius=0.005
        ),
    )


def cardan_rod(p: Delta6Parameters, leg: Leg) -> Shapes:
    """The shaft between its two forks; the fork pins lie along fork_b."""
    u = leg.span / np.linalg.norm(leg.span)
    upper = columns(leg.fork_b, np.cross(-u, leg.fork_b))
    lower = columns(leg.fork_b, np.cross(u, leg.fork_b))
    return (
        shape(
            "cylinder",
            at(tuple(0.5 * leg.span), _along(leg)),
            ORANGE,
            "shaft",
            radius=0.006,
            length=p.rod_length - 0.05,
        ),
        shape("fork", at((0.0, 0.0, 0.0), upper), ORANGE, "upper_fork", span=0.02, pin=0.003),
        shape("fork", at(vec(leg.span), lower), ORANGE, "lower_fork", span=0.02, pin=0.003),
    )


def plain_rod(p: Delta6Parameters, leg: Leg) -> Shapes:
    """The plain rod with its two balls."""
    return (
        shape("rod", at((0.0, 0.0, 0.0), _along(leg)), STEEL, "rod", length=p.rod_length, radius=0.0045),
        shape("sphere", at((0.0, 0.0, 0.0)), DARK, "upper_ball", radius=0.008),
        shape("sphere", at(vec(leg.span)), DARK, "lower_ball", radius=0.008),
    )


def stub(p: Delta6Parameters, leg: Leg, upper: bool) -> Shapes:
    """Shaft stub with its fork; the pin holes lie along fork_a."""
    up = np.array([0.0, 0.0, 1.0 if upper else -1.0])
    frame = columns(leg.fork_a, np.cross(-up, leg.fork_a))
    long = p.slider_height if upper else 0.045
    return (
        shape("fork", at((0.0, 0.0, 0.0), frame), TEAL, "fork", span=0.02, pin=0.003),
        shape("cylinder", at(tuple(0.5 * (0.016 + long) * up)), TEAL, "stub", radius=0.0045, length=long - 0.016),
    )


def cross(leg: Leg) -> Shapes:
    """The cross with its four pins."""
    return (
        shape("cross", at((0.0, 0.0, 0.0), columns(leg.fork_a, leg.fork_b)), DARK, "cross", span=0.022, radius=0.0028),
    )
