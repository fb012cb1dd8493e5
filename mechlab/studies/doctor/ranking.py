"""What each finding does to a user's results, and which are the gravest: the order of a diagnosis."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from mechlab.experiment.recording import Symptom
from mechlab.studies.doctor.case import ORDER

CONSEQUENCES = {
    "refused": "nothing can be run.",
    "massless": "nothing can be run: a body without inertia has an infinite acceleration.",
    "triangle": "nothing can be run, or a gyroscopic motion that no body has.",
    "tree": "one of the two joints is lost; the robot is another machine.",
    "not_meshes": "inertias that come from meshes, and contacts, are not examined.",
    "degrees": "joints are locked within a few degrees, or are free where they should stop.",
    "millimetres": "the motion is that of a model a thousand times as large: slower by a factor of 30.",
    "inertia_unit": "bodies hardly turn, whatever drives them.",
    "gravity_unit": "times, forces and torques are in other units than their readers expect.",
    "memory": "parts go through each other, or loops and stops do not hold, while the run goes on.",
    "trial": "positions at its end are wrong; those of longer runs are worse.",
    "pushed": "it will show as soon as something moves the mechanism.",
    "unstable_step": "the run blows up, or a limit hides that it does.",
    "locked": "forces do not move it; what motion there is, is softness.",
    "nearly_redundant": "the mechanism is locked, or its reactions are arbitrarily large.",
    "gap": "the first steps jump, with an energy that nothing in the mechanism has.",
    "sparse_jacobian": "accelerations, and with them motions and forces, are wrong without a warning.",
    "armature_across_branches": "the rotor's inertia acts on one side only: frequencies and reactions are off.",
    "damping_across_branches": "momentum is not conserved.",
    "stiff_equalities": "the run blows up.",
    "soft_equalities": "parts that should move together do not; the error does not vanish with the timestep.",
    "sag": "the tool hangs away from its place under its own weight.",
    "contacts": "a force that no drive gives pushes the parts, and heats or jams the loop.",
    "fast_activation": "commands are distorted, or the actuator oscillates.",
    "refsafe": "the softness differs between runs with different timesteps.",
    "softer_than_it_could_be": "loops give way more than they need to.",
    "beyond_range": "the first steps are a kick; a policy or controller learns it.",
    "control_beyond_range": "a command can press the joint against its stop with the full force of the actuator.",
    "still_masses": "the loop tears, or the run loses its energy, within some hundred steps.",
    "singular_reference": "a start at rest may go on in either way, decided by rounding.",
    "freedoms_differ": "one of the two counts misreads the file.",
    "curved_equality": "forces and accelerations of this coupling are off by its curvature times the speed squared.",
    "held_friction": "losses that the file writes down are missing in the run.",
    "masses_changed": "torques and accelerations are those of other masses.",
    "switched_off": "the loop is open in a run, unless a program closes it.",
    "first_order": "phase and energy drift in proportion to the timestep.",
    "lost_order": "smaller timesteps pay less than they should.",
    "first_order_activation": "RK4 costs four times as much and gains nothing here.",
    "mimic": "another tool runs another machine.",
    "fixed_range": "one tool locks the joint, another lets it turn.",
    "joint_kind": "some tools refuse the file.",
    "spins": "the count of freedoms is larger than that of the mechanism; linearizations and inverse dynamics meet singular motions.",
    "mocap_weld": "the weld lags behind what drags it; that is its purpose.",
    "soft_friction": "what should stick creeps, which matters for stick-slip and holding brakes, and for little else.",
    "autoreset": "a blow-up looks like a run.",
    "continuous": "code that takes q by number reads another joint.",
    "pinocchio_reader": "the same file is another machine there.",
}  # fmt: skip
"""By name, the gravest first."""
_RANK = {name: k for k, name in enumerate(CONSEQUENCES)}


def ranked(findings: Iterable[Symptom]) -> tuple[Symptom, ...]:
    """The findings by severity, then by what they do; each with its consequence."""
    known = [f if f.consequence else replace(f, consequence=CONSEQUENCES.get(f.name, "")) for f in findings]
    return tuple(sorted(known, key=lambda f: (ORDER[f.severity], _RANK.get(f.name, len(_RANK)))))
