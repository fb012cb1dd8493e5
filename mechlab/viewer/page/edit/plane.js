// The plane of a planar mechanism, its pivots, and what a moved pivot changes: the other pivots stay where they are.

/** The unit normal of the plane in which everything moves at home; null for a spatial mechanism. */
function planeOf(model) {
  const tree = new Tree(model).set(model.home), at = (v) => [...tree.axes.subarray(3 * v, 3 * v + 3)];
  const axes = (kind) => model.joints.filter((joint) => joint.kind === kind).map((joint) => at(joint.v));
  const turns = axes("revolute");
  if (!turns.length || model.joints.some((joint) => joint.kind === "spherical")) return null;
  if (turns.some((axis) => length3(cross3(axis, turns[0])) > 1e-9) || axes("prismatic").some((axis) => Math.abs(inner3(axis, turns[0])) > 1e-9)) return null;
  return turns[0].map((x) => (Math.abs(x) < 1e-15 ? 0 : x));
}

const PINS = ["spherical", "revolute", "universal", "cylindrical"];

/** Pivots of a planar model in its reference pose: [{point (world), places: [{body, local}], pinned, name}]. A frame that is at no
 * pivot is one too, that nothing is pinned to. */
function pivotsOf(model, normal) {
  const { document, size } = model, tree = new Tree(model).set(model.home), found = [];
  const world = (body, local) => [...tree.placed(model.index.get(body), { rotation: UNTURNED, position: local }).origin];
  const add = (name, places, pinned) => {
    const point = world(places[0].body, places[0].local);
    const same = found.filter((pivot) => (pinned ? pivot.pinned : true) && pivot.places.some((a) => places.some((b) => a.body === b.body && length3(across(minus3(world(a.body, a.local), point), normal)) < 1e-9 * size)));
    if (!pinned && same.length) { for (const pivot of same) if (!pivot.pinned || /_|\d/.test(pivot.name)) pivot.name = name; return; }
    const joined = { name: same.length ? same[0].name : name, point, pinned, places: [...same.flatMap((pivot) => pivot.places), ...places] };
    for (const pivot of same) found.splice(found.indexOf(pivot), 1);
    found.push(joined);
  };
  for (const body of document.bodies) {
    const [joint] = body.joints || [];
    if (joint && joint.kind === "revolute") add(joint.name, [{ body: body.parent || GROUND_NAME, local: body.placement.position }, { body: body.name, local: [0, 0, 0] }], true);
  }
  for (const loop of document.loops || []) {
    const a = { body: loop.body_a, local: loop.placement_a.position }, b = { body: loop.body_b, local: loop.placement_b.position };
    if (PINS.includes(loop.kind)) add(loop.name, [a, b], true);
    if (loop.kind === "distance") for (const end of [a, b]) add(loop.name, [end], true);
  }
  for (const frame of document.frames || []) if ((frame.body || GROUND_NAME) !== GROUND_NAME) add(frame.name, [{ body: frame.body, local: frame.placement.position }], false);
  return found;
}

/** The document of a model (its reference pose) with a pivot moved by `by` [m, world, in the plane]: links turn and are stretched,
 * all other pivots stay. Returns {document, kept: names of the parts whose mass stays as it was}. */
