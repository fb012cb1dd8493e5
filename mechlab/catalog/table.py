"""The catalog as a table: names, titles, fidelities and scenes, without building a mechanism or loading what it needs.

A test compares each row with the Entry of its name.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One mechanism: the name of its module here, its title, its fidelities and scenes, and one sentence on it."""

    name: str
    title: str
    fidelities: tuple[str, ...]
    scenes: tuple[str, ...]
    summary: str


TABLE = (
    Row(
        "fourbar", "Four-bar linkage", ("kinematic", "minimal"),
        ("driven-crank", "free-run", "constant-torque"),
        "Planar four-bar: crank, coupler, rocker; both assembly modes.",
    ),
    Row(
        "class4_linkage", "Class IV linkage", ("kinematic", "minimal"),
        ("driven-crank", "free-run", "into-the-fold"),
        "Planar linkage with an Assur group of class IV: every assembly mode, limit positions, a driven turn.",
    ),
    Row(
        "platform_3rrr", "Planar platform 3-RRR", ("kinematic", "minimal"),
        ("driven-cranks", "free-run"),
        "Planar parallel robot (class III): all assembly modes, all working modes.",
    ),
    Row(
        "quick_return", "Quick-return mechanism", ("kinematic", "minimal"),
        ("driven-crank", "free-run"),
        "Shaper with a slotted lever: slow working stroke, quick return.",
    ),
    Row(
        "stephenson", "Stephenson six-bar", ("kinematic", "minimal"),
        ("driven-crank", "free-run"),
        "Four-bar with a dyad on its coupler point (Stephenson III); four assembly modes.",
    ),
    Row(
        "fivebar", "Five-bar", ("kinematic", "minimal"),
        ("driven-crank", "free-run"),
        "Planar five-bar with two driven cranks; both assembly modes.",
    ),
    Row(
        "planetary_stage", "Planetary stage", ("kinematic", "minimal", "parts", "full"),
        ("constant-torques",),
        "Sun, planets on a moving carrier and ring: gears as exact linear relations.",
    ),
    Row(
        "wolfrom", "Wolfrom train", ("kinematic", "minimal", "parts", "full"),
        ("constant-torques",),
        "A sun, stepped planets, a held and a turning ring: 116:1 in one stage, and what that costs in efficiency.",
    ),
    Row(
        "closed_differential", "Closed gear differential", ("kinematic", "minimal", "parts", "full"),
        (
            "constant-moments", "held-input-dry-load", "housing-drag", "internal-drag", "one-way-stop",
            "locked-pair", "motor-and-viscous-load", "constant-power", "backstop-two-range",
        ),
        "Two carriers joined by two blocks of gears, two freedoms, one input: the gear CVT of the source, on trial.",
    ),
    Row(
        "delta6", "6-DOF delta with cardan shafts and bevel head", ("kinematic", "minimal", "parts", "full"),
        ("pose-sweep", "head-tracking", "head-tracking-swapped", "gravity-hold", "pure-rotation", "toolpath"),
        "Three linear and three rotary drives; six rods, three of them cardan shafts; gears on moving carriers; a bevel head.",
    ),
    Row(
        "impulse_transmission", "Inertial-impulse transmission", ("minimal", "full"),
        (
            "fig2", "fig2-swapped", "fig4", "fig4-swapped", "fig5", "fig5-swapped", "fig7", "unidirectional",
            "sticking",
        ),
        "Unbalanced planets on a free carrier between two shafts: impulses turn the output against friction and load.",
    ),
    Row(
        "gear_linkage", "Three-gear four-bar", ("kinematic", "minimal"),
        ("constant-crank", "free-spin", "near-change-point", "knife-drive", "sheet-delivery", "glue-and-cut"),
        "Gears on the joints of a four-bar: an output that speeds up, dwells or runs back once a turn.",
    ),
    Row(
        "planetary", "Planetary gear with series planets", ("kinematic", "minimal", "parts", "full"),
        ("constant-torques",),
        "Sun, two planets in series on each ray, fixed central gear, all meshes external; ratio 1 + z4 / z1.",
    ),
    Row(
        "prosthetic_leg", "Above-knee prosthesis with elastic slides", ("minimal", "parts", "full"),
        ("swing", "stance-drop"),
        "Planar leg: hip hitch, split thigh and shin, knee, ankle; equations in transition matrices.",
    ),
    Row(
        "pendulum", "Simple pendulum (A01)", ("full",),
        ("swing",),
        "Benchmark A01: a point mass on a massless rod, released from the horizontal.",
    ),
    Row(
        "n_fourbar", "N four-bars (A02)", ("full",),
        ("fall",),
        "Benchmark A02: a row of N parallelograms that passes its singular position again and again.",
    ),
    Row(
        "andrews", "Andrews' squeezer (A03)", ("full",),
        ("squeeze",),
        "Benchmark A03: seven bodies, three loops, tiny lengths and high speed.",
    ),
    Row(
        "bricard", "Bricard's mechanism (A04)", ("full",),
        ("fall",),
        "Benchmark A04: an overconstrained spatial loop that moves nevertheless.",
    ),
    Row(
        "flyball", "Flyball governor (A05)", ("full",),
        ("spin",),
        "Benchmark A05: a governor with stiff spring-dampers; explicit methods need tiny steps.",
    ),
    Row(
        "slider_crank", "Slider-crank", ("full",),
        ("free-run",),
        "A slider-crank that runs freely from 10 rad/s: first-order methods lose its phase.",
    ),
)  # fmt: skip
"""All mechanisms of the catalog, in the order in which they are listed."""
