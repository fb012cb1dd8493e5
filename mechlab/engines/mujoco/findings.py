"""The health record of a MuJoCo run: what was seen of loops, dry friction, ends of ranges, soft rows and masses.

Soft constraints give way silently where nothing can close, so every sample is looked at for a loop that has opened. Rows of dry
friction creep instead of sticking. And MuJoCo divides by no number below mjMINVAL = 1e-15, moments of inertia among them, so
that a small light part becomes a heavier one without a word.
"""

from __future__ import annotations

import math
from typing import Protocol

import mujoco
import numpy as np

from mechlab.engines.mujoco.engine_warnings import engine_warnings
from mechlab.engines.mujoco.model import MujocoMap
from mechlab.engines.mujoco.stepping import SteppingEnd, length
from mechlab.experiment.energy import dissipation, energy_finding, work
from mechlab.experiment.findings import (
    OPEN_LOOP,
    friction_finding,
    kinematic_findings,
    open_loop_finding,
    restart_finding,
    saturation_finding,
    smallest_link,
)
from mechlab.experiment.held_rates import capture_finding
from mechlab.experiment.lag import lag_findings
from mechlab.experiment.ranges import limited_parts, met_ends, outside_start_finding
from mechlab.experiment.recording import Finding, Health
from mechlab.experiment.scene import Scene, Settings
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import Joint, Shaft, Spring

_KINDS = (int(mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF), int(mujoco.mjtConstraint.mjCNSTR_FRICTION_TENDON))
INSIDE = 1.0 - 1e-6
"""A force below this part of its bound is not at it."""


class FrictionWatch:
    """Records at every sample (after mj_forward) the rate of each joint or shaft with dry friction, and whether the
    friction force is below its bound, so that the load cannot break it away."""

    def __init__(self, map_: MujocoMap) -> None:
        model, m = map_.model, map_.mechanism
        joints = {int(map_.dof[s.start + k]): name for name, s in m.v_slice.items() for k in range(s.stop - s.start)}
        tendons = {k: name for name, k in map_.tendons.items()} if model.ntendon else {}
        self._rows = [(_KINDS[0], k, joints[k]) for k in np.flatnonzero(model.dof_frictionloss).tolist() if k in joints]
        self._rows += [
            (_KINDS[1], k, tendons[k]) for k in np.flatnonzero(model.tendon_frictionloss).tolist() if k in tendons
        ]
        self.names = tuple(name for *_, name in self._rows)
        self._layout = (-1, -1)
        self._rates: list[Array] = []
        self._standing: list[Array] = []

    def take(self, data: mujoco.MjData) -> None:
        """One sample."""
        if not self._rows:
            return
        if (data.ne, data.nf) != self._layout:  # the rows of friction keep their places while their number is the same
            self._layout = data.ne, data.nf
            found = [np.flatnonzero((data.efc_type == kind) & (data.efc_id == k)) for kind, k, _ in self._rows]
            self._known = np.array([len(x) > 0 for x in found])
            self._at = np.array([x[0] for x in found if len(x)], dtype=int)
        rates, standing = np.zeros(len(self._rows)), np.ones(len(self._rows), dtype=bool)
        rates[self._known] = data.efc_vel[self._at]
        standing[self._known] = np.abs(data.efc_force[self._at]) < INSIDE * data.efc_frictionloss[self._at]
        self._rates.append(rates)
        self._standing.append(standing)

    def cut(self, count: int) -> None:
        """Keep the first `count` samples alone."""
        del self._rates[count:], self._standing[count:]

    def finding(self, t: list[float], tolerance: float, timestep: float) -> Finding | None:
        """The finding "friction" of the run; None without dry friction."""
        how = f"is of first order in the step ({timestep:g} s) whatever the integrator, and creeps instead of sticking"
        return friction_finding(
            self.names, np.array(t), np.array(self._rates), np.array(self._standing, dtype=bool), tolerance, how
        )


LOOKED_AT = 250
"""Most samples that are examined where each costs a pass over the whole tree."""
UNEXPLAINED, SLIP_FLOOR = 3.0, 1e-6
"""Measured over predicted slip of gear rows above which the finding warns, and the slip [rad or m] below which it does not."""


