// What the constraints of a mechanism are worth: rank at closed poses, sizes of rows, independent drives.

const RANK_TOLERANCE = 1e-8;
const CLEAR_SHARE = 1e-3; // share of a rate beyond which it is a good coordinate

/** Repeatable numbers in -1..1. */
function randomNumbers(seed) {
  let state = seed >>> 0;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2147483648 - 1;
  };
}

/** Length of a unit of each rate: 1 for turns, the size of the mechanism for slides. */
function rateScale(model) {
  const scale = new Float64Array(model.nv).fill(1);
  for (const joint of model.joints) if (joint.kind === "prismatic") scale[joint.v] = model.size;
  return scale;
}

/** q moved by rates dv (nv): q + dv, and q * exp(dv) for spherical joints; into `out`. */
function movedBy(model, q, dv, out) {
  for (let k = 0; k < model.joints.length; k++) {
    const joint = model.joints[k];
    if (joint.kind !== "spherical") {
      out[joint.q] = q[joint.q] + dv[joint.v];
      continue;
    }
    const i = joint.q, j = joint.v, angle = Math.sqrt(dv[j] * dv[j] + dv[j + 1] * dv[j + 1] + dv[j + 2] * dv[j + 2]);
    const c = Math.cos(angle / 2), s = angle < 1e-12 ? 0.5 : Math.sin(angle / 2) / angle;
    const x = s * dv[j], y = s * dv[j + 1], z = s * dv[j + 2], w = q[i], a = q[i + 1], b = q[i + 2], d = q[i + 3];
    const e = w * c - a * x - b * y - d * z, f = w * x + a * c + b * z - d * y;
    const g = w * y - a * z + b * c + d * x, h = w * z + a * y - b * x + d * c, n = 1 / Math.sqrt(e * e + f * f + g * g + h * h);
    out[i] = e * n; out[i + 1] = f * n; out[i + 2] = g * n; out[i + 3] = h * n;
  }
  return out;
}

/** Rows of the closure at closed poses near home: {rank, sizes (of rows), poses, generic (index of a pose of that rank)}. */
class Structure {
  constructor(model) {
    this.model = model;
    this.scale = rateScale(model);
    this.tree = new Tree(model);
    this.closure = new Closure(model);
    const rows = this.closure.count;
    this.units = Float64Array.from(this.closure.lengths, (isLength) => (isLength ? 1 / model.size : 1));
    this.factors = new RowFactors(rows + 2 * model.nv, model.nv);
    this.poses = [model.home, ...this._near(8, 0.1)];
    this.sizes = new Float64Array(rows).fill(1e-12);
    for (const q of this.poses) this._measure(q);
    this.rank = 0;
    this.generic = 0;
    this.poses.forEach((q, k) => {
      const rank = this._load(q);
      if (rank > this.rank) [this.rank, this.generic] = [rank, k];
    });
    this._load(this.poses[this.generic]);
    this.independent = this._independent();
  }

  _measure(q) {
    const { nv } = this.model, { jacobian } = this.closure;
    this.closure.evaluate(this.tree.set(q), true);
    for (let i = 0; i < this.sizes.length; i++) {
      let sum = 0;
      for (let k = 0; k < nv; k++) sum += (this.units[i] * jacobian[i * nv + k] * this.scale[k]) ** 2;
      this.sizes[i] = Math.max(this.sizes[i], Math.sqrt(sum));
    }
  }

  /** Factors the scaled rows at q; returns their rank. */
  _load(q, tolerance = RANK_TOLERANCE, sizes = this.sizes) {
    const { nv } = this.model, { jacobian, count } = this.closure, { factors } = this;
    this.closure.evaluate(this.tree.set(q), true);
    for (let i = 0; i < count; i++) {
      const unit = this.units[i] / sizes[i];
      for (let k = 0; k < nv; k++) factors.matrix[i * nv + k] = unit * jacobian[i * nv + k] * this.scale[k];
    }
    factors.clear();
    factors.stage(0, count, tolerance);
    return factors.rank;
  }

  /** Closed poses a step along the motions that the constraints leave at home. */
  _near(count, spread) {
    const { model, closure } = this, { nv } = model, random = randomNumbers(7), poses = [];
    const y = new Float64Array(nv), b = new Float64Array(closure.count), ones = new Float64Array(closure.count).fill(1);
    const step = new Float64Array(nv);
    for (let n = 0; n < count; n++) {
      const q = model.home.slice();
      const rank = this._load(q, RANK_TOLERANCE, ones);
      for (let k = 0; k < nv; k++) y[k] = random();
      this.factors.rotate(y);
      y.fill(0, 0, rank);
      this.factors.rotateBack(y);
      const size = Math.max(1e-300, ...y.map(Math.abs));
      for (let k = 0; k < nv; k++) step[k] = size > 1e-12 ? spread * y[k] / size * this.scale[k] : 0;
      movedBy(model, q, step, q);
      let worst = Infinity;
      for (let pass = 0; pass < 40; pass++) {
        this._load(q, 1e-11, ones);
        worst = 0;
        for (let i = 0; i < closure.count; i++) {
          b[i] = -closure.residual[i] * this.units[i];
          worst = Math.max(worst, Math.abs(b[i]));
        }
        if (worst < 1e-14) break;
        this.factors.solve(b, y);
        const longest = Math.max(...y.map(Math.abs)), part = Math.min(1, 0.5 / (longest || 1));
        for (let k = 0; k < nv; k++) step[k] = part * y[k] * this.scale[k];
        movedBy(model, q, step, q);
      }
      if (worst < 1e-11) poses.push(q);
    }
    return poses;
  }

  /** Names of scalars, drives first, that with the constraints determine the pose; and rates (numbers) that complete them. */
  _independent() {
    const { model, factors } = this, { nv } = model, names = [], rates = [], declared = [];
    let next = this.closure.count;
    const take = (row, least) => {
      factors.matrix.set(row, next * nv);
      const before = factors.rank;
      factors.taken[next] = 0;
      factors.stage(next, next + 1, least);
      if (factors.rank > before) next++;
      return factors.rank > before;
    };
    const unit = (row) => {
      const scaled = row.map((x, k) => x * this.scale[k]), length = Math.hypot(...scaled) || 1;
      return scaled.map((x) => x / length);
    };
    for (const name of new Set((model.document.drives || []).map((drive) => drive.on))) {
      if (!model.quantities.has(name) || !take(unit(model.row(name)), RANK_TOLERANCE)) continue;
      names.push(name);
      declared.push(name);
    }
    for (const least of [CLEAR_SHARE, RANK_TOLERANCE]) {
      for (const joint of model.joints) {
        for (let c = 0; c < (joint.kind === "spherical" ? 3 : 1) && factors.rank < nv; c++) {
          const row = new Float64Array(nv);
          row[joint.v + c] = 1;
          if (rates.includes(joint.v + c) || !take(row, least)) continue;
          rates.push(joint.v + c);
          if (joint.kind !== "spherical") names.push(joint.name);
        }
      }
    }
    return { names, declared, rates };
  }
}

function independentDrives(model) {
  const { names, declared } = structureOf(model).independent;
  return declared.length ? declared : names;
}

/** The structure of a model, worked out once. */
function structureOf(model) {
  if (!model.structure) model.structure = new Structure(model);
  return model.structure;
}
