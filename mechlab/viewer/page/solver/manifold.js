// The closed poses of a mechanism: Newton's method onto them, and where assembly modes meet. Lengths are scaled: slides in
// sizes of the mechanism, turns in radians. A group is a list of holds, taken in after the closure rows.

const CLOSED = 1e-13, ACCEPTED = 1e-11; // scaled residuals: aimed at, and good enough where rounding stops the fall
const FIRM = 1e-10; // share of a row beyond which it does not repeat the rows before it
const CHORD = 1e-3; // corrections below this go on with the rows factored before

/** The null space of rows, and the sign of their determinant with it: that changes where two curves of closed poses cross. */
class Crossing {
  constructor(nv) {
    this.nv = nv;
    this.border = new Float64Array(nv * nv);
  }

  remember(factors) {
    const { nv, border } = this;
    this.rank = factors.rank;
    this.sign = factors.sign();
    for (let i = 0; i < nv - factors.rank; i++) {
      const row = border.subarray(i * nv, (i + 1) * nv);
      row.fill(0);
      row[factors.rank + i] = 1;
      factors.rotateBack(row);
    }
  }

  /** True where the sign has changed since; `room`: the first free row of the factors. */
  happened(factors, room) {
    const { nv, rank } = this;
    if (factors.rank !== rank) return true;
    factors.matrix.set(this.border.subarray(0, (nv - rank) * nv), room * nv);
    factors.stage(room, room + nv - rank, 1e-12);
    const happened = factors.rank < nv || factors.sign() !== this.sign;
    factors.taken.fill(0, room, room + nv - rank);
    factors.rank = rank;
    return happened;
  }
}

class Manifold {
  /** `structure`: of the model; null while it is worked out. */
  constructor(model, structure) {
    const { nv } = model;
    this.model = model;
    this.structure = structure;
    this.scale = rateScale(model);
    this.tree = new Tree(model);
    this.closure = new Closure(model);
    this.units = Float64Array.from(this.closure.lengths, (isLength) => (isLength ? 1 / model.size : 1));
    this.weights = this.units.map((unit, i) => (structure ? unit / structure.sizes[i] : unit));
    const capacity = this.closure.count + 2 * model.names.length + 5 * nv + 8;
    this.factors = new RowFactors(capacity, nv);
    this.b = new Float64Array(capacity);
    [this.y, this.dv] = arrays(2, nv);
    this.chosen = null; // indices of independent closure rows, in use since the pose where they were chosen
    this.choices = 0;
    this.goodness = 0; // their smallest pivot there
    this.ends = []; // rank after the closure rows and after each group of the latest factoring
    this.fresh = false; // the closure rows are factored at the present pose
  }

  at(q) {
    this.q = q;
    this.fresh = false;
    this.closure.evaluate(this.tree.set(q));
  }

  /** Largest scaled residual of all closure rows, the redundant ones included. */
  gap() { return this.closure.residual.reduce((most, x, i) => Math.max(most, Math.abs(x) * this.units[i]), 0); }

  /** Chooses the independent closure rows at the present pose. */
  choose() {
    const { factors, closure } = this;
    factors.clear();
    for (let i = 0; i < closure.count; i++) this.write(i, i);
    this.goodness = factors.stage(0, closure.count, RANK_TOLERANCE, this.structure ? this.structure.rank : Infinity);
    this.chosen = factors.order.slice(0, factors.rank).sort();
    this.choices++;
    this.fresh = false;
  }

  write(row, to) {
    const { nv } = this.model, { jacobian } = this.closure, { matrix } = this.factors, weight = this.weights[row];
    for (let k = 0, i = row * nv, j = to * nv; k < nv; k++) matrix[j + k] = weight * jacobian[i + k] * this.scale[k];
  }

  /** Factors the chosen closure rows and groups of holds at the present pose. */
  factor(groups) {
    const { factors, chosen, ends } = this, { nv } = this.model;
    if (!this.fresh) {
      for (let i = 0; i < chosen.length; i++) this.write(chosen[i], i);
      factors.clear();
      this.pivot = factors.stage(0, chosen.length, FIRM);
      ends[0] = factors.rank;
      this.fresh = true;
    }
    factors.rank = ends[0];
    factors.taken.fill(0, chosen.length);
    ends.length = 1;
    this.rows = chosen.length;
    for (const group of groups) {
      const from = this.rows;
      for (const hold of group) {
        hold.update(this.q);
        factors.matrix.set(hold.row, nv * this.rows++);
      }
      factors.stage(from, this.rows, FIRM);
      ends.push(factors.rank);
    }
  }

  /** The same, with closure rows chosen afresh where those in use have become poor. */
  firmly(groups) {
    if (this.chosen) this.factor(groups);
    if (this.chosen && !(this.pivot < 0.1 * this.goodness) && this.ends[0] === this.chosen.length) return;
    this.choose();
    this.factor(groups);
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

  move(q, y, out) {
    for (let k = 0; k < y.length; k++) this.dv[k] = y[k] * this.scale[k];
    return movedBy(this.model, q, this.dv, out);
  }

  /** Newton's method from q, in place, onto the closure and the targets of the holds. Returns how far it moved q, or -1. */
  correct(q, groups, far = Infinity, most = 12) {
    let moved = 0, before = Infinity, last = Infinity, factored = false;
    for (let pass = 0; ; pass++) {
      this.at(q);
      const worst = this.residuals(groups);
      if (worst < CLOSED || (worst < ACCEPTED && worst > 0.2 * before)) break;
      if (pass === most || !(worst < 1e3)) return -1;
      if (!factored || last > CHORD || worst > 0.1 * before) {
        this.factor(groups);
        factored = true;
      }
      before = worst;
      this.factors.solve(this.b, this.y);
      const length = norm(this.y);
      moved += length;
      if (!(moved <= far) || (pass && length > 0.7 * last && length > 1e-9)) return -1;
      last = length;
      this.move(q, this.y, q);
    }
    return this.gap() < 1e-10 ? moved : -1;
  }
}
