// Drawing a linkage: what the tools do with a pointer or with keys, what can be undone, what is said.

const NEAR_POINT = 14, NEAR_FINGER = 24, CLICK = 5; // pixels
const TOOLS = {
  draw: ["Draw", "Click: a ground pivot. Drag from a pivot: a bar, to another pivot or to a free end."],
  slider: ["Slider", "Click a pivot that is not on the ground: it slides on a rail. Again: the rail turns by 45\u00b0; after 135\u00b0 it goes."],
  gear: ["Gear", "Click a pivot: a gear of 20 teeth on it. Gears that touch mesh. The number of teeth is in the panel."],
  motor: ["Motor", "Click a ground pivot: its bar or gear is driven. Then press Run."],
  shift: ["Shift pivot", "Drag a pivot: the bars at it become longer or shorter."],
  move: ["Move", "Drag a pivot or a bar: the mechanism moves as far as it can. Drag beside it: the plane moves."],
  remove: ["Delete", "Click a pivot or a bar: it goes."],
};

class Drawing {
  constructor(view, panel) {
    Object.assign(this, { view, panel, sketch: emptySketch(), tool: "draw", history: new PoseHistory(), selected: null, traces: new Map(), snap: true, cursor: null, running: false, said: "" });
    this.built = new Built(this.sketch);
    view.onResize = () => this.show();
    this.listen();
  }

