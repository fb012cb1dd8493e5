"""The forces on a part that is cut free, with what they make together, in a real browser against Newton's law in Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from mechlab import api
from mechlab.mechanism import TreeKinematics
from mechlab.mechanism.assembly import close
from mechlab.viewer import write_page

pytestmark = pytest.mark.browser

ARROWS = """() => lab.arrows.map(a => ({ name: a.name, label: a.label, kind: a.kind, role: a.role || "",
    vector: [...a.vectors].map(x => x * (a.sign || 1)), point: [...a.points] }))"""


def test_the_forces_on_a_part_make_its_acceleration(look: Callable[..., Any], tmp_path: Any) -> None:
    """Net force: m times the second difference of closed poses (error h^2, 1e-6); it is the sum of all forces drawn on the part."""
    m = api.load("fourbar").mechanism()
    page = look(write_page(api.explore("fourbar", vary={}), tmp_path / "page.html").as_uri(), width=1200, height=800)
    page.evaluate("lab.explorer.move('crank_angle', 1.4)")
    page.locator("#free-body").select_option("coupler")
    names = [a["label"] for a in page.evaluate(ARROWS)]
    assert sorted(names) == ["joint with crank, on coupler", "pin, on coupler", "weight of coupler"]
    page.get_by_label("net force").check()
    page.get_by_label("inertia").check()
    arrows = page.evaluate(ARROWS)
    rate = api.explore("fourbar", vary={}).explore.rates.get("crank_angle", 1.0)
    body, h = m.body("coupler"), 1e-3
    tree, poses = TreeKinematics(m), []
    for value in (1.4 - h, 1.4, 1.4 + h):
        found = close(m, m.reference(), {"crank_angle": value})
        tree.set(found.q)
        rotation, origin = tree.pose("coupler")
        poses.append(origin + rotation @ np.array(body.inertia.com))
    net = body.inertia.mass * (poses[0] - 2 * poses[1] + poses[2]) / h**2 * rate**2
    by_role = {(a["role"], a["kind"]): a for a in arrows if a["role"]}
    size = np.linalg.norm(net)
    np.testing.assert_allclose(by_role["net", "force"]["vector"], net, atol=1e-5 * size + 1e-9)
    np.testing.assert_allclose(by_role["net", "force"]["point"], poses[1], atol=1e-6)
    np.testing.assert_allclose(by_role["inertia", "force"]["vector"], -net, atol=1e-5 * size + 1e-9)
    acting = [a for a in arrows if not a["role"] and a["kind"] == "force"]
    weights = max(np.linalg.norm(a["vector"]) for a in acting)
    np.testing.assert_allclose(np.sum([a["vector"] for a in acting], axis=0), net, atol=1e-6 * (size + weights))
    turning = np.sum([np.cross(np.subtract(a["point"], poses[1]), a["vector"]) for a in acting], axis=0)
    moment = by_role["net", "torque"]["vector"]
    np.testing.assert_allclose(turning[1], moment[1], atol=1e-6 * (1 + abs(moment[1])))
    assert page.errors == []
