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

  /** The direction, into `tangent`, in which a row grows most; returns its share of the row. `tails`: what each group leaves. */
  heading(held, row) {
    const { manifold, tangent: t } = this, { factors } = manifold;
    for (let pass = 0; pass < 3 + 2 * this.limits.length; pass++) {
      this.factor(held);
      t.set(row);
      factors.rotate(t);
      this.tails = manifold.ends.map((rank) => norm(t, rank));
      if (this.letGo(t)) continue;
      t.fill(0, 0, factors.rank);
      const rate = norm(factors.rotateBack(t));
      if (rate < NO_MOTION) return rate;
      divide(t, rate);
      if (!this.block()) return rate;
    }
    return 0;
  }

  /** Holds a joint at the end of its range that the tangent would leave; true when there was one. */
  block() {
    const first = this.limited(1e-9);
    if (first) this._hold(pinned(first.hold, first.upper, first.hold.value(this.q)));
    return first !== null;
  }

  _hold(hold) {
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

  /** The first range that a step of `length` along the tangent would leave: {hold, length, upper}, or null. */
  limited(length) {
    let first = null;
    for (const hold of this.limits) {
      if (this.active.includes(hold)) continue;
      hold.update(this.q);
      const rate = dot(hold.row, this.tangent) * hold.norm, upper = rate > 0;
      const way = Math.max(0, (hold.range[upper ? 1 : 0] - hold.value(this.q)) / rate);
      if (!(Math.abs(rate) > 1e-9 * hold.norm && way < length)) continue;
      length = way;
      first = { hold, length, upper };
    }
    return first;
  }

  /** A step of `length` along the tangent to `next`, closed, with the values of `group`, within ranges; rate, cosine: of `row`. */
  step(length, held, group, row) {
    const { manifold, q, next, tangent: t, turning, after, active, limits } = this, { y, factors } = manifold;
    const first = this.limited(length), way = first ? first.length : length;
    const pins = first ? [pinned(first.hold, first.upper)] : [];
    this._crossing.remember(factors);
    for (let k = 0; k < t.length; k++) y[k] = way * (t[k] + 0.5 * way * turning[k]);
    manifold.move(q, y, next);
    this.ready = this.placed = false;
    const made = { length: way, pins, off: 0, rate: 0, cosine: 0, flipped: false, good: false };
    for (let more = true; more;) {
      const off = manifold.correct(next, [pins.length ? held : group, active, pins], 0.5 * way + 1e-6, 7);
      made.off = off < 0 ? off : made.off + off;
      if (off < 0) return made;
      more = limits.find((hold) => !active.includes(hold) && !pins.includes(hold) && side(hold, next) && !side(hold, q));
      if (more) pins.push(pinned(more, side(more, next) > 0));
    }
    manifold.factor([held, active]);
    after.set(row);
    made.rate = factors.project(after);
    divide(after, made.rate || 1);
    made.cosine = dot(after, t);
    made.flipped = this._crossing.happened(factors, manifold.rows);
    made.good = made.off <= STRAY * way + 1e-9 && !made.flipped;
    return made;
  }

  take({ pins, length }, turns) {
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
    pins.forEach((hold) => this._hold(hold));
  }
}

/** A joint that is to be held at the upper or lower end of its range. */
function pinned(hold, upper, target = hold.range[upper ? 1 : 0]) { return Object.assign(hold, { target, upper }); }

/** 1 above the range of a joint, -1 below, 0 within. */
function side(hold, q) {
  const { range: [low, high], norm } = hold, value = hold.value(q), near = 1e-10 * (norm + Math.abs(value));
  return value > high + near ? 1 : value < low - near ? -1 : 0;
}
