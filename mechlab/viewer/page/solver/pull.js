// A grabbed point follows its target as far as the closed poses allow: damped least squares on them, until stationary.

const MOST_TRIES = 30, LONGEST_PULL = 0.4;
const STATIONARY = 1e-9; // length of a step that is none

class Pull {
  /** grab: {body, point (3) in the body, target (3) in the world}; body by name or by its number in model.bodies. */
  constructor(model, grab) {
    const name = typeof grab.body === "number" ? model.bodies[grab.body] : grab.body;
    const shaft = model.drawnShafts.find((_, i) => model.bodies[model.parts.length + i] === name);
    this.model = model;
    this.name = name;
    this.shaft = shaft || null;
    this.part = shaft ? shaft.part : model.partIndex(name, "The grab");
    this.point = Float64Array.from(grab.point);
    this.target = Float64Array.from(grab.target);
    this.here = new Float64Array(3);
    this.offset = new Float64Array(3);
    this.rows = [0, 1, 2].map(() => new Float64Array(model.nv));
    this.free = [0, 1, 2].map(() => new Float64Array(model.nv));
    [this.gradient, this.way, this.before, this.after] = [0, 1, 2, 3].map(() => new Float64Array(model.nv));
    this.lever = new Float64Array(3);
  }

  /** Scaled distance of the point from its target at the pose of the tree; `offset` is the vector. */
  miss(tree, q) {
    const { shaft, part, point, here, target } = this, { size } = this.model;
    if (shaft) {
      const { rotation, origin } = tree.placed(part, shaft.placement);
      turnedAbout(rotation, 0, 0, 1, quantityValue(shaft.quantity, q) - shaft.quantity.zero, rotation);
      this.axis = [rotation[2], rotation[5], rotation[8]];
      this.foot = origin;
      for (let a = 0; a < 3; a++) here[a] = origin[a] + dot3(rotation, 3 * a, point);
    } else if (part < 0) here.set(point);
    else for (let a = 0; a < 3; a++) here[a] = tree.origin[3 * part + a] + dot3(tree.rotation, 9 * part + 3 * a, point);
    for (let a = 0; a < 3; a++) this.offset[a] = (target[a] - here[a]) / size;
    return norm(this.offset);
  }

  /** Rows of the point's scaled velocity, and the gradient rows^T offset. */
  linearize(tree, scale) {
    const { rows, lever, gradient, offset } = this, { size } = this.model;
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
    for (let a = 0; a < 3; a++) for (let b = 0; b < 3; b++) K[3 * a + b] = dot(free[a], free[b]);
    for (let a = 0; a < 3; a++) trace += K[4 * a];
    for (let a = 0; a < 3; a++) K[4 * a] += damping + 1e-12 * trace + 1e-300;
    const z = solveSymmetric3(K, offset);
    for (let k = 0; k < y.length; k++) y[k] = z[0] * free[0][k] + z[1] * free[1][k] + z[2] * free[2][k];
    factors.rotateBack(y);
    return norm(y);
  }

  /** Walks until the point is at its target or can come no nearer, while `held` hold; returns why it stopped: "" or "singular". */
  follow(walk, held) {
    const { manifold, tangent } = walk, { way, before, model } = this;
    this.longest = LONGEST_PULL;
    this.tries = MOST_TRIES;
    walk.ready = false;
    let damping = 0, made = 0;
    while (this.tries > 0) {
      walk.place();
      const miss = this.miss(manifold.tree, walk.q);
      this.linearize(manifold.tree, manifold.scale);
      if (made) { // the curvature of the closed poses, from the change of the gradient: what least squares leaves out
        walk.factor(held);
        tangent.set(this.gradient);
        manifold.factors.project(tangent);
        let change = 0, square = 0;
        for (let k = 0; k < model.nv; k++) change += (before[k] - tangent[k]) * way[k];
        for (const row of this.rows) square += dot(row, way) ** 2;
        damping = Math.max(0, change / made - square);
      }
      if (miss < 1e-12) return "";
      made = this._nearer(walk, held, miss, damping);
      if (!made) return this.flipped ? "singular" : "";
    }
    return "";
  }

  /** A step that brings the point nearer; returns its length, 0 where there is none or too short a one. */
  _nearer(walk, held, miss, least) {
    const { manifold, tangent } = walk, { factors } = manifold, { way, before } = this;
    let damping = least;
    this.flipped = false;
    while (this.tries-- > 0) {
      walk.factor(held);
      const length = this.step(factors, damping, tangent);
      if (walk.active.length && this._inward(walk, damping)) continue;
      if (!(length > STATIONARY)) return 0;
      for (let k = 0; k < tangent.length; k++) tangent[k] /= length;
      if (walk.block()) continue;
      way.set(tangent);
      before.set(this.gradient);
      const slope = factors.project(before);
      walk.turning.fill(0);
      const made = walk.step(Math.min(length, this.longest), held, held, way);
      if (made.good && made.rate > BEND && this.miss(manifold.tree, walk.next) < miss) {
        walk.take(made, false);
        this.longest = Math.min(LONGEST_PULL, 2 * Math.max(made.length, 0.01));
        return made.length;
      }
      this.flipped = made.flipped;
      this.longest = 0.5 * made.length;
      if (this.longest < SHORTEST_STEP) return 0;
      if (made.good) damping = Math.max(damping, slope / this.longest); // least squares is misled: turn to the steepest descent
      walk.place();
      this.miss(manifold.tree, walk.q);
    }
    return 0;
  }

  /** Lets go of a joint at the end of its range which would turn back at the end of the step in the walk's tangent. */
  _inward(walk, damping) {
    const { rows, offset, after } = this, { tangent } = walk;
    after.fill(0);
    for (let a = 0; a < 3; a++) {
      const rest = offset[a] - dot(rows[a], tangent);
      for (let k = 0; k < after.length; k++) after[k] += rest * rows[a][k];
    }
    for (let k = 0; k < after.length; k++) after[k] -= damping * tangent[k];
    return walk.letGo(walk.manifold.factors.rotate(after));
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
