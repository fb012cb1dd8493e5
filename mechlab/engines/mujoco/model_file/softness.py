"""How soft the loops and couplings of a MuJoCo model are with the values of its file, as the engine applies them.

A row is a spring and damper of its own inertia, behind an impedance d <= .9999: standing under a load f it gives way by
r = (1 - d) tc^2 zeta^2 A f. With solref "2h 1" it hardens as the timestep falls; with a fixed tc it does not.
Measured with MuJoCo 4.0.0: default softness leaves a four-bar 0.1 to 1.7 rad wrong after 1 s at every timestep.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping

import mujoco
import numpy as np

from mechlab.engines.mujoco.control import engine
from mechlab.engines.mujoco.model_file.rows import active, drags, equality_name, loops
from mechlab.engines.mujoco.model_file.start import start_data
from mechlab.experiment.recording import Symptom
from mechlab.mechanism.geometry import Array
from mechlab.tables import listed

SOFT_TIMECONST, HARD_TIMECONST = 0.01, 4.0
"""A time constant [s] from which on rows are soft at any timestep; and that, in timesteps, up to which they are hard."""
SOFT_IMPEDANCE, HARD_IMPEDANCE = 0.99, 0.999
RK4_LIMIT = 4.0
"""Largest k h^2 of a direct stiffness k [1/s^2] that RK4 was measured to survive; first-order integrators: 1."""
SAG, TORN = 1e-4, 1e-2
"""Sag of a row under the load of the start, over the size of the model: reported above SAG, an error above TORN."""
FAR_FROM_SEEN = 3.0
"""A predicted sag that is larger by this factor than what a run shows is not reached: in the time of a run a row gives way by half."""
IMPEDANCE = ".9999 .9999 .001 .5 2"


def equality_default(timestep: float) -> str:
    """The default class that makes every equality without a solref of its own hard."""
    return f'<default><equality solref="{2 * timestep:g} 1" solimp="{IMPEDANCE}"/></default>'


def softness(model: mujoco.MjModel, harmless: bool = False) -> Iterator[Symptom]:
    """Findings "soft_equalities", "softer_than_it_could_be", "refsafe", "stiff_equalities", "still_masses", "switched_off", "mocap_weld".

    harmless: a run has shown that the softness of this file changes its motion by less than matters.
    """
    h = float(model.opt.timestep)
    soft, middling = [], []
    for k in loops(model):
        tc, d = _timeconst(model, k), float(model.eq_solimp[k, 1])
        if tc >= SOFT_TIMECONST and tc > HARD_TIMECONST * h or d < SOFT_IMPEDANCE:
            soft.append(k)
        elif tc > HARD_TIMECONST * h or d < HARD_IMPEDANCE:
            middling.append(k)
    paste = equality_default(h)
    if soft:
        k = soft[0]
        text = (
            f"{_say(model, soft)}: time constant {_timeconst(model, k):g} s and impedance {model.eq_solimp[k, 1]:g}"
            f"{' (the defaults)' if _is_default(model, k) else ''}. Rows this soft do not converge at any timestep"
        )
        text += "; a short run of this file shows little of it." if harmless else ": the motion stays wrong however small the step."
        yield Symptom("soft_equalities", "warning" if harmless else "error", text, paste, _timeconst(model, k))
    if middling:
        k = middling[0]
        text = (
            f"{_say(model, middling)}: time constant {_timeconst(model, k) / h:.3g} timesteps, impedance "
            f"{model.eq_solimp[k, 1]:g}; 2 timesteps and .9999 are the hardest that hold."
        )
        yield Symptom("softer_than_it_could_be", "note" if harmless else "warning", text, paste, _timeconst(model, k) / h)
    yield from _refsafe(model, h)
    still = [k for k in loops(model) if _still_masses(model, k)]
    if still and not model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_DIAGEXACT:
        text = (
            f"{_say(model, still)} {'joins' if len(still) == 1 else 'join'} bodies whose centres of mass no force moves in the reference "
            "pose. MuJoCo scales the softness of such a row by that, to 0: stiffer than numbers can be, and a run breaks. The flag "
            "diagexact cures it but where the axis of the pin comes to lie along an axis of the world; one of the pin's sites in a welded "
            "body without mass, whose centre of mass is off the pin, cures it everywhere."
        )
        yield Symptom("still_masses", "error", text, '<option><flag diagexact="enable"/></option>', number=len(still))
    off = [equality_name(model, k) for k in range(model.neq) if k not in active(model)]
    if off:
        text = f"{listed(off)} {'does' if len(off) == 1 else 'do'} not act: switched off in the file. The freedoms count without."
        yield Symptom("switched_off", "warning", text, number=len(off))
    dragged = [k for k in active(model) if drags(model, k)]
    if dragged:
        text = f"{_say(model, dragged)} drags a body after a mocap body, softly: a program is expected to move it."
        yield Symptom("mocap_weld", "note", text, number=len(dragged))


def sag(model: mujoco.MjModel, qpos: Array, gaps: Mapping[int, float] | None = None) -> Iterator[Symptom]:
    """Finding "sag": how far a row gives way under the weight and controls of the start, r = R f / (K d^2), the r of
    the module: f, the force before the row gives way, is d times the standing load. Light parts under load sag most.

    gaps: largest residual by equality that a short run showed; where stops or contacts hold the parts before the row does, it is
    far below r, and is reported instead.
    """
    probe = copy.copy(model)
    probe.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    probe.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    data = start_data(probe, qpos)
    data.qvel[:] = 0.0
    with engine():
        mujoco.mj_forward(probe, data)
    held = np.isin(data.efc_id, loops(model)) & (data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY)
    if not np.any(held):
        return
    kbip, owners = data.efc_KBIP[held], data.efc_id[held]
    given = np.abs(data.efc_R[held] * data.efc_force[held]) / np.maximum(kbip[:, 0] * kbip[:, 2] ** 2, 1e-300)
    shown = np.array([given[i] if gaps is None else min(given[i], gaps.get(int(k), np.inf)) for i, k in enumerate(owners)])
    seen = gaps is not None and given.max() > FAR_FROM_SEEN * shown.max()
    k = int(np.argmax(shown if seen else given))
    value = float(shown[k] if seen else given[k])
    if value > SAG * model.stat.extent:
        name = equality_name(model, int(owners[k]))
        how = "in a short run, where stops or contacts catch its parts" if seen else "under the load of the start alone"
        text = f"{name} gives way by {value:.3g} m or rad {how}: soft, or a light part carries load."
        severity = "error" if value > TORN * model.stat.extent else "warning"
        yield Symptom("sag", severity, text, equality_default(float(model.opt.timestep)), value)


def _refsafe(model: mujoco.MjModel, h: float) -> Iterator[Symptom]:
    safe = not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_REFSAFE
    rk4 = model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4
    quick = [k for k in loops(model) if 0.0 < model.eq_solref[k, 0] < 2.0 * h * (1 - 1e-9)]
    if quick and safe:
        tc = float(model.eq_solref[quick[0], 0])
        text = (
            f"{_say(model, quick)}: solref time constant {tc:g} s is below two timesteps; MuJoCo takes {2 * h:g} s instead "
            "(refsafe), so the softness is not that of the file and changes with the timestep."
        )
        yield Symptom("refsafe", "warning", text, equality_default(h))
    elif quick and (not rk4 or float(model.eq_solref[quick, 0].min()) < h):
        tc = float(model.eq_solref[quick, 0].min())
        what = (
            "RK4 loses two digits at half a timestep and blows up at a tenth"
            if rk4
            else "first-order integrators blow up"
        )
        text = f"{_say(model, quick)}: refsafe is off and the time constant {tc:g} s is {tc / h:.2g} timesteps: {what}."
        discrete = model.opt.integrator == mujoco.mjtIntegrator.mjINT_DISCRETE
        yield Symptom("refsafe", "warning" if discrete or tc >= 0.5 * h and rk4 else "error", text, equality_default(h))
    direct = [k for k in loops(model) if model.eq_solref[k, 0] < 0]
    stiff = [k for k in direct if -model.eq_solref[k, 0] * h * h >= (RK4_LIMIT if rk4 else 1.0)]
    if stiff and model.opt.integrator != mujoco.mjtIntegrator.mjINT_DISCRETE:
        k = max(stiff, key=lambda i: -float(model.eq_solref[i, 0]))
        value = -float(model.eq_solref[k, 0]) * h * h
        text = (
            f"{_say(model, stiff)}: direct stiffness with k h^2 = {value:.3g}; "
            f"{'RK4 was measured to survive 4' if rk4 else 'a first-order integrator blows up from 1 on'}."
        )
        yield Symptom("stiff_equalities", "error", text, equality_default(h))


STILL = 1e-9
"""How easily a centre of mass is moved [1/kg], times the mass of the whole model, that counts as not at all."""


def _still_masses(model: mujoco.MjModel, k: int) -> bool:
    """Whether equality k pins two bodies of which MuJoCo believes that no force moves their centres of mass."""
    if int(model.eq_type[k]) not in (int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)):
        return False
    ends = [int(model.eq_obj1id[k]), int(model.eq_obj2id[k])]
    if model.eq_objtype[k] == mujoco.mjtObj.mjOBJ_SITE:
        ends = [int(model.site_bodyid[x]) for x in ends]
    ease = float(model.body_invweight0[ends, 0].sum()) * float(model.body_subtreemass[0])
    return ease < STILL and any(model.body_weldid[x] for x in ends)


def _timeconst(model: mujoco.MjModel, k: int) -> float:
    """Time constant [s] of an equality; of a direct stiffness and damping (-k, -b) that which gives the same damping."""
    first, second = (float(x) for x in model.eq_solref[k])
    if first > 0:
        safe = not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_REFSAFE
        return max(first, 2.0 * float(model.opt.timestep)) if safe else first
    return 2.0 / max(-second, 1e-300) / float(model.eq_solimp[k, 1])


def _is_default(model: mujoco.MjModel, k: int) -> bool:
    return np.allclose(model.eq_solref[k], (0.02, 1.0)) and np.allclose(model.eq_solimp[k, :2], (0.9, 0.95))


def _say(model: mujoco.MjModel, which: list[int]) -> str:
    return listed([equality_name(model, k) for k in which])
