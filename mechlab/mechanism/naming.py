"""The keys by which users address the parts of a mechanism, and the refusal of two parts with the same key.

A joint or shaft X: X, X_rate, X_accel, X_force, X_0, X_rate_0; a spherical joint its rates X_x, X_y, X_z. A frame F:
F_x, F_wx, their rates and accelerations, F_rotation. A loop L: L_fx .. L_mz, L_load. A relation or curve R: R_load.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

import numpy as np

from mechlab.errors import MechlabError
from mechlab.mechanism.geometry import quaternion_exp
from mechlab.mechanism.kinematics import TreeKinematics
from mechlab.mechanism.model import Mechanism

SCALAR = {"": "the value", "_rate": "the rate", "_accel": "the acceleration", "_force": "the force", "_0": "the initial value",
          "_rate_0": "the initial rate"}  # fmt: skip
POINT = {f"_{a}{s}": "a coordinate" for a in "xyz" for s in ("", "_rate", "_accel")}
TURN = {f"_w{a}{s}": "the turning" for a in "xyz" for s in ("", "_rate")} | {"_rotation": "the rotation"}
WRENCH = {f"_{k}{a}": "the reaction" for k in "fm" for a in "xyz"}


def keys_of(m: Mechanism) -> Iterator[tuple[str, str]]:
    """(key, its meaning in words) for all parts."""
    for what, names, suffixes in (
        ("joint", [j.name for j in m.joints if j.nv == 1], SCALAR),
        ("shaft", [s.name for s in m.shafts], SCALAR),
        ("spherical joint", [j.name for j in m.joints if j.nv == 3], {f"_{a}": "a rate" for a in "xyz"}),
        ("frame", [f.name for f in m.frames], POINT | TURN),
        ("loop", [x.name for x in m.loops], WRENCH | {"_load": "the load"}),
        ("relation", [r.name for r in m.relations], {"_load": "the load"}),
        ("curve", [x.name for x in m.curves], {"_load": "the load"}),
    ):
        for name in names:
            for suffix, meaning in suffixes.items():
                yield f"{name}{suffix}", f"{meaning} of {what} {name!r}"


def refuse_collisions(m: Mechanism) -> None:
    """Raise MechlabError for two parts with one key, unless it is the same quantity: a slide named as the coordinate of
    the frame that it moves (`floating("p")` and a frame "p")."""
    seen: dict[str, str] = {}
    same: dict[str, bool] = {}
    trees: list[TreeKinematics] = []
    for key, what in keys_of(m):
        if key not in seen:
            seen[key] = what
            continue
        name = key.removesuffix("_rate").removesuffix("_accel")
        if seen[key] != what and name not in same:
            trees = trees or _at_random_poses(m)
            same[name] = _same(trees, name)
        if seen[key] != what and not same[name]:
            raise MechlabError(f"{m.name}: {key!r} would mean {seen[key]} and {what}: give one of them another name.")


def refuse_parameters(m: Mechanism, parameters: Collection[str]) -> None:
    """Raise MechlabError, naming all of them, when parameters of the function that makes `m` have names of keys of the mechanism."""
    taken = set(parameters)
    clashes = {key: what for key, what in keys_of(m) if key in taken}
    if clashes:
        told = "; ".join(f"{key}=... would mean the parameter {key!r} and {what}" for key, what in clashes.items())
        raise MechlabError(f"{m.name}: {told}: give {'one of them' if len(clashes) == 1 else 'one of each'} another name.")


def colliding_frame(frame: str, scalars: Collection[str]) -> bool:
    """True when a frame of that name would have a key in common with a joint or shaft in `scalars`."""
    keys = {f"{frame}{s}" for s in POINT | TURN}
    return any(f"{name}{s}" in keys for name in scalars if name.startswith(frame) for s in SCALAR)


def _at_random_poses(m: Mechanism) -> list[TreeKinematics]:
    """The tree at three poses, closed or not."""
    rng, out = np.random.default_rng(5), []
    for _ in range(3):
        q = m.reference() + m.length_scale * rng.uniform(-0.5, 0.5, m.nq)
        for joint in m.joints:
            if joint.nv == 3:
                q[m.q_slice[joint.name]] = quaternion_exp(rng.uniform(-0.5, 0.5, 3))
        out.append(TreeKinematics(m, q))
    return out


def _same(trees: list[TreeKinematics], name: str) -> bool:
    """True when the name is a frame coordinate that equals the joint of the same name at all poses."""
    m = trees[0].mechanism
    frame = next((f for f in m.frames if name in {f"{f.name}_{a}" for a in "xyz"}), None)
    if frame is None or name not in m.scalar_names:
        return False
    for tree in trees:
        rotation, origin = tree.pose(frame.body)
        point = origin + rotation @ frame.placement.translation
        if abs(point["xyz".index(name[-1])] - float(m.value(name, tree.q))) > 1e-9 * m.length_scale:
            return False
    return True
