// The closed poses of a mechanism: Newton's method onto them, their tangents, and steps along them that never change
// the assembly mode unseen. Lengths are scaled: slides in sizes of the mechanism, turns in radians.

const CLOSED = 1e-13, ACCEPTED = 1e-11; // scaled residuals: aimed at, and good enough where rounding stops the fall
const BEND = Math.cos(0.3); // largest turn of the tangent in one step
const NO_MOTION = 1e-7; // share of a direction below which the rows hold it

class Manifold {
  constructor(model) {
    const { nv, nq } = model;
    this.model = model;
    this.structure = structureOf(model);
    this.scale = this.structure.scale;
    this.tree = new Tree(model);
    this.closure = new Closure(model);
    this.weights = this.structure.units.map((unit, i) => unit / this.structure.sizes[i]);
    const capacity = this.closure.count + 4 * nv + 8;
    this.factors = new RowFactors(capacity, nv);
    this.b = new Float64Array(capacity);
    this.y = new Float64Array(nv);
    this.dv = new Float64Array(nv);
    this.chosen = null; // indices of independent closure rows, in use since the pose where they were chosen
    this.goodness = 0; // their smallest pivot there
    this.ends = []; // rank after each group of rows of the latest factoring
    this.border = new Float64Array(nv * nv); // null space of the rows at the base of a step
    this.trial = new Float64Array(nq);
  }

  at(q) {
    this.q = q;
    this.closure.evaluate(this.tree.set(q), true);
  }

  /** Largest scaled residual of all closure rows, the redundant ones included. */
  gap() {
    let worst = 0;
    for (let i = 0; i < this.closure.count; i++) worst = Math.max(worst, Math.abs(this.closure.residual[i]) * this.structure.units[i]);
    return worst;
  }

  /** Chooses the independent closure rows afresh at the present pose. */
  choose() {
    const { factors, closure } = this;
    factors.clear();
    for (let i = 0; i < closure.count; i++) this._write(i, i);
    this.goodness = factors.stage(0, closure.count, 1e-9, this.structure.rank);
    this.chosen = Array.from(factors.order.subarray(0, factors.rank)).sort((a, b) => a - b);
  }

  _write(row, to) {
    const { nv } = this.model, { jacobian } = this.closure, { matrix } = this.factors, weight = this.weights[row];
    for (let k = 0, i = row * nv, j = to * nv; k < nv; k++) matrix[j + k] = weight * jacobian[i + k] * this.scale[k];
  }

  /** Factors the chosen closure rows and groups of holds at the present pose, one stage each; `b` gets minus the residuals. */
  factor(groups) {
    if (!this.chosen) this.choose();
    const { factors, b, chosen } = this, { nv } = this.model;
    for (let i = 0; i < chosen.length; i++) this._write(chosen[i], i);
    factors.clear();
    this.pivot = factors.stage(0, chosen.length, 1e-10);
    this.ends.length = 0;
    this.ends.push(factors.rank);
    let next = chosen.length;
    for (const group of groups) {
      const from = next;
      for (const hold of group) {
        hold.update(this.q);
        factors.matrix.set(hold.row, nv * next++);
      }
      factors.stage(from, next, 1e-10);
      this.ends.push(factors.rank);
    }
    this.rows = next;
  }

  /** b: minus the residuals of the rows; returns the largest. */
  residuals(groups) {
    const { b, chosen, closure } = this;
    let worst = 0, next = 0;
    for (; next < chosen.length; next++) {
      b[next] = -closure.residual[chosen[next]] * this.weights[chosen[next]];
      worst = Math.max(worst, Math.abs(b[next]));
    }
    for (const group of groups) for (const hold of group) {
      b[next] = -hold.error(this.q);
      worst = Math.max(worst, Math.abs(b[next++]));
    }
    return worst;
  }

  /** q moved by a scaled displacement y, into `out`. */
  move(q, y, share, out) {
    for (let k = 0; k < y.length; k++) this.dv[k] = share * y[k] * this.scale[k];
    return movedBy(this.model, q, this.dv, out);
  }

  /** Newton's method from q, in place, onto the closure and the targets of the holds; each correction is the smallest that
   * does it. Returns how far it moved q, or -1 when it did not close within `most` steps or moved further than `far`. */
  correct(q, groups, far = Infinity, most = 8) {
    let moved = 0, before = Infinity, worst = Infinity, last = Infinity;
    for (let pass = 0; ; pass++) {
      this.at(q);
      worst = this.residuals(groups);
      if (!(worst < 1e3)) return -1;
      if (worst < CLOSED || (worst < ACCEPTED && worst > 0.2 * before)) break;
      if (pass === most) return -1;
      before = worst;
      this.factor(groups);
      this.factors.solve(this.b, this.y);
      const length = Math.hypot(...this.y);
      moved += length;
      if (!(moved <= far) || (pass && length > 0.7 * last && length > 1e-9)) return -1;
      last = length;
      this.move(q, this.y, 1, q);
    }
    return this.gap() < 1e-10 ? moved : -1;
  }

  /** Remembers the null space of the rows of the latest factoring, and the sign of their determinant. */
  remember() {
    const { factors, border } = this, { nv } = this.model;
    this.free = nv - factors.rank;
    this.sign = factors.sign();
    this.firm = factors.rank;
    for (let i = 0; i < this.free; i++) {
      const row = border.subarray(i * nv, (i + 1) * nv);
      row.fill(0);
      row[factors.rank + i] = 1;
      factors.rotateBack(row);
    }
  }

  /** True where the determinant, bordered by the remembered null space, has changed its sign since. Call after `factor`. */
  flipped() {
    const { factors } = this, { nv } = this.model;
    if (factors.rank !== this.firm) return true;
    const from = this.rows;
    factors.matrix.set(this.border.subarray(0, this.free * nv), from * nv);
    factors.stage(from, from + this.free, 1e-12);
    const flipped = factors.rank < nv || factors.sign() !== this.sign;
    for (let i = from; i < from + this.free; i++) factors.taken[i] = 0;
    factors.rank = this.firm;
    return flipped;
  }
}
