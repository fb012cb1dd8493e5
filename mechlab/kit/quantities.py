"""Quantities of a mechanism by name, and their keys; their values and rows are those of `mechlab.mechanism.named_rows`.

Names: a joint or shaft X, X_rate, X_accel; a point FRAME_x of a frame, FRAME_x_rate, FRAME_x_accel; its angular velocity FRAME_wx
and angular acceleration FRAME_wx_rate, world axes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mechlab.errors import unknown
from mechlab.mechanism import Mechanism
from mechlab.mechanism.named_rows import LETTERS

SUFFIXES = ("", "_rate", "_accel")


def quantities(m: Mechanism) -> tuple[str, ...]:
    """All quantities that can be given or asked for."""
    names = list(m.scalar_names) + [f"{f.name}_{a}" for f in m.frames for a in LETTERS[:3]]
    spins = [f"{f.name}_{a}" for f in m.frames for a in LETTERS[3:]]
    return (
        *names,
        *(f"{n}_rate" for n in names),
        *(f"{n}_accel" for n in names),
        *spins,
        *(f"{n}_rate" for n in spins),
    )


def level(m: Mechanism, key: str) -> tuple[str, int]:
    """The joint, shaft or frame coordinate of a quantity, and its order: 0 value, 1 rate, 2 acceleration.

    Raises MechlabError for a name that is no quantity of the mechanism.
    """
    spins = {f"{f.name}_{a}" for f in m.frames for a in LETTERS[3:]} - set(m.scalar_names)
    if key in spins:
        return key, 1
    if key.removesuffix("_rate") in spins:
        return key.removesuffix("_rate"), 2
    plain = {*m.scalar_names, *(f"{f.name}_{a}" for f in m.frames for a in (*LETTERS[:3], "rotation"))}
    if key in plain:
        return key, 0
    for order, suffix in enumerate(SUFFIXES):
        if order and key.endswith(suffix) and key.removesuffix(suffix) in plain:
            return key.removesuffix(suffix), order
    raise unknown(f"{m.name}: quantity", key, quantities(m))


def key_of(m: Mechanism, name: str, order: int) -> str:
    """The key of a joint, shaft or frame coordinate at a level: the inverse of `level`."""
    frames = {f.name for f in m.frames}
    frame, _, letter = name.rpartition("_")
    spin = letter in LETTERS[3:] and frame in frames and name not in m.scalar_names
    return name + SUFFIXES[order - 1 if spin else order]


def split(m: Mechanism, values: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, float], dict[str, float]]:
    """Given quantities as values, rates and accelerations, keyed by joint, shaft or frame coordinate."""
    out: tuple[dict[str, Any], dict[str, float], dict[str, float]] = ({}, {}, {})
    for key, value in values.items():
        name, order = level(m, key)
        out[order][name] = value
    return out
