"""Mechanism to MuJoCo, through the same MJCF text that users get, and the map between the two by name."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from functools import cached_property, lru_cache
from pathlib import Path

import mujoco
import numpy as np

from mechlab.engines.mujoco.closure import Connector, equality_jacobian, find_connectors
from mechlab.engines.mujoco.control import compiling, engine
from mechlab.engines.mujoco.curve_rows import CurveRows
from mechlab.errors import MechlabError, unknown
from mechlab.experiment.scene import MUJOCO_INTEGRATORS, Settings
from mechlab.formats.mjcf.write import to_mjcf
from mechlab.formats.mjcf.write_loops import axis_name, body_name, tendon_name
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.tree import no_joints

Indices = np.ndarray
Model = mujoco.MjModel


_AS_COMPILED = Settings()
_SOFT = ("eq_{}", "jnt_{}", "dof_{}", "tendon_{}_lim", "tendon_{}_fri")
"""Arrays of the softness of rows: equalities, ends of ranges and dry friction of joints, of tendons."""
_DEFAULT_SOLREF, _DEFAULT_SOLIMP = (0.02, 1.0), (0.9, 0.95, 0.001, 0.5, 2.0)


@lru_cache(maxsize=32)
def _compiled(mechanism: Mechanism, bare: bool) -> mujoco.MjModel:
    if not mechanism.nv:
        raise no_joints(mechanism.name)
    text = to_mjcf(mechanism, _AS_COMPILED, bare=bare)
    try:
        with compiling():
            return mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        raise MechlabError(f"{mechanism.name}: MuJoCo refuses the model: {error}") from None


class Tuning:
    """Gives a compiled model, as often as wanted, the timestep, the integrator and the softness of other settings: all that they
    change in its text."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self._rows: list[tuple[Array, Array, bool]] = []
        for name in _SOFT:
            for what, written in (("solref", _AS_COMPILED.solref), ("solimp", _AS_COMPILED.solimp)):
                values = getattr(model, name.format(what))
                own = (values == written).all(axis=1)
                if own.any():
                    self._rows.append((values, own, what == "solref"))

    def put(self, settings: Settings) -> None:
        """See the class."""
        kind = settings.integrator if settings.integrator in MUJOCO_INTEGRATORS else "RK4"
        self.model.opt.timestep = settings.timestep
        self.model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{kind.upper()}")
        for values, own, reference in self._rows:
            values[own] = settings.solref or _DEFAULT_SOLREF if reference else settings.solimp or _DEFAULT_SOLIMP


