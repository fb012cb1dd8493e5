"""The equality constraints of a MuJoCo model at acceleration level: J a + b = 0, from the engine's own Jacobians.

The engine's rows (efc_J) have no dJ/dt v. The rows here span the same space and have it, from `mj_jac` and `mj_jacDot`:

    connect          the two anchors keep together:            J = jacp_2 - jacp_1,  b = (d jacp_2 - d jacp_1) v
    weld             that, and the bodies turn together:       jacr likewise (exact where the weld holds)
    fixed tendon     sum of coefficient x joint coordinate:    J constant, b = 0
    spatial tendon   the distance of two sites is constant:    J = e (jacp_2 - jacp_1), b = |d' across e|^2/|d| + e b_12
                     with d between the sites, e = d / |d|; the engine itself leaves b out of its distance rows

    joint            q_1 - (c0 + c1 q_2 + c2 q_2^2 + ...) = 0:        J = e_1 - p' e_2,  b = -p'' v_2^2

Connectors: MuJoCo closes a loop by `connect` or `weld` only. A loop that is a prismatic, cylindrical or universal joint becomes a
small body that hangs on one side of the loop with the joints of that kind, and is welded to the other side. Its
coordinates do not belong to the Mechanism; in an assembled pose they follow in closed form from the pose of the weld.

`ExactDynamics`: accelerations and reactions of hard constraints from the engine's own terms. MuJoCo holds a distance loop by a
tendon equality, whose dJ/dt v it ignores: its positions converge, its accelerations and forces do not. With the exact rows of
`Closure` they follow from the same mass matrix, forces and Jacobians; redundant rows share their load by least squares:

    M a - J^T r = qfrc_smooth + forces of friction and limits,    J a = -dJ/dt v
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from mechlab.errors import MechlabError
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.geometry import Array, cross, quaternion_to_matrix


@dataclass(frozen=True)
class _Pair:
    """A connect (turns False) or weld (True): body and anchor in the body, twice."""

    bodies: tuple[int, int]
    anchors: tuple[Array, Array]
    turns: bool
    distance: bool = False
    sites: tuple[int, int] = (-1, -1)


class Closure:
    """Rows of all equality constraints of a model, at the state that its data were evaluated at."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self._pairs: list[_Pair] = []
        self._pair_of: dict[int, _Pair] = {}
        fixed: list[Array] = []
        tendons: list[int] = []
        pairs: list[int] = []
        self.joints: list[int] = []
        for k in range(self.model.neq):
            kind = self.model.eq_type[k]
            if kind == mujoco.mjtEq.mjEQ_TENDON:
                row, pair = _tendon(self.model, int(self.model.eq_obj1id[k]))
                if pair is None:
                    fixed.append(row)
                    tendons.append(k)
                    continue
                self._pairs.append(pair)
            elif kind == mujoco.mjtEq.mjEQ_JOINT:
                self.joints.append(k)
                continue
            elif self.model.eq_objtype[k] == mujoco.mjtObj.mjOBJ_SITE:
                one, two = int(self.model.eq_obj1id[k]), int(self.model.eq_obj2id[k])
                self._pairs.append(_site_pair(self.model, one, two, bool(kind == mujoco.mjtEq.mjEQ_WELD)))
            else:
                name = mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_EQUALITY, k)
                raise MechlabError(f"the MuJoCo model: equality {name!r} is neither of sites nor of joints nor of a tendon.")
            pairs.append(k)
            self._pair_of[k] = self._pairs[-1]
        rows = [1] * len(fixed) + [1 if p.distance else 6 if p.turns else 3 for p in self._pairs]
        ends = np.cumsum([0, *rows, *[1 for _ in self.joints]])
        self.slices = {k: slice(a, b) for k, a, b in zip(tendons + pairs + self.joints, ends, ends[1:], strict=False)}
        """Equality of the engine -> its rows here."""
        self._fixed = np.array(fixed).reshape(len(fixed), self.model.nv)
        self._buffer = [np.zeros((3, self.model.nv)) for _ in range(8)]  # the engine writes into them

    def ends_of_distance(self, equality: int) -> tuple[int, int] | None:
        """The two sites whose distance an equality of the engine keeps; None for one of another kind."""
        pair = self._pair_of.get(equality)
        return pair.sites if pair is not None and pair.distance else None

    def rows(self, data: mujoco.MjData) -> tuple[Array, Array]:
        """(rows, engine nv) J and (rows,) b in the engine's rates, connectors included.

        `data` must have been evaluated at its position and velocity (mj_fwdPosition, mj_fwdVelocity), as it is in a
        control callback and after mj_forward.
        """
        if not (self._pairs or self.joints):
            return self._fixed.copy(), np.zeros(len(self._fixed))
        blocks: list[Array] = [self._fixed]
        biases: list[Array] = [np.zeros(len(self._fixed))]
        model, v = self.model, data.qvel
        p1, r1, dp1, dr1, p2, r2, dp2, dr2 = self._buffer
        for pair in self._pairs:
            one, two = pair.bodies
            a = data.xpos[one] + data.xmat[one].reshape(3, 3) @ pair.anchors[0]
            b = data.xpos[two] + data.xmat[two].reshape(3, 3) @ pair.anchors[1]
            mujoco.mj_jac(model, data, p1, r1, a, one)
            mujoco.mj_jac(model, data, p2, r2, b, two)
            mujoco.mj_jacDot(model, data, dp1, dr1, a, one)
            mujoco.mj_jacDot(model, data, dp2, dr2, b, two)
            relative, relative_bias = p2 - p1, (dp2 - dp1) @ v
            if pair.distance:
                d, dd = b - a, relative @ v
                length = float(np.linalg.norm(d))
                along = d / length
                across = dd - along * (along @ dd)
                blocks.append((along @ relative)[None, :])
                biases.append(np.array([across @ across / length + along @ relative_bias]))
                continue
            blocks.append(relative)
            biases.append(relative_bias)
            if pair.turns:
                blocks.append(r2 - r1)
                biases.append((dr2 - dr1) @ v)
        for k in self.joints:
            row, bias = joint_row(model, data, k)
            blocks.append(row[None, :])
            biases.append(np.array([bias]))
        return np.concatenate(blocks), np.concatenate(biases)


