"""The Recording of a hybrid run: channels, health, and how often what stuck."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mechlab.errors import MechlabError
from mechlab.experiment.energy import energy_finding
from mechlab.experiment.health import Finding, Health
from mechlab.experiment.observe import kinematic_findings, saturation_finding
from mechlab.experiment.recording import Cost, Recording
from mechlab.experiment.scene import Scene
from mechlab.experiment.settings import Settings
from mechlab.integrate import HybridTrajectory
from mechlab.mechanism.model import Mechanism
from mechlab.solve.channels import channels
from mechlab.solve.equations import BlowUp
from mechlab.solve.hybrid.equations import RoughEquations
from mechlab.solve.runner import versions


def recording_of(
    mechanism: Mechanism,
    scene: Scene,
    settings: Settings,
    motion: RoughEquations,
    parts: list[HybridTrajectory],
    end: BlowUp | None,
    spent: float,
) -> Recording:
    """The samples of all parts in one Recording; `end` is what stopped the run early. Raises MechlabError when there is
    no part at all."""
    if not parts:
        assert end is not None
        raise MechlabError(f"{mechanism.name}: the hybrid run cannot start: {end.reason}.")
    t = np.concatenate([parts[0].t[:1], *(p.t[1:] for p in parts)])
    y = np.vstack([parts[0].y[:1], *(p.y[1:] for p in parts)])
    modes = np.vstack([parts[0].modes[:1], *(p.modes[1:] for p in parts)])
    instants = []
    for now, state, mode in zip(t, y, modes, strict=True):
        motion.modes = tuple(int(m) for m in mode)
        instants.append(motion.instant(now, motion.project(now, state)))
    q, v = y[:, : mechanism.nq], y[:, mechanism.nq : mechanism.nq + mechanism.nv]
    found, units = channels(motion.plant, t, q, v, instants)
    findings = list(kinematic_findings(mechanism, q, v))
    findings.append(
        energy_finding(mechanism, t, q, v, np.array([x.power for x in instants]), y[:, -1], laws=scene.laws)
    )
    forces = {n: found[f"{n}_force"] for n in mechanism.scalar_names if f"{n}_force" in found}
    limited = saturation_finding(scene.laws, forces)
    if limited is not None:
        findings.append(limited)
    findings.append(_friction(motion, parts))
    if end is not None:
        text = f"the run stopped at t = {end.t:.6g} s of {scene.duration:g} s: {end.reason}"
        findings.insert(0, Finding("blow_up", end.t, scene.duration, "s", "error", text))
    evaluations = sum(p.evaluations for p in parts)
    return Recording(
        mechanism=mechanism, t=t, q=q, v=v, channels=found, units=units, health=Health(tuple(findings)),
        cost=Cost(spent, sum(p.steps for p in parts), evaluations), settings=replace(settings, integrator="DOP853"),
        scene=scene.name, name=mechanism.name, fidelity=scene.fidelity, versions=versions(),
    )  # fmt: skip


def _friction(motion: RoughEquations, parts: list[HybridTrajectory]) -> Finding:
    """How often what stuck, and for how long."""
    names = motion.plant.passive.friction_names
    if not names:
        return Finding("friction", 0.0, 0.0, "events", "ok", "no dry friction: plain DOP853")
    stuck = np.sum([p.stuck_time for p in parts], axis=0)
    events = sum(len(p.events) for p in parts)
    spans = ", ".join(f"{n} stood still for {float(s):.6g} s" for n, s in zip(names, stuck, strict=False))
    text = f"dry friction was followed through {events} events without smoothing; {spans}"
    return Finding("friction", float(events), 0.0, "events", "ok", text)
