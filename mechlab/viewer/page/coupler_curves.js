// Coupler curves: the paths of all named points while one drive goes through its reach and the others rest.

const PIECES = 240;       // of the reach of a drive
const BURST = 10;         // ms of work before the page gets its turn

class CouplerCurves {
  constructor(stage, traces, marks) {
    Object.assign(this, { stage, traces, marks });
    this.job = 0;
    this.done = true;
  }

  /** Draws the curves of the drive `name` of `solver`'s pose between `low` and `high`, a burst at a time. `held`: values of all
   * drives. A job that is overtaken by another one ends. */
  async draw(solver, name, [low, high], held) {
    const job = ++this.job;
    this.done = false;
    const start = held[name];
    const paths = this.marks.map(() => [[], []]), values = [[], []];
    const step = (high - low) / PIECES;
    for (const [side, way] of [[0, -1], [1, 1]]) {
      const walker = solver.copy();
      const end = way < 0 ? low : high;
      this.visit(walker, paths, side);
      for (let k = 1, rest = null; k <= PIECES; k++) {
        const value = way < 0 ? Math.max(end, start - k * step) : Math.min(end, start + k * step);
        const report = walker.solve({ drives: { ...held, [name]: value }, locked: [], grab: null });
        if (job !== this.job) return;
        this.visit(walker, paths, side);
        values[side].push(report.values[name]);
        if (report.stops.length || value === end) break;
        rest = rest || performance.now() + BURST;
        if (performance.now() > rest) { await pause(); rest = null; if (job !== this.job) return; }
      }
    }
    this.traces.clear();
    /** Values of the drive at the points of the curves. */
    this.values = [...values[0].reverse(), start, ...values[1]];
    this.paths = {};
    this.marks.forEach((mark, j) => {
      const [back, forth] = paths[j];
      const points = [...back.slice(1).reverse(), ...forth];
      this.paths[mark.name] = points.flat();
      this.traces.add(this.stage, this.paths[mark.name], TRACE_COLORS[j % TRACE_COLORS.length], mark.name);
    });
    this.traces.apply(Infinity);
    this.stage.redraw();
    this.done = true;
  }

  visit(walker, paths, side) {
    const { position, quaternion } = walker.model.poses(walker.q);
    this.marks.forEach((mark, j) => {
      const k = mark.inModel;
      const at = new THREE.Vector3(...mark.point).applyQuaternion(new THREE.Quaternion().fromArray(quaternion, 4 * k));
      paths[j][side].push([at.x + position[3 * k], at.y + position[3 * k + 1], at.z + position[3 * k + 2]]);
    });
  }

  clear() { this.job++; this.done = true; this.traces.clear(); }
}

function pause() { return new Promise((go) => setTimeout(go)); }
