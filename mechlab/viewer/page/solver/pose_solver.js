// The page's solver: drives to their targets, a grabbed point after the pointer, on closed poses.

class PoseSolver {
  constructor(model) {
    this.model = model;
    this.manifold = new Manifold(model, structureOf(model));
    this.walk = new Walk(this.manifold);
    this.q = this.walk.q;
    this._holds = new Map();
    this.drives = model.drives.map((name) => this.hold(name));
    const { structure } = this.manifold; // its `usual`: the largest distance from a singular pose near home, the unit of closeness
    if (!structure.usual) structure.usual = Math.max(1e-12, ...structure.poses.map((q) => this._distance(q)));
    this.set(model.home);
  }

  hold(name) {
    if (!this._holds.has(name)) this._holds.set(name, new Hold(this.manifold, name));
    return this._holds.get(name);
  }

  /** Smallest singular value of the closure with the drives held, at q or where the manifold stands: 0 where modes meet. */
  _distance(q) {
    const { manifold } = this;
    if (q) manifold.at(q);
    manifold.firmly([this.drives]);
    return manifold.factors.rank < manifold.structure.rank + this.drives.length ? 0 : manifold.factors.smallest();
  }

  /** Takes coordinates, closed nearby if they are not. Throws an Error where that is impossible. */
  set(q) {
    const { manifold, walk } = this;
    if (q.length !== this.model.nq) throw new Error(`There are ${q.length} coordinates; the mechanism has ${this.model.nq}.`);
    walk.next.set(q);
    manifold.at(walk.next);
    manifold.choose();
    if (!(manifold.gap() < ACCEPTED) && manifold.correct(walk.next, [], Infinity, 40) < 0) throw new Error("These coordinates do not close the loops.");
    this.q.set(walk.next);
    walk.placed = false;
    walk.active.length = 0;
  }

  copy() {
    const other = new PoseSolver(this.model);
    other.set(this.q);
    return other;
  }

  /** Drives to their targets, then a grabbed point towards its own, while the locked joints hold. */
  solve({ drives = {}, locked = [], grab = null } = {}) {
    const { walk, q } = this, stops = [], moving = [], held = locked.map((name) => this._kept(name));
    const pull = grab ? new Pull(this.model, grab) : null;
    for (const [name, wanted] of Object.entries(drives)) this._drive(name, wanted, locked, held, moving, stops);
    const determined = !grab && this.drives.every((hold) => held.includes(hold) || moving.includes(hold));
    walk.begin(determined ? null : this.drives);
    if (moving.length) {
      const why = follow(walk, moving, this._firm(held));
      if (why) for (const { name } of why === "range" ? walk.active : moving) stops.push({ name, why });
    }
    if (pull) {
      const why = pull.follow(walk, this._firm([...held, ...moving.map((hold) => this._kept(hold.name))]));
      if (why) stops.push({ name: pull.name, why });
      if (pull.miss(this.manifold.tree, q) > 1e-9) for (const { name } of walk.active) stops.push({ name, why: "range" });
    }
    return this._report(stops, pull);
  }

  _kept(name) {
    const hold = this.hold(name);
    hold.target = hold.value(this.q);
    return hold;
  }

  _drive(name, wanted, locked, held, moving, stops) {
    if (!Number.isFinite(wanted)) throw new Error(`The target of ${name} is no number.`);
    const hold = this._kept(name), now = hold.target, isLocked = locked.includes(name);
    const [low, high] = isLocked ? [now, now] : hold.range || [wanted, wanted];
    hold.target = Math.min(Math.max(wanted, Math.min(low, now)), Math.max(high, now));
    if (Math.abs(hold.target - wanted) > 1e-12 * hold.norm) stops.push({ name, why: isLocked ? "locked" : "range" });
    if (!isLocked) (Math.abs(hold.error(this.q)) < CLOSED ? held : moving).push(hold);
  }

  /** The holds that do not repeat others. */
  _firm(held) {
    const { manifold } = this;
    if (held.length < 2) return held;
    this.walk.place();
    manifold.firmly([held]);
    const first = manifold.chosen.length;
    return held.filter((_, i) => manifold.factors.taken[first + i]);
  }

  _report(stops, pull) {
    const { manifold, q, model, walk } = this, values = {};
    walk.place();
    for (const name of model.names) values[name] = model.value(name, q);
    const gap = Math.max(0, ...manifold.closure.residual.map(Math.abs)), closed = manifold.gap() < 1e-9;
    const miss = pull ? pull.miss(manifold.tree, q) * model.size : 0, closeness = Math.min(1, this._distance() / manifold.structure.usual);
    const rank = manifold.ends[0], freedoms = model.nv - rank, modeChanged = walk.changes % 2 === 1;
    const stuck = !pull && closeness < 1e-5 && stops.some(({ why }) => why === "singular");
    const sentence = solveSentence(stops, stuck, modeChanged);
    return { closed, gap, values, stops, rank, freedoms, closeness, miss, modeChanged, sentence };
  }
}

const STOP_WORDS = {
  range: "the range ends there",
  fold: "the mechanism is stretched or folded there",
  singular: "the pose there is singular, assembly modes meet in it",
  locked: "what is locked holds it",
};

/** What a solve has to say, in one sentence; empty when everything is where it was asked to be. */
function solveSentence(stops, stuck, modeChanged) {
  const parts = [];
  for (const [why, words] of Object.entries(STOP_WORDS)) {
    const names = new Set(stops.filter((stop) => stop.why === why).map((stop) => stop.name));
    if (names.size) parts.push(`${[...names].join(", ")} cannot go further: ${words}`);
  }
  if (stuck) parts.push("undo, or drag it out");
  if (modeChanged) parts.push("the mechanism passed a limit position into another assembly mode");
  return parts.length ? `${parts.join("; ")}.` : "";
}
