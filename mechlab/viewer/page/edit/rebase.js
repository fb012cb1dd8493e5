// A pose becomes the reference pose of a document: placements absorb it, and it is added to the zero of every joint and shaft,
// as Builder.assemble does in Python.

function copied(document) { return JSON.parse(JSON.stringify(document)); }

/** The document with the coordinates q of its model as the reference pose. Throws one sentence where a document cannot hold it. */
function rebased(model, q) {
  const document = copied(model.document);
  for (const body of document.bodies) rebaseBody(body, model, q);
  for (const shaft of document.shafts || []) shaft.zero = model.value(shaft.name, q);
  return document;
}

function rebaseBody(body, model, q) {
  let turn = UNTURNED, shift = [0, 0, 0], moved = false;
  const moves = (body.joints || []).map((joint) => {
    const { kind, q: at, axis } = model.jointNamed.get(joint.name);
    if (kind === "prismatic") {
      if (q[at] !== 0 && turn !== UNTURNED) throw new Error(`The part ${body.name} slides after a turn: it can be changed only where ${joint.name} is at its home.`);
      shift = plus3(shift, times(q[at], axis));
      moved = moved || q[at] !== 0;
      return null;
    }
    const r = kind === "spherical" ? quaternionMatrix(q, at, new Float64Array(9)) : axisRotation(axis, q[at]);
    if (kind === "revolute" ? q[at] === 0 : Math.hypot(q[at + 1], q[at + 2], q[at + 3]) === 0) return null;
    turn = multiplied(turn, r);
    return r;
  });
  (body.joints || []).forEach((joint, k) => {
    let after = UNTURNED;
    for (const r of moves.slice(k + 1)) if (r) after = multiplied(after, r);
    if (after !== UNTURNED) joint.axis = unitVector(timesBack33(after, joint.axis), `the axis of joint ${joint.name}`);
    const known = model.jointNamed.get(joint.name);
    if (known.kind !== "spherical") joint.zero = (joint.zero || 0) + q[known.q];
  });
  if (!moved && turn === UNTURNED) return;
  const { rotation, position } = placementOf(body.placement);
  body.placement = { position: plus3([...position], times33(rotation, shift)), quaternion: turn === UNTURNED ? body.placement.quaternion : quaternionList(multiplied(rotation, turn)) };
}

/** Ball joints whose range counts from the pose that is left: a document cannot keep it. */
function rangesLost(model, q) {
  return model.joints.filter((j) => j.kind === "spherical" && j.range && Math.hypot(q[j.q + 1], q[j.q + 2], q[j.q + 3]) > 1e-9).map((j) => j.name);
}
