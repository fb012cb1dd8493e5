"""What the help of each verb ends with: two commands that run as they stand, in one folder, from the first verb to the last."""

from __future__ import annotations

from collections.abc import Mapping

EXAMPLES: Mapping[str, tuple[str, str]] = {
    "run": ("mechlab run fourbar -o out", "mechlab run pendulum length=0.5 -o out2"),
    "list": ("mechlab list", "mechlab list --family walking"),
    "show": ("mechlab show fourbar", "mechlab show delta6 --fidelity full"),
    "generate": ("mechlab generate fourbar crank=120mm -o .", "mechlab generate delta6 --fidelity full -o model"),
    "solve": (
        "mechlab solve fourbar crank_angle=60deg",
        "mechlab solve fourbar crank_angle=1 --tolerance crank=0.05mm",
    ),
    "simulate": ("mechlab simulate fourbar --duration 0.2 -o run.npz", "mechlab simulate pendulum --max-error 0.1mm"),
    "sweep": (
        "mechlab sweep fourbar crank=80mm:120mm:5 crank_angle=1 --quantity rocker_angle",
        "mechlab sweep fourbar crank_angle_rate_0=5:15:3 --scene free-run --duration 0.2 --quantity crank_angle,trusted",
    ),
    "cycle": ("mechlab cycle slider_crank --points 36", "mechlab cycle fourbar crank_angle_rate=10 -o cycle.csv"),
    "track": (
        "mechlab track delta6 D_x=0:20mm:5 D_y=0",
        "mechlab track delta6 D_x=0:20mm:5 D_z=0 --duration 1 -o path.npz",
    ),
    "check": ("mechlab check fourbar", "mechlab check hoeken peaucellier"),
    "claims": ("mechlab claims class4_linkage", "mechlab claims planetary"),
    "chart": ("mechlab chart planetary_stage --fidelities", "mechlab chart pendulum --duration 0.2 -o chart.svg"),
    "modes": ("mechlab modes fourbar", "mechlab modes prosthetic_leg --html modes.html"),
    "stability": (
        "mechlab stability n_fourbar --map singularity --budget 2",
        "mechlab stability fourbar --map softness --budget 2 -o maps",
    ),
    "synthesize": (
        "mechlab synthesize planetary ratio=6 planets=3",
        "mechlab synthesize path x=0,.03,.06,.09,.09,.09 y=0,0,0,0,.03,.06 chain=six-bar limit=1",
    ),
    "compare": ("mechlab compare quick-return", "mechlab compare straight-line -o compare.html"),
    "optimize": (
        "mechlab optimize fourbar crank=60mm:120mm --minimize cycle.peak.crank_angle_force --evaluations 40 crank_angle_rate=20",
        "mechlab optimize hoeken crank=40mm:60mm --minimize crank --evaluations 40",
    ),
    "workspace": (
        "mechlab workspace fivebar left_angle=1:2:9 right_angle=1:2:9",
        "mechlab workspace delta6 -o maps.npz",
    ),
    "doctor": ("mechlab doctor fourbar.xml", "mechlab doctor fourbar.xml --fix -o cured.xml"),
    "fit": (
        "mechlab fit fourbar measured.csv crank=80mm:130mm --scene constant-torque",
        "mechlab fit fourbar measured.csv --free mass_per_length --scene constant-torque -o fit",
    ),
    "view": ("mechlab view fourbar --html fourbar.html", "mechlab view run.npz --csv run.csv"),
}
