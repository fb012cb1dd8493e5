"""Forces of contacts on the bodies of a run, how deep parts overlap, the stops that push, and the gaps of the file's own equalities."""

from __future__ import annotations

import mujoco
import numpy as np

from mechlab.engines.mujoco.model_file.compiled import OBJECT, key
from mechlab.experiment.model_file import ModelFile
from mechlab.mechanism.geometry import Array
from mechlab.mechanism.parts import GROUND

EQUALITY = int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)
STOP = int(mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT)


class ContactWatch:
    """What is seen of contacts and equalities at the samples, each an evaluated state.

    `deepest` [m]: the largest overlap, at time `deepest_at` [s] between the bodies `pair`; `gaps`: equality -> its largest gap
    [m or rad]; `stops`: of each sample the joint whose stop pushes hardest, "" where none does.
    """

    def __init__(self, file: ModelFile, model: mujoco.MjModel) -> None:
        self.model = model
        names = {0: GROUND} | {k: file.bodies.get(key(model, OBJECT.mjOBJ_BODY, k), "") for k in range(1, model.nbody)}
        self._body = [names[int(b)] for b in model.geom_bodyid]
        self._sums: list[dict[str, Array]] = []
        self.deepest, self.deepest_at, self.pair = 0.0, 0.0, ("", "")
        self.gaps: dict[str, float] = {}
        self.stops: list[str] = []
        self._force = np.zeros(6)

    def take(self, data: mujoco.MjData) -> None:
        """One sample."""
        now: dict[str, Array] = {}
        if data.ncon:
            self._contacts(data, now)
        self._sums.append(now)
        pushed = np.where(data.efc_type == STOP, data.efc_force, 0.0)
        hardest = int(np.argmax(pushed)) if pushed.any() else -1
        self.stops.append(key(self.model, OBJECT.mjOBJ_JOINT, int(data.efc_id[hardest])) if hardest >= 0 else "")
        rows = np.flatnonzero(data.efc_type == EQUALITY)
        for row, which in zip(rows.tolist(), data.efc_id[rows].tolist(), strict=True):
            name = key(self.model, OBJECT.mjOBJ_EQUALITY, which)
            self.gaps[name] = max(self.gaps.get(name, 0.0), abs(float(data.efc_pos[row])))

    def _contacts(self, data: mujoco.MjData, now: dict[str, Array]) -> None:
        geoms, depths, normals = data.contact.geom, -data.contact.dist, data.contact.frame.reshape(-1, 3, 3)
        deepest = int(np.argmax(depths))
        if depths[deepest] > self.deepest:
            sides = zip(geoms[deepest].tolist(), data.contact.flex[deepest].tolist(), strict=True)
            first, second = (self._body[g] if g >= 0 else key(self.model, OBJECT.mjOBJ_FLEX, f) for g, f in sides)
            self.deepest, self.deepest_at, self.pair = float(depths[deepest]), data.time, (first, second)
        for k in np.flatnonzero(data.contact.efc_address >= 0).tolist():
            mujoco.mj_contactForce(self.model, data, k, self._force)
            push = self._force[:3] @ normals[k]
            first, second = geoms[k].tolist()
            for geom, force in ((first, -push), (second, push)):
                name = self._body[geom] if geom >= 0 else ""
                if name:
                    now[name] = now[name] + force if name in now else force

    def channels(self) -> tuple[dict[str, Array], dict[str, str]]:
        """BODY_contact_x, _y, _z [N]: the sum of all contact forces on a body, world axes, of the bodies that touched in the run;
        "ground" is what stands still."""
        order = dict.fromkeys([*self._body, *(name for now in self._sums for name in now)])
        names = [n for n in order if any(n in now for now in self._sums)]
        nothing = np.zeros(3)
        out: dict[str, Array] = {}
        for name in names:
            force = np.array([now.get(name, nothing) for now in self._sums])
            out |= {f"{name}_contact_{axis}": force[:, i] for i, axis in enumerate("xyz")}
        return out, dict.fromkeys(out, "N")
