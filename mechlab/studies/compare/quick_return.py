"""Quick returns at equal stroke and equal time of a turn: time ratio, speeds, accelerations and drive torque of the ram.

With the stroke S and the turn as units, s = stroke / S and u = crank angle / 2 pi: speed ds/du, acceleration d2s/du2. A constant cutting
force F on the slow stroke asks for the drive torque F ds/dphi (virtual work, no friction, no mass).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechlab.experiment.entry import Entry
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array
from mechlab.studies.compare.result import Column, Comparison, Panel, Row
from mechlab.studies.cycle.cycle import run_cycle

Flags = NDArray[np.bool_]
FAMILY = "quick-return"
POINTS = 360
RAMS = {"quick_return": "D_slide", "whitworth": "F_slide"}
"""The slide that is the ram."""
FOLLOWERS = {"drag_link": "follower_angle"}
"""A shaft that turns fully; a yoke on it moves the ram, s = cos(angle - offset), with the offset of the largest time ratio."""
VARIED: Mapping[str, tuple[str, str]] = {"quick_return": ("crank", "distance"), "whitworth": ("eccentricity", "crank")}
"""The parameter that sets the time ratio, sin a of the length that is named behind it."""
RATIOS = (1.25, 1.5, 1.75, 2.0, 2.25, 2.5)
"""Time ratios to which these are set, for the price of a quicker return."""
EQUAL = 2.0
"""Time ratio at which the designs of the table stand, where they can be set."""

COLUMNS = (
    Column("time_ratio", "slow : quick", "", "crank angle of the slow stroke over that of the quick one, at an even crank"),
    Column("peak_speed", "peak speed, slow", "strokes / turn", "largest speed on the slow stroke; 2 is an even stroke in half a turn", -1),
    Column("peak_return_speed", "peak speed, quick", "strokes / turn", "largest speed on the quick stroke", -1),
    Column("peak_acceleration", "peak acceleration", "strokes / turn2", "largest of the whole turn: the inertia of the ram", -1),
    Column("peak_torque", "peak drive torque", "force x stroke", "drive torque at a constant cutting force on the slow stroke, over that "
           "force and the stroke: peak speed / 2 pi", -1),
    Column("evenness", "mean over peak speed", "", "on the slow stroke; 1 would be an even cut", 1),
)  # fmt: skip
TEXT = (
    "All rams make the same stroke in the same time of a turn of an even crank, and cut with a constant force on the slow stroke. Where a "
    f"proportion sets the time ratio, it is set to {EQUAL:g}: (pi + 2 a) / (pi - 2 a) = {EQUAL:g} for a = 30 degrees, with sin a = "
    "crank / distance of the slotted lever and sin a = eccentricity / crank of Whitworth's.",
    "A quicker return makes the cut a little slower and is paid for on the way back, where speed and acceleration rise. The drag link has "
    "no ram in the catalog; its follower moves one by a yoke here.",
)


@dataclass(frozen=True, eq=False)
class Ram:
    """One turn of a ram at even steps of the crank: stroke s (n,), ds/dphi, d2s/dphi2 in units of the stroke, crank angle phi."""

    phi: Array
    s: Array
    rate: Array
    accel: Array

    @property
    def ends(self) -> tuple[float, float]:
        """Crank angles of the two ends of the stroke, where the rate crosses zero: of the least and of the largest s."""
        from scipy.interpolate import CubicSpline

        roots = CubicSpline(self.phi, self.rate, bc_type="periodic").roots(extrapolate=False)
        s = np.array(CubicSpline(self.phi, self.s, bc_type="periodic")(roots))
        return float(roots[s.argmin()]), float(roots[s.argmax()])

    @property
    def strokes(self) -> tuple[Flags, Flags, float]:
        """Samples of the slow and of the quick stroke, and the share of the turn that the slow one takes."""
        low, high = self.ends
        share = ((high - low) % (2 * pi)) / (2 * pi)
        out = (self.phi - low) % (2 * pi) < (high - low) % (2 * pi)
        return (out, ~out, share) if share > 0.5 else (~out, out, 1.0 - share)

    @property
    def numbers(self) -> dict[str, float | None]:
        """Key of COLUMNS -> number."""
        slow, quick, share = self.strokes
        cut = 2 * pi * float(np.abs(self.rate[slow]).max())
        return {
            "time_ratio": share / (1.0 - share), "peak_speed": cut,
            "peak_return_speed": 2 * pi * float(np.abs(self.rate[quick]).max()),
            "peak_acceleration": (2 * pi) ** 2 * float(np.abs(self.accel).max()),
            "peak_torque": cut / (2 * pi), "evenness": 1.0 / (share * cut),
        }  # fmt: skip

    def from_slow(self) -> tuple[Array, Array, Array]:
        """Turn from 0 to 1 from the beginning of the slow stroke on, s counted from there, and ds/du, positive on the slow stroke."""
        slow, _, share = self.strokes
        begin = self.ends[0 if abs((self.ends[1] - self.ends[0]) % (2 * pi) / (2 * pi) - share) < 1e-9 else 1]
        u = ((self.phi[:-1] - begin) % (2 * pi)) / (2 * pi)
        order = np.argsort(u)
        sign = float(np.sign(self.rate[slow].sum()))
        s = sign * self.s[:-1][order]
        return u[order], s - s.min(), 2 * pi * sign * self.rate[:-1][order]


def quick_returns(entries: Iterable[Entry]) -> Comparison:
    """The comparison of all entries with a ram, or a follower that a yoke can take its motion from."""
    rows, speed, force, price, skipped = [], {}, {}, {}, []
    for entry in entries:
        if entry.name not in RAMS and entry.name not in FOLLOWERS:
            skipped.append(entry.name)
            continue
        changed = set_to(entry, EQUAL)
        ram, difference = ram_of(entry, changed)
        rows.append(Row(entry.name, entry.title, ram.numbers, changed, difference))
        u, s, rate = ram.from_slow()
        speed[entry.title] = u, rate
        cutting = (rate > 0.0) & (s > 0.02) & (s < 0.98)
        force[entry.title] = s[cutting], 2 * pi / rate[cutting]
        if entry.name in VARIED:
            found = [ram_of(entry, set_to(entry, x), 180)[0].numbers for x in RATIOS]
            for key, words in (("peak_speed", "slow"), ("peak_return_speed", "quick")):
                price[f"{entry.title}, {words}"] = np.array(RATIOS), np.array([x[key] for x in found], dtype=float)
    panels = (
        Panel("Speed of the ram", "turn of the crank, from the beginning of the slow stroke", "speed [strokes / turn]", speed),
        Panel("Force at the ram for an even drive torque", "slow stroke", "force [torque / stroke]", force),
        Panel("What a quicker return costs", "time ratio slow : quick", "peak speed [strokes / turn]", price),
    )
    return Comparison(
        "quick-return", "Which quick return cuts most evenly?", TEXT, COLUMNS,
        tuple(sorted(rows, key=lambda r: r.values["peak_speed"] or 0.0)), panels, tuple(skipped),
    )  # fmt: skip


def set_to(entry: Entry, ratio: float) -> dict[str, float]:
    """The parameter that gives an entry a time ratio (pi + 2 a) / (pi - 2 a); {} where it has none in VARIED."""
    if entry.name not in VARIED:
        return {}
    varied, unit = VARIED[entry.name]
    return {varied: float(getattr(entry.parameters(), unit) * np.sin(0.5 * pi * (ratio - 1.0) / (ratio + 1.0)))}


def ram_of(entry: Entry, changed: Mapping[str, float], points: int = POINTS) -> tuple[Ram, float]:
    """The ram over one turn of the crank with a stroke of 1, and the largest difference of the witnesses."""
    from scipy.interpolate import CubicSpline

    p: Any = replace(entry.parameters(), **changed)
    m = entry.build(p, list(entry.fidelities)[-1])
    name = RAMS.get(entry.name) or FOLLOWERS[entry.name]
    cycle = run_cycle(m, drive="crank_angle", points=points)
    phi, s, rate, accel = (cycle[n] for n in ("crank_angle", name, f"{name}_rate", f"{name}_accel"))
    if entry.name in FOLLOWERS:
        s, rate, accel = _yoke(phi, s, rate, accel)
    s, rate, accel = (np.append(x[:-1], x[0]) for x in (s, rate, accel))  # a turn ends where it began, to rounding
    fine = CubicSpline(phi, s, bc_type="periodic")
    stroke = float(np.ptp(fine(fine.derivative().roots(extrapolate=False))))
    return Ram(phi, s / stroke, rate / stroke, accel / stroke), max(cycle.witnesses.values(), default=0.0)


def _yoke(phi: Array, angle: Array, rate: Array, accel: Array) -> tuple[Array, Array, Array]:
    """s = cos(angle - offset) with the offset for which half a turn of the follower takes the largest share of a turn."""
    turned = np.unwrap(angle)
    offsets = np.linspace(0.0, 2 * pi, 721)
    both = np.concatenate([turned, turned[1:] + turned[-1] - turned[0]])
    cranks = np.concatenate([phi, phi[1:] + 2 * pi])
    first = np.interp(turned[0] + offsets, both, cranks)
    half = np.interp(turned[0] + offsets + pi, np.concatenate([both, both[1:] + 2 * (turned[-1] - turned[0])]),
                     np.concatenate([cranks, cranks[1:] + 4 * pi]))
    offset = turned[0] + float(offsets[np.argmax(half - first)])
    x = turned - offset
    return np.cos(x), -np.sin(x) * rate, -np.sin(x) * accel - np.cos(x) * rate**2
