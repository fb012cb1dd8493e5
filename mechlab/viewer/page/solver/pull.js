// A grabbed point follows its target as far as the closed poses allow: damped least squares on them, until stationary.

const MOST_PULLS = 40, STATIONARY = 1e-10, LONGEST_PULL = 0.4;

class Pull {
  /** grab: {body, point (3) in the body, target (3) in the world}; body by name or by its number in model.bodies. */
  constructor(solver, grab) {
    const { model } = solver, name = typeof grab.body === "number" ? model.bodies[grab.body] : grab.body;
    const shaft = model.drawnShafts.find((item, i) => model.bodies[model.parts.length + i] === name);
    this.solver = solver;
    this.shaft = shaft || null;
    this.part = shaft ? shaft.part : model.partIndex(name, "The grab");
    this.point = Float64Array.from(grab.point);
    this.target = Float64Array.from(grab.target);
    this.here = new Float64Array(3);
    this.offset = new Float64Array(3);
    this.rows = [0, 1, 2].map(() => new Float64Array(model.nv));
    this.free = [0, 1, 2].map(() => new Float64Array(model.nv));
    this.gradient = new Float64Array(model.nv);
    this.lever = new Float64Array(3);
  }

  /** Scaled distance of the point from its target at the pose of the tree; `offset` is the vector. */
  miss(tree, q) {
    const { shaft, part, point, here, target } = this, { size } = this.solver.model;
    if (shaft) {
      const { rotation, origin } = tree.placed(part, shaft.placement);
      turnedAbout(rotation, 0, 0, 1, quantityValue(shaft.quantity, q) - shaft.quantity.zero, rotation);
      this.axis = [rotation[2], rotation[5], rotation[8]];
      this.foot = origin;
      for (let a = 0; a < 3; a++) here[a] = origin[a] + dot3(rotation, 3 * a, point);
    } else if (part < 0) here.set(point);
    else for (let a = 0; a < 3; a++) here[a] = tree.origin[3 * part + a] + dot3(tree.rotation, 9 * part + 3 * a, point);
    for (let a = 0; a < 3; a++) this.offset[a] = (target[a] - here[a]) / size;
    return Math.hypot(...this.offset);
  }

  /** Rows of the point's scaled velocity, and the gradient rows^T offset. */
  linearize(tree, scale) {
    const { rows, lever, gradient, offset } = this, { size } = this.solver.model;
    for (const row of rows) row.fill(0);
    if (this.part >= 0) for (const c of tree.columns[this.part]) {
      tree.lever(c, this.here, 0, lever, 0);
      for (let a = 0; a < 3; a++) rows[a][c] += lever[a] * scale[c] / size;
    }
    if (this.shaft) {
      const r = [0, 1, 2].map((a) => this.here[a] - this.foot[a]), u = this.axis;
      const turn = [u[1] * r[2] - u[2] * r[1], u[2] * r[0] - u[0] * r[2], u[0] * r[1] - u[1] * r[0]];
      const { columns, coefficients } = this.shaft.quantity;
      columns.forEach((joint, k) => { for (let a = 0; a < 3; a++) rows[a][joint.v] += coefficients[k] * turn[a] * scale[joint.v] / size; });
    }
    for (let k = 0; k < gradient.length; k++) gradient[k] = rows[0][k] * offset[0] + rows[1][k] * offset[1] + rows[2][k] * offset[2];
  }

  /** The damped step on the null space of the latest factoring, scaled, into y; returns its length. */
  step(factors, damping, y) {
    const { rows, free, offset } = this, K = new Float64Array(9);
    for (let a = 0; a < 3; a++) {
      free[a].set(rows[a]);
      factors.rotate(free[a]);
      free[a].fill(0, 0, factors.rank);
    }
    let trace = 0;
    for (let a = 0; a < 3; a++) for (let b = 0; b < 3; b++) K[3 * a + b] = dotRows(free[a], free[b]);
    for (let a = 0; a < 3; a++) trace += K[4 * a];
    for (let a = 0; a < 3; a++) K[4 * a] += damping + 1e-12 * trace + 1e-300;
    const z = solveSymmetric3(K, offset);
    for (let k = 0; k < y.length; k++) y[k] = z[0] * free[0][k] + z[1] * free[1][k] + z[2] * free[2][k];
    factors.rotateBack(y);
    return Math.hypot(...y);
  }
}

