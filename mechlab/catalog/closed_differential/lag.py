"""How far MuJoCo's soft gear rows will lag, before a run: the sentences that warn."""

from __future__ import annotations

import numpy as np

from mechlab.analytic import differential as closed
from mechlab.catalog.closed_differential.parameters import Parameters
from mechlab.catalog.closed_differential.witnesses import numpy_machine
from mechlab.experiment.scene import PRESETS, Settings

LAG_LIMIT = 1e-3
"""Lag [rad] above which a warning is given."""


def predicted_lag(p: Parameters, fidelity: str, settings: Settings | None = None) -> dict[str, float]:
    """Relation -> predicted |residual| [rad of the wheel it turns] under M_H1 and M_H2 with rows as soft as `settings`
    (default: the preset `accurate`) make them."""
    chosen = settings or PRESETS["accurate"]
    solref, solimp = chosen.solref or (0.02, 1.0), chosen.solimp or (0.9, 0.95, 0.001, 0.5, 2.0)
    made = numpy_machine(p, fidelity)
    force = made.applied(w_H1=p.M_H1, w_H2=-p.M_H2)
    lag = closed.predicted_lag(made.mass, made.rows, force, solref[0], solimp[1], solref[1])
    return dict(zip([r.name for r in made.mechanism.relations], lag.tolist(), strict=True))


def warnings(p: Parameters) -> tuple[str, ...]:
    """Sentences on doubtful parameters: lag of soft rows, planets that cannot stand evenly or touch each other."""
    out = []
    for fidelity in ("parts", "full"):
        lag = predicted_lag(p, fidelity)
        worst = max(lag, key=lambda name: lag[name])
        if not lag[worst] <= LAG_LIMIT:
            out.append(
                f"in fidelity {fidelity!r} MuJoCo's soft rows are predicted to lag by {lag[worst]:.3g} rad at {worst} "
                f"(limit {LAG_LIMIT:g}): light parts under load; take fidelity 'minimal', which has no rows"
            )
    for stage, found in zip((1, 2), closed.conditions(p.train, p.planets), strict=True):
        sun, ring = p.teeth[3 * stage - 3], p.teeth[3 * stage - 1]
        if not found.even:
            out.append(
                f"stage {stage}: {p.planets} planets cannot stand at equal angles, ({sun} + {ring})/{p.planets} is not "
                "whole; they are drawn at the nearest angles at which the teeth fit"
            )
        if not found.neighbours:
            out.append(
                f"stage {stage}: {p.planets} planets of {p.teeth[3 * stage - 2]} teeth touch each other; take fewer"
            )
    if not np.isfinite(p.module):
        out.append("module is not finite")
    return tuple(out)
