"""What is read of MJCF files, and how far the mechanism that is read is from MuJoCo's own model of the file.

    python tests/benchmarks/read_files.py FILE_OR_FOLDER ... [--csv TABLE.csv]

Of every file: whether it is read, what is lost, and for a file with nothing lost the largest differences over random states:
mass matrix, bias force, constraint rows, free acceleration, actuator forces, relative to their largest entry (or 1), and the
motion over 0.5 s with the contacts switched off in both models and the same settings.

"Nothing lost": everything in the file that acts on the motion without contacts is in the mechanism: bodies, inertias, joints,
springs, dampers, dry friction, stops, loops, couplings, transmissions and gains of actuators, gravity. Contacts and what belongs
to them (floor, pairs, excludes), drawings (meshes, materials, lights, cameras), sensors and keyframes do not count: they are
kept in a run of the file as it is.
"""

from __future__ import annotations

import argparse
import csv
import sys
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np

from mechlab.engines.mujoco.control import engine
from mechlab.engines.mujoco.model import to_mujoco
from mechlab.engines.mujoco.model_file.compiled import OBJECT, compiled, key
from mechlab.engines.mujoco.model_file.coordinates import FileCoordinates
from mechlab.engines.mujoco.model_file.read_model import from_compiled
from mechlab.errors import MechlabError
from mechlab.experiment.model_file import ModelFile

STATES, DURATION = 20, 0.5
DISABLE = mujoco.mjtDisableBit
QUANTITIES = ("mass", "bias", "rows", "free_acceleration", "actuator_force")


@dataclass
class Row:
    """One line of the table."""

    name: str
    read: bool
    lost: str = ""
    differences: dict[str, float] = field(default_factory=dict)
    motion: float = float("nan")
    remark: str = ""


