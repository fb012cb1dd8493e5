"""Inertia of every part of the delta. The fidelities lump the same parts, so that their totals agree."""

from __future__ import annotations

from mechlab.catalog.delta6.parameters import Delta6Parameters, Leg
from mechlab.mechanism import Inertia
from mechlab.mechanism.geometry import Vector

PLANET_OFFSET = 0.04
"""Distance of the planet axes from the central axis [m]."""
BEVEL_OFFSET = 0.03
"""Distance of the double bevels from the head centre along the crossbar [m]."""
STUB = Inertia.axial(0.02, 2e-6, 4e-6)
"""Shaft stub with its fork, upper or lower."""
SPUR = Inertia.axial(0.06, 4e-5, 2.2e-5)
"""Spur gear N on a lower shaft."""
CENTRAL = Inertia.axial(0.10, 2e-5, 1.2e-5)
"""Double spur gear Pr, loose on the central axis."""
PLANET = Inertia.axial(0.08, 2e-5, 1.2e-5)
"""Planet with its bevel Nz."""
BEVEL = Inertia.axial(0.06, 1.5e-5, 1e-5, axis=(0.0, 1.0, 0.0))
"""Double bevel Pz on the crossbar."""
CARRIER = Inertia(0.15, (0.0, 0.0, 0.0), (1.5e-4, 1.5e-4, 2e-4, 0.0, 0.0, 0.0))
"""Carrier of the head."""
TEE = Inertia(0.08, (0.0, 0.0, 0.0), (1e-4, 5e-5, 1e-4, 0.0, 0.0, 0.0))
"""T-shaped carrier with its crossbar along Y'."""


def vec(v: object) -> Vector:
    """A numpy (3,) as a tuple of floats."""
    x, y, z = (float(c) for c in v)  # type: ignore[attr-defined]
    return (x, y, z)


def slider(p: Delta6Parameters) -> Inertia:
    """Slider with its motor housing; it only translates."""
    return Inertia.box(p.slider_mass, 0.06, 0.06, 0.08)


def cross(p: Delta6Parameters, share: float = 1.0) -> Inertia:
    """A cardan cross, or a share of it."""
    k = share * p.cross_mass * 0.012**2 / 3.0
    return Inertia(share * p.cross_mass, (0.0, 0.0, 0.0), (k, k, k, 0.0, 0.0, 0.0))


def rod(p: Delta6Parameters, leg: Leg, count: int = 1) -> Inertia:
    """`count` slender rods along the span of a leg, from the origin."""
    return Inertia.rod(count * p.rod_mass, (0.0, 0.0, 0.0), vec(leg.span), p.rod_radius)


def rod_spin(p: Delta6Parameters) -> float:
    """Moment of inertia of a rod about its own axis [kg m2]."""
    return p.rod_mass * p.rod_radius**2 / 2.0


def shaft_spin(p: Delta6Parameters) -> float:
    """Moment of inertia of what turns with a rotary drive besides rotor and gear: two stubs, two crosses and the cardan rod,
    which turns at the mean speed [kg m2]."""
    return 2.0 * STUB.tensor[2] + 2.0 * cross(p).tensor[2] + rod_spin(p)


def platform(p: Delta6Parameters) -> Inertia:
    """Platform plate; it only translates in the delta, but the full model must find that out itself."""
    return Inertia.cylinder(p.platform_mass, 0.08, 0.02, com=(0.0, 0.0, p.platform_height))


def output(p: Delta6Parameters) -> Inertia:
    """Output link VZ, centre of mass at D on its own axis X'."""
    return Inertia.axial(p.output_mass, 3e-5, 4e-5, axis=(1.0, 0.0, 0.0), com=(p.head_offset, 0.0, 0.0))


def without_axial(part: Inertia, axis: int) -> Inertia:
    """The part without its moment of inertia about one of its axes (0, 1, 2), which a Shaft has instead."""
    t = list(part.tensor)
    t[axis] = 0.0
    return Inertia(part.mass, part.com, (t[0], t[1], t[2], 0.0, 0.0, 0.0))
