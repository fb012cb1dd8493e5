"""Random mechanisms for the tests: all joint kinds, compound joints, welded bodies, loops, relations, shafts."""

from fractions import Fraction

import numpy as np

from mechlab.mechanism import Body, Builder, Inertia, Joint, LinearRelation, Placement, Spring, TreeKinematics
from mechlab.mechanism.geometry import matrix_to_quaternion
from mechlab.mechanism.parts import GROUND, LOOP_ROWS, Loop


def direction(rng):
    if rng.random() < 0.4:
        return tuple(float(x) for x in np.eye(3)[rng.integers(3)])
    v = rng.normal(size=3)
    v /= np.linalg.norm(v)
    v /= np.linalg.norm(v)
    return tuple(float(x) for x in v)


def placement(rng):
    return Placement(tuple(rng.normal(size=3) * 0.5), tuple(rng.normal(size=4)))


def inertia(rng):
    x = rng.normal(size=(6, 3)) * 0.1
    out = Inertia()
    for p in x:
        out = out + Inertia.point(float(rng.uniform(0.2, 1.0)), tuple(p))
    return out


def random_mechanism(seed, bodies=8, loops=True):
    """A tree with loops that close at the reference pose by construction, whatever their kind."""
    rng = np.random.default_rng(seed)
    b = Builder(f"random_{seed}", gravity=tuple(rng.normal(size=3) * 5))
    names = [GROUND]
    for i in range(bodies):
        name = f"body_{i}"
        parent = names[rng.integers(len(names))]
        count = int(rng.choice([0, 1, 1, 1, 2, 3])) if i else 1
        joints = tuple(
            Joint(
                f"joint_{i}_{k}",
                str(rng.choice(["revolute", "revolute", "prismatic", "spherical"])),
                direction(rng),
                damping=float(rng.uniform(0, 0.3)),
                armature=float(rng.uniform(0, 0.1)),
                stiffness=float(rng.uniform(0, 2)),
            )
            for k in range(count)
        )
        joints = tuple(
            j if j.kind != "spherical" else Joint(j.name, "spherical", damping=j.damping, armature=j.armature)
            for j in joints
        )
        b.bodies.append(Body(name, parent, placement(rng), joints, inertia(rng)))
        names.append(name)
    scalar = [j.name for x in b.bodies for j in x.joints if j.kind != "spherical"]
    b.springs.append(Spring("spring", names[1], names[-1], (0.1, 0.2, 0.0), (0.0, 0.3, 0.1), 3.0, 0.4, 0.2))
    tree = TreeKinematics(b.build())
    if loops:
        for k, kind in enumerate(LOOP_ROWS):
            one, two = rng.choice(names, 2, replace=False)
            add_loop(b, tree, rng, f"loop_{k}", kind, str(one), str(two))
        if len(scalar) > 2:
            terms = tuple((n, Fraction(int(rng.integers(1, 9)), 4)) for n in scalar[:3])
            b.mesh(LinearRelation("relation", terms))
    leaf = path_joints(b)
    if leaf:
        terms = {n: Fraction(int(rng.integers(1, 9)), 4) for n in leaf}
        b.shaft("shaft", terms, inertia=0.2, damping=0.1, stiffness=1.5, spring_rest=0.1)
    b.frame("tip", names[-1], (0.1, 0.2, 0.3), placement(rng))
    return b.build()


def path_joints(b):
    """Scalar joints on one path from the ground to the last body."""
    by_name = {x.name: x for x in b.bodies}
    at, out = b.bodies[-1].name, []
    while at != GROUND:
        out += [j.name for j in by_name[at].joints if j.kind != "spherical"]
        at = by_name[at].parent
    return out


def add_loop(b, tree, rng, name, kind, one, two):
    ra, pa = tree.pose(one)
    rb, pb = tree.pose(two)
    frame = placement(rng)
    r, p = frame.rotation, frame.translation
    place_a = Placement(tuple(ra.T @ (p - pa)), matrix_to_quaternion(ra.T @ r))
    length = 0.0
    if kind == "distance":
        away = rng.normal(size=3)
        p = p + away
        length = float(np.linalg.norm(away))
    place_b = Placement(tuple(rb.T @ (p - pb)), matrix_to_quaternion(rb.T @ r))
    b.close_here(Loop(name, kind, one, two, place_a, place_b, length))


def random_state(m, rng, spread=1.0):
    q = rng.normal(size=m.nq) * spread
    for j in m.joints:
        if j.kind == "spherical":
            s = m.q_slice[j.name]
            q[s] /= np.linalg.norm(q[s])
    return q, rng.normal(size=m.nv)