/** x with K x = b for a symmetric positive definite 3 x 3 K (Cholesky). */
function solveSymmetric3(K, b) {
  const a = Math.sqrt(K[0]), d = K[3] / a, g = K[6] / a, e = Math.sqrt(Math.max(K[4] - d * d, 1e-300));
  const h = (K[7] - g * d) / e, i = Math.sqrt(Math.max(K[8] - g * g - h * h, 1e-300));
  const x = b[0] / a, y = (b[1] - d * x) / e, z = (b[2] - g * x - h * y) / i;
  const r = z / i, s = (y - h * r) / e;
  return [(x - d * s - g * r) / a, s, r];
}

PoseSolver.prototype._pull = function pullTowards(grab, held) {
  const { manifold, q, _tangent: t } = this, pull = new Pull(this, grab);
  const before = new Float64Array(t.length), along = new Float64Array(t.length);
  let damping = 0, made = 0, reach = LONGEST_PULL;
  this._active = this._active.slice();
  for (let count = 0; count < MOST_PULLS; count++) {
    manifold.at(q);
    const miss = pull.miss(manifold.tree, q);
    pull.linearize(manifold.tree, this.scale);
    const rate = this._heading(held, pull.gradient); // chooses the joints at the end of their ranges
    if (rate < STATIONARY || miss < 1e-12) return;
    if (made) { // what the curvature of the closed poses adds to least squares, by the change of the gradient
      let change = 0, square = 0;
      for (let k = 0; k < t.length; k++) change += (before[k] - rate * t[k]) * along[k];
      for (let a = 0; a < 3; a++) square += dotRows(pull.rows[a], along) ** 2;
      damping = Math.max(0, change / made - square);
    }
    for (let k = 0; k < t.length; k++) before[k] = rate * t[k];
    made = this._pullStep(pull, held, miss, damping, reach, along);
    reach = this._reach;
    if (!made) return;
  }
};

/** One accepted step, made smaller and more damped until the point comes nearer; returns its length, 0 where none does. */
PoseSolver.prototype._pullStep = function pullStep(pull, held, miss, damping, reach, along) {
  const { manifold, q, _tangent: t } = this;
  for (let attempt = 0; attempt < 30; attempt++) {
    manifold.at(q);
    pull.miss(manifold.tree, q);
    pull.linearize(manifold.tree, this.scale);
    manifold.factor([held, this._active]);
    manifold.remember();
    const length = pull.step(manifold.factors, damping, t);
    if (!(length > 1e-13)) break;
    for (let k = 0; k < t.length; k++) t[k] /= length;
    const outward = this._limits.find((hold) => !this._active.includes(hold) && this._outward(hold, t));
    if (outward) {
      outward.target = outward.value(q);
      this._active.push(outward);
      continue;
    }
    const wanted = Math.min(length, reach), stopped = this._limited(wanted), way = stopped ? stopped.length : wanted;
    along.set(t);
    const group = [held, stopped ? this._active.concat(stopped.hold) : this._active];
    const made = this._advance(way, group, held, along, false);
    if (made.ok && made.rate > BEND && pull.miss(manifold.tree, this._next) < miss) {
      q.set(this._next);
      if (stopped) this._active.push(stopped.hold);
      this._reach = Math.min(LONGEST_PULL, 1.5 * Math.max(way, 0.02));
      return way;
    }
    reach = 0.5 * way;
    this._reach = reach;
    if (reach < SHORTEST_STEP) {
      if (made.flipped && miss > 1e-9) this._stop(this.model.bodies[pull.part] || "", "singular");
      break;
    }
  }
  return 0;
};

PoseSolver.prototype._miss = function missOf(grab) {
  const { manifold, q } = this;
  manifold.at(q);
  return new Pull(this, grab).miss(manifold.tree, q) * this.model.size;
};
