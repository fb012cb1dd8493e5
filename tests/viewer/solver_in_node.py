"""The page's solver in Node: one process that answers many questions."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Sequence
from typing import Any

import pytest

from mechlab.formats.mechanism_json import to_json
from mechlab.mechanism import Mechanism
from mechlab.viewer.html_page import SOLVER, asset


def in_node(
    mechanism: Mechanism, questions: Sequence[dict[str, Any]], scripts: Sequence[str] = SOLVER
) -> list[Any]:
    """Answers of the page's `scripts` on one mechanism: each question names a function of ANSWERS and its arguments.

    Skips the test where there is no Node."""
    node = shutil.which("node") or shutil.which("nodejs")
    if node is None:
        pytest.skip("no node was found on the path: the page's solver runs in the browser's tests alone")
    script = "\n".join(asset(name) for name in scripts) + ANSWERS
    asked = json.dumps({"model": json.loads(to_json(mechanism)), "questions": list(questions)})
    done = subprocess.run(
        [node, "-e", script], input=asked, capture_output=True, text=True, encoding="utf-8", timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr[-3000:]
    found = json.loads(done.stdout)
    assert isinstance(found, list)
    return found


ANSWERS = """
const asked = JSON.parse(require("fs").readFileSync(0, "utf8"));
const model = new PageModel(asked.model), solver = new PoseSolver(model), list = (x) => Array.from(x);
const lists = (found) => Object.fromEntries(Object.entries(found).map(([name, x]) => [name, list(x)]));
const answers = {
  facts: () => ({ size: model.size, bodies: model.bodies, names: model.names, drives: model.drives, nq: model.nq, nv: model.nv,
    rank: model.structure.rank, home: list(model.home) }),
  poses: ({ q }) => lists(model.poses(q)),
  velocities: ({ q, v }) => lists(model.velocities(q, v)),
  constraints: ({ q }) => lists(model.constraints(q)),
  value: ({ name, q }) => model.value(name, q),
  row: ({ name }) => list(model.row(name)),
  forces: ({ drives, name, rate }) => {
    solver.solve({ drives });
    return { q: list(solver.q), loads: new SteadyForces(model).at(solver, name, rate) };
  },
  set: ({ q }) => { solver.set(Float64Array.from(q)); return list(solver.q); },
  text: () => documentText(model.document) + "\\n",
  rebased: ({ q }) => documentText(settled(model, Float64Array.from(q)).document),
  pivots: () => pivotsOf(model, planeOf(model)),
  move: ({ name, by }) => {
    const normal = planeOf(model), { document, kept } = movePivot(model, normal, pivotsOf(model, normal).find((p) => p.name === name), by);
    const moved = settled(new PageModel(document), model.home);
    return { text: documentText(moved.document), kept, faults: meshFaults(moved, meshesOf(model)), pivots: pivotsOf(moved, normal) };
  },
  edit: ({ part, row, to, stepwise = true }) => {
    const pairs = meshesOf(model), found = numbersOf(model, part, planeOf(model), pairs).find((x) => x.name === row);
    let kept = [];
    const apply = (document, x) => { kept = found.apply(document, stepwise ? x : to) || []; };
    try {
      const done = reassembled(model, model.home, { from: stepwise ? found.value : null, to: stepwise ? to : null, apply }, model.drives);
      return { text: documentText(done.model.document), moved: done.moved, kept, faults: meshFaults(done.model, pairs) };
    } catch (error) { return { refused: error.message, reached: error.reached ?? null }; }
  },
  solve: (wish) => {
    const began = performance.now(), report = solver.solve(wish);
    return { ...report, q: list(solver.q), milliseconds: performance.now() - began };
  },
};
const out = asked.questions.map(({ ask, ...rest }) => answers[ask](rest));
process.stdout.write(JSON.stringify(out));
"""
"""What `in_node` can be asked: {"ask": name, ...arguments}."""
