"""Reactions by MuJoCo: of loops and relations during a run, and what a given motion needs (inverse dynamics).

MuJoCo: M a + h = tau + J^T f with J the gradient of its residual. A relation's residual is its tendon length, so f is the
multiplier of the Mechanism's row: with the first coefficient 1 the torque on that joint. A connect or weld measures site 1
minus site 2, so the force on body b is -f. A loop with a connector is read where the joint stands: the force that the host
passes to the connector, which together with the body it is welded to is the other side of the loop.

Inverse dynamics: accelerations and reactions of hard constraints (`ExactDynamics`) are linear in the drive force, so two
evaluations fix it. The reactions are then put in the place of the engine's own constraint forces, and mj_rnePostConstraint
finds what passes through each joint.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mechlab.engines.mujoco.closure import ExactDynamics
from mechlab.engines.mujoco.hard_rows import EXACT, MANY, HardRows
from mechlab.engines.mujoco.model import Indices, MujocoMap, passive, to_mujoco
from mechlab.engines.state import MotionForces
from mechlab.errors import MechlabError, NoSolution
from mechlab.formats.mjcf.write_loops import axis_name, axis_site_names, connector_name, site_names
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array, cross
from mechlab.mechanism.model import Mechanism
from mechlab.mechanism.parts import FORCES, LOOP_ROWS, MOMENTS, Loop


@dataclass(frozen=True)
class _Reader:
    loop: Loop
    equalities: tuple[int, ...]
    site_b: int
    connector: int = -1
    on_b: float = 1.0
    lever: tuple[int, int] | None = None


class Reactions:
    """Keeps what a run needs of each evaluated state (after mj_forward), and reads from all of them accelerations, and the
    reactions of relations and loops.

    Channels: RELATION_load, conjugate to the relation's sum [N m, or N: its first joint slides]; CURVE_load on its output;
    LOOP_fx _fy _fz [N] and LOOP_mx _my _mz [N m] on body b at its end of the loop, world axes; no moments for spherical loops. LOOP_load
    [N] of a distance loop pushes its ends apart. All are those of rigid rows at the state, but with the integrator `discrete`
    (`HardRows`); a mechanism with a distance loop is read by `ExactDynamics`, which gives the loads of relations, distance loops and
    spherical loops. Rows that repeat others share their load equally: in an overconstrained mechanism this says how the engine shares it,
    no more. slips: whether `slip` will be asked for. alone: one state, with rigid rows to rounding.
    """

    def __init__(self, map_: MujocoMap, slips: bool = True, alone: bool = False) -> None:
        self.map, self.model, self._slips = map_, map_.model, slips
        m = map_.mechanism
        self.relations = tuple(x.name for x in m.couplings)
        self.distances = tuple(x.name for x in m.loops if x.kind == "distance")
        kept = ("spherical",) if self.distances else tuple(k for k in LOOP_ROWS if k != "distance")
        self._loops = [self._reader(x) for x in m.loops if x.kind in kept]
        self._exact = ExactDynamics(self.model) if self.distances else None
        self._hard = HardRows(map_, EXACT, MANY) if alone else HardRows(map_)
        self._connectors = [r.connector for r in self._loops if r.connector >= 0]
        self._roots = self.model.body_rootid[self._connectors]
        self._turns = any(r.connector < 0 and r.loop.kind == "fixed" for r in self._loops)
        far = [site for r in self._loops if r.lever is not None for site in r.lever]
        self._sites = sorted({*far, *(r.site_b for r in self._loops if r.connector >= 0 or r.loop.kind == "fixed")})
        self.units: dict[str, str] = {f"{x.name}_load": "N" if x.coefficients[0][0] in m.slides else "N m" for x in m.relations}
        self.units |= {f"{x.name}_load": "N" if x.output in m.slides else "N m" for x in m.curves}
        self.units |= {f"{name}_load": "N" for name in self.distances}
        for reader in self._loops:
            self.units |= {f"{reader.loop.name}_{k}": "N" for k in FORCES}
            if reader.loop.kind != "spherical":
                self.units |= {f"{reader.loop.name}_{k}": "N m" for k in MOMENTS}
        self._rows = np.array(self._sites, dtype=int)
        self.names = tuple(self.units)
        self._ids: dict[int, Array] = {}
        self._counts: list[int] = []
        self._kept: defaultdict[str, list[Array]] = defaultdict(list)

    def _reader(self, loop: Loop) -> _Reader:
        site_b = self.map.site(site_names(loop.name)[1])
        found = self.map.equalities[loop.name]
        connector = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, connector_name(loop.name))
        if connector >= 0:
            welded = (int(self.model.eq_obj1id[found[0]]), int(self.model.eq_obj2id[found[0]]))
            return _Reader(loop, found, site_b, connector, 1.0 if site_b in welded else -1.0)
        if loop.kind == "revolute":
            names = [mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_EQUALITY, k) for k in found]
            point, axis = found[names.index(loop.name)], found[names.index(axis_name(loop.name))]
            lever = (site_b, self.map.site(axis_site_names(loop.name)[1]))
            return _Reader(loop, (point, axis), site_b, lever=lever)
        return _Reader(loop, found, site_b)

    def keep(self, data: mujoco.MjData) -> None:
        """Remember a state."""
        count = data.ne
        if count not in self._ids:  # the rows of equalities keep their places while their number is the same
            self._ids[count] = data.efc_id[:count].copy()
        self._counts.append(count)
        if self.relations and self._slips:
            terms = data.efc_KBIP[:count]
            self._kept["soft"].append(np.array([data.efc_pos[:count], data.efc_R[:count], terms[:, 0], terms[:, 2]]))
        if self._exact is not None:
            acceleration, reaction = self._exact.solve(data)
            self._kept["qacc"].append(acceleration)
            self._kept["reaction"].append(reaction)
        else:
            self._hard.solve(data)
            self._kept["qacc"].append(data.qacc.copy())
        if self.names:
            force = data.efc_force
            self._kept["force"].append(force.copy() if len(force) == count else force[:count].copy())
        if len(self._sites):
            self._kept["place"].append(data.site_xpos[self._rows])
        if self._turns:
            self._kept["turn"].append(data.site_xmat[self._rows])
        if len(self._connectors):
            mujoco.mj_rnePostConstraint(self.model, data)
            self._kept["wrench"].append(data.cfrc_int[self._connectors])
            self._kept["centre"].append(data.subtree_com[self._roots])
        self._hard.put_back(data)

    def cut(self, count: int) -> None:
        """Keep the first `count` states alone."""
        del self._counts[count:]
        for kept in self._kept.values():
            del kept[count:]

    def accelerations(self) -> Array:
        """(n, nv) accelerations of the kept states."""
        return self.map.rates(self.engine_accelerations())

    def engine_accelerations(self) -> Array:
        """(n, engine nv) accelerations of the kept states."""
        return np.array(self._kept["qacc"])

    def loads(self) -> Array:
        """(n, channels) reactions at the kept states, in the order of `names`."""
        out = np.zeros((len(self._counts), len(self.names)))
        if self._exact is not None:
            slices = self._exact.closure.slices
            names = [*self.relations, *self.distances, *(r.loop.name for r in self._loops)]
            columns = [k for name in names for k in range(len(self._kept["reaction"][0]))[slices[self.map.equalities[name][0]]]]
            return np.array(self._kept["reaction"])[:, columns]
        for at, ids, force in self._alike():
            column = 0
            for name in self.relations:
                out[at, column] = force[:, ids == self.map.equalities[name][0]].sum(axis=1)
                column += 1
            for reader in self._loops:
                f, moment = self._wrenches(reader, at, ids, force)
                both = f if reader.loop.kind == "spherical" else np.hstack([f, moment])
                out[at, column : column + both.shape[1]] = both
                column += both.shape[1]
        return out

    def _alike(self) -> Iterator[tuple[Indices, Array, Array]]:
        """States with the same rows of equalities: their indices (g,), the equality of each row (rows,), the forces (g, rows)."""
        counts = np.array(self._counts)
        for count, ids in self._ids.items() if self.names else ():
            at = np.flatnonzero(counts == count)
            yield at, ids, np.array([self._kept["force"][k] for k in at]).reshape(len(at), count)

    def _wrenches(self, reader: _Reader, at: Indices, ids: Array, force: Array) -> tuple[Array, Array]:
        """Forces (g, 3) on body b, and moments (g, 3) about its site of the loop, at the states `at`."""
        rows = [-force[:, ids == k] for k in reader.equalities]
        # MuJoCo leaves out a connect whose rows are all zero (a point that no joint moves): it carries nothing
        rows = [r if r.size else np.zeros((len(at), 3)) for r in rows]
        if reader.connector >= 0:
            k = self._connectors.index(reader.connector)
            wrench = reader.on_b * np.array([self._kept["wrench"][i][k] for i in at])
            arm = np.array([self._kept["centre"][i][k] for i in at]) - self._places(reader.site_b, at)
            return wrench[:, 3:], wrench[:, :3] + np.cross(arm, wrench[:, 3:])
        if reader.lever is not None:
            arm = self._places(reader.lever[1], at) - self._places(reader.site_b, at)
            return rows[0] + rows[1], np.cross(arm, rows[1])
        if rows[0].shape[1] == 6:
            # The residual of the rotation is torquescale x the vector part of a quaternion, in the axes of the sites.
            scale, k = 0.5 * self.model.eq_data[reader.equalities[0], 10], self._sites.index(reader.site_b)
            turns = np.array([self._kept["turn"][i][k] for i in at]).reshape(-1, 3, 3)
            return rows[0][:, :3], scale * (turns @ rows[0][:, 3:, None])[..., 0]
        return rows[0], np.zeros((len(at), 3))

    def _places(self, site: int, at: Indices) -> Array:
        """(g, 3) of a site in the world."""
        k = self._sites.index(site)
        return np.array([self._kept["place"][i][k] for i in at])

    def slip(self) -> tuple[float, float, float]:
        """Largest |residual| of the relations, the largest one that softness alone predicts at standstill, and the work
        [J] that their soft rows have taken up, sum |r f|: half of it stored, half lost when a load comes on at once.

        A soft row obeys R f = -k d r when the row neither moves nor accelerates, with R = (1 - d) A / d and
        k = 1 / (d^2 tc^2 zeta^2): r = (1 - d) tc^2 zeta^2 A f, A the engine's diagonal estimate of J M^-1 J^T.
        """
        measured = predicted = taken = 0.0
        equalities = [self.map.equalities[name][0] for name in self.relations]
        for at, ids, force in self._alike() if self.relations else ():
            rows = np.isin(ids, equalities)
            residual, size, stiffness, impedance = np.array([self._kept["soft"][k][:, rows] for k in at]).transpose(1, 0, 2)
            force = force[:, rows]
            measured = max(measured, float(np.max(np.abs(residual), initial=0.0)))
            predicted = max(predicted, float(np.max(np.abs(size * force / (stiffness * impedance)), initial=0.0)))
            taken = max(taken, float(np.max(np.abs(residual * force).sum(axis=1), initial=0.0)))
        return measured, predicted, taken


@dataclass(frozen=True)
class MujocoInverse:
    """drive_force [N m or N]; loops: force (3,) on body b of each spherical loop; joints: force and moment (6,) on each
    body from its parent, about the origin of its last joint, world axes; accelerations (nv,)."""

    drive_force: float
    loops: dict[str, Array]
    joints: dict[str, Array]
    accelerations: Array


class InverseDynamicsSolver:
    """Inverse dynamics of one mechanism with one freedom, for many states. Loops must be spherical.

    Raises MechlabError for a mechanism with loops of other kinds: MuJoCo closes those through bodies of its own.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        other = [x.name for x in mechanism.loops if x.kind != "spherical"]
        if other:
            raise MechlabError(
                f"{mechanism.name}: reactions by MuJoCo are read for spherical loops; {', '.join(other)} are of other "
                "kinds. Use pinocchio."
            )
        self.mechanism = mechanism
        self.model, self.data = to_mujoco(mechanism)
        passive(self.model)
        self.map = MujocoMap(mechanism, self.model)
        self.exact = ExactDynamics(self.model)

    def solve(
        self, q: ArrayLike, v: ArrayLike, drive: str, acceleration: float, load: ArrayLike | None = None
    ) -> MujocoInverse:
        """Drive force and reactions of the state q (nq,), v (nv,) in which `drive` has the acceleration; `load` (nv,)
        generalized forces of loads. Raises NoSolution when the drive cannot make the motion (a limit position)."""
        data, row = self.data, np.zeros(self.model.nv)
        row[self.map.dof] = self.mechanism.row(drive)
        extra = np.zeros(self.model.nv)
        if load is not None:
            extra[self.map.dof] = np.asarray(load, dtype=float)
        data.qpos[:] = self.map.engine_coordinates(np.asarray(q, dtype=float))
        data.qvel[:] = self.map.engine_rates(data.qpos, np.asarray(v, dtype=float))
        self.map.curves.place(data.qpos)
        got = []
        for force in (0.0, 1.0):
            data.qfrc_applied[:] = extra + force * row
            mujoco.mj_forward(self.model, data)
            a, reaction = self.exact.solve(data)
            got.append((row @ a, a, reaction))
        gain = got[1][0] - got[0][0]
        if not abs(gain) > 1e-12 * max(1.0, float(np.abs(got[1][1]).max())):
            raise NoSolution(f"{self.mechanism.name}: {drive} cannot drive the mechanism in this pose.")
        f = (acceleration - got[0][0]) / gain
        a = got[0][1] + f * (got[1][1] - got[0][1])
        reaction = got[0][2] + f * (got[1][2] - got[0][2])
        return MujocoInverse(
            float(f), self._loops(reaction), self._joints(a, reaction, extra, f * row), self.map.rates(a)
        )

    def _loops(self, reaction: Array) -> dict[str, Array]:
        """Rows of the closure are site 2 minus site 1, and site 2 stands in body b."""
        slices = self.exact.closure.slices
        return {x.name: reaction[slices[self.map.equalities[x.name][0]]] for x in self.mechanism.loops}

    def _joints(self, a: Array, reaction: Array, extra: Array, drive: Array) -> dict[str, Array]:
        """Wrenches through the joints by mj_rnePostConstraint, with the loop forces as external forces on the bodies:
        the engine's own sum over equality rows leaves out tendons and would repeat the soft forces."""
        model, data = self.model, self.data
        data.qacc[:] = a
        data.efc_force[:] = 0.0
        data.xfrc_applied[:] = 0.0
        for loop in self.mechanism.loops:
            force = reaction[self.exact.closure.slices[self.map.equalities[loop.name][0]]]
            for name, side, sign in zip((loop.body_a, loop.body_b), site_names(loop.name), (-1.0, 1.0), strict=True):
                held = self.map.body(name)
                arm = data.site_xpos[self.map.site(side)] - data.xipos[held]
                data.xfrc_applied[held] += np.concatenate([sign * force, cross(arm, sign * force)])
        mujoco.mj_rnePostConstraint(model, data)
        data.xfrc_applied[:] = 0.0
        out: dict[str, Array] = {}
        for body in self.mechanism.bodies:
            if not body.joints:
                continue
            number = self.map.body(body.name)
            here, centre = data.xpos[number], data.subtree_com[model.body_rootid[number]]
            moment, force = data.cfrc_int[number][:3], data.cfrc_int[number][3:]
            out[body.joints[-1].name] = np.concatenate([force, moment + cross(centre - here, force)])
        return out


def motion_forces(
    mechanism: Mechanism, q: Array, v: Array, drive: str, acceleration: float, load: Array
) -> MotionForces:
    """`InverseDynamicsSolver` at states q (n, nq), v (n, nv): the last joint of every body; reactions of relations are
    not read. Raises MechlabError unless all loops are spherical, which transmit no moment."""
    m, solver = mechanism, InverseDynamicsSolver(mechanism)
    found = [solver.solve(q[k], v[k], drive, acceleration, load) for k in range(len(q))]
    loops = {x.name: np.array([np.concatenate([f.loops[x.name], np.zeros(3)]) for f in found]) for x in m.loops}
    joints = {b.joints[-1].name: np.array([f.joints[b.joints[-1].name] for f in found]) for b in m.bodies if b.joints}
    return MotionForces(np.array([f.drive_force for f in found]), loops, joints, {})
