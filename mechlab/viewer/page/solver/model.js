// The mechanism of a model document, the JSON that `generate` writes.

// kind: axes of the offset rows; axes of a and of b of the angle rows. As mechanism/constraints.py.
const LOOP_ROWS = {
  spherical: ["xyz"], revolute: ["xyz", "xz", "yz"], universal: ["xyz", "xy"], cylindrical: ["xy", "xz", "yz"],
  prismatic: ["xy", "xz", "yz", "xy"], fixed: ["xyz", "xz", "yz", "xy"], distance: [""],
};
const JOINT_RATES = { revolute: 1, prismatic: 1, spherical: 3 };
const GROUND_NAME = "ground", Z_AXIS = [0, 0, 1];

class PageModel {
  /** Reads a model document. Throws an Error with one sentence for a document that it cannot read. */
  constructor(document) {
    if (!document || document.format !== "mechlab.mechanism") throw new Error("This document holds no mechanism of mechlab.");
    if (document.schema !== 1) throw new Error(`The mechanism has schema ${document.schema}; this page reads schema 1.`);
    this.document = document;
    this.parts = document.bodies || [];
    this._joints();
    this._quantities();
    this._drawn();
    this.home = new Float64Array(this.nq);
    for (const joint of this.joints) if (joint.rates > 1) this.home[joint.q] = 1;
    this.tree = new Tree(this);
    this.size = modelSize(this);
    this.closure = new Closure(this);
  }

  _joints() {
    this.index = new Map([[GROUND_NAME, this.parts.length]]);
    this.joints = [];
    let [q, v] = [0, 0];
    this.parts.forEach((body, k) => {
      if (this.index.has(body.name)) throw new Error(`The body name ${body.name} is used twice.`);
      this.partIndex(body.parent, `Body ${body.name}, which must follow its parent,`);
      this.index.set(body.name, k);
      for (const joint of body.joints || []) {
        const { name, kind = "revolute", axis = Z_AXIS, range = null, zero = 0 } = joint;
        const rates = JOINT_RATES[kind], length = Math.hypot(...axis);
        if (!rates) throw new Error(`Joint ${name} is of the unknown kind ${kind}.`);
        if (axis.length !== 3 || !(length > 1e-12)) throw new Error(`The axis of joint ${name} is no direction.`);
        const unit = Math.abs(length - 1) < 4e-16 ? [...axis] : axis.map((x) => x / length);
        this.joints.push({ name, kind, body: body.name, part: k, q, v, rates, range, zero, axis: unit });
        q += rates === 3 ? 4 : 1;
        v += rates;
      }
    });
    this.nq = q;
    this.nv = v;
    this.jointNamed = new Map(this.joints.map((joint) => [joint.name, joint]));
    if (this.jointNamed.size !== this.joints.length) throw new Error("Two joints have the same name.");
  }

  _quantities() {
    this.quantities = new Map(); // of joints and shafts with one value: zero + sum of coefficients x coordinates of `columns`
    const add = ({ name, zero = 0, range = null }, columns, coefficients) => {
      const slides = columns.length > 0 && columns.every((joint) => joint.kind === "prismatic");
      this.quantities.set(name, { name, zero, range, columns, coefficients, slides });
    };
    for (const joint of this.joints) if (joint.rates === 1) add(joint, [joint], [1]);
    for (const shaft of this.document.shafts || []) add(shaft, ...this.combination(shaft.coefficients, `Shaft ${shaft.name}`));
    this.names = [...this.quantities.keys()];
  }

  /** Joints and numbers of exact coefficients {joint: "7/5"}. */
  combination(coefficients, what) {
    const columns = [], numbers = [];
    for (const [name, ratio] of Object.entries(coefficients || {})) {
      const joint = this.jointNamed.get(name), [over, under = 1] = String(ratio).split("/").map(Number);
      if (!joint || joint.rates > 1) throw new Error(`${what} names ${name}, which is no joint with one value.`);
      if (!Number.isFinite(over / under)) throw new Error(`${what}: ${ratio} is no ratio.`);
      columns.push(joint);
      numbers.push(over / under);
    }
    return [columns, numbers];
  }

  /** Bodies, then shafts with shapes, then the ground: the order of story.bodies. */
  _drawn() {
    const shafts = (this.document.shafts || []).filter((shaft) => (shaft.shapes || []).length);
    this.drawnShafts = shafts.map((shaft) => ({
      quantity: this.quantities.get(shaft.name),
      name: this.index.has(shaft.name) ? `${shaft.name} (shaft)` : shaft.name,
      part: this.partIndex(shaft.body, `Shaft ${shaft.name}`),
      placement: placementOf(shaft.placement),
    }));
    this.bodies = [...this.parts, ...this.drawnShafts].map((item) => item.name).concat(GROUND_NAME);
  }