  listen() {
    const { svg } = this.view;
    const at = (event) => { const box = svg.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
    svg.addEventListener("pointerdown", (event) => { if (event.button !== 0 || this.held) return; event.preventDefault(); svg.focus(); svg.setPointerCapture(event.pointerId); this.pointer = event.pointerId; this.cursor = null; this.reach = event.pointerType === "touch" ? NEAR_FINGER : NEAR_POINT; this.down(at(event)); });
    svg.addEventListener("pointermove", (event) => { if (this.held && event.pointerId === this.pointer) this.move(at(event)); });
    for (const kind of ["pointerup", "pointercancel"]) svg.addEventListener(kind, (event) => { if (this.held && event.pointerId === this.pointer) this.up(at(event)); });
    svg.addEventListener("wheel", (event) => { event.preventDefault(); this.view.zoom(Math.exp(-0.0015 * event.deltaY), at(event)); this.show(); }, { passive: false });
    svg.addEventListener("keydown", (event) => this.key(event));
    document.addEventListener("keydown", (event) => {
      if (!(event.ctrlKey || event.metaKey) || event.target.matches("input") || !["z", "y"].includes(event.key.toLowerCase())) return;
      event.preventDefault();
      if (event.key.toLowerCase() === "y" || event.shiftKey) this.redo(); else this.undo();
    });
  }

  /** Arrow keys move a cross by the grid; Enter presses there, Space begins a bar and ends it. */
  key(event) {
    const ways = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    this.reach = NEAR_POINT;
    if (event.key in ways) {
      const step = GRID * (event.shiftKey ? 10 : 1), [x, y] = this.cursor || this.view.centre.map((c) => Math.round(c / GRID) * GRID);
      this.cursor = this.cursor ? [x + step * ways[event.key][0], y + step * ways[event.key][1]] : [x, y];
      if (this.held) this.move(this.view.toScreen(this.cursor));
    } else if ((event.key === "Enter" || event.key === " ") && this.cursor) {
      const place = this.view.toScreen(this.cursor);
      if (this.held) this.up(place); else { this.down(place); if (event.key === "Enter") this.up(place); }
    } else if (event.key === "Escape") { this.held = this.from = this.to = null; this.select(null); } else return;
    event.preventDefault();
    this.show();
  }

  // What lies where

  snapped(place) { const p = this.view.toPlane(place); return this.snap ? p.map((x) => Math.round(x / GRID) * GRID) : p; }

  pointAt(place, except = null) {
    const far = (p) => { const [x, y] = this.view.toScreen([p.x, p.y]); return Math.hypot(x - place[0], y - place[1]); };
    return this.sketch.points.filter((p) => p !== except && far(p) < this.reach).sort((a, b) => far(a) - far(b))[0] || null;
  }

  barAt(place) {
    const far = (bar) => {
      const [[ax, ay], [bx, by]] = bar.ends.map((id) => { const p = pointOf(this.sketch, id); return this.view.toScreen([p.x, p.y]); });
      const t = Math.min(1, Math.max(0, ((place[0] - ax) * (bx - ax) + (place[1] - ay) * (by - ay)) / ((bx - ax) ** 2 + (by - ay) ** 2 || 1)));
      return Math.hypot(place[0] - ax - t * (bx - ax), place[1] - ay - t * (by - ay));
    };
    return this.sketch.bars.filter((bar) => far(bar) < this.reach).sort((a, b) => far(a) - far(b))[0] || null;
  }

  // The pointer

  down(place) {
    this.stop();
    const point = this.pointAt(place), bar = point ? null : this.barAt(place);
    this.said = "";
    this.held = { place, point, bar, before: JSON.stringify(this.sketch), moved: false, centre: [...this.view.centre] };
    if (this.tool === "move" && this.built.model) this.held.grip = this.grip(point, bar, place);
  }

  /** The body and the point in it that is pulled. */
  grip(point, bar, place) {
    const { model } = this.built, frame = point && model.document.frames.find((f) => f.name === point.name);
    if (frame) return { body: frame.body, local: frame.placement.position };
    if (!bar || this.built.loose.includes(bar)) return null;
    const body = barName(this.sketch, bar), k = model.index.get(body), tree = this.built.tree(), origin = [...tree.origin.slice(3 * k, 3 * k + 3)];
    return { body, local: timesBack33(rotationIn(tree, model, body), minus3([...this.view.toPlane(place), 0], origin)) };
  }

  move(place) {
    const { held, view } = this;
    if (!held.moved && Math.hypot(place[0] - held.place[0], place[1] - held.place[1]) < CLICK) return;
    held.moved = true;
    if (this.tool === "draw" && held.point) {
      const end = this.pointAt(place, held.point);
      this.from = [held.point.x, held.point.y];
      this.to = end ? [end.x, end.y] : this.snapped(place);
    } else if (this.tool === "shift" && held.point) {
      [held.point.x, held.point.y] = this.snapped(place);
      for (const bar of this.sketch.bars) if (bar.ends.includes(held.point.id)) bar.length = this.span(bar);
      this.rebuild();
    } else if (this.tool === "move" && held.grip) {
      this.report = this.built.pull(held.grip.body, held.grip.local, view.toPlane(place));
      this.built.place();
    } else if (this.tool !== "draw" || !held.bar) {
      view.centre = [held.centre[0] - (place[0] - held.place[0]) / view.scale, held.centre[1] + (place[1] - held.place[1]) / view.scale];
      held.panned = true;
    }
    this.show();
  }

  span(bar) { const [a, b] = bar.ends.map((id) => pointOf(this.sketch, id)); return Math.hypot(b.x - a.x, b.y - a.y); }

  up(place) {
    const { held } = this;
    this.held = this.from = this.to = null;
    try {
      if (!held.panned) this[held.moved ? "dragged" : "clicked"](held, place);
    } catch (error) { this.sketch = JSON.parse(held.before); this.say(error.message); }
    this.changed(held.before);
  }

  dragged(held, place) {
    if (this.tool !== "draw" || !held.point) return;
    let end = this.pointAt(place, held.point);
    if (!end) { const [x, y] = this.snapped(place); end = addPoint(this.sketch, [x, y], false); }
    this.selected = addBar(this.sketch, held.point, end);
  }

  clicked({ point, bar }, place) {
    const { sketch, tool } = this;
    if (tool === "remove") {
      if (point) removePoint(sketch, point.id); else if (bar) sketch.bars.splice(sketch.bars.indexOf(bar), 1);
      this.selected = null;
      return;
    }
    if (tool === "draw" && !point && !bar) { this.selected = addPoint(sketch, this.snapped(place), true); return; }
    if (point && tool === "slider") {
      if (point.ground) throw new Error(`${point.name} is fixed to the ground; a slider needs a pivot that moves.`);
      point.rail = point.rail === null ? 0 : point.rail > 2 ? null : point.rail + Math.PI / 4;
    }
    if (point && tool === "gear") point.teeth = point.teeth || 20;
    if (point && tool === "motor") {
      if (!point.ground) throw new Error(`A motor stands on the ground; ${point.name} moves.`);
      sketch.motor = sketch.motor === point.id ? null : point.id;
    }
    this.selected = point || bar;
  }

  // What changes

  /** After a change of the sketch that was `before`: undo, the mechanism anew. */
  changed(before) {
    if (JSON.stringify(this.sketch) !== before) this.history.push(before);
    this.adopt();
    this.rebuild();
    this.show();
  }

  /** The selected thing in the present sketch. */
  adopt() {
    const { selected, sketch } = this;
    this.selected = selected ? [...sketch.points, ...sketch.bars].find((x) => x.id === selected.id) || null : null;
    this.traces.clear();
  }

  rebuild() {
    try { this.built = new Built(this.sketch); } catch (error) { this.say(error.message); }
  }

  undo() { this.restore(this.history.undo(JSON.stringify(this.sketch))); }
  redo() { this.restore(this.history.redo(JSON.stringify(this.sketch))); }

  restore(text) {
    if (!text) return;
    this.stop();
    this.sketch = JSON.parse(text);
    this.adopt();
    this.rebuild();
    this.show();
  }

  /** A change by the panel; what it throws is said. */
  change(action) {
    const before = JSON.stringify(this.sketch);
    this.said = "";
    try { action(); } catch (error) { this.sketch = JSON.parse(before); this.say(error.message); }
    this.changed(before);
  }

  setLength(bar, length) {
    this.change(() => {
      if (this.built.loose.includes(bar)) { const [a, b] = bar.ends.map((id) => pointOf(this.sketch, id)), k = length / bar.length; [b.x, b.y] = [a.x + k * (b.x - a.x), a.y + k * (b.y - a.y)]; bar.length = length; } else this.built.setLength(bar, length);
    });
  }

  select(item) { this.selected = item; }
  choose(tool) { this.tool = tool; this.said = ""; this.show(); }
  say(words) { this.said = words; }

  // Running

  /** Turns the motor at 1 rad/s, back again where it cannot go on. */
  run() {
    const { drive } = this.built;
    if (!drive) return;
    this.before = JSON.stringify(this.sketch);
    this.running = true;
    this.way = 1;
    this.traces.clear();
    let last = null;
    const frame = (now) => {
      if (!this.running) return;
      const step = last === null ? 0 : Math.min(0.05, (now - last) / 1000);
      last = now;
      this.turn(this.way * 1.5 * step);
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
    this.show();
  }

  turn(by) {
    const { built } = this, value = built.model.value(built.drive, built.solver.q);
    const report = built.solver.solve({ drives: { [built.drive]: value + by }, locked: [], grab: null });
    if (report.stops.length) { this.way = -this.way; this.say(report.sentence); }
    built.place();
    for (const p of this.sketch.points) {
      if (p.ground) continue;
      const list = this.traces.get(p.id) || [];
      list.push([p.x, p.y]);
      this.traces.set(p.id, list.slice(-800));
    }
    this.show();
  }

  stop() {
    if (!this.running) return;
    this.running = false;
    this.rebuild();
    this.show();
  }

  save() {
    if (!this.built.model) { this.say("There is nothing to save yet."); this.show(); return; }
    const name = `${this.sketch.name}.json`;
    saveFile(name, new Blob([this.built.text()], { type: "application/json" }));
    this.say(`Saved as ${name}; try: mechlab run ${name}`);
    this.show();
  }

  show() { this.view.show(this); this.panel.show(this); }
}
