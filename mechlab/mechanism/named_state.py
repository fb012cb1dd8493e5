"""States of a mechanism by the names and values that a user sees, and as arrays of its coordinates and rates.

q = value - zero     of a revolute or prismatic joint (0 in the reference pose);  a quaternion (w, x, y, z) is itself
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from mechlab.errors import MechlabError, unknown
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism

Named = Mapping[str, ArrayLike]


def coordinates_of(mechanism: Mechanism, values: Named) -> Array:
    """(nq,) coordinates for the physical values of all joints: a number [rad or m], or a quaternion (w, x, y, z), which is
    normalized. Shafts follow from joints and may be left in. Raises MechlabError that names what is missing, unknown or bad."""
    m = mechanism
    _complete(m, values, "value")
    q = m.reference()
    for joint in m.joints:
        x = _numbers(m, joint.name, values[joint.name], joint.nq)
        if joint.nv == 3:
            norm = float(np.linalg.norm(x))
            if norm < 1e-6:
                raise MechlabError(
                    f"{m.name}: joint {joint.name!r}: expected a quaternion (w, x, y, z), got {x.tolist()}."
                )
            x = x / norm
        q[m.q_slice[joint.name]] = x if joint.nv == 3 else x - joint.zero
    return q


def rates_of(mechanism: Mechanism, rates: Named) -> Array:
    """(nv,) rates of all joints [rad/s or m/s], three numbers of a spherical joint. Raises as `coordinates_of`."""
    m = mechanism
    _complete(m, rates, "rate")
    v = np.zeros(m.nv)
    for joint in m.joints:
        v[m.v_slice[joint.name]] = _numbers(m, joint.name, rates[joint.name], joint.nv)
    return v


def state_of(
    mechanism: Mechanism, values: Named | ArrayLike, rates: Named | ArrayLike | None = None
) -> tuple[Array, Array]:
    """Coordinates (nq,) and rates (nv,), each by name as above or already as an array, which is copied; rates default to 0.
    Raises as above, and for arrays of another length."""
    m = mechanism
    q = coordinates_of(m, values) if isinstance(values, Mapping) else numbers_of(m, values, m.nq, "coordinates q")
    if rates is None:
        return q, np.zeros(m.nv)
    return q, rates_of(m, rates) if isinstance(rates, Mapping) else numbers_of(m, rates, m.nv, "rates v")


def numbers_of(mechanism: Mechanism, given: ArrayLike, size: int, what: str) -> Array:
    """(size,) a copy of the numbers of a state. what: their name in the message of the MechlabError that any other shape raises."""
    try:
        out = np.array(given, dtype=float)
    except (TypeError, ValueError):
        raise MechlabError(f"{mechanism.name}: {what}: expected {size} numbers, got {given!r}.") from None
    if out.shape != (size,):
        of = ", ".join(j.name for j in mechanism.joints)
        raise MechlabError(f"{mechanism.name}: {what}: expected {size} numbers (joints {of}), got the shape {out.shape}.")
    return out


def named_values(mechanism: Mechanism, q: Array) -> dict[str, float | Array]:
    """Physical value of every joint and shaft; of a spherical joint its quaternion (w, x, y, z)."""
    m = mechanism
    out: dict[str, float | Array] = {n: float(m.value(n, q)) for n in m.scalar_names}
    return out | {j.name: np.array(q[m.q_slice[j.name]]) for j in m.joints if j.nv == 3}


def named_rates(mechanism: Mechanism, v: Array) -> dict[str, float | Array]:
    """Rate of every joint and shaft; of a spherical joint three numbers."""
    m = mechanism
    out: dict[str, float | Array] = {n: float(m.row(n) @ v) for n in m.scalar_names}
    return out | {j.name: np.array(v[m.v_slice[j.name]]) for j in m.joints if j.nv == 3}


def _complete(m: Mechanism, given: Named, what: str) -> None:
    names = [j.name for j in m.joints]
    missing = [n for n in names if n not in given]
    if missing:
        raise MechlabError(
            f"{m.name}: the {what} of {', '.join(missing)} is missing; a state has one for every joint. ml.solve finds the rest."
        )
    for name in given:
        if name not in names and name not in m.scalar_names:
            raise unknown(f"{m.name}: joint or shaft", name, [*names, *m.scalar_names])


def _numbers(m: Mechanism, name: str, given: ArrayLike, size: int) -> Array:
    x = np.atleast_1d(np.asarray(given, dtype=float))
    if x.shape != (size,) or not np.all(np.isfinite(x)):
        raise MechlabError(f"{m.name}: joint {name!r}: expected {size} finite numbers, got {given!r}.")
    return x