def joint_row(model: mujoco.MjModel, data: mujoco.MjData, equality: int) -> tuple[Array, float]:
    """(engine nv,) J and b of a joint equality: its polynomial at the present coordinates."""
    one, two = int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])
    row = np.zeros(model.nv)
    row[model.jnt_dofadr[one]] = 1.0
    if two < 0:
        return row, 0.0
    adr = int(model.jnt_qposadr[two])
    x, v, c = float(data.qpos[adr] - model.qpos0[adr]), float(data.qvel[model.jnt_dofadr[two]]), model.eq_data[equality, :5]
    row[model.jnt_dofadr[two]] = -(c[1] + x * (2.0 * c[2] + x * (3.0 * c[3] + x * 4.0 * c[4])))
    return row, float(-(2.0 * c[2] + x * (6.0 * c[3] + x * 12.0 * c[4])) * v * v)


def _site_pair(model: mujoco.MjModel, one: int, two: int, turns: bool, distance: bool = False) -> _Pair:
    bodies = (int(model.site_bodyid[one]), int(model.site_bodyid[two]))
    return _Pair(bodies, (model.site_pos[one].copy(), model.site_pos[two].copy()), turns, distance, (one, two))


def _tendon(model: mujoco.MjModel, tendon: int) -> tuple[Array, _Pair | None]:
    row = np.zeros(model.nv)
    start, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    sites = []
    for w in range(start, start + count):
        thing = int(model.wrap_objid[w])
        if model.wrap_type[w] == mujoco.mjtWrap.mjWRAP_JOINT:
            row[model.jnt_dofadr[thing]] += model.wrap_prm[w]
        elif model.wrap_type[w] == mujoco.mjtWrap.mjWRAP_SITE:
            sites.append(thing)
    if not sites:
        return row, None
    if len(sites) != 2:
        raise MechlabError(f"the MuJoCo model: tendon {tendon} is not the distance of two sites.")
    return row, _site_pair(model, sites[0], sites[1], False, True)


def equality_rows(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Array, Array]:
    """(rows,) residual and (rows, engine nv) Jacobian of the equality rows of `data`, evaluated (mj_fwdPosition)."""
    return data.efc_pos[_is_equality(data)].copy(), equality_jacobian(model, data)