class Samples(Protocol):
    """What the health record needs of the samples."""

    t: list[float]

    @property
    def states(self) -> tuple[Array, Array]:
        """Coordinates (n, nq) and rates (n, nv)."""
        ...

    @property
    def friction(self) -> FrictionWatch:
        """What was seen of dry friction."""
        ...

    @property
    def forces(self) -> dict[str, Array]:
        """Joint or shaft -> (n,) force."""
        ...

    @property
    def work(self) -> Array:
        """(n,) work of the laws."""
        ...

    @property
    def slip(self) -> tuple[float, float, float]:
        """Largest residual of the relations, measured and predicted, and the work in their soft rows [J]."""
        ...


def health(
    mechanism: Mechanism,
    scene: Scene,
    settings: Settings,
    data: mujoco.MjData,
    blow_up: SteppingEnd | None,
    samples: Samples,
) -> Health:
    """All findings of a run, the worst first where one ended it."""
    q, v = samples.states
    t = np.array(samples.t)
    some = np.unique(np.linspace(0, len(t) - 1, min(len(t), LOOKED_AT)).round().astype(int))
    out: list[Finding] = []
    if blow_up is not None:
        out.append(_blown(mechanism, blow_up, scene, settings))
    out += kinematic_findings(mechanism, q[some], v[some], keep_mode=scene.keep_mode)
    if mechanism.couplings:
        out += lag_findings(mechanism, scene, settings)
        out.append(_slip(*samples.slip[:2], scene.tolerance))
    lost = dissipation(mechanism, q, v)
    limited = limited_parts(mechanism)
    stopped = met_ends(mechanism, limited, t, q, v)
    if len(t) > 1:
        done = samples.work - work(t, lost)
        power = np.gradient(done, t)
        hit = np.maximum.reduceat(stopped.any(axis=0), some[:-1]) if len(stopped) else None
        out.append(
            energy_finding(
                mechanism,
                t[some],
                q[some],
                v[some],
                power[some],
                done[some],
                in_rows=samples.slip[2],
                stopped=hit,
                laws=scene.laws,
            )  # fmt: skip
        )
    names = [j for j, met in zip(limited, stopped, strict=True) if met.any()]
    if names:
        text = f"{', '.join(names)} reached the end of the range, where the engine has a soft stop that takes energy"
        out.append(Finding("range", float(len(names)), 0.0, "joints", "warning", text))
    rubbed = samples.friction.finding(samples.t, scene.tolerance, settings.timestep)
    some_more = (
        outside_start_finding(mechanism, q),
        saturation_finding(scene.laws, samples.forces),
        capture_finding(scene.laws, settings),
        rubbed,
    )
    out += [f for f in some_more if f is not None]
    restarted = restart_finding(mechanism, t, q, v)
    if restarted is not None:
        out.insert(0, restarted)
    out += engine_warnings(data)
    out += _notes(mechanism, settings)
    return Health(tuple(out))


def _blown(mechanism: Mechanism, blow_up: SteppingEnd, scene: Scene, settings: Settings) -> Finding:
    tips = [f"a smaller timestep (now {settings.timestep:g} s)"]
    parts: tuple[Joint | Shaft | Spring, ...] = (*mechanism.joints, *mechanism.shafts, *mechanism.springs)
    if any(x.stiffness or x.damping for x in parts) and settings.integrator != "discrete":
        tips.append("the preset 'stiff', which is implicit in springs and dampers of the mechanism (not in laws)")
    if scene.laws:
        tips.append("softer laws, such as smaller gains of a servo, or more inertia where it acts")
    text = f"the run blew up at t = {blow_up.t:.6g} s and was stopped: {blow_up.reason}. Try {', or '.join(tips)}"
    return Finding("blow_up", blow_up.t, scene.duration, "s", "error", text)


def _slip(measured: float, predicted: float, tolerance: float) -> Finding:
    """Finding on measured against predicted slip of soft rows. Slip that the loads do not explain is a motion of the
    rows themselves; it is an error where it exceeds the tolerance of the scene."""
    text = (
        f"softness alone predicts a slip of the relations of {predicted:.3g}, r = (1-d) tc^2 zeta^2 A f, standing; "
        f"measured {measured:.3g} rad or m"
    )
    if measured > max(UNEXPLAINED * predicted, SLIP_FLOOR):
        text += ": the loads do not explain it, the rows swing, or fight each other. Take a smaller timestep"
        severity = "error" if measured > tolerance else "warning"
        return Finding(
            "relation_softness", measured, max(UNEXPLAINED * predicted, tolerance), "rad or m", severity, text
        )
    return Finding("relation_softness", predicted, math.inf, "rad or m", "ok", text)


