// The mechanism of the page: names, coordinates and constraints of a model document (the JSON that `generate` writes).
// No page and no drawing here: the solver's scripts also run in Node.

const LOOP_ROWS = {
  // kind: axes of the offset rows; pairs (axis of a, axis of b) of the angle rows. As mechanism/constraints.py.
  spherical: [[0, 1, 2], []],
  revolute: [[0, 1, 2], [[0, 2], [1, 2]]],
  universal: [[0, 1, 2], [[0, 1]]],
  cylindrical: [[0, 1], [[0, 2], [1, 2]]],
  prismatic: [[0, 1], [[0, 2], [1, 2], [0, 1]]],
  fixed: [[0, 1, 2], [[0, 2], [1, 2], [0, 1]]],
  distance: [[], []],
};
const GROUND_NAME = "ground";

/** Something with one value, a joint or a shaft: value = zero + sum of coefficients x coordinates. */
class Quantity {
  constructor(name, zero, range, columns, coefficients, slides) {
    Object.assign(this, { name, zero, range, columns, coefficients, slides });
  }
}

class PageModel {
  /** Reads a model document. Throws an Error with one sentence for a document that it cannot read. */
  constructor(document) {
    if (!document || document.format !== "mechlab.mechanism") throw new Error("This document holds no mechanism of mechlab.");
    if (document.schema !== 1) throw new Error(`The mechanism has schema ${document.schema}; this page reads schema 1.`);
    this.document = document;
    this.parts = ordered(document.bodies || []);
    this._joints();
    this._quantities();
    this._drawn();
    this.size = modelSize(this);
    this.home = new Float64Array(this.nq);
    for (const joint of this.joints) if (joint.kind === "spherical") this.home[joint.q] = 1;
    this.tree = new Tree(this);
    this.closure = new Closure(this);
    this._drives = null;
  }

  _joints() {
    this.index = new Map([[GROUND_NAME, -1], ...this.parts.map((body, k) => [body.name, k])]);
    this.joints = [];
    let [q, v] = [0, 0];
    this.parts.forEach((body, k) => {
      for (const joint of body.joints || []) {
        const kind = joint.kind || "revolute";
        if (!["revolute", "prismatic", "spherical"].includes(kind)) throw new Error(`Joint ${joint.name} is of the unknown kind ${kind}.`);
        const axis = kind === "spherical" ? [0, 0, 1] : unitVector(joint.axis || [0, 0, 1], `the axis of joint ${joint.name}`);
        this.joints.push({ name: joint.name, kind, body: body.name, part: k, q, v, range: joint.range || null, zero: joint.zero || 0, axis });
        q += kind === "spherical" ? 4 : 1;
        v += kind === "spherical" ? 3 : 1;
      }
    });
    this.nq = q;
    this.nv = v;
    this.jointNamed = new Map(this.joints.map((joint) => [joint.name, joint]));
    if (this.jointNamed.size !== this.joints.length) throw new Error("Two joints have the same name.");
  }

  _quantities() {
    this.quantities = new Map();
    for (const j of this.joints) {
      if (j.kind === "spherical") continue;
      this.quantities.set(j.name, new Quantity(j.name, j.zero, j.range, [j], [1], j.kind === "prismatic"));
    }
    for (const shaft of this.document.shafts || []) {
      const [columns, coefficients] = this.combination(shaft.coefficients, `shaft ${shaft.name}`);
      const slides = columns.length > 0 && columns.every((joint) => joint.kind === "prismatic");
      this.quantities.set(shaft.name, new Quantity(shaft.name, shaft.zero || 0, shaft.range || null, columns, coefficients, slides));
    }
    this.names = [...this.quantities.keys()];
  }

  /** Joints and numbers of exact coefficients {joint: "7/5"}. */
  combination(coefficients, what) {
    const columns = [], numbers = [];
    for (const [name, ratio] of Object.entries(coefficients || {})) {
      const joint = this.jointNamed.get(name);
      if (!joint || joint.kind === "spherical") throw new Error(`${what} names ${name}, which is no joint with one value.`);
      columns.push(joint);
      numbers.push(ratioNumber(ratio, what));
    }
    return [columns, numbers];
  }

