// The mechanism that a sketch stands for: the same solver as in every page moves it.

class Built {
  constructor(sketch) {
    Object.assign(this, sketchDocument(sketch));
    this.sketch = sketch;
    this.model = this.solver = null;
    this.freedoms = 0;
    if (!this.document) return;
    const open = new PageModel(this.document), closed = closedNear(open, open.home, {});
    if (!closed) throw new Error("These lengths cannot be assembled.");
    this.model = settled(open, closed);
    this.solver = new PoseSolver(this.model);
    this.freedoms = this.model.nv - structureOf(this.model).rank;
  }

  get drive() { const [motor] = this.model ? this.model.document.drives : []; return motor ? motor.on : null; }

  tree() { return this.model.tree.set(this.solver.q); }

  /** The angle of a part in the plane. */
  angleOf(name) { const r = this.tree().rotation, k = 9 * this.model.index.get(name); return Math.atan2(r[k + 3], r[k]); }

  /** Pulls a point of a body after a target [x, y]. */
  pull(body, local, target) { return this.solver.solve({ drives: {}, locked: [], grab: { body, point: local, target: [...target, 0] } }); }

  /** Puts the points of the sketch where the solver has them. */
  place() {
    if (!this.model) return;
    const tree = this.tree();
    for (const frame of this.model.document.frames) {
      const { origin } = tree.placed(this.model.index.get(frame.body), placementOf(frame.placement)), p = this.sketch.points.find((x) => x.name === frame.name);
      if (p) [p.x, p.y] = [origin[0], origin[1]];
    }
  }

  /** A bar of another length; the mechanism is closed near the pose that is shown. */
  setLength(bar, length) {
    const name = barName(this.sketch, bar), normal = [0, 0, 1], from = bar.length;
    if (!(length > 0.001 && length < 100)) throw new Error("Expected a length from 1 mm to 100 m.");
    const apply = (d, x) => moveAttached(d, name, [from, 0, 0], [x - from, 0, 0], normal, this.model.size);
    const { model } = reassembled(this.model, this.solver.q, { from, to: length, apply }, this.model.drives);
    this.model = model;
    this.solver = new PoseSolver(model);
    this.place();
    bar.length = length;
  }

  /** The document to save, in the pose that is shown. */
  text() { return `${documentText(settled(this.model, this.solver.q).document)}\n`; }
}