class Pair:
    """MuJoCo's model of a file, and its model of the mechanism that was read, both without contacts."""

    def __init__(self, model: mujoco.MjModel, file: ModelFile) -> None:
        self.file = file
        self.a, (self.b, self.data_b) = model, to_mujoco(file.mechanism)
        self.data_a = mujoco.MjData(model)
        for m in (self.a, self.b):
            m.opt.disableflags |= DISABLE.mjDSBL_CONTACT
        self.map = FileCoordinates(file, model)
        self.controls = [(k, name) for k, name in self._actuators()]
        self._dofs()

    def _actuators(self) -> list[tuple[int, int]]:
        of = [key(self.a, OBJECT.mjOBJ_ACTUATOR, k) for k in range(len(self.a.actuator_trntype))]
        return [
            (k, mujoco.mj_name2id(self.b, OBJECT.mjOBJ_ACTUATOR, self.file.drives[name]))
            for k, name in enumerate(of)
            if name in self.file.drives
        ]

    def _dofs(self) -> None:
        """Addresses in the second model of the first one's coordinates and rates."""
        m = self.file.mechanism
        self.qpos_b, self.dof_b = [], []
        for joint in m.joints:
            k = mujoco.mj_name2id(self.b, OBJECT.mjOBJ_JOINT, joint.name)
            self.qpos_b += range(self.b.jnt_qposadr[k], self.b.jnt_qposadr[k] + joint.nq)
            self.dof_b += range(self.b.jnt_dofadr[k], self.b.jnt_dofadr[k] + joint.nv)

    def set(self, qpos: np.ndarray, qvel: np.ndarray, ctrl: np.ndarray) -> None:
        """Put both models into a state of the file."""
        a, b = self.data_a, self.data_b
        a.qpos[:], a.qvel[:], a.ctrl[:] = qpos, qvel, ctrl
        q, v = self.map.to_mechanism(qpos, qvel)
        b.qpos[self.qpos_b], b.qvel[self.dof_b] = q, v
        for k, other in self.controls:
            b.ctrl[other] = ctrl[k]
        mujoco.mj_forward(self.a, a)
        mujoco.mj_forward(self.b, b)

    def quantities(self, model: mujoco.MjModel, data: mujoco.MjData, dofs: list[int]) -> dict[str, np.ndarray]:
        """The quantities that are compared, in the order of the file's rates."""
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        rows = np.zeros((0, len(dofs)))
        if data.nefc:
            dense = np.zeros((data.nefc, model.nv))
            if mujoco.mj_isSparse(model):
                mujoco.mju_sparse2dense(dense, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
            else:
                dense = np.array(data.efc_J).reshape(data.nefc, model.nv)
            rows = dense[np.array(data.efc_type) == mujoco.mjtConstraint.mjCNSTR_EQUALITY][:, dofs]
        return {
            "mass": mass[np.ix_(dofs, dofs)],
            "bias": data.qfrc_bias[dofs],
            "rows": projector(rows),
            "free_acceleration": data.qacc_smooth[dofs],
            "actuator_force": data.qfrc_actuator[dofs],
        }

    def differences(self, rng: np.random.Generator) -> dict[str, float]:
        """Largest differences over random states, relative to the largest entry or 1."""
        worst = dict.fromkeys(QUANTITIES, 0.0)
        for _ in range(STATES):
            self.set(*self.random_state(rng))
            left = self.quantities(self.a, self.data_a, list(range(self.a.nv)))
            right = self.quantities(self.b, self.data_b, self.dof_b)
            for name in QUANTITIES:
                worst[name] = max(worst[name], relative(left[name], right[name]))
        return worst

    def random_state(self, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """qpos, qvel and ctrl of the file about its reference pose, the controls within their ranges."""
        qpos = np.array(self.map.reference)
        velocity = rng.uniform(-0.5, 0.5, self.a.nv)
        mujoco.mj_integratePos(self.a, qpos, velocity, 1.0)
        low, high = self.a.actuator_ctrlrange[:, 0].copy(), self.a.actuator_ctrlrange[:, 1].copy()
        low[low == high], high[low == high] = -1.0, 1.0
        return qpos, rng.uniform(-1.0, 1.0, self.a.nv), rng.uniform(low, high)

    def motion(self, rng: np.random.Generator) -> float:
        """Largest difference of coordinates [m, rad] after a motion from the reference pose with small random rates, relative
        to 1 or the largest coordinate. Step, integrator, solver and softness are those of the file in both models."""
        a, b = self.a, self.b
        self._same_settings()
        _, _, ctrl = self.random_state(rng)
        qvel = np.zeros(a.nv) if a.neq else rng.uniform(-0.1, 0.1, a.nv)
        mujoco.mj_resetData(a, self.data_a)
        mujoco.mj_resetData(b, self.data_b)
        self.set(np.array(self.map.reference), qvel, ctrl)
        for _ in range(round(DURATION / a.opt.timestep)):
            mujoco.mj_step(a, self.data_a)
            mujoco.mj_step(b, self.data_b)
        q, _ = self.map.to_mechanism(self.data_a.qpos, self.data_a.qvel)
        return relative(q, self.data_b.qpos[self.qpos_b])

    def _same_settings(self) -> None:
        a, b = self.a, self.b
        for name in ("timestep", "integrator", "solver", "iterations", "tolerance", "ls_iterations", "ls_tolerance", "cone",
                     "impratio", "noslip_iterations", "noslip_tolerance"):  # fmt: skip
            setattr(b.opt, name, getattr(a.opt, name))
        if mujoco.mjtJoint.mjJNT_FREE in a.jnt_type:  # the implicit integrators treat free joints in a way of their own
            a.opt.integrator = b.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
        a.opt.jacobian = b.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        clamps = b.opt.disableflags & DISABLE.mjDSBL_CLAMPCTRL
        off = a.opt.disableflags & (DISABLE.mjDSBL_EULERDAMP | DISABLE.mjDSBL_REFSAFE | DISABLE.mjDSBL_WARMSTART)
        b.opt.disableflags = int(clamps | DISABLE.mjDSBL_CONTACT | off)
        for k in range(a.njnt):
            d = int(a.jnt_dofadr[k])
            for n in self.file.joints[key(a, OBJECT.mjOBJ_JOINT, k)]:
                j = mujoco.mj_name2id(b, OBJECT.mjOBJ_JOINT, n)
                e = int(b.jnt_dofadr[j])
                b.jnt_solref[j], b.jnt_solimp[j], b.jnt_margin[j] = a.jnt_solref[k], a.jnt_solimp[k], a.jnt_margin[k]
                count = 3 if b.jnt_type[j] == mujoco.mjtJoint.mjJNT_BALL else 1
                for i in range(count):
                    b.dof_solref[e + i], b.dof_solimp[e + i] = a.dof_solref[d + i], a.dof_solimp[d + i]
        for k in range(a.ntendon):
            j = mujoco.mj_name2id(b, OBJECT.mjOBJ_TENDON, self.file.tendons.get(key(a, OBJECT.mjOBJ_TENDON, k), ""))
            if j >= 0:
                b.tendon_solref_lim[j], b.tendon_solimp_lim[j] = a.tendon_solref_lim[k], a.tendon_solimp_lim[k]
                b.tendon_solref_fri[j], b.tendon_solimp_fri[j] = a.tendon_solref_fri[k], a.tendon_solimp_fri[k]
                b.tendon_margin[j] = a.tendon_margin[k]
        for k in range(a.neq):
            name = self.file.closures.get(key(a, OBJECT.mjOBJ_EQUALITY, k))
            if name is not None:
                j = mujoco.mj_name2id(b, OBJECT.mjOBJ_EQUALITY, name)
                b.eq_solref[j], b.eq_solimp[j] = a.eq_solref[k], a.eq_solimp[k]
                if a.eq_type[k] == mujoco.mjtEq.mjEQ_WELD:
                    b.eq_data[j, 10] = a.eq_data[k, 10]  # torquescale


def projector(rows: np.ndarray) -> np.ndarray:
    """(nv, nv) projector on the space of the rows: equal for two sets of rows that say the same."""
    if not len(rows):
        return np.zeros((rows.shape[1], rows.shape[1]))
    scaled = rows / np.maximum(np.linalg.norm(rows, axis=1), 1e-300)[:, None]
    _, s, vt = np.linalg.svd(scaled, full_matrices=False)
    kept = vt[s > 1e-7 * s[0]]
    return kept.T @ kept


def relative(a: np.ndarray, b: np.ndarray) -> float:
    """Largest difference, relative to the largest entry or 1."""
    if a.shape != b.shape:
        return float("inf")
    return float(np.max(np.abs(a - b), initial=0.0)) / max(1.0, float(np.max(np.abs(a), initial=0.0)))


def row_of(path: Path) -> Row | None:
    """The line of one file; None for a file that MuJoCo does not compile or in which nothing moves."""
    try:
        model = compiled(path)
    except MechlabError:
        return None
    if not model.nv:
        return None
    try:
        file = from_compiled(model, path)
    except MechlabError as error:
        return Row(path.name, False, remark=str(error))
    lost = "; ".join(x.sentence for x in file.lost)
    row = Row(path.name, True, lost, remark=" ".join(file.notes))
    rng = np.random.default_rng(1)
    with engine():
        pair = Pair(model, file)
        row.differences = pair.differences(rng)
        row.motion = pair.motion(rng)
    return row


def files(given: list[str]) -> list[Path]:
    """The files given, and those in the folders given."""
    out: list[Path] = []
    for text in given:
        path = Path(text)
        out += sorted(path.rglob("*.xml")) if path.is_dir() else [path]
    return out


def main(arguments: list[str]) -> int:
    """Print the table; 1 if a file with nothing lost differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="+")
    parser.add_argument("--csv")
    given = parser.parse_args(arguments)
    rows = []
    for path in files(given.paths):
        row = row_of(path)
        if row is None:
            continue
        rows.append(row)
        numbers = " ".join(f"{n} {x:.1e}" for n, x in row.differences.items())
        print(f"{row.name:36} {'read' if row.read else 'NOT READ':8} {'lost' if row.lost else '':5} {numbers} motion {row.motion:.1e}")
        for text in (row.lost, row.remark):
            if text:
                print(f"    {text[:300]}")
    whole = [r for r in rows if r.read and not r.lost]
    wrong = [r.name for r in whole if max(r.differences.values()) > 1e-10]
    moved = [r.name for r in whole if not r.motion <= 1e-9]
    print(
        f"{len(rows)} files, {sum(r.read for r in rows)} read, {len(whole)} with nothing lost; of these "
        f"{len(whole) - len(wrong)} agree to 1e-10 at {STATES} states, {len(whole) - len(moved)} move alike to 1e-9."
    )
    print(f"differ at states: {', '.join(wrong) or 'none'}\ndiffer in motion: {', '.join(moved) or 'none'}")
    if given.csv:
        with Path(given.csv).open("w", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow(["file", "read", "lost", *QUANTITIES, "motion", "remark"])
            for r in rows:
                writer.writerow([r.name, r.read, r.lost, *(r.differences.get(n, "") for n in QUANTITIES), r.motion, r.remark])
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