  /** Index of a body in `parts`; the ground comes after them. */
  partIndex(name, what) {
    const k = this.index.get(name || GROUND_NAME);
    if (k === undefined) throw new Error(`${what} names the body ${name}, which does not exist.`);
    return k;
  }

  shaftFrame(tree, { part, placement, quantity }, q) {
    const frame = tree.placed(part, placement);
    turnedAbout(frame.rotation, Z_AXIS, quantityValue(quantity, q) - quantity.zero);
    return frame;
  }

  quantity(name) {
    const found = this.quantities.get(name);
    if (!found) throw new Error(`There is no joint or shaft ${name} with one value; there are ${this.names.join(", ")}.`);
    return found;
  }

  value(name, q) { return quantityValue(this.quantity(name), q); }

  /** Float64Array(nv): the rate of a joint or shaft is this row times the rates. */
  row(name) {
    const { columns, coefficients } = this.quantity(name), row = new Float64Array(this.nv);
    columns.forEach((joint, k) => { row[joint.v] += coefficients[k]; });
    return row;
  }

  range(name) { return this.quantity(name).range; }

  get drives() {
    const { names, declared } = structureOf(this).independent;
    return declared.length ? declared : names;
  }

  /** {position: Float64Array(3 nb), quaternion: Float64Array(4 nb) as x, y, z, w} of `bodies`; new arrays unless `into` is given. */
  poses(q, into = { position: new Float64Array(3 * this.bodies.length), quaternion: new Float64Array(4 * this.bodies.length) }) {
    const tree = this.tree.set(q), n = this.parts.length, last = this.bodies.length - 1;
    const put = (k, rotation, r, origin, p) => {
      for (let a = 0; a < 3; a++) into.position[3 * k + a] = origin[p + a];
      quaternionOf(rotation, r, into.quaternion, 4 * k);
    };
    for (let k = 0; k <= n; k++) put(k < n ? k : last, tree.rotation, 9 * k, tree.origin, 3 * k);
    this.drawnShafts.forEach((shaft, i) => {
      const { rotation, origin } = this.shaftFrame(tree, shaft, q);
      put(n + i, rotation, 0, origin, 0);
    });
    return into;
  }

  /** {linear, angular}: Float64Array(3 nb) each, of the origins of `bodies` at rates v, world axes. */
  velocities(q, v) {
    const tree = this.tree.set(q), [linear, angular] = arrays(2, 3 * this.bodies.length), lever = new Float64Array(3);
    const add = (part, point, i, at) => {
      for (const c of tree.columns[part]) {
        tree.lever(c, point, i, lever);
        for (let a = 0; a < 3; a++) linear[at + a] += v[c] * lever[a];
        if (tree.turns[c]) for (let a = 0; a < 3; a++) angular[at + a] += v[c] * tree.axes[3 * c + a];
      }
    };
    this.parts.forEach((_, k) => add(k, tree.origin, 3 * k, 3 * k));
    this.drawnShafts.forEach(({ part, placement, quantity }, i) => {
      const at = 3 * (this.parts.length + i), { rotation, origin } = tree.placed(part, placement), rate = dot(this.row(quantity.name), v);
      add(part, origin, 0, at);
      for (let a = 0; a < 3; a++) angular[at + a] += rate * rotation[3 * a + 2];
    });
    return { linear, angular };
  }

  /** {residual, jacobian (row-major), names} of all loops, then all relations, then all curves. */
  constraints(q) {
    const { closure, tree } = this;
    closure.evaluate(tree.set(q));
    return { residual: closure.residual.slice(), jacobian: closure.jacobian.slice(), names: [...closure.names] };
  }
}

function quantityValue({ zero, columns, coefficients }, q) {
  return columns.reduce((sum, joint, k) => sum + coefficients[k] * q[joint.q], zero);
}

/** Largest coordinate [m] of a body, loop, spring, frame or centre of mass in the reference pose, or 1. */
function modelSize(model) {
  const tree = model.tree.set(model.home), { document } = model;
  let largest = 0;
  const see = (name, position, what) => {
    const { origin } = tree.placed(model.partIndex(name, what), placementOf({ position }));
    largest = Math.max(largest, ...origin.map(Math.abs));
  };
  for (const { name, inertia } of model.parts) {
    see(name);
    if (inertia && inertia.mass > 0) see(name, inertia.com);
  }
  for (const x of [...(document.loops || []), ...(document.springs || [])]) {
    see(x.body_a, x.point_a || (x.placement_a || {}).position, x.name);
    see(x.body_b, x.point_b || (x.placement_b || {}).position, x.name);
  }
  for (const x of document.frames || []) see(x.body, (x.placement || {}).position, x.name);
  return largest > 0 && Number.isFinite(largest) ? largest : 1;
}
