"""Involute teeth as outlines: radius and half angle of a tooth from root to tip, outlines of whole gears and racks.

Rack-generated profile (ISO 53): addendum m, dedendum 1.25 m, pressure angle alpha. The tooth half angle is
    psi(r) = s / (2 rp) + inv(alpha) - inv(alpha_r),   cos(alpha_r) = rb / r,   inv(x) = tan x - x
above the form circle; below it the root is the trochoid that the sharp corner of the rack cuts, so pinions of fewer
than 2.5 / sin(alpha)^2 teeth (21 at 20 degrees) come out undercut (Litvin & Fuentes, Gear Geometry, ch. 6).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass

Array = NDArray[np.float64]
ADDENDUM, DEDENDUM = 1.0, 1.25  # in modules
LEAST_LAND = 0.1  # tip land that a pointed tooth is shortened to [modules]


def involute(angle: float | Array) -> Array:
    """inv(x) = tan x - x."""
    return np.asarray(np.tan(angle) - angle)


@dataclass(frozen=True)
class Teeth:
    """A toothed circle: `number` of teeth (a fraction for the virtual gear of a bevel gear), lengths in metres.

    `backlash` is taken off the tooth thickness at the pitch circle, pi m / 2 + 2 shift tan(alpha) - backlash.
    """

    number: float
    module: float
    pressure_angle: float = math.radians(20.0)
    backlash: float = 0.0
    shift: float = 0.0

    def __post_init__(self) -> None:
        if not math.radians(10.0) <= self.pressure_angle <= math.radians(30.0):
            raise MechlabError(f"gear: pressure_angle must lie within 10..30 degrees, got {self.pressure_angle:g} rad.")
        if not 0.0 <= self.backlash < 0.5 * self.module:
            raise MechlabError("gear: backlash must lie within 0..0.5 modules.")
        if not -0.5 <= self.shift / self.module <= 1.0:
            raise MechlabError("gear: profile_shift must lie within -0.5..1 modules.")

    @property
    def pitch(self) -> float:
        """Pitch radius m z / 2 [m]."""
        return 0.5 * self.module * self.number

    @property
    def base(self) -> float:
        """Base radius rp cos(alpha) [m]."""
        return self.pitch * math.cos(self.pressure_angle)

    @property
    def thickness(self) -> float:
        """Tooth thickness along the pitch circle [m]."""
        return 0.5 * math.pi * self.module + 2.0 * self.shift * math.tan(self.pressure_angle) - self.backlash

    def flank(self, r: Array) -> Array:
        """Half angle [rad] of the involute tooth at radii r >= base."""
        at = np.arccos(np.minimum(self.base / r, 1.0))
        return 0.5 * self.thickness / self.pitch + involute(self.pressure_angle) - involute(at)

    def fillet(self, r: Array) -> Array:
        """Half angle [rad] that the corner of the rack leaves at radii r between root and tip."""
        rho = self.root
        corner = 0.25 * math.pi * self.module - DEDENDUM * self.module * math.tan(self.pressure_angle)
        corner = corner + 0.5 * self.backlash
        u = np.sqrt(np.maximum(r * r - rho * rho, 0.0))
        return math.pi / self.number - (np.arctan(u / rho) + (corner - u) / self.pitch)

    @property
    def root(self) -> float:
        """Root radius of an external gear [m]."""
        return self.pitch - DEDENDUM * self.module + self.shift

    @property
    def tip(self) -> float:
        """Tip radius of an external gear [m]: addendum m, less where the tooth would be pointed."""
        full = self.pitch + ADDENDUM * self.module + self.shift
        half = 0.5 * LEAST_LAND * self.module
        return _where_zero(lambda r: float(self.flank(np.array(r))) * r - half, max(self.base, self.pitch), full)

    @property
    def form(self) -> float:
        """Radius where the involute begins: tangent to the fillet, or where the undercut meets it [m]."""
        depth = DEDENDUM * self.module - self.shift
        rho = self.pitch * math.sin(self.pressure_angle) - depth / math.sin(self.pressure_angle)
        if rho >= 0.0:
            return math.hypot(self.base, rho)
        return _where_zero(lambda r: float(self.fillet(np.array(r)) - self.flank(np.array(r))), self.tip, self.base)


def _where_zero(f: Callable[[float], float], good: float, bad: float) -> float:
    """`bad` if f(bad) >= 0; else by bisection the border where f, at least 0 at `good`, becomes negative."""
    if f(bad) >= 0.0:
        return bad
    for _ in range(60):
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if f(middle) >= 0.0 else (good, middle)
    return good


def tooth(teeth: Teeth, finer: int = 1) -> tuple[Array, Array]:
    """Radii (k,) from root to tip and half angles (k,) of an external tooth; one radius is the pitch radius exactly.

    finer: chords of a flank for each that a mesh has.
    """
    few = teeth.number > 45.0
    form, pitch, tip = teeth.form, teeth.pitch, teeth.tip
    below = teeth.root + (form - teeth.root) * np.linspace(0.0, 1.0, (2 if few else 3) * finer + 1) ** 2
    low = _between(teeth, form, min(pitch, tip), (1 if few else 2) * finer + 1) if form < pitch < tip else np.array([form])
    high = _between(teeth, max(pitch, form), tip, 2 * finer + 1)
    radii = np.concatenate([below[:-1], low[:-1], high])
    rolled = radii >= form
    return radii, np.where(rolled, teeth.flank(np.maximum(radii, teeth.base)), teeth.fillet(radii))


def ring_tooth(teeth: Teeth) -> tuple[Array, Array]:
    """Radii from root (outside) to tip (inside) and half angles of a tooth of an internal gear."""
    space = Teeth(teeth.number, teeth.module, teeth.pressure_angle, 0.0, teeth.shift)
    widened = 0.5 * teeth.backlash / teeth.pitch
    # shorter teeth keep the tip of the ring off the root fillets of small pinions (handbook rule 1 - 7.55 / z)
    addendum = min(0.8, 1.0 - 7.55 / teeth.number) * teeth.module
    tip = max(teeth.pitch - addendum + teeth.shift, 1.0005 * teeth.base)
    if not teeth.base < tip < teeth.pitch:
        raise MechlabError(f"internal_gear: {teeth.number:g} teeth are too few for this pressure angle.")
    half = 0.5 * LEAST_LAND * teeth.module
    full = teeth.pitch + DEDENDUM * teeth.module + teeth.shift
    root = _where_zero(lambda r: float(space.flank(np.array(r))) * r - half, teeth.pitch, full)
    radii = np.concatenate([_between(teeth, teeth.pitch, root, 4)[::-1], _between(teeth, tip, teeth.pitch, 3)[-2::-1]])
    return radii, math.pi / teeth.number - space.flank(radii) - widened


def _between(teeth: Teeth, low: float, high: float, points: int) -> Array:
    """Radii in equal steps of the roll angle sqrt((r / rb)^2 - 1), where chords of the involute err least."""
    rb = teeth.base
    roll = np.linspace(math.sqrt(max((low / rb) ** 2 - 1.0, 0.0)), math.sqrt((high / rb) ** 2 - 1.0), points)
    radii = rb * np.sqrt(1.0 + roll**2)
    radii[0], radii[-1] = low, high
    return radii


def teeth_of(number: float, module: float, pressure_angle: float, backlash: float, profile_shift: float = 0.0) -> Teeth:
    """Teeth from the parameters of a kind, where backlash and profile shift are multiples of the module."""
    return Teeth(number, module, pressure_angle, backlash * module, profile_shift * module)


def around(radii: Array, halves: Array, number: int, phase: float, stretch: float = 1.0) -> tuple[Array, Array]:
    """Radii and azimuths (number, 2 k) of all teeth: up the right flank, down the left one, counter-clockwise."""
    r = np.concatenate([radii, radii[::-1]])
    side = stretch * np.concatenate([-halves, halves[::-1]])
    azimuth = phase + 2.0 * math.pi * np.arange(number)[:, None] / number + side
    return np.broadcast_to(r, azimuth.shape), azimuth


def tooth_faces(loop: NDArray[np.int64], number: int) -> NDArray[np.int64]:
    """Triangles (m, 3) over every tooth of an outline loop (number * 2 k,): rungs from flank to flank."""
    rows = loop.reshape(number, -1)
    k = rows.shape[1]
    a, b = rows[:, : k // 2 - 1], rows[:, 1 : k // 2]
    c, d = rows[:, ::-1][:, 1 : k // 2], rows[:, ::-1][:, : k // 2 - 1]
    return np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)


def feet(loop: NDArray[np.int64], number: int) -> NDArray[np.int64]:
    """The two root corners of every tooth of an outline loop: the border between teeth and gear body."""
    return loop.reshape(number, -1)[:, [0, -1]].ravel()


def spur_outline(teeth: Teeth, phase: float = 0.0, finer: int = 1) -> Array:
    """(n, 2) counter-clockwise outline of a spur gear, a tooth at angle `phase`; corners lie on the true profile (finer: see `tooth`)."""
    r, t = around(*tooth(teeth, finer), int(teeth.number), phase)
    return np.column_stack([(r * np.cos(t)).ravel(), (r * np.sin(t)).ravel()])


def internal_outline(teeth: Teeth, phase: float = 0.0) -> Array:
    """(n, 2) counter-clockwise outline of the hole in an internal gear, a tooth centred at angle `phase`."""
    r, t = around(*ring_tooth(teeth), int(teeth.number), phase)
    return np.column_stack([(r * np.cos(t)).ravel(), (r * np.sin(t)).ravel()])


def rack_outline(
    teeth: int, module: float, height: float, pressure_angle: float, backlash: float, phase: float
) -> Array:
    """(n, 2) counter-clockwise outline of a rack: teeth along x, pitch line y = 0, a tooth at x = `phase` pitches."""
    pitch, slope = math.pi * module, math.tan(pressure_angle)
    half = 0.25 * pitch - 0.5 * backlash * module
    tip, foot = half - module * slope, half + 1.25 * module * slope
    centers = pitch * (np.arange(teeth) - (teeth - 1) // 2 + phase)
    shape = np.array([[-foot, -1.25 * module], [-tip, module], [tip, module], [foot, -1.25 * module]])
    top = (shape + np.column_stack([centers, 0.0 * centers])[:, None, :]).reshape(-1, 2)
    ends = [(centers[0] - 0.5 * pitch, -1.0), (centers[-1] + 0.5 * pitch, 1.0)]
    low = -1.25 * module - height
    frame = [np.array([[x, -1.25 * module], [x, low]][:: -1 if s < 0 else 1]) for x, s in ends]
    return np.concatenate([frame[0], top, frame[1]])[::-1]