def equality_jacobian(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """(rows, engine nv) Jacobian of the equality rows of `data`, which must have been evaluated (mj_fwdPosition)."""
    if mujoco.mj_isSparse(model):
        raise MechlabError("the MuJoCo model has a sparse Jacobian; mechlab needs option jacobian='dense'.")
    return constraint_jacobian(model, data)[_is_equality(data)]


def _is_equality(data: mujoco.MjData) -> Array:
    """(nefc,) whether a constraint row belongs to an equality."""
    return np.asarray(data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY)


def constraint_jacobian(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """(nefc, engine nv) Jacobian of all constraint rows of `data`, which must have been evaluated (mj_fwdPosition)."""
    if mujoco.mj_isSparse(model):
        rows = np.zeros((data.nefc, model.nv))
        mujoco.mju_sparse2dense(rows, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
        return rows
    # the engine drops rows that no motion can violate, and keeps their space
    return np.asarray(data.efc_J[: data.nefc * model.nv].reshape(data.nefc, model.nv))


class ExactDynamics:
    """Solves the constrained equations at the state of a MjData after mj_forward."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self.closure = Closure(model)
        self._mass = np.zeros((model.nv, model.nv))

    def solve(self, data: mujoco.MjData) -> tuple[Array, Array]:
        """(engine nv,) accelerations and (rows,) reactions of the rows of `closure`."""
        model = self.model
        mujoco.mj_fullM(model, data, self._mass)
        jacobian, bias = self.closure.rows(data)
        other = np.logical_not(_is_equality(data))
        rows = constraint_jacobian(model, data)
        force = data.qfrc_smooth + rows[other].T @ data.efc_force[other]
        free = np.linalg.solve(self._mass, np.column_stack([force, jacobian.T]))
        compliance = jacobian @ free[:, 1:]
        # Scaled to a unit diagonal, so that rows in metres and in radians are cut off alike; void rows stay void.
        diagonal = np.diag(compliance)
        scale = 1.0 / np.sqrt(np.maximum(diagonal, 1e-14 * np.max(diagonal, initial=1e-300)))
        scaled = compliance * scale[:, None] * scale
        reaction = scale * np.linalg.lstsq(scaled, -scale * (bias + jacobian @ free[:, 0]), rcond=1e-11)[0]
        return free[:, 0] + free[:, 1:] @ reaction, reaction


@dataclass(frozen=True)
class Connector:
    """A connector body, its joints (engine ids) and the weld that holds it."""

    model: mujoco.MjModel
    body: int
    joints: tuple[int, ...]
    weld: int

    def place(self, data: mujoco.MjData, qpos: Array) -> None:
        """Write the coordinates into `qpos` that put the connector into the pose that the weld prescribes.

        `data` has the poses of all bodies that are no connectors (mj_kinematics).
        """
        model = self.model
        parent = int(model.body_parentid[self.body])
        rest = data.xmat[parent].reshape(3, 3) @ quaternion_to_matrix(model.body_quat[self.body])
        origin = data.xpos[parent] + data.xmat[parent].reshape(3, 3) @ model.body_pos[self.body]
        rotation, position = self._target(data)
        turn = rest.T @ rotation
        shift = rest.T @ (position - origin)
        slides = [j for j in self.joints if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_SLIDE]
        hinges = [j for j in self.joints if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE]
        for j in slides:
            qpos[model.jnt_qposadr[j]] = model.jnt_axis[j] @ shift
        for j, angle in zip(hinges, _angles(turn, [model.jnt_axis[j] for j in hinges]), strict=True):
            qpos[model.jnt_qposadr[j]] = angle

    def _target(self, data: mujoco.MjData) -> tuple[Array, Array]:
        """World rotation and position of the connector at which the two sites of the weld coincide."""
        model = self.model
        own, other = int(model.eq_obj1id[self.weld]), int(model.eq_obj2id[self.weld])
        if model.site_bodyid[own] != self.body:
            own, other = other, own
        rotation = data.site_xmat[other].reshape(3, 3) @ quaternion_to_matrix(model.site_quat[own]).T
        return rotation, data.site_xpos[other] - rotation @ model.site_pos[own]


def _angles(turn: Array, axes: list[Array]) -> list[float]:
    """Angles of one hinge, or of two crossing hinges, that make the rotation `turn`."""
    if not axes:
        return []
    if len(axes) == 1:
        across = _perpendicular(axes[0])
        return [_angle(axes[0], across, turn @ across)]
    first, second = axes
    return [_angle(first, second, turn @ second), -_angle(second, first, turn.T @ first)]


def _angle(axis: Array, start: Array, end: Array) -> float:
    """Angle about `axis` from `start` to `end`, both across the axis."""
    return math.atan2(float(cross(start, end) @ axis), float(start @ end))


def _perpendicular(axis: Array) -> Array:
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    out = cross(axis, helper)
    return np.asarray(out / np.linalg.norm(out))


def find_connectors(model: mujoco.MjModel, known_dof: set[int]) -> tuple[Connector, ...]:
    """The connectors of a model: bodies whose joints are not of the Mechanism. Raises MechlabError for one that no weld
    of two sites holds."""
    bodies: dict[int, list[int]] = {}
    for j in range(model.njnt):
        if int(model.jnt_dofadr[j]) not in known_dof:
            bodies.setdefault(int(model.jnt_bodyid[j]), []).append(j)
    welds = {}
    for k in range(model.neq):
        if model.eq_type[k] == mujoco.mjtEq.mjEQ_WELD and model.eq_objtype[k] == mujoco.mjtObj.mjOBJ_SITE:
            for site in (int(model.eq_obj1id[k]), int(model.eq_obj2id[k])):
                welds[int(model.site_bodyid[site])] = k
    for body in bodies:
        if body not in welds:
            name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body)
            raise MechlabError(f"the MuJoCo model: body {name!r} is not of the mechanism, and no weld holds it.")
    return tuple(Connector(model, body, tuple(joints), welds[body]) for body, joints in bodies.items())
