"""Equalities of a compiled MuJoCo model: loops, linear relations, and curves of joints."""

from __future__ import annotations

from dataclasses import field

import mujoco
import numpy as np

from mechlab.engines.mujoco.model_file.compiled import OBJECT, given_name, key
from mechlab.engines.mujoco.model_file.read_tendons import Tendons
from mechlab.engines.mujoco.model_file.read_tree import CompiledTree, placement, site_place, switched_off, vector
from mechlab.formats.mjcf.read_drives import Terms, coupled
from mechlab.formats.mjcf.source import Names
from mechlab.lazy_dataclass import dataclass
from mechlab.mechanism.curve import CurveRelation, polynomial
from mechlab.mechanism.geometry import Placement
from mechlab.mechanism.parts import LinearRelation, Loop

EQUALITY = mujoco.mjtEq
End = tuple[str, Placement]


@dataclass
class Equalities:
    """Loops, relations and curves; `offsets`: of a relation with an offset the value of its sum of coordinates, 0 in the file's own pose;
    `of`: the file's equality -> loop, relation or curve."""

    loops: list[Loop] = field(default_factory=list)
    relations: list[LinearRelation] = field(default_factory=list)
    curves: list[CurveRelation] = field(default_factory=list)
    offsets: dict[str, float] = field(default_factory=dict)
    of: dict[str, str] = field(default_factory=dict)


def read_equalities(tree: CompiledTree, tendons: Tendons, names: Names) -> Equalities:
    """The equalities that are active in the file."""
    model, remarks = tree.model, tree.remarks
    out = Equalities()
    flags = (mujoco.mjtDisableBit.mjDSBL_EQUALITY, mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    for k in range(model.neq):
        kind, label = EQUALITY(model.eq_type[k]), key(model, OBJECT.mjOBJ_EQUALITY, k)
        if not model.eq_active0[k] or switched_off(model, *flags):
            remarks.notes.append(f"the equality {label!r} is not active in the file, and not part of the mechanism.")
            continue
        given = given_name(model, OBJECT.mjOBJ_EQUALITY, k)
        if kind in (EQUALITY.mjEQ_CONNECT, EQUALITY.mjEQ_WELD):
            (body_a, at_a), (body_b, at_b) = _ends(tree, k, kind)
            fixed = kind == EQUALITY.mjEQ_WELD and model.eq_data[k, 10] != 0.0
            if body_a == body_b:
                remarks.notes.append(f"the equality {label!r} joins a body to itself, and does nothing.")
            else:
                out.of[label] = names.add(given)
                kind_of_loop = "fixed" if fixed else "spherical"
                out.loops.append(Loop(out.of[label], kind_of_loop, body_a, body_b, at_a, at_b))
        elif kind in (EQUALITY.mjEQ_JOINT, EQUALITY.mjEQ_TENDON):
            _couple(tree, tendons, k, names, out)
        else:
            remarks.lose(f"{kind.name.removeprefix('mjEQ_').lower()} equality", label, "it joins parts of a flex")
    return out


def _ends(tree: CompiledTree, k: int, kind: mujoco.mjtEq) -> tuple[End, End]:
    """The frames that a connect or weld holds together, in the bodies of the Mechanism."""
    model, data = tree.model, tree.model.eq_data[k]
    one, two = int(model.eq_obj1id[k]), int(model.eq_obj2id[k])
    if model.eq_objtype[k] == OBJECT.mjOBJ_SITE:
        return site_place(tree, one), site_place(tree, two)
    if kind == EQUALITY.mjEQ_CONNECT:
        first, second = Placement(vector(data[:3])), Placement(vector(data[3:6]))
    else:
        first, second = placement(data[3:6], data[6:10]), Placement(vector(data[:3]))
    a = (tree.body_of[one], tree.place_of[one] @ first)
    return a, (tree.body_of[two], tree.place_of[two] @ second)


def _couple(tree: CompiledTree, tendons: Tendons, k: int, names: Names, out: Equalities) -> None:
    """A joint or tendon equality: x1 - x1(0) = polynomial in x2 - x2(0), as a relation, a
    curve, or a loop that keeps a distance."""
    model, remarks = tree.model, tree.remarks
    label, given = key(model, OBJECT.mjOBJ_EQUALITY, k), given_name(model, OBJECT.mjOBJ_EQUALITY, k)
    one, two, poly = int(model.eq_obj1id[k]), int(model.eq_obj2id[k]), model.eq_data[k, :5]
    kind = "joint" if model.eq_type[k] == EQUALITY.mjEQ_JOINT else "tendon"
    if kind == "joint" and two >= 0 and np.any(poly[2:]) and all(len(tree.joints_of[x]) == 1 for x in (one, two)):
        output, given_by = tree.joints_of[one][0], tree.joints_of[two][0]
        zeros = {j.name: j.zero for b in tree.bodies for j in b.joints}
        law = polynomial((zeros[output] + poly[0], *poly[1:]), zeros[given_by])
        out.of[label] = names.add(given)
        out.curves.append(CurveRelation(out.of[label], output, given_by, law))
        return
    if two >= 0 and np.any(poly[2:]):
        remarks.lose(f"{kind} equality", label, "its polynomial is nonlinear")
        return
    if kind == "tendon" and one in tendons.straight and two < 0 and poly[0] == 0.0:
        (body_a, at_a), (body_b, at_b) = tendons.straight[one]
        length = float(model.tendon_length0[one])
        out.of[label] = names.add(given)
        out.loops.append(Loop(out.of[label], "distance", body_a, body_b, at_a, at_b, length))
        return
    first, other = (_terms(tree, tendons, kind, x) if x >= 0 else () for x in (one, two))
    if first is None or other is None:
        remarks.lose(f"{kind} equality", label, "its tendon is no sum of joints")
        return
    terms = coupled(first, other, float(poly[1]))
    if not terms:
        remarks.notes.append(f"the equality {label!r} couples nothing.")
        return
    out.of[label] = names.add(given)
    out.relations.append(LinearRelation(out.of[label], terms))
    if poly[0] != 0.0:
        out.offsets[out.of[label]] = float(poly[0])


def _terms(tree: CompiledTree, tendons: Tendons, kind: str, k: int) -> Terms | None:
    if kind == "tendon":
        return tendons.fixed.get(k)
    names = tree.joints_of[k]
    return ((names[0], 1.0),) if len(names) == 1 else None
