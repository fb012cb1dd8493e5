"""Geometry of the six-drive delta: lengths, leg directions and gear ratios; and the checks of input arrays that its closed
forms share.

Frames. Base frame: Z up, parallel to the three slider guides. The platform only translates; O is the point of the platform
where the three axes of the head meet. D = O + head_offset * e1 is the centre of the output link, e1 and e2 its unit X' and Y'
axes. Leg i has azimuth psi_i, r_i = (cos psi, sin psi), t_i = (-sin psi, cos psi).
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechlab.errors import MechlabError, NoSolution
from mechlab.lazy_dataclass import dataclass

FloatArray: TypeAlias = NDArray[np.float64]
BoolArray: TypeAlias = NDArray[np.bool_]


def vectors(name: str, value: ArrayLike, length: int = 3) -> FloatArray:
    """Finite float array of shape (..., length)."""
    array = finite(name, value)
    if array.ndim == 0 or array.shape[-1] != length:
        raise MechlabError(f"{name} has shape {array.shape}; expected (..., {length})")
    return array


def finite(name: str, value: ArrayLike) -> FloatArray:
    """Float array without NaN or infinity."""
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise MechlabError(f"{name} is not an array of numbers: {error}") from error
    if not np.all(np.isfinite(array)):
        raise MechlabError(
            f"{name} holds {np.count_nonzero(~np.isfinite(array))} values that are not finite; "
            "expected finite numbers. Mask them out first"
        )
    return array


def number(name: str, value: float, *, above: float = -math.inf) -> float:
    """Finite scalar greater than `above`."""
    try:
        result = float(value)
    except (TypeError, ValueError) as error:
        raise MechlabError(f"{name} = {value!r} is not a number") from error
    if not math.isfinite(result) or not result > above:
        wanted = "a finite number" if above == -math.inf else f"a finite number greater than {above:g}"
        raise MechlabError(f"{name} = {value!r}; expected {wanted}")
    return result


def demand(good: BoolArray, sentence: str, advice: str) -> None:
    """Raise NoSolution unless every element is good; the message has their number and the index of the first."""
    if np.all(good):
        return
    bad = np.argwhere(~good)
    where = f" (first at index {tuple(int(i) for i in bad[0])})" if good.ndim else ""
    raise NoSolution(f"{len(bad)} of {good.size} poses{where}: {sentence}. {advice}")


def apply(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    """Matrix times vector over leading axes: (..., m, n), (..., n) -> (..., m)."""
    return np.asarray(vector @ matrix.T if matrix.ndim == 2 else np.einsum("...ij,...j->...i", matrix, vector))


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Vector product over leading axes: (..., 3), (..., 3) -> (..., 3); three times faster than `np.cross`."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.subtract(a[..., j] * b[..., k], a[..., k] * b[..., j], out=out[..., i])
    return out


def freeze(rows: ArrayLike) -> FloatArray:
    """Read-only float array, so that no caller can change a shared constant."""
    array = np.array(rows, dtype=np.float64)
    array.flags.writeable = False
    return array


@dataclass(frozen=True)
class Delta6:
    """Parameters of the mechanism (metres, radians, ratios) and quantities derived from them.

    rod_length L; radial_offset rho and tangential_offset tau of a platform anchor from its guide;
    platform_radius and platform_height of the lower cross centres above O; slider_height of the slider above
    its upper cross centre; leg_azimuths psi; head_offset d from O to D. k_spur: drive 1 and 2 turns per turn of
    gamma; k_transfer: their turns per turn of beta; k_bevel: output gear to double bevel, so that
    k_transfer * k_bevel belongs to alpha. rotary_signs: +1 or -1 per rotary drive, -1 where the positive
    sense of the motor is opposite to that of `drive_matrix`.

    Raises MechlabError for values that are not finite, a rod that does not reach its home position
    (hypot(rho, tau) >= L), anchors on one line, a zero ratio, a sign other than +-1.
    """

    rod_length: float = 0.37
    radial_offset: float = 0.228
    tangential_offset: float = 0.003315
    platform_radius: float = 0.06
    platform_height: float = 0.06
    slider_height: float = 0.05
    leg_azimuths: tuple[float, float, float] = (-math.pi / 6, math.pi / 2, 7 * math.pi / 6)
    head_offset: float = 0.05
    k_spur: float = 1.4
    k_transfer: float = 0.783
    k_bevel: float = 1.0
    rotary_signs: tuple[int, int, int] = (1, 1, 1)

    def __post_init__(self) -> None:
        length = number("rod_length", self.rod_length, above=0.0)
        for name in (
            "radial_offset", "tangential_offset", "platform_radius", "platform_height", "slider_height", "head_offset",
            "k_spur", "k_transfer", "k_bevel"
        ):  # fmt: skip
            number(name, getattr(self, name))
        for name in ("k_spur", "k_transfer", "k_bevel"):
            if getattr(self, name) == 0.0:
                raise MechlabError(f"{name} = 0; expected a ratio other than zero, otherwise a drive moves nothing")
        for name in ("leg_azimuths", "rotary_signs"):
            if len(getattr(self, name)) != 3:
                raise MechlabError(f"{name} has {len(getattr(self, name))} entries; expected 3, one a leg")
        for azimuth in self.leg_azimuths:
            number("leg_azimuths", azimuth)
        if any(sign not in (-1, 1) for sign in self.rotary_signs):
            raise MechlabError(f"rotary_signs = {self.rotary_signs}; expected +1 or -1 for each drive")
        offset = math.hypot(self.radial_offset, self.tangential_offset)
        if offset >= length:
            raise MechlabError(
                f"rod_length = {length:g} m does not span the horizontal offset {offset:g} m of its "
                "ends at home; expected rod_length > hypot(radial_offset, tangential_offset)"
            )
        g = self.leg_offsets
        area = (g[1, 0] - g[0, 0]) * (g[2, 1] - g[0, 1]) - (g[1, 1] - g[0, 1]) * (g[2, 0] - g[0, 0])
        if abs(area) <= 1e-12 * length**2:
            raise MechlabError(
                f"leg_azimuths = {self.leg_azimuths} put the three leg offsets on one line; "
                "expected three different directions and a radial offset other than zero"
            )

    @cached_property
    def radial_directions(self) -> FloatArray:
        """r_i, shape (3, 2)."""
        return freeze([[math.cos(psi), math.sin(psi)] for psi in self.leg_azimuths])

    @cached_property
    def tangential_directions(self) -> FloatArray:
        """t_i, shape (3, 2)."""
        return freeze([[-math.sin(psi), math.cos(psi)] for psi in self.leg_azimuths])

    @cached_property
    def leg_offsets(self) -> FloatArray:
        """g_i = -rho r_i + tau t_i: horizontal vector from guide to platform anchor at O = 0, shape (3, 2)."""
        return freeze(
            -self.radial_offset * self.radial_directions + self.tangential_offset * self.tangential_directions
        )

    @cached_property
    def platform_anchors(self) -> FloatArray:
        """a_i = platform_radius r_i + platform_height z: lower cross centres minus O, shape (3, 3)."""
        heights = np.full((3, 1), self.platform_height)
        return freeze(np.hstack([self.platform_radius * self.radial_directions, heights]))

    @cached_property
    def guide_positions(self) -> FloatArray:
        """u_i = (platform_radius + rho) r_i - tau t_i: the vertical guides in the base plane, shape (3, 2)."""
        return freeze(
            (self.platform_radius + self.radial_offset) * self.radial_directions
            - self.tangential_offset * self.tangential_directions
        )

    @cached_property
    def home_height(self) -> float:
        """h at O = 0, sqrt(L^2 - rho^2 - tau^2): equal for the three legs."""
        return math.sqrt(self.rod_length**2 - self.radial_offset**2 - self.tangential_offset**2)

    @property
    def k_product(self) -> float:
        """k_transfer * k_bevel: turns of drives 1 and 2 per turn of alpha."""
        return self.k_transfer * self.k_bevel
