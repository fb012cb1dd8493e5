// The solver of the page: drives to their targets, or a grabbed point after the pointer, along closed poses.

const LONGEST_STEP = 0.6, FIRST_STEP = 0.3, SHORTEST_STEP = 1e-6, FOLD_STEP = 3e-5;
const MOST_STEPS = 400;

class PoseSolver {
  constructor(model) {
    this.model = model;
    this.manifold = new Manifold(model);
    this.structure = this.manifold.structure;
    this.scale = this.manifold.scale;
    this._holds = new Map();
    this._limits = this._ranged();
    this._active = [];
    this.drives = model.drives.map((name) => this.hold(name));
    this._completion = this._completed();
    this.q = model.home.slice();
    this._next = model.home.slice();
    this._tangent = new Float64Array(model.nv);
    this._after = new Float64Array(model.nv);
    this._turning = new Float64Array(model.nv);
    this._shares = new Float64Array(this.manifold.b.length);
    this._best = this._usualCloseness();
    this.set(model.home);
  }

  /** The hold of a joint or shaft with one value. */
  hold(name) {
    if (!this._holds.has(name)) this._holds.set(name, new Hold(this, name));
    return this._holds.get(name);
  }

  _ranged() {
    const scalars = this.model.names.filter((name) => this.model.range(name)).map((name) => new Hold(this, name));
    return [...scalars, ...this.model.joints.filter((j) => j.kind === "spherical" && j.range).map((j) => new TiltHold(this, j))];
  }

  /** Rates that complete the drives to a determined pose, as holds. */
  _completed() {
    const { names, declared, rates } = this.structure.independent, used = new Set(this.model.drives);
    return rates.map((k) => {
      const row = new Float64Array(this.model.nv);
      row[k] = 1;
      const joint = this.model.joints.find((j) => j.v === k && j.kind !== "spherical");
      return { name: joint ? joint.name : "", row, update() {}, error: () => 0 };
    }).filter((hold) => !used.has(hold.name));
  }

  _usualCloseness() {
    let best = 1e-12;
    for (const q of this.structure.poses) {
      this.manifold.at(q);
      best = Math.max(best, this._smallest());
    }
    return best;
  }

  _smallest() {
    const { manifold } = this;
    manifold.choose();
    manifold.factor([this.drives, this._completion]);
    this._mode = manifold.factors.rank === this.model.nv ? manifold.factors.sign() : 0;
    this._rank = manifold.ends[0];
    if (manifold.ends[1] < this.structure.rank + this.drives.length) return 0;
    return manifold.factors.smallest();
  }

  /** Takes coordinates that are closed, or closes them nearby. Throws an Error where that is impossible. */
  set(q) {
    this._next.set(q);
    this.manifold.chosen = null;
    this.manifold.at(this._next);
    if (this.manifold.gap() > ACCEPTED) {
      this.manifold.choose();
      if (this.manifold.correct(this._next, [], Infinity, 40) < 0) throw new Error("These coordinates do not close the loops.");
    }
    this.q.set(this._next);
    this._active = [];
  }

  /** A solver of the same model at the same pose. */
  copy() {
    const other = new PoseSolver(this.model);
    other.set(this.q);
    return other;
  }

  solve({ drives = {}, locked = [], grab = null } = {}) {
    this._stops = [];
    const held = [], moving = [];
    for (const name of locked) this._lock(name, held);
    for (const [name, wanted] of Object.entries(drives)) this._drive(name, wanted, held, moving, locked);
    this.manifold.at(this.q);
    this.manifold.choose();
    if (moving.length) this._follow(moving, this._firm(held));
    if (grab) this._pull(grab, this._firm([...held, ...moving.map((hold) => this._keep(hold))]));
    return this._report(grab);
  }

  _keep(hold) {
    hold.target = hold.value(this.q);
    return hold;
  }

  _lock(name, held) {
    const joint = this.model.jointNamed.get(name);
    if (!joint || joint.kind !== "spherical") {
      held.push(this._keep(this.hold(name)));
      return;
    }
    for (const axis of [0, 1, 2]) {
      const hold = new TurnHold(this, joint, axis);
      hold.keep(this.q);
      held.push(hold);
    }
  }

  _drive(name, wanted, held, moving, locked) {
    const hold = this.hold(name), now = hold.value(this.q);
    if (!Number.isFinite(wanted)) throw new Error(`The target of ${name} is no number.`);
    if (locked.includes(name)) {
      if (Math.abs(wanted - now) > 1e-12 * hold.norm) this._stop(name, "locked");
      return;
    }
    let target = wanted;
    if (hold.range) target = Math.min(Math.max(wanted, Math.min(hold.range[0], now)), Math.max(hold.range[1], now));
    if (target !== wanted) this._stop(name, "range");
    hold.target = target;
    (Math.abs(hold.error(this.q)) < CLOSED ? held : moving).push(hold);
  }