function movePivot(model, normal, pivot, by) {
  const document = copied(model.document), tree = new Tree(model).set(model.home), kept = new Set();
  if (!pivot.pinned) {
    const [{ body, local }] = pivot.places, frames = document.frames.filter((f) => f.body === body && length3(minus3(f.placement.position, local)) < 1e-9 * model.size);
    for (const frame of frames) frame.placement.position = plus3(frame.placement.position, timesBack33(rotationIn(tree, model, body), by));
    return { document, kept: [] };
  }
  const pivots = pivotsOf(model, normal).filter((x) => x.pinned), turns = new Map([[GROUND_NAME, 0]]);
  const hosts = new Set(pivot.places.map((place) => place.body));
  const steps = [];
  for (const body of model.parts) {
    const rotation = rotationIn(tree, model, body.name), local = (v) => timesBack33(rotation, v), flat = local(normal);
    const parent = body.parent || GROUND_NAME, [joint] = body.joints || [], up = turns.get(parent);
    const pins = joint && joint.kind === "revolute" && body.joints.length === 1;
    let turn = pins ? 0 : up;
    if (hosts.has(body.name)) {
      const own = pointsOn(pivots, body.name, flat, model.size), origin = own.find((p) => length3(across(p, flat)) < 1e-9 * model.size);
      const place = pivot.places.find((x) => x.body === body.name).local, atOrigin = length3(across(place, flat)) < 1e-9 * model.size;
      const others = own.filter((p) => p !== origin);
      if (pins && origin && others.length === 1) {
        const before = across(others[0], flat), after = atOrigin ? minus3(before, local(by)) : plus3(before, local(by));
        if (length3(after) < 1e-6 * model.size) throw new Error(`${body.name} would have no length.`);
        turn = angleBetween(before, after, flat);
        steps.push([body.name, others[0], times(length3(after) / length3(before) - 1, before), flat]);
      } else if (pins && atOrigin) for (const p of others) steps.push([body.name, p, times(-1, local(by)), flat]);
      else if (!pins && own.length === 1 && joint) steps.push([null, body.name, by]);
      else steps.push([body.name, place, local(by), flat]);
    }
    turns.set(body.name, turn);
  }
  const onGround = pivot.places.find((place) => place.body === GROUND_NAME);
  if (onGround) steps.push([GROUND_NAME, onGround.local, by, normal]);
  for (const [name, ...rest] of steps) {
    if (name === null) shiftPart(document, model, tree, ...rest);
    else for (const part of moveAttached(document, name, ...rest, model.size)) kept.add(part);
  }
  turnParts(document, model, tree, normal, turns);
  for (const loop of document.loops || []) if (loop.kind === "distance") loop.length = spanOf(new PageModel(document), loop);
  return { document, kept: [...kept] };
}

function rotationIn(tree, model, name) {
  const k = model.index.get(name);
  return tree.rotation.slice(9 * k, 9 * k + 9);
}

/** Distinct pivots of a part, in the part. */
function pointsOn(pivots, body, normal, size) {
  const points = [];
  for (const { places } of pivots) for (const place of places) {
    if (place.body === body && !points.some((p) => length3(across(minus3(p, place.local), normal)) < 1e-9 * size)) points.push(place.local);
  }
  return points;
}

/** A slider goes along with its only pivot, and its rail too. */
function shiftPart(document, model, tree, name, by) {
  const body = document.bodies.find((x) => x.name === name);
  body.placement.position = plus3(body.placement.position, timesBack33(rotationIn(tree, model, body.parent || GROUND_NAME), by));
}

/** Parts turned about the normal by `turns` (name -> angle, world): their placements, and the zero of their joints. */
function turnParts(document, model, tree, normal, turns) {
  for (const body of document.bodies) {
    const parent = body.parent || GROUND_NAME, angle = turns.get(body.name) - turns.get(parent);
    if (angle === 0) continue;
    const { rotation } = placementOf(body.placement), flat = timesBack33(rotationIn(tree, model, parent), normal);
    body.placement.quaternion = quaternionList(multiplied(rotationBy(times(angle, flat)), rotation));
    const [joint] = body.joints;
    joint.zero += inner3(times33(rotationIn(tree, model, body.name), joint.axis), normal) > 0 ? angle : -angle;
  }
  const after = new PageModel(document);
  for (const shaft of document.shafts || []) {
    // The zero of a shaft goes with those of its joints.
    const { columns, coefficients } = after.quantity(shaft.name);
    shaft.zero += columns.reduce((sum, joint, k) => sum + coefficients[k] * (joint.zero - model.jointNamed.get(joint.name).zero), 0);
  }
}

/** Distance of the ends of a loop in the reference pose. */
function spanOf(model, loop) {
  const tree = new Tree(model).set(model.home), end = (name, placement) => [...tree.placed(model.index.get(name), placementOf(placement)).origin];
  return length3(minus3(end(loop.body_b, loop.placement_b), end(loop.body_a, loop.placement_a)));
}
