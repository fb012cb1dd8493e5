// What was done by hand, to be undone and done again.

const MOST_KEPT = 200;

class PoseHistory {
  constructor() { this.past = []; this.future = []; }

  /** Remembers the state before a change. */
  push(before) {
    this.past.push(before);
    if (this.past.length > MOST_KEPT) this.past.shift();
    this.future = [];
  }

  get canUndo() { return this.past.length > 0; }
  get canRedo() { return this.future.length > 0; }

  /** The state before the latest change, null when there is none; `now` is kept to be done again. */
  undo(now) { return this.step(this.past, this.future, now); }
  redo(now) { return this.step(this.future, this.past, now); }

  step(from, to, now) {
    if (!from.length) return null;
    to.push(now);
    return from.pop();
  }
}