  /** Bodies, then shafts with shapes, then the ground: the order of story.bodies. */
  _drawn() {
    this.drawnShafts = [];
    this.bodies = this.parts.map((body) => body.name);
    for (const shaft of this.document.shafts || []) {
      if (!(shaft.shapes || []).length) continue;
      const part = this.partIndex(shaft.body || GROUND_NAME, `shaft ${shaft.name}`);
      this.drawnShafts.push({ quantity: this.quantities.get(shaft.name), part, placement: placementOf(shaft.placement) });
      this.bodies.push(this.index.has(shaft.name) ? `${shaft.name} (shaft)` : shaft.name);
    }
    this.bodies.push(GROUND_NAME);
  }

  /** Index of a body in `parts`, -1 for the ground. */
  partIndex(name, what) {
    const k = this.index.get(name);
    if (k === undefined) throw new Error(`${what} names the body ${name}, which does not exist.`);
    return k;
  }

  quantity(name) {
    const found = this.quantities.get(name);
    if (!found) throw new Error(`There is no joint or shaft ${name} with one value; there are ${this.names.join(", ")}.`);
    return found;
  }

  /** Physical value of a joint or shaft at the coordinates q. */
  value(name, q) { return quantityValue(this.quantity(name), q); }

  /** Float64Array(nv): the rate of a joint or shaft is this row times the rates. */
  row(name) {
    const { columns, coefficients } = this.quantity(name), row = new Float64Array(this.nv);
    columns.forEach((joint, k) => { row[joint.v] += coefficients[k]; });
    return row;
  }

  /** [low, high] of a joint or shaft, or null. */
  range(name) { return this.quantity(name).range; }

  /** Independent declared drives, else independent joints. */
  get drives() {
    if (!this._drives) this._drives = independentDrives(this);
    return this._drives;
  }

  /** {position: Float64Array(3 nb), quaternion: Float64Array(4 nb) as x, y, z, w} of `bodies`; new arrays unless `into` is given. */
  poses(q, into = { position: new Float64Array(3 * this.bodies.length), quaternion: new Float64Array(4 * this.bodies.length) }) {
    const tree = this.tree.set(q), n = this.parts.length, { position, quaternion } = into;
    for (let k = 0; k < 3 * n; k++) position[k] = tree.origin[k];
    for (let k = 0; k < n; k++) quaternionOf(tree.rotation, 9 * k, quaternion, 4 * k);
    this.drawnShafts.forEach((shaft, i) => {
      const k = n + i, { rotation, origin } = tree.placed(shaft.part, shaft.placement);
      const angle = quantityValue(shaft.quantity, q) - shaft.quantity.zero;
      turnedAbout(rotation, 0, 0, 1, angle, rotation);
      position.set(origin, 3 * k);
      quaternionOf(rotation, 0, quaternion, 4 * k);
    });
    const last = this.bodies.length - 1;
    position.fill(0, 3 * last);
    quaternion.fill(0, 4 * last);
    quaternion[4 * last + 3] = 1;
    return into;
  }

  /** {linear, angular}: Float64Array(3 nb) each, of the origins of `bodies` at rates v, world axes. */
  velocities(q, v) {
    const tree = this.tree.set(q), count = this.bodies.length, n = this.parts.length;
    const linear = new Float64Array(3 * count), angular = new Float64Array(3 * count);
    for (let k = 0; k < n; k++) tree.velocity(k, tree.origin, 3 * k, v, linear, angular, 3 * k);
    this.drawnShafts.forEach((shaft, i) => {
      const at = 3 * (n + i), { rotation, origin } = tree.placed(shaft.part, shaft.placement);
      tree.velocity(shaft.part, origin, 0, v, linear, angular, at);
      let rate = 0;
      shaft.quantity.columns.forEach((joint, c) => { rate += shaft.quantity.coefficients[c] * v[joint.v]; });
      for (let a = 0; a < 3; a++) angular[at + a] += rate * rotation[3 * a + 2];
    });
    return { linear, angular };
  }

