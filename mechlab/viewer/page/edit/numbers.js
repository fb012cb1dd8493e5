// The numbers of a part that can be edited: lengths, placements, axes, tooth counts, coefficients of relations.

const AXES_NAMED = ["x", "y", "z"];

/** Rows [{name, value, unit ("m", "rad", "", "ratio", "teeth"), main, apply(document, value) -> parts whose mass is kept}] of the part
 * `part` of a model in its reference pose. normal: see planeOf; pairs: meshes, see meshesOf. */
function numbersOf(model, part, normal, pairs) {
  const { document } = model, body = document.bodies.find((x) => x.name === part), rows = [];
  if (body) {
    rows.push(...hostRows(model, part, normal), ...placeRows(model, body, normal));
    for (const joint of body.joints) if (joint.kind !== "spherical") rows.push(...axisRows(body, joint));
  } else rows.push(...hostRows(model, part, normal));
  for (const loop of document.loops || []) {
    if (loop.kind === "distance" && [loop.body_a, loop.body_b].includes(part))
      rows.push({ name: `length of ${loop.name}`, value: loop.length, unit: "m", main: true, apply: (d, x) => { d.loops.find((l) => l.name === loop.name).length = positive(x); } });
  }
  gearsOf(model).forEach((gear, k) => {
    if (gear.body === part) rows.push({ name: `teeth of ${gear.shape.name || gear.body}`, value: gear.teeth, unit: "teeth", main: true, apply: (d, z) => setTeeth(d, model, pairs, k, toothCount(z)) });
  });
  const own = body ? body.joints.map((joint) => joint.name) : [];
  for (const relation of document.relations || []) {
    for (const [name, ratio] of Object.entries(relation.coefficients)) {
      if (own.includes(name)) rows.push({ name: `${relation.name}: coefficient of ${name}`, value: ratio, unit: "ratio", main: true, apply: (d, x) => { d.relations.find((r) => r.name === relation.name).coefficients[name] = x; } });
    }
  }
  for (const frame of document.frames || []) {
    if ((frame.body || GROUND_NAME) !== part) continue;
    rows.push(...componentRows(`point ${frame.name}`, frame.placement.position, flatIn(model, part, normal), false, (d, by) => {
      const found = d.frames.find((f) => f.name === frame.name);
      found.placement.position = plus3(found.placement.position, by);
    }));
  }
  rows.push(...sizeRows(body ? body.shapes || [] : document.ground_shapes || [], part));
  return rows;
}

function positive(x) {
  if (!(x > 0)) throw new Error("A length must be greater than 0.");
  return x;
}

function toothCount(z) {
  if (!(Number.isInteger(z) && z >= 5 && z <= 1000)) throw new Error("Expected a whole number of teeth from 5 to 1000.");
  return z;
}

/** The normal of the plane in the axes of a part. */
function flatIn(model, part, normal) {
  if (!normal) return null;
  return timesBack33(rotationIn(new Tree(model).set(model.home), model, part), normal);
}

/** Points of a part to which others are pinned: one row for each component, and the length of a link between two pivots. */
function hostRows(model, part, normal) {
  const { document, size } = model, flat = flatIn(model, part, normal), points = [];
  const see = (name, position) => {
    const same = points.find((p) => length3(across(minus3(p.position, position), flat)) < 1e-9 * size);
    if (same) same.names.push(name); else points.push({ names: [name], position });
  };
  for (const other of document.bodies) if ((other.parent || GROUND_NAME) === part && other.joints.length && other.joints[0].kind !== "prismatic") see(other.joints[0].name, other.placement.position);
  for (const loop of document.loops || []) {
    if (loop.body_a === part) see(loop.name, loop.placement_a.position);
    if (loop.body_b === part) see(loop.name, loop.placement_b.position);
  }
  const far = points.filter((p) => length3(across(p.position, flat)) > 1e-9 * size);
  const link = part !== GROUND_NAME && far.length === 1;
  const rows = [];
  if (link) {
    const { position } = far[0], length = length3(across(position, flat));
    rows.push({ name: "length", value: length, unit: "m", main: true, apply: (d, x) => moveAttached(d, part, position, times(positive(x) / length - 1, across(position, flat)), flat, size) });
  }
  for (const { names, position } of points) rows.push(...componentRows(`pivot ${[...new Set(names)].join(", ")}`, position, flat, !link, (d, by) => moveAttached(d, part, position, by, flat, size)));
  return rows;
}

/** One row for each component of a point; `move(document, by)` moves it. Components along the normal are not among the main ones. */
function componentRows(name, position, normal, main, move) {
  return AXES_NAMED.map((axis, k) => ({ name: `${name}, ${axis}`, value: position[k], unit: "m", main: main && (!normal || Math.abs(normal[k]) < 1 - 1e-6),
    apply: (d, x) => move(d, [0, 1, 2].map((i) => (i === k ? x - position[k] : 0))) }));
}

/** Where a part stands in its parent, and how it is turned there. */
function placeRows(model, body, normal) {
  const parent = body.parent || GROUND_NAME, flat = flatIn(model, parent, normal), { position, quaternion } = body.placement;
  const slides = body.joints.length && body.joints[0].kind === "prismatic";
  const find = (d) => d.bodies.find((x) => x.name === body.name);
  const move = (d, by) => { if (!slides) return moveAttached(d, parent, position, by, flat, model.size); const { placement } = find(d); placement.position = plus3(placement.position, by); return []; };
  const turn = rotationVector(quaternion);
  return [...componentRows(`stands in ${parent}`, position, flat, true, move),
    ...AXES_NAMED.map((axis, k) => ({ name: `turned in ${parent}, about ${axis}`, value: turn[k], unit: "rad", main: false,
      apply: (d, x) => { find(d).placement.quaternion = quaternionList(rotationBy(turn.map((y, i) => (i === k ? x : y)))); } }))];
}

function axisRows(body, joint) {
  return AXES_NAMED.map((axis, k) => ({ name: `axis of ${joint.name}, ${axis}`, value: joint.axis[k], unit: "", main: false, apply: (d, x) => {
    const found = d.bodies.find((other) => other.name === body.name).joints.find((other) => other.name === joint.name);
    found.axis = unitVector(joint.axis.map((y, i) => (i === k ? x : y)), `the axis of ${joint.name}`);
  } }));
}

/** Sizes of shapes that the page draws itself. */
function sizeRows(shapes, part) {
  const rows = [];
  shapes.forEach((shape, i) => {
    if (!["box", "cylinder", "tube", "sphere", "link", "plate_link"].includes(shape.kind)) return;
    for (const [key, value] of Object.entries(shape.size)) {
      if (key === "points" || /^[xy]_\d+$/.test(key) || (key === "length" && shape.kind === "link")) continue;
      rows.push({ name: `${shape.name || shape.kind}: ${key}`, value, unit: "m", main: false, apply: (d, x) => {
        const owner = part === GROUND_NAME ? d.ground_shapes : d.bodies.find((body) => body.name === part).shapes;
        owner[i].size[key] = positive(x);
      } });
    }
  });
  return rows;
}
