"""Springs between points on Pinocchio: lengths and gradients against the numpy tree and against differences, at poses off the loops."""

import numpy as np
import pytest

from mechlab import catalog
from mechlab.engines.pinocchio.dynamics import PinPlant
from mechlab.mechanism import TreeKinematics, integrate
from mechlab.mechanism.statics import spring_row


@pytest.mark.parametrize("name", ["equipoised", "flyball", "andrews"])
def test_lengths_and_gradients(name):
    entry = catalog.entry(name)
    m = entry.build(entry.parameters(), entry.default_fidelity)
    rng, step = np.random.default_rng(1), 1e-6
    v, q = rng.normal(size=m.nv), integrate(m, m.reference(), 0.1 * rng.normal(size=m.nv))
    plant = PinPlant(m, q, v)
    lengths, rows = (x.copy() for x in plant.passive.springs.stretched())
    truth = [spring_row(TreeKinematics(m, q), s) for s in m.springs]
    assert np.allclose(lengths, [x for x, _ in truth], rtol=1e-14) and np.allclose(
        rows, [x for _, x in truth], atol=1e-14
    )
    ahead, behind = (PinPlant(m, integrate(m, q, s * v)).passive.springs.stretched()[0] for s in (step, -step))
    assert np.allclose(rows @ v, (ahead - behind) / (2.0 * step), atol=1e-8)
    damping = np.array([s.damping for s in m.springs])
    assert plant.passive.springs.loss(v) == pytest.approx(float(damping @ (rows @ v) ** 2))
