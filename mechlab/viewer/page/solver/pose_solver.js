// The solver of the page: drives to their targets, or a grabbed point after the pointer, along closed poses.

class PoseSolver {
  constructor(model) {
    this.model = model;
    this.manifold = new Manifold(model);
    this.walk = new Walk(this.manifold);
    this.q = this.walk.q;
    this._holds = new Map();
    this.drives = model.drives.map((name) => this.hold(name));
    this._usual = this._usualCloseness();
    this.set(model.home);
  }

  /** The hold of a joint or shaft with one value. */
  hold(name) {
    if (!this._holds.has(name)) this._holds.set(name, new Hold(this.manifold, name));
    return this._holds.get(name);
  }

  /** Largest of the smallest singular values at poses near home: the unit of closeness. */
  _usualCloseness() {
    const { manifold } = this, { structure } = manifold;
    if (structure.usual === undefined) {
      structure.usual = 1e-12;
      for (const q of structure.poses) {
        manifold.chosen = null;
        manifold.at(q);
        structure.usual = Math.max(structure.usual, this._smallest());
      }
    }
    return structure.usual;
  }

  /** Smallest singular value of the closure rows with the drives held, at the present pose: 0 where modes meet. */
  _smallest() {
    const { manifold } = this;
    manifold.firmly([this.drives]);
    return manifold.factors.rank < manifold.structure.rank + this.drives.length ? 0 : manifold.factors.smallest();
  }

  /** Takes coordinates that are closed, or closes them nearby. Throws an Error where that is impossible. */
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

  /** A solver of the same model at the same pose. */
  copy() {
    const other = new PoseSolver(this.model);
    other.set(this.q);
    return other;
  }

  /** Moves the drives to their targets, then a grabbed point towards its target, while the locked joints hold. */
  solve({ drives = {}, locked = [], grab = null } = {}) {
    const { walk, q } = this, stops = [], held = [], moving = [];
    const pull = grab ? new Pull(this.model, grab) : null;
    for (const name of new Set(locked)) this._lock(name, held);
    for (const [name, wanted] of Object.entries(drives)) this._drive(name, wanted, locked, held, moving, stops);
    const named = new Set([...held, ...moving].map((hold) => hold.name));
    walk.begin(grab || this.drives.some((hold) => !named.has(hold.name)) ? this.drives : null);
    if (moving.length) {
      const why = follow(walk, moving, this._firm(held));
      if (why === "range") for (const hold of walk.active) stops.push({ name: hold.name, why });
      else if (why) for (const hold of moving) stops.push({ name: hold.name, why });
    }
    if (pull) {
      for (const hold of moving) hold.target = hold.value(q);
      const why = pull.follow(walk, this._firm([...held, ...moving]));
      if (why) stops.push({ name: pull.name, why });
      if (pull.miss(this.manifold.tree, q) > 1e-9) for (const hold of walk.active) stops.push({ name: hold.name, why: "range" });
    }
    return this._report(stops, pull);
  }

  _lock(name, held) {
    const joint = this.model.jointNamed.get(name);
    if (joint && joint.kind === "spherical") {
      for (const axis of [0, 1, 2]) held.push(new TurnHold(this.manifold, joint, axis, this.q));
      return;
    }
    const hold = this.hold(name);
    hold.target = hold.value(this.q);
    held.push(hold);
  }

  _drive(name, wanted, locked, held, moving, stops) {
    const hold = this.hold(name), now = hold.value(this.q), range = hold.range;
    if (!Number.isFinite(wanted)) throw new Error(`The target of ${name} is no number.`);
    if (locked.includes(name)) {
      if (Math.abs(wanted - now) > 1e-12 * hold.norm) stops.push({ name, why: "locked" });
      return;
    }
    hold.target = range ? Math.min(Math.max(wanted, Math.min(range[0], now)), Math.max(range[1], now)) : wanted;
    if (hold.target !== wanted) stops.push({ name, why: "range" });
    (Math.abs(hold.error(this.q)) < CLOSED ? held : moving).push(hold);
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
    let gap = 0;
    for (const x of manifold.closure.residual) gap = Math.max(gap, Math.abs(x));
    for (const name of model.names) values[name] = model.value(name, q);
    const closed = manifold.gap() < 1e-9, miss = pull ? pull.miss(manifold.tree, q) * model.size : 0;
    const closeness = Math.min(1, this._smallest() / this._usual), rank = manifold.ends[0];
    const report = { closed, gap, values, stops, rank, freedoms: model.nv - rank, closeness, miss, modeChanged: walk.changes % 2 === 1 };
    report.sentence = solveSentence(report);
    return report;
  }
}

const STOP_WORDS = {
  range: (names) => `${names} ${names.includes(",") ? "are at the end of their ranges" : "is at the end of its range"}`,
  fold: (names) => `${names} cannot go further: the mechanism is stretched or folded there`,
  singular: (names) => `${names} cannot go further: assembly modes meet there, and the way on cannot be told`,
  locked: (names) => `${names} cannot move: what is locked holds it`,
};

/** What a solve has to say, in one sentence; empty when everything is where it was asked to be. */
function solveSentence({ stops, modeChanged }) {
  const parts = [];
  for (const [why, words] of Object.entries(STOP_WORDS)) {
    const names = new Set(stops.filter((stop) => stop.why === why).map((stop) => stop.name));
    if (names.size) parts.push(words([...names].join(", ")));
  }
  if (modeChanged) parts.push("the mechanism passed a limit position into another assembly mode");
  return parts.length ? `${parts.join("; ")}.` : "";
}
