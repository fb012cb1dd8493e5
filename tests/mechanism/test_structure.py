"""Freedoms, redundancies and singularities against counts that are known by hand."""

import math
from fractions import Fraction

import numpy as np
import pytest

from mechlab.catalog import entry
from mechlab.mechanism import Builder, Inertia, TreeKinematics, close, revolute, singularity, structure
from mechlab.mechanism.constraints import ConstraintSet
from mechlab.mechanism.structure import generic, shared_loads
from tests.mechanism.samples import fourbar, planetary


def test_fourbar_has_one_freedom_and_one_void_row() -> None:
    found = structure(fourbar())
    assert (found.nv, found.rows, found.rank, found.freedoms, found.mobility) == (3, 3, 2, 1, 1)
    assert [r.sentence for r in found.redundant] == ["pin.z is void: no motion can violate it"]
    assert found.independent == ("crank",)


def test_planetary_redundancy_is_named_with_its_combination() -> None:
    found = structure(planetary())
    assert (found.rows, found.rank, found.freedoms) == (6, 4, 2)
    assert {r.row for r in found.redundant} == {"outer_1", "outer_2"}
    for item in found.redundant:
        assert dict(item.combination)["outer_0"] == 1.0 or math.isclose(dict(item.combination)["outer_0"], 1.0)


def test_delta_counts() -> None:
    delta = entry("delta6")
    p = delta.parameters()
    expected = {"minimal": (10, 15, 9, 6, 0), "parts": (16, 18, 12, 6, 0), "full": (34, 45, 36, 9, 3)}
    for fidelity, (bodies, nv, rows, freedoms, idle) in expected.items():
        m = delta.build(p, fidelity)
        found = structure(m)
        assert (len(m.bodies), found.nv, found.rows, found.freedoms, len(found.idle)) == (
            bodies,
            nv,
            rows,
            freedoms,
            idle,
        )
        assert found.rank == rows and not found.redundant
        assert found.mobility == 6 == found.driven
    assert structure(delta.build(p, "full")).idle == ("spin of plain_1", "spin of plain_2", "spin of plain_3")


def test_singularity_of_the_fourbar_at_a_dead_centre() -> None:
    """With crank 0.1, coupler 0.3, rocker 0.25, ground 0.3 the rocker is at its limit where crank and coupler align."""
    m = fourbar()
    assert singularity(m, m.reference()) == ()
    # Rocker driven instead: at its outer limit |AC| = crank + coupler = 0.4, from the triangle with 0.3 and 0.25.
    from dataclasses import replace

    from mechlab.mechanism import Drive

    other = replace(m, drives=(Drive("rocker", "rocker"),))
    inner = math.acos((0.3**2 + 0.25**2 - 0.4**2) / (2 * 0.3 * 0.25))
    crank = math.acos((0.3**2 + 0.4**2 - 0.25**2) / (2 * 0.3 * 0.4))
    found = close(other, None, {"crank": crank}, steps=10)
    assert found.closed
    assert math.isclose(float(m.value("rocker", found.q)), math.pi - inner, abs_tol=1e-9)
    assert "parallel" in singularity(other, found.q)
    assert "parallel" not in singularity(m, found.q)


def test_head_of_the_delta_is_serially_singular_at_beta_90_degrees() -> None:
    delta = entry("delta6")
    m = delta.build(delta.parameters(), "minimal")
    from mechlab.mechanism import TreeKinematics

    for beta, expected in ((math.pi / 2, ("serial",)), (1.0, ())):
        q = m.reference()
        q[m.q_slice["beta"]] = beta
        tree = TreeKinematics(m, q)
        rotation, origin = tree.pose("output")
        assert singularity(m, q, tree.jacobian("output", origin + rotation @ np.array([0.05, 0, 0]))) == expected


def geared(drive: str = ""):
    """slow = 1e-5 fast: one freedom, which `slow` fixes a hundred thousand times worse than `fast`."""
    b = Builder("geared", gravity=(0, 0, 0))
    for name in ("slow", "fast"):
        b.body(name, revolute(name), inertia=Inertia.axial(1.0, 0.01, 0.005))
    b.relation("ratio", slow=1, fast=Fraction(-1, 100_000))
    if drive:
        b.drive(drive)
    return b.build()


def test_a_coordinate_that_hardly_moves_alone_is_not_chosen_unless_driven() -> None:
    assert structure(geared()).independent == ("fast",)
    assert structure(geared("slow")).independent == ("slow",)


def test_bodies_can_be_moved_alone() -> None:
    m = fourbar()
    q = m.reference() + 0.3
    whole, part = TreeKinematics(m, q), TreeKinematics(m).set(q, only=[0])
    first, *others = (b.name for b in m.bodies)
    assert np.array_equal(part.matrix(first), whole.matrix(first))
    still = TreeKinematics(m)
    assert all(np.array_equal(part.matrix(n), still.matrix(n)) for n in others)


@pytest.mark.parametrize("name", ["closed_differential", "wolfrom", "bennett", "schmidt", "fourbar", "delta6"])
def test_a_load_is_shared_exactly_where_a_null_vector_of_the_rows_changes_it(name: str) -> None:
    """J^T (r + n) = J^T r for J^T n = 0: by singular values, where the product eliminates row by row."""
    found = entry(name)
    m = found.build(found.parameters(), "full")
    rows, (_, jacobian) = ConstraintSet(m), generic(m)
    jacobian = jacobian[np.linalg.norm(jacobian, axis=1) > 1e-12]  # rows of nothing share with nobody
    there = [n for n, row in zip(rows.rows, generic(m)[1], strict=True) if np.linalg.norm(row) > 1e-12]
    u, s, _ = np.linalg.svd(jacobian / np.linalg.norm(jacobian, axis=1)[:, None])
    null = u[:, np.count_nonzero(s > 1e-9 * s[0]) :]
    free = {n for n, row in zip(there, null, strict=True) if np.linalg.norm(row) > 1e-7}
    assert set(shared_loads(m)) == {c.name for c in rows.items if free.intersection(c.rows)}
    assert bool(free) == (name not in ("fourbar", "delta6"))
