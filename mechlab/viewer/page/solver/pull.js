// A grabbed point follows its target as far as closed poses allow: damped least squares.

const MOST_TRIES = 30, LONGEST_PULL = 0.4, STATIONARY = 1e-9;
const NOT_MOVED = placementOf(null);

class Pull {
  /** grab: {body, point (3) in the body, target (3) in the world}. */
  constructor(model, grab) {
    this.name = grab.body;
    this.model = model;
    this.shaft = model.drawnShafts.find((shaft) => shaft.name === this.name);
    this.part = this.shaft ? this.shaft.part : model.partIndex(this.name, "The grab");
    this.point = grab.point;
    this.target = grab.target;
    [this.here, this.offset, this.lever] = arrays(3, 3);
    this.rows = arrays(3, model.nv);
    this.free = arrays(3, model.nv);
    [this.gradient, this.way, this.before, this.after, this.rest] = arrays(5, model.nv);
  }

  /** Scaled distance of the point from its target. */
  miss(tree, q) {
    const { shaft, part, point, here, target } = this, { size } = this.model;
    this.frame = shaft ? this.model.shaftFrame(tree, shaft, q) : tree.placed(part, NOT_MOVED);
    for (let a = 0; a < 3; a++) here[a] = this.frame.origin[a] + dot3(this.frame.rotation, 3 * a, point);
    for (let a = 0; a < 3; a++) this.offset[a] = (target[a] - here[a]) / size;
    return norm(this.offset);
  }

  linearize(tree, scale) {
    const { rows, lever, gradient, offset } = this, { size } = this.model;
    for (const row of rows) row.fill(0);
    for (const c of tree.columns[this.part]) {
      tree.lever(c, this.here, 0, lever);
      for (let a = 0; a < 3; a++) rows[a][c] += lever[a] * scale[c] / size;
    }
    if (this.shaft) {
      const { rotation, origin } = this.frame, turning = this.model.row(this.shaft.quantity.name);
      for (let a = 0; a < 3; a++) { // the axis of the shaft, crossed with the way from it to the point
        const b = (a + 1) % 3, c = (a + 2) % 3;
        const way = rotation[3 * b + 2] * (this.here[c] - origin[c]) - rotation[3 * c + 2] * (this.here[b] - origin[b]);
        for (let k = 0; k < turning.length; k++) rows[a][k] += turning[k] * way * scale[k] / size;
      }
    }
    combine(rows, offset, gradient);
  }

  /** The damped step on the null space of the latest factoring, by conjugate gradients, into y; returns its length. */
  step(factors, damping, y) {
    const { rows, free, offset, rest, way: p, after: h } = this;
    for (let a = 0; a < 3; a++) {
      free[a].set(rows[a]);
      factors.rotate(free[a]).fill(0, 0, factors.rank);
    }
    y.fill(0);
    combine(free, offset, rest);
    p.set(rest);
    let square = dot(rest, rest);
    for (let pass = 0, end = 1e-24 * square; pass < 3 && square > end; pass++) {
      combine(free, free.map((row) => dot(row, p)), h);
      addTo(h, damping, p);
      const share = square / dot(p, h), last = square;
      addTo(y, share, p);
      addTo(rest, -share, h);
      square = dot(rest, rest);
      for (let k = 0; k < y.length; k++) p[k] = rest[k] + square / last * p[k];
    }
    return norm(factors.rotateBack(y));
  }

  /** Walks until the point is at its target or can come no nearer, while `held` hold; returns why it stopped: "" or "singular". */
  follow(walk, held) {
    const { manifold, tangent } = walk, { way, before, model } = this;
    this.longest = LONGEST_PULL;
    this.tries = Math.max(5, Math.min(MOST_TRIES, 1e7 / (model.nv * manifold.structure.rank ** 2)));
    walk.ready = false;
    this.stretch = 1;
    let damping = 0, made = 0;
    while (this.tries > 0) {
      walk.place();
      const miss = this.miss(manifold.tree, walk.q);
      this.linearize(manifold.tree, manifold.scale);
      if (made) { // the curvature that least squares leaves out, from the change of the gradient
        walk.factor(held);
        tangent.set(this.gradient);
        manifold.factors.project(tangent);
        let change = 0, square = 0;
        for (let k = 0; k < model.nv; k++) change += (before[k] - tangent[k]) * way[k];
        for (const row of this.rows) square += dot(row, way) ** 2;
        damping = Math.max(0, change / made - square);
        this.stretch = Math.max(1, Math.min(10, square * made / change));
      }
      if (miss < 1e-12) return "";
      made = this._nearer(walk, held, miss, damping);
      if (!made) return this.singular ? "singular" : "";
    }
    return "";
  }

  /** A step that brings the point nearer; returns its length, 0 where there is none. */
  _nearer(walk, held, miss, least) {
    const { manifold, tangent } = walk, { factors } = manifold, { way, before } = this;
    let damping = least;
    this.singular = false;
    while (this.tries-- > 0) {
      walk.factor(held);
      const length = this.step(factors, damping, tangent);
      if (walk.active.length && this._inward(walk, damping)) continue;
      if (!(length > STATIONARY)) return 0;
      divide(tangent, length);
      if (walk.block()) continue;
      way.set(tangent);
      before.set(this.gradient);
      const slope = factors.project(before);
      walk.turning.fill(0);
      const margin = Math.min(manifold.pivot, manifold.structure.margin);
      const made = walk.step(Math.min(length * this.stretch, this.longest), held, held, way);
      const singular = made.flipped || (made.good && manifold.pivot < margin);
      if (made.good && !singular && made.rate > BEND && this.miss(manifold.tree, walk.next) < miss) {
        walk.take(made, false);
        this.longest = Math.min(LONGEST_PULL, 2 * Math.max(made.length, 0.01));
        return made.length;
      }
      this.singular = singular;
      this.stretch = 1;
      this.longest = 0.5 * made.length;
      if (this.longest < SHORTEST_STEP) return 0;
      if (made.good) damping = Math.max(damping, slope / this.longest);
      walk.place();
      this.miss(manifold.tree, walk.q);
    }
    return 0;
  }

  /** Lets go of a joint at the end of its range that would turn back at the end of the step. */
  _inward(walk, damping) {
    const { rows, offset, after } = this, { tangent } = walk;
    combine(rows, rows.map((row, a) => offset[a] - dot(row, tangent)), after);
    addTo(after, -damping, tangent);
    return walk.letGo(walk.manifold.factors.rotate(after));
  }
}

/** out = the sum of three rows, each with its weight. */
function combine([x, y, z], [u, v, w], out) {
  for (let k = 0; k < out.length; k++) out[k] = u * x[k] + v * y[k] + w * z[k];
}
