// A walk along closed poses. Joints at the end of their range are held there (`active`) until the way turns back.

const BEND = Math.cos(0.3); // largest turn of the tangent in one step
const NO_MOTION = 1e-7; // share of a direction below which the rows hold it
const STRAY = 0.15; // largest correction of a step, as a share of its length

class Walk {
  constructor(manifold) {
    const { model } = manifold, { nv, home } = model;
    this.manifold = manifold;
    this.limits = model.names.filter((name) => model.range(name)).map((name) => new Hold(manifold, name));
    for (const joint of model.joints) if (joint.rates === 3 && joint.range) this.limits.push(new TiltHold(manifold, joint));
    this.active = [];
    this.q = home.slice();
    this.next = home.slice(); // the pose after the latest step, not yet taken
    [this.tangent, this.after, this.turning] = arrays(3, nv); // here, at `next`, and its change per length
    this.tails = [0, 0, 0];
    this._crossing = new Crossing(nv);
    this._mode = new Crossing(nv);
    this._shares = new Float64Array(manifold.b.length);
    this.placed = false; // the manifold stands at q
    this.ready = false; // and has factored what is held there
  }

  /** Begins at q. `watched`: holds whose determinant with the closure tells assembly modes apart; null: not watched. */
  begin(watched) {
    this.watched = watched;
    this.changes = 0;
    this.choices = -1;
    this.ready = false;
    this.turning.fill(0);
  }

  place() {
    if (!this.placed) this.manifold.at(this.q);
    this.placed = true;
  }

  /** The rows factored at q, with the joints at the end of their ranges held. */
  factor(held) {
    if (this.ready) return;
    const { manifold, active } = this;
    this.place();
    manifold.firmly([held, active]);
    if (this.watched && this.choices !== manifold.choices) {
      manifold.factor([this.watched]);
      this._mode.remember(manifold.factors);
      this.choices = manifold.choices;
      manifold.factor([held, active]);
    }
    this.ready = true;
  }

  /** The direction, into `tangent`, in which a row grows most with the holds held; returns its share of the row.
   * `tails`: what the closure, then the holds, then the active joints leave of the row. */
  heading(held, row) {
    const { manifold, tangent: t } = this, { factors } = manifold;
    for (let pass = 0; pass < 3 + 2 * this.limits.length; pass++) {
      this.factor(held);
      t.set(row);
      factors.rotate(t);
      for (let k = 0; k < 3; k++) this.tails[k] = norm(t, manifold.ends[k]);
      if (this.letGo(t)) continue;
      t.fill(0, 0, factors.rank);
      const rate = norm(factors.rotateBack(t));
      if (rate < NO_MOTION) return rate;
      for (let k = 0; k < t.length; k++) t[k] /= rate;
      if (!this.block()) return rate;
    }
    return 0;
  }

  /** Holds a joint at the end of its range that the tangent would leave; true when there was one. */
  block() {
    const first = this.limited(1e-9);
    if (first) this._hold(first.hold, first.hold.value(this.q), first.upper);
    return first !== null;
  }

  _hold(hold, target, upper) {
    hold.target = target;
    hold.upper = upper;
    this.active.push(hold);
    this.ready = false;
  }

  /** Lets go of the active joint that a motion (Q^T of its row) would bring back most; true when there was one. */
  letGo(rotated) {
    const { manifold, active } = this, shares = manifold.factors.shares(rotated, this._shares);
    const first = manifold.rows - active.length;
    let found = -1, most = 1e-9;
    for (let i = 0; i < active.length; i++) {
      const back = active[i].upper ? -shares[first + i] : shares[first + i];
      if (back > most) [found, most] = [i, back];
    }
    if (found >= 0) active.splice(found, 1);
    if (found >= 0) this.ready = false;
    return found >= 0;
  }

  /** The first range that a step of `length` along the tangent would leave: {hold, length, end, upper}, or null. */
  limited(length) {
    let first = null;
    for (const hold of this.limits) {
      if (this.active.includes(hold)) continue;
      hold.update(this.q);
      const rate = dot(hold.row, this.tangent) * hold.norm, upper = rate > 0, end = hold.range[upper ? 1 : 0];
      const way = Math.max(0, (end - hold.value(this.q)) / rate);
      if (!(Math.abs(rate) > 1e-9 * hold.norm && way < length)) continue;
      length = way;
      first = { hold, length, end, upper };
    }
    return first;
  }

  /** A step of `length` along the tangent to `next`, closed, with the values of `group`; a range that it would leave ends it.
   * rate, cosine in what is returned: those of `row` after it. */
  step(length, held, group, row) {
    const { manifold, next, tangent: t, turning, after } = this, { y, factors } = manifold;
    const stopped = this.limited(length), way = stopped ? stopped.length : length;
    this._crossing.remember(factors);
    for (let k = 0; k < t.length; k++) y[k] = way * (t[k] + 0.5 * way * turning[k]);
    manifold.move(this.q, y, next);
    if (stopped) stopped.hold.target = stopped.end;
    this.ready = this.placed = false;
    const groups = stopped ? [held, this.active, [stopped.hold]] : [group, this.active];
    const off = manifold.correct(next, groups, 0.5 * way + 1e-6, 7);
    const made = { length: way, stopped, off, rate: 0, cosine: 0, flipped: false, good: false };
    if (off < 0) return made;
    manifold.factor([held, this.active]);
    after.set(row);
    made.rate = factors.project(after);
    for (let k = 0; k < after.length; k++) after[k] /= made.rate || 1;
    made.cosine = dot(after, t);
    made.flipped = this._crossing.happened(factors, manifold.rows);
    made.good = off <= STRAY * way + 1e-9 && !made.flipped;
    return made;
  }

  take({ stopped, length }, turns) {
    this.q.set(this.next);
    for (let k = 0; k < this.turning.length; k++) this.turning[k] = turns ? (this.after[k] - this.tangent[k]) / length : 0;
    this.placed = this.ready = true;
    this.manifold.q = this.q;
    if (this.watched) {
      this.manifold.factor([this.watched]);
      if (this._mode.happened(this.manifold.factors, this.manifold.rows)) this.changes++;
      this._mode.remember(this.manifold.factors);
      this.ready = false;
    }
    if (stopped) this._hold(stopped.hold, stopped.end, stopped.upper);
  }
}