  _stop(name, why) {
    if (!this._stops.some((stop) => stop.name === name && stop.why === why)) this._stops.push({ name, why });
  }

  /** The holds that do not repeat others. */
  _firm(held) {
    const { manifold } = this;
    manifold.at(this.q);
    manifold.factor([held]);
    const first = manifold.chosen.length;
    return held.filter((_, i) => manifold.factors.taken[first + i]);
  }

  /** Drives to their targets on a straight line, along the curve of closed poses, until they are there or something stops them. */
  _follow(moving, held) {
    const { manifold, q } = this;
    const errors = moving.map((hold) => hold.error(q)), total = Math.hypot(...errors);
    const line = errors.map((x) => -x / total), along = new BlendHold(moving, line);
    const across = BlendHold.across(moving, line);
    const path = { held: [...held, ...across], along, targets: [...held, ...moving], names: moving.map((hold) => hold.name) };
    let step = FIRST_STEP, bound = null, fresh = false;
    for (let count = 0; count < MOST_STEPS; count++) {
      const rate = this._heading(path.held, along.row);
      if (rate < NO_MOTION) return this._blocked(path, count);
      const left = -along.error(q);
      const final = left <= step * rate;
      const length = final ? left / rate : step;
      const stopped = this._limited(length);
      const group = stopped ? [path.held, this._active.concat(stopped.hold)] : final ? [path.targets, this._active] : [path.held, this._active];
      const made = this._advance(stopped ? stopped.length : length, group, path.held, along.row, fresh);
      if (made.ok && made.cosine > BEND) {
        q.set(this._next);
        if (stopped) { this._active.push(stopped.hold); fresh = false; continue; }
        if (final) return undefined;
        fresh = true;
        for (let k = 0; k < this._turning.length; k++) this._turning[k] = (this._after[k] - this._tangent[k]) / length;
        if (bound !== null) step = Math.max(0.9 * made.rate * length / Math.max(rate - made.rate, 1e-300), FOLD_STEP);
        else if (made.off < 0.03 * length && made.cosine > 0.99) step = Math.min(LONGEST_STEP, 1.7 * step);
        if (bound !== null && made.rate < 1e-4 * bound) return this._fold(path.names);
        continue;
      }
      fresh = false;
      if (made.closed && made.cosine < -BEND) { // the drive has turned back within the step
        bound = Math.max(bound || 0, rate);
        step = Math.min(0.5 * length, 0.9 * length * rate / (rate + made.rate));
        if (step < FOLD_STEP) return this._fold(path.names);
      } else {
        step = 0.5 * length;
        if (step < SHORTEST_STEP || (made.flipped && step < 1e-3)) return this._singular(path.names);
      }
    }
    return this._singular(path.names);
  }

  /** The direction in which the closed poses follow a row best, into _tangent; returns its share of the row. Joints at the
   * end of their ranges hold where they would go on, and are let go where they would turn back. */
  _heading(held, row) {
    const { manifold, q, _tangent: t } = this;
    for (let pass = 0; pass < 12; pass++) {
      manifold.at(q);
      manifold.factor([held, this._active]);
      if (manifold.pivot < 0.1 * manifold.goodness) {
        manifold.choose();
        manifold.factor([held, this._active]);
      }
      t.set(row);
      manifold.factors.rotate(t);
      this._tails = manifold.ends.map((rank) => tailLength(t, rank));
      if (this._active.length && this._letGo(t)) continue;
      t.fill(0, 0, manifold.factors.rank);
      manifold.remember();
      manifold.factors.rotateBack(t);
      const rate = Math.hypot(...t);
      if (rate >= NO_MOTION) for (let k = 0; k < t.length; k++) t[k] /= rate;
      const outward = rate < NO_MOTION ? null : this._limits.find((hold) => !this._active.includes(hold) && this._outward(hold, t));
      if (!outward) return rate;
      outward.target = outward.value(q);
      this._active.push(outward);
    }
    return 0;
  }

  _outward(hold, t) {
    const value = hold.value(this.q), near = 1e-10 * (hold.norm + Math.abs(value));
    hold.update(this.q);
    const rate = dotRows(hold.row, t);
    return (rate > 1e-9 && value > hold.range[1] - near) || (rate < -1e-9 && value < hold.range[0] + near);
  }

