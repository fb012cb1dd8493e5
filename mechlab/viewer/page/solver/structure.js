// What the constraints are worth: rank at closed poses, sizes of rows, independent drives.

const RANK_TOLERANCE = 1e-8;
const MARGIN = 1e-3; // share of the smallest usual pivot that a pull leaves
const CLEAR_SHARE = 1e-3; // share of a rate beyond which it is a good coordinate

/** Units of the rates: 1 for turns, the size of the mechanism for slides. */
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
    const { q: i, v: j } = joint, angle = Math.hypot(dv[j], dv[j + 1], dv[j + 2]), c = Math.cos(angle / 2);
    const s = angle < 1e-12 ? 0.5 : Math.sin(angle / 2) / angle, x = s * dv[j], y = s * dv[j + 1], z = s * dv[j + 2];
    const w = q[i], a = q[i + 1], b = q[i + 2], d = q[i + 3];
    out[i] = w * c - a * x - b * y - d * z;
    out[i + 1] = w * x + a * c + b * z - d * y;
    out[i + 2] = w * y - a * z + b * c + d * x;
    out[i + 3] = w * z + a * y - b * x + d * c;
    const length = Math.hypot(out[i], out[i + 1], out[i + 2], out[i + 3]);
    for (let n = i; n < i + 4; n++) out[n] /= length;
  }
  return out;
}

/** The closure at closed poses near home: `poses`, largest `sizes` of rows, `rank` at the pose `generic`, `independent` names. */
class Structure {
  constructor(model) {
    const manifold = new Manifold(model, null), { closure, units } = manifold;
    this.model = model;
    this.manifold = manifold;
    this.poses = [model.home, ...this._near(8, 0.1)];
    this.sizes = new Float64Array(closure.count);
    for (const q of this.poses) {
      manifold.at(q);
      for (let i = 0; i < closure.count; i++) {
        manifold.write(i, i);
        this.sizes[i] = Math.max(this.sizes[i], norm(manifold.factors.matrix.subarray(i * model.nv, (i + 1) * model.nv)));
      }
    }
    this.sizes = this.sizes.map((size) => (size > 1e-12 ? size : 1)); // else rounding alone
    manifold.weights = units.map((unit, i) => unit / this.sizes[i]);
    const ranks = this.poses.map((q) => this._rankAt(q));
    this.rank = Math.max(...ranks);
    this.generic = this.poses[ranks.indexOf(this.rank)];
    this._rankAt(this.generic);
    this.margin = MARGIN * manifold.goodness;
    this.independent = this._independent();
  }

  _rankAt(q) {
    this.manifold.at(q);
    this.manifold.choose();
    return this.manifold.chosen.length;
  }

  /** Closed poses a step along the motions that the constraints leave at home. */
  _near(count, spread) {
    const { model, manifold } = this, poses = [], y = new Float64Array(model.nv);
    manifold.chosen = Int32Array.from({ length: manifold.closure.count }, (_, i) => i);
    for (let n = 0; n < count; n++) {
      manifold.at(model.home);
      manifold.factor([]);
      for (let k = 0; k < y.length; k++) y[k] = Math.sin(12.9898 * (k + 1) * (n + 1));
      manifold.factors.project(y);
      const largest = Math.max(1e-12, ...y.map(Math.abs)), q = model.home.slice();
      manifold.move(model.home, y.map((x) => spread * x / largest), q);
      if (manifold.correct(q, [], Infinity, 40) >= 0) poses.push(q);
    }
    return poses;
  }

  /** Names that with the constraints determine the pose, declared drives first. */
  _independent() {
    const { model, manifold } = this, { factors, scale } = manifold, names = [], from = manifold.closure.count - factors.rank;
    const take = (row, least) => {
      const next = from + factors.rank, scaled = row.map((x, k) => x * scale[k]), length = norm(scaled) || 1;
      factors.matrix.set(scaled.map((x) => x / length), next * model.nv);
      return factors.stage(next, next + 1, least) < Infinity;
    };
    for (const { on } of model.document.drives || []) if (take(model.row(on), RANK_TOLERANCE)) names.push(on);
    const declared = names.slice();
    for (const least of [CLEAR_SHARE, RANK_TOLERANCE]) for (const joint of model.joints) {
      for (let c = joint.v; c < joint.v + joint.rates; c++) {
        if (take(new Float64Array(model.nv).fill(1, c, c + 1), least) && joint.rates === 1) names.push(joint.name);
      }
    }
    return { names, declared };
  }
}

function structureOf(model) {
  if (!model.structure) model.structure = new Structure(model);
  return model.structure;
}
