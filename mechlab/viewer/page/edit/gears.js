// Gears of a document: which pairs mesh, whether their axes are where their teeth need them, and what a tooth count changes.

/** Spur and ring gears in the reference pose: {body, shape, point, axis, teeth, module, inside}. */
function gearsOf(model) {
  const tree = new Tree(model).set(model.home), gears = [];
  const add = (body, k, shape) => {
    if (shape.kind !== "spur_gear" && shape.kind !== "internal_gear") return;
    const { rotation, origin } = tree.placed(k, placementOf(shape.placement));
    gears.push({ body, shape, point: [...origin], axis: [rotation[2], rotation[5], rotation[8]], ...shape.size, inside: shape.kind === "internal_gear" });
  };
  model.parts.forEach((body, k) => (body.shapes || []).forEach((shape) => add(body.name, k, shape)));
  (model.document.ground_shapes || []).forEach((shape) => add(GROUND_NAME, model.parts.length, shape));
  return gears;
}

function axisDistance(a, b) { return length3(across(minus3(b.point, a.point), a.axis)); }

/** The distance of the axes that the teeth of two gears need [m]. */
function pitchDistance(a, b) { return (Math.max(a.module, b.module) * Math.abs(a.inside || b.inside ? a.teeth - b.teeth : a.teeth + b.teeth)) / 2; }

/** Pairs of indices of the gears that mesh: side by side, as far apart as their teeth need. */
function meshesOf(model) {
  const gears = gearsOf(model), pairs = [];
  gears.forEach((a, i) => gears.forEach((b, j) => {
    if (j <= i || a.body === b.body || (a.inside && b.inside) || Math.abs(a.module - b.module) > 1e-9 * a.module) return;
    if (length3(cross3(a.axis, b.axis)) > 1e-9 || Math.abs(inner3(minus3(b.point, a.point), a.axis)) > 0.5 * (a.width + b.width)) return;
    if (Math.abs(axisDistance(a, b) - pitchDistance(a, b)) < 0.01 * a.module) pairs.push([i, j]);
  }));
  return pairs;
}

/** Sentences on the pairs that no longer mesh. */
function meshFaults(model, pairs) {
  const gears = gearsOf(model), mm = (x) => `${Number((1000 * x).toPrecision(5))} mm`;
  return pairs.map(([i, j]) => [gears[i], gears[j]]).filter(([a, b]) => Math.abs(axisDistance(a, b) - pitchDistance(a, b)) > 1e-6 * a.module).map(([a, b]) =>
    `${a.shape.name || a.body} and ${b.shape.name || b.body} do not mesh: their axes are ${mm(axisDistance(a, b))} apart, their teeth (${a.teeth} and ${b.teeth} of ${mm(a.module)}) need ${mm(pitchDistance(a, b))}.`);
}

/** Gives a gear another tooth count, in its shape and in the relations of the meshes `pairs` it is in. */
function setTeeth(document, model, pairs, index, teeth) {
  const gears = gearsOf(model);
  for (const pair of pairs.filter((x) => x.includes(index))) {
    const [a, b] = [gears[index], gears[pair.find((k) => k !== index)]];
    for (const relation of document.relations || []) {
      const found = meshRow(model, relation, a, b);
      if (found) relation.coefficients = found(teeth);
    }
  }
  const after = gearsOf(new PageModel(document))[index].shape;
  after.size.teeth = teeth;
}

/** How a relation comes from the mesh of the gears a and b: a function (teeth of a) -> coefficients, or null where it does not.
 * alpha (A - C) +- beta (B - C) = 0 with A, B, C the sums over the joints that turn the gears and their carrier. */
function meshRow(model, relation, a, b) {
  const path = (name) => new Set(model.tree.columns[model.index.get(name)]);
  const inA = path(a.body), inB = path(b.body), sign = a.inside || b.inside ? -1 : 1;
  const names = model.joints.filter((j) => inA.has(j.v) || inB.has(j.v) || j.name in relation.coefficients);
  if (names.some((joint) => joint.kind !== "revolute")) return null;
  const tree = new Tree(model).set(model.home);
  const way = (joint) => (inner3([...tree.axes.subarray(3 * joint.v, 3 * joint.v + 3)], a.axis) > 0 ? 1 : -1);
  const value = (joint, za, zb, held) => way(joint) * ((inA.has(joint.v) ? za : 0) + sign * (inB.has(joint.v) ? zb : 0) - (held ? za + sign * zb : 0));
  const given = new Map(names.map((joint) => [joint, joint.name in relation.coefficients ? ratioNumber(relation.coefficients[joint.name]) : 0]));
  const first = names.find((joint) => given.get(joint) !== 0);
  for (const held of [false, true]) {
    const scale = given.get(first) / value(first, a.teeth, b.teeth, held);
    if (!Number.isFinite(scale)) continue;
    const carrier = new Map(names.map((joint) => [joint, [false, true].find((h) => Math.abs(scale * value(joint, a.teeth, b.teeth, h) - given.get(joint)) < 1e-9 * Math.abs(given.get(first)))]));
    if (names.some((joint) => carrier.get(joint) === undefined)) continue;
    return (teeth) => {
      const lead = Math.round(value(first, teeth, b.teeth, carrier.get(first)));
      const rows = names.map((joint) => [joint.name, Math.round(value(joint, teeth, b.teeth, carrier.get(joint)))]).filter(([, x]) => x !== 0);
      const order = Object.keys(relation.coefficients);
      return Object.fromEntries(rows.sort(([p], [q]) => order.indexOf(p) - order.indexOf(q)).map(([name, x]) => [name, ratioText(x, lead)]));
    };
  }
  return null;
}

/** A ratio of whole numbers in lowest terms, as the documents write it. */
function ratioText(over, under) {
  const divisor = (p, q) => (q ? divisor(q, p % q) : Math.abs(p));
  const common = divisor(over, under) * (under < 0 ? -1 : 1);
  return under / common === 1 ? String(over / common) : `${over / common}/${under / common}`;
}