  /** Lets go of the joint at the end of its range that the motion would bring back most; true when there was one. */
  _letGo(rotated) {
    const { manifold } = this, shares = manifold.factors.shares(rotated, this._shares);
    const first = manifold.rows - this._active.length;
    let worst = -1, most = 1e-9;
    this._active.forEach((hold, i) => {
      const upper = hold.value(this.q) > 0.5 * (hold.range[0] + hold.range[1]);
      const inward = upper ? -shares[first + i] : shares[first + i];
      if (inward > most) [worst, most] = [i, inward];
    });
    if (worst >= 0) this._active.splice(worst, 1);
    return worst >= 0;
  }

  /** The first range that a step of `length` along the tangent would leave: {hold, length}, or null. */
  _limited(length) {
    let first = null;
    for (const hold of this._limits) {
      if (this._active.includes(hold)) continue;
      hold.update(this.q);
      const value = hold.value(this.q), rate = dotRows(hold.row, this._tangent) * hold.norm;
      const end = rate > 0 ? hold.range[1] : hold.range[0], way = (end - value) / rate;
      if (Math.abs(rate) > 1e-9 && way >= 0 && way < length) {
        length = way;
        hold.target = end;
        first = { hold, length };
      }
    }
    return first;
  }

  /** A step along the tangent, closed again: {ok, closed, off, cosine, rate, flipped}; the pose is in _next, its tangent in _after. */
  _advance(length, groups, held, row, bent) {
    const { manifold, q, _next: next, _tangent: t, _after: after } = this, y = manifold.y;
    for (let k = 0; k < t.length; k++) y[k] = length * (t[k] + (bent ? 0.5 * length * this._turning[k] : 0));
    manifold.move(q, y, 1, next);
    const off = manifold.correct(next, groups, 0.5 * length + 1e-6, 6);
    const made = { ok: false, closed: off >= 0, off, cosine: 0, rate: 0, flipped: false };
    if (off < 0) return made;
    manifold.factor([held, this._active]);
    after.set(row);
    manifold.factors.rotate(after);
    after.fill(0, 0, manifold.factors.rank);
    manifold.factors.rotateBack(after);
    made.rate = Math.hypot(...after);
    for (let k = 0; k < after.length; k++) after[k] /= made.rate || 1;
    made.cosine = dotRows(after, t);
    made.flipped = manifold.flipped();
    made.ok = off <= 0.15 * length + 1e-9 && !made.flipped;
    return made;
  }

  _blocked({ held, names }, count) {
    const [loops, holds] = this._tails;
    if (count > 0 && holds < 1e-4 && loops > 1e-4) return this._fold(names);
    if (loops < 1e-4) return count > 0 ? this._fold(names) : this._singular(names);
    if (holds < NO_MOTION) {
      for (const name of names) this._stop(name, "locked");
      return undefined;
    }
    for (const hold of this._active) this._stop(hold.name, "range");
    return undefined;
  }

  _fold(names) { for (const name of names) this._stop(name, "fold"); }
  _singular(names) { for (const name of names) this._stop(name, "singular"); }

  _report(grab) {
    const { manifold, q, model } = this, before = this._mode;
    manifold.at(q);
    const gap = Math.max(0, ...manifold.closure.residual.map(Math.abs)), closed = manifold.gap() < 1e-9;
    const smallest = this._smallest(), values = {};
    for (const name of model.names) values[name] = model.value(name, q);
    for (const hold of this._active) this._stop(hold.name, "range");
    const report = {
      closed, gap, values, stops: this._stops, rank: this._rank, freedoms: model.nv - this._rank,
      closeness: Math.min(1, smallest / this._best), miss: grab ? this._miss(grab) : 0, modeChanged: false,
    };
    report.sentence = solveSentence(report);
    return report;
  }
}

function dotRows(a, b) {
  let sum = 0;
  for (let k = 0; k < a.length; k++) sum += a[k] * b[k];
  return sum;
}

function tailLength(x, from) {
  let sum = 0;
  for (let k = from; k < x.length; k++) sum += x[k] * x[k];
  return Math.sqrt(sum);
}

const STOP_WORDS = {
  range: (names) => `${names} ${names.includes(",") ? "are" : "is"} at the end of the range`,
  singular: (names) => `assembly modes meet beyond this pose: the way on of ${names} cannot be told`,
  fold: (names) => `${names} cannot go further: the mechanism is stretched or folded there`,
  locked: (names) => `${names} ${names.includes(",") ? "are" : "is"} held by what is locked`,
};

/** What a solve has to say, in one sentence; empty when everything is where it was asked to be. */
function solveSentence({ stops }) {
  const parts = Object.keys(STOP_WORDS).map((why) => {
    const names = stops.filter((stop) => stop.why === why).map((stop) => stop.name);
    return names.length ? STOP_WORDS[why](names.join(", ")) : "";
  }).filter(Boolean);
  const text = parts.join("; ");
  return text ? `${text[0].toUpperCase()}${text.slice(1)}.` : "";
}