def _notes(mechanism: Mechanism, settings: Settings) -> list[Finding]:
    """What the user must know about the settings (a warning) and about where numbers come from."""
    out = []
    if settings.warning:
        out.append(Finding("settings", 0.0, 0.0, "", "warning", settings.warning))
    if settings.integrator == "discrete":
        text = "with the integrator 'discrete', accelerations and reactions are means over the next step: (v+ - v) / h"
        out.append(Finding("accelerations", 0.0, 0.0, "", "ok", text))
    if any(x.kind == "distance" for x in mechanism.loops):
        text = (
            "a distance loop is right in positions only, MuJoCo ignores dJ/dt v of a tendon: accelerations and "
            "reactions were computed at the samples from its mass matrix, forces and Jacobians"
        )
        out.append(Finding("distance_loops", 0.0, 0.0, "", "ok", text))
    return out


GAP_KINDS = ("spherical", "revolute", "universal", "fixed")
"""Loops whose two sides keep one point in common."""


class LoopWatch:
    """Checks after each evaluated sample whether a loop has opened by more than 1e-3 of the smallest link."""

    def __init__(self, map_: MujocoMap) -> None:
        self.map = map_
        self.limit = OPEN_LOOP * smallest_link(map_.mechanism)
        self.names = [x.name for x in map_.mechanism.loops if x.kind != "distance"]
        self.worst: tuple[float, float, str] | None = None
        self._watches = bool(self.names) and math.isfinite(self.limit)
        self._rows = -1

    def opened(self, t: float, data: mujoco.MjData) -> bool:
        """True when the distance between the two sides of any loop is beyond the limit; remembers which and how far."""
        if not self._watches:
            return False
        if data.ne != self._rows:  # the rows of equalities keep their places while their number is the same
            self._points = self.map.first_rows(data, self.names, 3)
            self._rows = data.ne
        if length(data.efc_pos[: data.ne]) <= self.limit:  # all rows together are closed enough
            return self.worst is not None
        gaps = np.linalg.norm(data.efc_pos[self._points], axis=1)
        k = int(np.argmax(gaps))
        if not gaps[k] <= self.limit:
            self.worst = (t, float(gaps[k]), self.names[k])
        return self.worst is not None

    def cut(self, t: float) -> None:
        """Forget a loop that opened after the time t [s]."""
        if self.worst is not None and self.worst[0] > t:
            self.worst = None

    def finding(self, duration: float) -> Finding | None:
        """The error finding "loop_open", or None when no loop opened."""
        if self.worst is None:
            return None
        t, gap, name = self.worst
        return open_loop_finding(t, gap, self.limit, duration, name)


MASS_LIMIT = 1e-6


def masses_finding(map_: MujocoMap, q: Array, data: mujoco.MjData | None = None) -> Finding | None:
    """Finding "engine_masses" (an error) where the engine's mass matrix at q (nq,) is not that of the mechanism; None where
    it is, within LIMIT of sqrt(M_ii M_jj), or where connectors that the mechanism lacks carry a part of the masses. data: scratch."""
    if len(map_.other_dof):
        return None
    data = mujoco.MjData(map_.model) if data is None else data
    data.qpos[:] = map_.engine_coordinates(q)
    mujoco.mj_fwdPosition(map_.model, data)
    own = TreeKinematics(map_.mechanism, q).mass_matrix()
    scale = np.sqrt(np.abs(np.diag(own)))
    off = np.abs(map_.mass_matrix(data) - own) / np.where(np.outer(scale, scale) > 0.0, np.outer(scale, scale), 1.0)
    worst = float(np.max(off, initial=0.0))
    if worst <= MASS_LIMIT:
        return None
    text = (
        f"MuJoCo's mass matrix is off by {worst:.2g} of its size: a moment of inertia below {mujoco.mjMINVAL:g} kg m2 is too "
        "small for this engine; do not trust this run. Take --engine pinocchio, or other units of length and mass"
    )
    return Finding("engine_masses", worst, MASS_LIMIT, "of its size", "error", text)
