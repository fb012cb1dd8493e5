"""Steps of many motions by MuJoCo Warp, on a GPU where there is one and else on the processor: MuJoCo's algorithms in single precision.

Each motion is a world. Models that differ in numbers alone (lengths, masses, gravity) share one model with those fields for each world;
a difference that it cannot express is refused by name. Some steps at a time are captured as one graph and launched as one.

MuJoCo Warp 4.0 refuses a model that switches `autoreset` off, which it does not know anyhow; the flag is taken back. Its numbers have
24 bits: points 1 m away are rounded to 6e-8 m, which a loop with the time constant 2 h turns into rates of 6e-8 m / h. How far motions are
from those in double precision is measured on some of them by whoever asks (`mechlab.studies.sweep.precision`).
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np

from mechlab.engines.mujoco.control import engine
from mechlab.engines.mujoco.sparse import only_equalities
from mechlab.errors import EngineMissing, MechlabError, install_extra
from mechlab.mechanism.geometry import Array

AT_ONCE = 5
"""Steps of one graph, whose states go to the host together; to record a step of RK4 takes 0.1 s."""
NUMBERS = 40_000_000
"""Most numbers (320 MB) of one call: more than for the processor, since a graph is recorded anew for each."""
REFINED, ACTIVE_SETS = 3, 10
"""Solves of the constraints for equalities alone, and where limits may act. One solve of a four-bar is off 150 times as far as three."""
WITHOUT_EFFECT = ("dof_length", "site_size", "geom_rbound", "geom_size", "geom_pos", "geom_quat", "geom_aabb")
"""Fields of a model that a motion without contact and without sleep does not feel."""
OPTIONS = ("gravity", "wind", "magnetic", "density", "viscosity")


def need_warp() -> Any:
    """The package mujoco_warp. Raises EngineMissing, saying what to install, where it is missing."""
    try:
        import warp

        # nothing on the terminal: releases before 1.16 know the first, later ones the second
        warp.config.quiet, warp.config.log_level = True, getattr(warp, "LOG_ERROR", 40)
        warp.config.enable_backward = False
        import mujoco_warp
    except ModuleNotFoundError as missing:
        raise EngineMissing(
            f"--backend warp needs MuJoCo Warp ({missing.name} is missing): {install_extra('gpu')}."
        ) from None
    return mujoco_warp


def device_name() -> str:
    """Where the steps are taken, in words. Raises EngineMissing without MuJoCo Warp."""
    need_warp()
    import warp

    device = warp.get_preferred_device()
    return f"{device.name} ({device})" if device.is_cuda else "the processor, no accelerator"


def steps_of_warp(models: Sequence[mujoco.MjModel], start: Array, push: Array, count: int) -> tuple[Array, Array]:
    """`mechlab.engines.mujoco.batch.Steps` in single precision; states hold time, coordinates and rates, no more.

    Raises MechlabError for a model that MuJoCo Warp does not take.
    """
    mjw = need_warp()
    import warp as wp

    first, worlds = models[0], len(models)
    size = first.nq + first.nv
    states, sensed = np.empty((worlds, count, 1 + size)), np.empty((worlds, count, first.nsensordata))
    states[:, :, 0] = first.opt.timestep * np.arange(1, count + 1)
    with engine(), wp.ScopedDevice(wp.get_preferred_device()):
        model = _model_of_all(mjw, wp, models)
        # a tolerance of 0: its own, 1e-6, ends the solver after a single solve, whose rounding a second and a third one take back
        model.opt.tolerance.zero_()
        model.opt.iterations, model.opt.warn_overflow = REFINED if only_equalities(first) else ACTIVE_SETS, 0
        data = mjw.put_data(first, mujoco.MjData(first), nworld=worlds, njmax=_rows(first), nconmax=1)
        for field, values in (
            (data.qpos, start[:, 1 : 1 + first.nq]), (data.qvel, start[:, 1 + first.nq : 1 + size]), (data.qfrc_applied, push),
        ):  # fmt: skip
            field.assign(np.ascontiguousarray(values, dtype=np.float32))
        for at, steps in _launches(mjw, wp, model, data, count):
            for i, (q, v, s) in enumerate(steps):
                states[:, at + i, 1 : 1 + first.nq], states[:, at + i, 1 + first.nq :], sensed[:, at + i] = q, v, s
        if np.any(data.nefc.numpy() > _rows(first)):
            raise MechlabError("MuJoCo Warp had no room for all rows of the constraints; run it without --backend warp.")
    return states, sensed


def _launches(mjw: Any, wp: Any, model: Any, data: Any, count: int) -> Iterator[tuple[int, list[tuple[Array, Array, Array]]]]:
    """Number of the first step, and coordinates, rates (after) and sensor data (before) of it and the next ones."""
    kept = [[wp.empty_like(x) for x in (data.qpos, data.qvel, data.sensordata)] for _ in range(min(AT_ONCE, count))]

    def record(some: Sequence[list[Any]]) -> Any:
        with wp.ScopedCapture() as capture:
            for slot in some:
                mjw.step(model, data)
                for to, field in zip(slot, (data.qpos, data.qvel, data.sensordata), strict=True):
                    wp.copy(to, field)
        return capture.graph

    # a capture executes nothing on a GPU, and on the processor neither; kernels are compiled before it begins
    graphs: dict[int, Any] = {}
    for at in range(0, count, len(kept)):
        some = kept[: min(len(kept), count - at)]
        if len(some) not in graphs:
            graphs[len(some)] = record(some)
        wp.capture_launch(graphs[len(some)])
        yield at, [tuple(x.numpy() for x in slot) for slot in some]


def _rows(model: mujoco.MjModel) -> int:
    """Most rows of constraints: those of equalities, and one for each joint and tendon with a range or dry friction."""
    return int(6 * model.neq + 2 * model.njnt + 2 * model.ntendon + model.nv + 1)


def _model_of_all(mjw: Any, wp: Any, models: Sequence[mujoco.MjModel]) -> Any:
    """One model of MuJoCo Warp for all worlds, with the fields that differ for each of them."""
    different = list({id(m): m for m in models}.values())
    whole = _put(mjw, different[0])
    if len(different) == 1:
        return whole
    of = {id(m): k for k, m in enumerate(different)}
    which = np.array([of[id(m)] for m in models])
    for holder, names, sources in (
        (whole, [n for n in _arrays(whole) if hasattr(models[0], n)], different),
        (whole.opt, OPTIONS, [m.opt for m in different]),
    ):
        for name in names:
            values = np.stack([np.asarray(getattr(x, name)) for x in sources])
            field = getattr(holder, name)
            if name in WITHOUT_EFFECT or (values == values[0]).all():
                continue
            if field.shape[0] != 1 or field.numpy().ndim != values.ndim:
                raise _refusal(name)
            setattr(holder, name, wp.array(values[which].astype(np.float32), dtype=field.dtype))
    last = _put(mjw, different[-1])
    at = int(np.flatnonzero(which == len(different) - 1)[0])
    for mine, theirs in ((whole, last), (whole.opt, last.opt)):
        found = _arrays(mine)
        for name, field in _arrays(theirs).items():
            own, wanted = found[name].numpy(), field.numpy()
            if name not in WITHOUT_EFFECT and not np.array_equal(own[at : at + 1] if own.shape != wanted.shape else own, wanted):
                raise _refusal(name)
    return whole


def _put(mjw: Any, model: mujoco.MjModel) -> Any:
    """A model of MuJoCo Warp; raises MechlabError for what it does not take."""
    made = copy.copy(model)
    made.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    try:
        return mjw.put_model(made)
    except (NotImplementedError, ValueError) as cause:
        raise MechlabError(f"MuJoCo Warp does not take the model: {cause}") from None


def _arrays(holder: Any) -> Mapping[str, Any]:
    """Name -> array of a model of MuJoCo Warp."""
    return {n: x for n in type(holder).__dataclass_fields__ if hasattr(x := getattr(holder, n), "numpy")}


def _refusal(name: str) -> MechlabError:
    return MechlabError(f"MuJoCo Warp has no {name} for each motion, and it differs between them; sweep without --backend warp.")