  /** {residual, jacobian (row-major), names} of all loops, then all relations. */
  constraints(q) {
    this.closure.evaluate(this.tree.set(q), true);
    return { residual: this.closure.residual.slice(), jacobian: this.closure.jacobian.slice(), names: [...this.closure.names] };
  }
}

function quantityValue({ zero, columns, coefficients }, q) {
  let value = zero;
  for (let k = 0; k < columns.length; k++) value += coefficients[k] * q[columns[k].q];
  return value;
}

function ratioNumber(text, what) {
  const [over, under] = String(text).split("/").map(Number);
  const value = under === undefined ? over : over / under;
  if (!Number.isFinite(value)) throw new Error(`${what}: ${text} is no ratio.`);
  return value;
}

function unitVector(vector, what) {
  const length = Math.hypot(...vector);
  if (vector.length !== 3 || !(length > 1e-12)) throw new Error(`${what} is no direction.`);
  return Math.abs(length - 1) < 4e-16 ? [...vector] : vector.map((x) => x / length);
}

/** Parents before children, depth-first, siblings in their order: the order of the coordinates. */
function ordered(bodies) {
  const children = new Map(), names = new Set(), out = [];
  for (const body of bodies) {
    if (names.has(body.name) || body.name === GROUND_NAME) throw new Error(`The body name ${body.name} is used twice.`);
    names.add(body.name);
    const parent = body.parent || GROUND_NAME;
    children.set(parent, [...(children.get(parent) || []), body]);
  }
  const stack = [...(children.get(GROUND_NAME) || [])].reverse();
  while (stack.length) {
    const body = stack.pop();
    out.push(body);
    stack.push(...[...(children.get(body.name) || [])].reverse());
  }
  if (out.length !== bodies.length) throw new Error("Some bodies do not hang on the ground.");
  return out;
}

/** Largest coordinate [m] of an origin, loop end, spring end, frame or centre of mass in the reference pose; 1 where all are 0. */
function modelSize(model) {
  const { document } = model, rotation = [], origin = [];
  let largest = 0;
  const see = (k, point) => {
    for (let a = 0; a < 3; a++) {
      const there = k < 0 ? point[a] : origin[k][a] + dot3(rotation[k], 3 * a, point);
      largest = Math.max(largest, Math.abs(there));
    }
  };
  model.parts.forEach((body, k) => {
    const parent = model.index.get(body.parent || GROUND_NAME), placement = placementOf(body.placement);
    rotation[k] = parent < 0 ? placement.rotation : product33(rotation[parent], placement.rotation);
    origin[k] = [0, 1, 2].map((a) => (parent < 0 ? placement.position[a] : origin[parent][a] + dot3(rotation[parent], 3 * a, placement.position)));
    see(k, [0, 0, 0]);
    if (body.inertia && body.inertia.mass > 0) see(k, body.inertia.com || [0, 0, 0]);
  });
  for (const x of document.loops || []) {
    see(model.partIndex(x.body_a, `loop ${x.name}`), placementOf(x.placement_a).position);
    see(model.partIndex(x.body_b, `loop ${x.name}`), placementOf(x.placement_b).position);
  }
  for (const x of document.springs || []) {
    see(model.partIndex(x.body_a, `spring ${x.name}`), x.point_a || [0, 0, 0]);
    see(model.partIndex(x.body_b, `spring ${x.name}`), x.point_b || [0, 0, 0]);
  }
  for (const x of document.frames || []) see(model.partIndex(x.body || GROUND_NAME, `frame ${x.name}`), placementOf(x.placement).position);
  return largest > 0 && Number.isFinite(largest) ? largest : 1;
}
