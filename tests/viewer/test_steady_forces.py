"""The forces that the page computes at a pose, against Pinocchio's inverse dynamics."""

from __future__ import annotations

import numpy as np
import pytest

import mechlab as ml
from mechlab.mechanism import ConstraintSet, Mechanism, TreeKinematics, structure
from mechlab.mechanism.geometry import Array
from mechlab.studies.cycle.quantities import reactions
from mechlab.viewer.html_page import SOLVER
from tests.viewer.solver_in_node import in_node

SCRIPTS = (*SOLVER, "vectors.js", "mobility.js", "forces.js")
RATE = 3.0


def rates(m: Mechanism, q: Array, drive: str) -> Array:
    """(nv,) rates with the drive at RATE."""
    matrix = np.vstack([ConstraintSet(m).jacobian(TreeKinematics(m, q)), m.row(drive)])
    wanted = np.zeros(len(matrix))
    wanted[-1] = RATE
    return np.asarray(np.linalg.lstsq(matrix, wanted, rcond=1e-11)[0])


NAMES = "fourbar slider_crank quick_return stephenson class4_linkage planetary_stage bricard gear_linkage andrews".split()


@pytest.mark.parametrize("name", NAMES)
def test_forces_are_those_of_pinocchio(name: str) -> None:
    """Loops, joints and the drive at two poses beside the reference pose."""
    d = ml.load(name)
    m = d.mechanism(list(d.entry.fidelities)[-1])
    (free,) = structure(m).independent
    drive = next((x.on for x in m.drives if x.on == free), free)
    home = float(m.value(drive, m.reference()))
    questions = [{"ask": "forces", "drives": {drive: home + x}, "name": drive, "rate": RATE} for x in (0.03, -0.02)]
    for found in in_node(m, questions, SCRIPTS):
        q = np.array(found["q"])
        truth = reactions(m, drive, 0.0, q[None], rates(m, q, drive)[None], np.zeros(m.nv))
        scale = max(1e-6, *(float(np.abs(x[0, :3]).max()) for x in truth.forces.values()), float(abs(truth.drive[0])))
        loads = {x["name"]: np.array(x["vector"]) for x in found["loads"]}
        compared = 0
        for key, table in truth.forces.items():
            # Differences over 2e-3 of poses closed to 1e-13: 1e-7 of the accelerations.
            np.testing.assert_allclose(loads.get(key, np.zeros(3)), table[0, :3], atol=1e-6 * scale)
            compared += 1
        assert compared == len(m.loops) + len(m.joints)
        if drive in {j.name for j in m.joints}:
            assert np.linalg.norm(loads.get(f"{drive} (drive)", np.zeros(3))) == pytest.approx(abs(truth.drive[0]), abs=1e-6 * scale)
