"""The table of the catalog against the entries themselves."""

import numpy as np
import pytest

from mechlab.catalog import NAMES, entry
from mechlab.catalog.table import TABLE, Row
from mechlab.mechanism import Mechanism, TreeKinematics
from mechlab.mechanism.structure import structure


def test_every_row_is_that_of_its_entry() -> None:
    assert len(set(NAMES)) == len(TABLE)
    for row in TABLE:
        e = entry(row.name)
        assert row.name == e.name
        assert row.title == e.title
        assert row.summary == e.summary
        assert row.fidelities == tuple(e.fidelities)
        assert row.scenes == tuple(e.scenes)
        assert row.claims == bool(e.claims or e.figures), f"{row.name}: say so in mechlab/catalog/table.py"


@pytest.mark.parametrize("row", TABLE, ids=lambda r: r.name)
def test_freedoms_and_motion_are_those_of_the_mechanism(row: Row) -> None:
    """Freedoms by the rank of the constraints; motion by the velocities of all bodies in the reference pose."""
    m = entry(row.name).build(entry(row.name).parameters(), row.fidelities[-1])
    assert (structure(m).freedoms, motion_of(m)) == (row.freedoms, row.motion), f"{row.name}: say so in mechlab/catalog/table.py"


def motion_of(m: Mechanism) -> str:
    """planar: all bodies turn about one direction and move across it; spherical: one point at rest belongs to all of them."""
    tree = TreeKinematics(m, m.reference(), np.zeros(m.nv))
    places = [tree.pose(b.name)[1] for b in m.bodies]
    twists = np.array([tree.jacobian(b.name, c) for b, c in zip(m.bodies, places, strict=True)])  # (bodies, 6, nv)
    velocity, turning = (x.swapaxes(1, 2).reshape(-1, 3) for x in (twists[:, :3], twists[:, 3:]))
    _, size, axes = np.linalg.svd(turning)
    if size[1:].max(initial=0.0) < 1e-9 and np.abs(velocity @ axes[0]).max() < 1e-9:
        return "planar"
    cross = np.array([np.cross(w, np.eye(3), axisb=0) for w in turning])  # cross[i].T @ x = w x x
    rows = np.concatenate([c.T for c in cross])
    target = np.concatenate([c.T @ p for c, p in zip(cross, np.repeat(places, m.nv, axis=0), strict=True)]) - velocity.ravel()
    center = np.linalg.lstsq(rows, target, rcond=None)[0]
    return "spherical" if np.abs(rows @ center - target).max() < 1e-9 else "spatial"
