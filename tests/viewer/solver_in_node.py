"""The page's solver in Node: one process for a mechanism, which answers many questions."""

from __future__ import annotations

import json
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from mechlab.formats.mechanism_json import to_json
from mechlab.mechanism import Mechanism
from mechlab.viewer.html_page import SOLVER, asset


class Conversation:
    """A process of Node with the page's solver on one mechanism, which answers one question after another.

    Skips the test where there is no Node."""

    def __init__(self, mechanism: Mechanism, scripts: Sequence[str] = SOLVER) -> None:
        node = shutil.which("node") or shutil.which("nodejs")
        if node is None:
            pytest.skip("no node was found on the path: the page's solver runs in the browser's tests alone")
        script = "\n".join(asset(name) for name in scripts) + ANSWERS
        self._folder = tempfile.TemporaryDirectory()
        path = Path(self._folder.name) / "solver.js"
        path.write_text(script, encoding="utf-8")
        self._process = subprocess.Popen(
            [node, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="utf-8"
        )
        self.read(json.loads(to_json(mechanism)))

    def __enter__(self) -> Conversation:
        return self

    def __exit__(self, *_: object) -> None:
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait(60)
        self._process.stdout.close()
        self._folder.cleanup()

    def _send(self, line: dict[str, Any]) -> Any:
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(json.dumps(line) + "\n")
        self._process.stdin.flush()
        answer = json.loads(self._process.stdout.readline() or '{"error": "the process ended"}')
        if "error" in answer:
            raise AssertionError(answer["error"])
        return answer["answer"]

    def read(self, document: dict[str, Any]) -> None:
        """Goes on with another model. Raises AssertionError with the message of an error there."""
        self._send({"model": document})

    def ask(self, question: str, **arguments: Any) -> Any:
        """The answer of the function `question` of ANSWERS. Raises AssertionError with the message of an error there."""
        return self._send({"ask": question} | arguments)


def in_node(mechanism: Mechanism, questions: Sequence[dict[str, Any]], scripts: Sequence[str] = SOLVER) -> list[Any]:
    """Answers of the page's `scripts` to several questions {"ask": name, ...arguments}."""
    with Conversation(mechanism, scripts) as page:
        return [page.ask(q["ask"], **{k: v for k, v in q.items() if k != "ask"}) for q in questions]


ANSWERS = """
const list = (x) => Array.from(x);
const lists = (found) => Object.fromEntries(Object.entries(found).map(([name, x]) => [name, list(x)]));
let model = null, solver = null;
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
const read = (line) => {
  const asked = JSON.parse(line);
  if (!asked.model) return answers[asked.ask](asked);
  model = new PageModel(asked.model);
  solver = new PoseSolver(model);
  return null;
};
require("readline").createInterface({ input: process.stdin }).on("line", (line) => {
  let out;
  try { out = { answer: read(line) }; } catch (error) { out = { error: error.message }; }
  process.stdout.write(JSON.stringify(out) + "\\n");
});
"""
"""What a Conversation can be asked."""
