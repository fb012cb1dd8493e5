"""Witnesses at many poses: equal to the search of one pose after the other, and to closed forms where these exist."""

from __future__ import annotations

import numpy as np
import pytest

import mechlab as ml
from mechlab.engines.protocol import WITNESSES, available, engine
from mechlab.kit.regular import Regularity
from mechlab.kit.witness import engine_answers
from mechlab.lab.ask import asked_mechanism
from mechlab.mechanism import Mechanism, Status, singularity
from mechlab.mechanism.structure import structure

ENGINES = [name for name in WITNESSES if not available(name)]


def free_names(m: Mechanism) -> list[str]:
    return [n for n in structure(m).independent if n in m.scalar_names]


@pytest.mark.parametrize("engine_name", ENGINES)
@pytest.mark.parametrize("name", ["fourbar", "delta6", "closed_differential", "bricard", "stephenson", "slider_crank", "flyball"])
def test_many_poses_are_the_engine_s_own_search_one_by_one(engine_name: str, name: str) -> None:
    """Positions, rates and accelerations at poses around the reference against `assemble`, `rates`, `accelerations_of` of the engine."""
    m = asked_mechanism(ml.load(name))
    r, names = engine(engine_name), free_names(m)
    t = np.array([-0.07, 0.0, 0.02, 0.05])
    given = {n: m.zero(n) + t * (1.0 + 0.2 * k) for k, n in enumerate(names)}
    rates = {n: 1.0 + 0.1 * k for k, n in enumerate(names)}
    wanted = [k for n in m.scalar_names if n not in names for k in (n, f"{n}_rate", f"{n}_accel")]
    found = engine_answers(engine_name, m, given | {f"{n}_rate": x for n, x in rates.items()}, wanted, len(t))
    for k, answer in enumerate(found):
        one = r.assemble(m, {n: float(x[k]) for n, x in given.items()})
        assert answer.status is (Status.SOLVED if one.status is Status.SOLVED and not answer.notes else answer.status)
        v = r.rates(m, one.q, rates)
        a = r.accelerations_of(m, one.q, v, dict.fromkeys(names, 0.0))
        for key, value in answer.values.items():
            joint = key.removesuffix("_rate").removesuffix("_accel")
            expected = m.row(joint) @ v if key.endswith("_rate") else m.row(joint) @ a if key.endswith("_accel") else m.value(joint, one.q)
            # Newton leaves 1e-13, times the slopes of the mechanism, at accelerations squared
            assert abs(value - float(expected)) < 1e-10 * max(1.0, abs(float(expected)))


def test_an_array_is_the_closed_form_over_a_whole_turn() -> None:
    phi = np.linspace(0.0, 2.0 * np.pi, 100)
    answers = ml.solve("fourbar", crank_angle=phi, crank_rate=2.0, crank_accel=0.5)
    exact = answers["analytic"]
    for name in ENGINES:
        for key, value in answers[name].items():
            turns = (np.asarray(value) - exact[key]) / (2.0 * np.pi) if key.endswith("_angle") else 0.0
            np.testing.assert_allclose(np.asarray(value) - 2.0 * np.pi * np.round(turns), exact[key], atol=1e-11)


def test_poses_without_an_assembly_do_not_spoil_the_others() -> None:
    """A crank-rocker driven at its rocker: beyond the limit there is no pose, and the others are the same as alone."""
    m = asked_mechanism(ml.load("fourbar"))
    zero = m.zero("rocker_angle")
    values = np.array([zero, zero + 0.05, zero + 3.0, zero + 0.1])
    wanted = ["crank_angle", "coupler_angle"]
    for name in ENGINES:
        found = engine_answers(name, m, {"rocker_angle": values}, wanted, 4)
        assert [a.status.exit_code for a in found] == [0, 0, found[2].status.exit_code, 0] and found[2].status.exit_code
        for k in (0, 1, 3):
            alone = engine(name).assemble(m, {"rocker_angle": float(values[k])})
            assert abs(found[k].values["crank_angle"] - float(m.value("crank_angle", alone.q))) < 1e-11


def test_what_is_regular_is_never_singular_by_the_singular_values() -> None:
    """A pose that is certified has no kind of singularity by singular values; a flat parallelogram, where its modes meet, is not
    certified."""
    m = asked_mechanism(ml.load("slider_crank"))
    names = free_names(m)
    r = engine("numpy")
    poses = [r.assemble(m, {names[0]: m.zero(names[0]) + x}).q for x in np.linspace(-1.0, 1.0, 21)]
    look = Regularity(m).set(np.array(poses))
    near = look.singular(None)
    for q, doubt in zip(poses, near, strict=True):
        assert doubt or not singularity(m, q)
    fixed = look.fixed(names)
    for q, sure in zip(poses, fixed, strict=True):
        rows = np.vstack([look.rows(names)[0], Regularity(m).set(q[None]).closure[0]])
        assert not sure or np.linalg.svd(rows, compute_uv=False)[m.nv - 1] > 1e-6
    assert not look.fixed([]).any()
    b = ml.Builder("parallelogram")
    b.bar("crank", ml.revolute("crank"), 0.2).bar("coupler", ml.revolute("coupler"), 0.3, parent="crank", at=(0.2, 0, 0))
    b.bar("rocker", ml.revolute("rocker"), 0.2, at=(0.3, 0, 0))
    b.loop("pin", "coupler", "rocker", (0.3, 0, 0), (0.2, 0, 0))
    folded = b.drive("crank").assemble({"crank": 1.0, "coupler": -1.0, "rocker": 1.0}, hold=["crank"])
    flat = np.array([-folded.zero(j.name) for j in folded.joints])
    assert singularity(folded, flat) and Regularity(folded).set(flat[None]).singular(None)[0]