def to_mujoco(mechanism: Mechanism, settings: Settings | None = None, bare: bool = False) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A fresh model and its data in the reference pose, evaluated (mj_forward).

    The model is the caller's own: the compiled one is kept and copied. bare: without shapes, sensors and keyframe, for runs.
    Raises MechlabError when MuJoCo refuses it.
    """
    model = copy.copy(_compiled(mechanism, bare))
    if settings is not None:
        Tuning(model).put(settings)
    data = mujoco.MjData(model)
    with engine():
        mujoco.mj_forward(model, data)
    return model, data


RELEASED = 30
"""The group of actuators that is disabled; MuJoCo has groups 0 to 30."""


def passive(model: mujoco.MjModel) -> None:
    """Take the actuators of the file out of a model: their group is disabled, and their damping, which MuJoCo applies
    also in disabled groups, is set to zero. The control callback still runs."""
    model.actuator_group[:] = RELEASED
    model.opt.disableactuator |= 1 << RELEASED
    model.actuator_damping[:] = 0.0
    model.actuator_dampingpoly[:] = 0.0


class MujocoMap:
    """Where the names of a Mechanism stand in a MuJoCo model: addresses, and conversion of coordinates and rates.

    `qpos` (nq,) and `dof` (nv,) are the engine's addresses in the order of the Mechanism; `other_dof` those of the
    connectors that close loops of some kinds, which the Mechanism does not have.
    """

    def __init__(self, mechanism: Mechanism, model: mujoco.MjModel) -> None:
        self.mechanism = mechanism
        self.model = model
        qpos: list[int] = []
        dof: list[int] = []
        for joint in mechanism.joints:
            k = _id(model, mujoco.mjtObj.mjOBJ_JOINT, "joint", joint.name)
            qpos += range(model.jnt_qposadr[k], model.jnt_qposadr[k] + joint.nq)
            dof += range(model.jnt_dofadr[k], model.jnt_dofadr[k] + joint.nv)
        self.qpos: Indices = np.array(qpos, dtype=int)
        self.dof: Indices = np.array(dof, dtype=int)
        self._square = None if np.array_equal(self.dof, np.arange(model.nv)) else np.ix_(self.dof, self.dof)
        self.other_dof: Indices = np.delete(np.arange(model.nv), self.dof)
        self._mass = np.zeros((model.nv, model.nv))
        self.curves = CurveRows(mechanism, model)
        self._scratch: mujoco.MjData | None = None

    @cached_property
    def connectors(self) -> tuple[Connector, ...]:
        """The bodies that stand between the two sides of a loop and belong to the engine's model alone."""
        return find_connectors(self.model, set(self.dof.tolist()))

    @cached_property
    def equalities(self) -> dict[str, tuple[int, ...]]:
        """Loop, relation or curve -> the engine's equality constraints that stand for it."""
        model = self.model
        names = {mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_EQUALITY, k): k for k in range(model.neq)}
        out: dict[str, tuple[int, ...]] = {}
        for wanted in [*(x.name for x in self.mechanism.loops), *(x.name for x in self.mechanism.couplings)]:
            found = [names[name] for name in (wanted, axis_name(wanted)) if name in names]
            if not found:
                raise unknown(f"{self.mechanism.name}: equality of the MuJoCo model", wanted, names)
            out[wanted] = tuple(sorted(found))
        return out

    @cached_property
    def tendons(self) -> dict[str, int]:
        """Shaft or relation -> its fixed tendon."""
        kind, m = mujoco.mjtObj.mjOBJ_TENDON, self.mechanism
        names = {x.name: tendon_name(m, x.name) for x in m.relations} | {x.name: x.name for x in m.shafts}
        return {name: _id(self.model, kind, "tendon", tendon) for name, tendon in names.items()}

    @cached_property
    def actuators(self) -> dict[str, int]:
        """Drive -> its position actuator."""
        kind = mujoco.mjtObj.mjOBJ_ACTUATOR
        return {x.name: _id(self.model, kind, "actuator", x.name) for x in self.mechanism.drives}

    def body(self, name: str) -> int:
        """The engine's number of a body of the Mechanism, or of the ground."""
        return _id(self.model, mujoco.mjtObj.mjOBJ_BODY, "body", body_name(name))

    def site(self, name: str) -> int:
        """The engine's number of a site: a Frame by its name, an end of a loop."""
        return _id(self.model, mujoco.mjtObj.mjOBJ_SITE, "site", name)

    def rows(self, data: mujoco.MjData, name: str) -> Indices:
        """Rows of the constraint arrays (efc_*) of a loop or relation, as they stand in `data` now."""
        is_equality = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        return np.flatnonzero(is_equality & np.isin(data.efc_id, self.equalities[name]))

    def first_rows(self, data: mujoco.MjData, names: Sequence[str], count: int) -> Indices:
        """(names, count) the first rows of each of some loops or relations, as `rows`, in one pass over the arrays."""
        equality = np.flatnonzero(data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY)
        ids = data.efc_id[equality]
        order = np.argsort(ids, kind="stable")
        ends = np.searchsorted(ids[order], np.arange(self.model.neq + 1))
        own = [[equality[order[ends[e] : ends[e + 1]]] for e in self.equalities[name]] for name in names]
        return np.array([np.sort(np.concatenate(rows))[:count] for rows in own], dtype=int).reshape(-1, count)

    # -- coordinates and rates ---------------------------------------------------------------------------------------

    def coordinates(self, qpos: Array) -> Array:
        """(..., nq) of the Mechanism from the engine's qpos."""
        return np.asarray(qpos)[..., self.qpos]

    def rates(self, qvel: Array) -> Array:
        """(..., nv) of the Mechanism from the engine's qvel."""
        return np.asarray(qvel)[..., self.dof]

    def engine_coordinates(self, q: Array) -> Array:
        """The engine's qpos of a pose q (nq,): the coordinates of the connectors follow in closed form, so that an
        assembled pose has equality residuals at rounding level."""
        qpos = self.model.qpos0.copy()
        qpos[self.qpos] = q
        if self.connectors:
            data = self._data()
            data.qpos[:] = qpos
            mujoco.mj_kinematics(self.model, data)
            for connector in self.connectors:
                connector.place(data, qpos)
        return np.asarray(qpos)

    def engine_rates(self, qpos: Array, v: Array) -> Array:
        """The engine's qvel of rates v (nv,) at its qpos: connectors follow from the equality constraints."""
        qvel = np.zeros(self.model.nv)
        qvel[self.dof] = v
        if len(self.other_dof):
            data = self._data()
            data.qpos[:] = qpos
            mujoco.mj_fwdPosition(self.model, data)
            jacobian = equality_jacobian(self.model, data)
            other = jacobian[:, self.other_dof]
            qvel[self.other_dof] = -np.linalg.lstsq(other, jacobian[:, self.dof] @ v, rcond=1e-11)[0]
        return qvel

    def mass_matrix(self, data: mujoco.MjData) -> Array:
        """(nv, nv) of the Mechanism, armatures and shafts included, at the state that `data` was evaluated at."""
        mujoco.mj_fullM(self.model, data, self._mass)
        return self._mass.copy() if self._square is None else np.asarray(self._mass[self._square])

    def _data(self) -> mujoco.MjData:
        if self._scratch is None:
            self._scratch = mujoco.MjData(self.model)
        return self._scratch


def _id(model: mujoco.MjModel, kind: mujoco.mjtObj, what: str, name: str) -> int:
    found = mujoco.mj_name2id(model, kind, name)
    if found < 0:
        count = {"joint": model.njnt, "tendon": model.ntendon, "body": model.nbody, "site": model.nsite}.get(
            what, model.nu
        )
        names = [mujoco.mj_id2name(model, kind, k) or "" for k in range(count)]
        raise unknown(f"the MuJoCo model: {what}", name, names)
    return int(found)


def file_size(path: Path) -> tuple[float, int]:
    """Mass [kg] of all bodies of an MJCF file and its number of rates. Raises MechlabError where MuJoCo refuses the file."""
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise MechlabError(f"MuJoCo refuses {path.name}: {error}") from None
    return float(model.body_mass.sum()), int(model.nv)
