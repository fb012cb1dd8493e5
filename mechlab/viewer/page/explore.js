// Moving the mechanism by hand: all drives by sliders, any part by grabbing it. The solver in the page closes every pose.

const NEAR = 0.05;      // closeness to a singularity below which the page warns
const SAME = 1e-9;      // rad or m by which two values of a drive are the same

class Explorer {
  /** page: {stage, traces, layers, read, panel, redraw, player, shown()}; shown() gives the coordinates that a recording shows
   * now, or null. Throws one sentence for a mechanism that the page cannot solve. */
  constructor(story, page) {
    Object.assign(this, page, { story });
    this.recorded = !story.explore;
    this.byHand = !this.recorded;
    this.followers = [];
    this.modelFollowers = [];
    this.history = new PoseHistory();
    this.before = new PoseBefore(this.stage);
    // Where the sliders of the parameters stand, and those of the design that is drawn: a value may have no mechanism.
    this.picked = this.drawnPicks = story.variants.map((v) => v.home);
    this.models = new WeakMap();
    this.locked = new Set();
    this.take(story);
    this.curves = this.recorded ? null : new CouplerCurves(this.stage, this.traces, this.marks);
    this.freeBody = !this.recorded && FreeBody.fits(this.model, this.report) ? new FreeBody(this) : null;
    this.controls = new HandControls(this);
    this.layers.show.add("before", "ghost: the pose before", true, (on) => this.before.want(on));
    listenTo(document, "keydown", (event) => this.key(event));
    if (this.curves) atEnd(() => this.curves.clear());
    if (this.byHand) { addReach(this.stage, this.layers.show, story.explore.reach, this.read); this.show(); this.drawCurves(); }
  }

  /** Takes over the mechanism of the story, or of a variant of it. */
  take(source) {
    this.source = source;
    if (!this.models.has(source)) this.models.set(source, new PageModel(source.model));
    this.model = this.models.get(source);
    this.solver = new PoseSolver(this.model);
    this.order = this.stage.bodies.map((name) => this.model.bodies.indexOf(name));
    this.normal = planeNormal(this.model);
    this.moving = movingBodies(this.model);
    this.marks = source.marks.filter((m) => m.kind === "frame").map((m) => ({ ...m, inModel: this.order[m.body] }));
    if (this.curves) this.curves.marks = this.marks;
    this.drives = this.model.drives.map((name) => this.driveOf(name));
    this.values = this.valuesNow();
    this.report = this.solver.solve({ drives: this.values, locked: [], grab: null });
    this.otherMode = false;
  }

  /** A drive as a slider shows it: over its range, or a turn, or the size of the mechanism. */
  driveOf(name) {
    const home = this.model.value(name, this.model.home);
    const unit = this.model.quantity(name).slides ? "m" : "rad";
    const half = unit === "m" ? this.stage.framing.radius : Math.PI;
    const range = this.model.range(name);
    const [low, high] = range || [home - half, home + half];
    return { name, unit, home, low, high, range };
  }

  valuesNow() { return Object.fromEntries(this.model.drives.map((name) => [name, this.model.value(name, this.solver.q)])); }

  // What was done, to be undone

  state() {
    return { q: this.solver.q.slice(), values: { ...this.values }, locked: [...this.locked], picked: this.drawnPicks, otherMode: this.otherMode, source: this.source };
  }

  restore(state) {
    if (state.picked.some((index, j) => index !== this.picked[j])) this.showVariant(state.picked);
    if (state.source !== this.source) this.showSource(state.source);
    this.refused = "";
    this.before.keep();
    this.solver.set(state.q);
    this.values = { ...state.values };
    this.locked = new Set(state.locked);
    this.report = this.solver.solve({ drives: this.values, locked: [], grab: null });
    this.otherMode = state.otherMode;
    this.show();
    this.before.show();
    this.drawCurves();
  }

  undo() { this.goThrough((now) => this.history.undo(now)); }
  redo() { this.goThrough((now) => this.history.redo(now)); }

  goThrough(step) {
    if (this.grabber) this.grabber.letGo();
    this.end();
    const state = step(this.state());
    if (state) this.restore(state);
  }

  key(event) {
    if (!this.byHand || !(event.ctrlKey || event.metaKey) || event.altKey || event.target.matches("input.quantity, textarea")) return;
    const name = event.key.toLowerCase();
    if (name !== "z" && name !== "y") return;
    event.preventDefault();
    if (name === "y" || event.shiftKey) this.redo(); else this.undo();
  }

  /** A change begins: what is shown now can be come back to. */
  begin() {
    if (this.begun) return;
    this.takeOver();
    this.begun = this.state();
    this.before.keep();
  }

  /** A change has ended. */
  end() {
    if (!this.begun) return;
    const { q } = this.begun;
    if (q.length !== this.solver.q.length || q.some((x, i) => Math.abs(x - this.solver.q[i]) > SAME)) this.history.push(this.begun);
    this.begun = null;
    this.grabbing = false;
    this.before.show();
    this.show();
    this.drawCurves();
  }

  // Grabbing

  /** Whether the mechanism can move a body (an index of the story). */
  movable(body) { return this.moving.has(this.order[body]); }

  /** Where keys grab a body: at a named point that moves, or else at its end that moves most. */
  handle(body) {
    const group = this.stage.groups[body];
    const named = this.marks.filter((m) => m.body === body).map((m) => new THREE.Vector3(...m.point));
    const box = new THREE.Box3();
    for (const part of group.children) if (part.isMesh && !part.userData.overlay) box.union(new THREE.Box3().setFromBufferAttribute(part.geometry.getAttribute("position")).applyMatrix4(part.matrix));
    const ends = box.isEmpty() ? [new THREE.Vector3()] : [box.getCenter(new THREE.Vector3()), ...boxEnds(box)];
    const best = (points) => points.map((p) => [mobility(this.model, this.solver.q, this.order[body], p, group), p]).sort((a, b) => b[0] - a[0])[0];
    const candidates = named.length ? [best(named), best(ends)] : [best(ends)];
    const [, point] = candidates[0][0] > 0.2 * candidates[candidates.length - 1][0] ? candidates[0] : candidates[1];
    return point.clone().applyQuaternion(group.quaternion).add(group.position);
  }

  /** Pulls a point (in the body) to a target (in the mechanism's frame) as far as the mechanism lets it. */
  drag(body, point, target) {
    const grab = { body: this.model.bodies[this.order[body]], point: point.toArray(), target: target.toArray() };
    this.accept(this.solver.solve({ drives: {}, locked: [...this.locked], grab }));
    this.values = this.valuesNow();
    this.grabbing = true;
    this.show();
    this.before.show();
    return this.report;
  }

  // Drives

  /** Moves a drive to a value; all the others stay where they were put. */
  move(name, value) {
    if (!Number.isFinite(value)) throw new Error(`cannot move ${name} to ${value}: expected a number`);
    if (!Object.hasOwn(this.values, name)) throw new Error(`drive ${name} does not exist; expected one of ${this.model.drives.join(", ")}`);
    if (this.locked.has(name)) { this.say(`${name} is locked; unlock it first.`); return null; }
    this.begin();
    this.accept(this.solver.solve({ drives: { ...this.values, [name]: value }, locked: [], grab: null }));
    const now = this.valuesNow();
    // A value that was reached stays as it was asked for: no drift over many moves.
    for (const [key, found] of Object.entries(now)) {
      const asked = key === name ? value : this.values[key];
      this.values[key] = Math.abs(found - asked) < SAME ? asked : found;
    }
    this.active = name;
    this.missed = Math.abs(this.values[name] - value) >= SAME;
    this.show();
    this.before.show();
    return this.report;
  }

  /** The drives that are not at home, for a link to this pose; none while a recording is shown. */
  given() {
    const away = ([name, value]) => this.recorded || Math.abs(value - this.drives.find((d) => d.name === name).home) > SAME;
    return this.byHand ? Object.fromEntries(Object.entries(this.values).filter(away)) : {};
  }

  /** Takes values {drive: number}, one after another, as a link gives them. */
  give(values) {
    for (const [name, value] of Object.entries(values)) if (Object.hasOwn(this.values, name)) this.move(name, value);
    this.end();
  }

  accept(report) {
    this.report = report;
    this.said = "";
    this.missed = this.grabbing = false;
    if (report.modeChanged) this.otherMode = !this.otherMode;
  }

  lock(name, on) {
    if (on) this.locked.add(name); else this.locked.delete(name);
    this.show();
  }

  goHome() {
    this.begin();
    this.solver.set(this.model.home);
    this.values = this.valuesNow();
    this.accept(this.solver.solve({ drives: this.values, locked: [], grab: null }));
    this.otherMode = false;
    this.end();
  }

  // Variants of the design

  /** Takes choice `index` of parameter `j`; the other parameter goes home, the drives stay where they are as far as they can. */
  pick(j, index) {
    const variant = this.story.variants[j];
    const picked = this.story.variants.map((v, i) => (i === j ? Math.min(v.values.length - 1, Math.max(0, Math.round(index))) : v.home));
    const choice = picked[j] === variant.home ? this.story : variant.choices[picked[j]];
    this.refused = typeof choice === "string" ? choice : "";
    const before = this.state();
    if (this.refused) this.picked = picked; else this.showVariant(picked);
    if (before.picked.join() !== this.drawnPicks.join()) this.history.push(before);
    this.show();
    this.drawCurves();
  }

  showVariant(picked) {
    const j = picked.findIndex((index, i) => index !== this.story.variants[i].home);
    const values = this.values;
    this.picked = this.drawnPicks = picked;
    this.refused = "";
    this.showSource(j < 0 ? this.story : this.story.variants[j].choices[picked[j]]);
    this.accept(this.solver.solve({ drives: values, locked: [], grab: null }));
    this.values = this.valuesNow();
  }

  /** Shows another mechanism of the same parts: the story's, a variant of it, or an edited one, in its reference pose. */
  showSource(source) {
    this.take(source);
    this.before.clear();
    this.stage.replaceParts(source.drawnAs || source, this.read);
    if (source.drawnAs) redrawShapes(this.stage, source.drawnAs.model, source.model);
    for (const follower of this.modelFollowers) follower(this.model);
    this.controls.refresh();
  }

  /** `follower(model)` is called after every change of the mechanism itself. */
  onModel(follower) { this.modelFollowers.push(follower); }

  // A recording

  /** The first change of a recorded pose: the playback is left. */
  takeOver() {
    if (this.byHand) return;
    const start = this.live || this.shown() || this.model.home; // live: what a server shows now
    this.player.pause();
    this.byHand = true;
    this.history = new PoseHistory();
    this.solver.set(start);
    this.values = this.valuesNow();
    this.accept(this.solver.solve({ drives: this.values, locked: [], grab: null }));
    this.otherMode = false;
    // The forces of the recording are those of its own pose.
    for (const item of this.layers.arrows.items) item.visible = item.group.visible = false;
    this.controls.leavePlayback(this.player);
  }

  /** Back to the recording. */
  comeBack() {
    if (!this.recorded || !this.byHand) return;
    this.byHand = false;
    this.begun = null;
    if (this.source !== this.story) this.showSource(this.story);
    this.before.clear();
    this.controls.enterPlayback();
    this.player.seek(this.player.time);
  }

  // Showing

  /** The value of a joint or shaft at the pose that is shown; null for one that has none. */
  value(name) { return this.model.names.includes(name) ? this.model.value(name, this.solver.q) : null; }

  /** `follower()` is called after every change of the pose by hand. */
  onMove(follower) { this.followers.push(follower); }

  /** Whether a part is held at a point that it cannot bring to where it is pulled. */
  get outOfReach() { return this.grabbing && this.report.miss > OPENED * 2 * this.stage.framing.radius; }

  say(words) { this.said = words; this.controls.tell(); }

  show() {
    const { position, quaternion } = this.model.poses(this.solver.q);
    this.stage.groups.forEach((group, k) => {
      group.position.fromArray(position, 3 * this.order[k]);
      group.quaternion.fromArray(quaternion, 4 * this.order[k]);
    });
    if (this.curves && this.curveKey && this.curveKey !== this.keyOfCurves()) { this.curves.clear(); this.curveKey = null; }
    if (this.freeBody) this.freeBody.update();
    this.controls.show();
    for (const follower of this.followers) follower();
    this.redraw();
  }

  /** What the curves depend on: which drive they are of, where the others are, the mode, the design. */
  keyOfCurves() {
    const others = Object.entries(this.values).filter(([name]) => name !== this.active).map(([, value]) => value.toFixed(9));
    return [this.active, this.otherMode, ...this.picked, ...others].join(" ");
  }

  /** The curves of the drive moved last, anew where they are others. */
  drawCurves() {
    if (!this.curves || !this.marks.length || !this.model.drives.length) return;
    this.active = this.active || this.model.drives[0];
    if (this.keyOfCurves() === this.curveKey && this.source === this.curveSource) return;
    [this.curveKey, this.curveSource] = [this.keyOfCurves(), this.source];
    const drive = this.drives.find((d) => d.name === this.active);
    this.curves.draw(this.solver, this.active, [drive.low, drive.high], { ...this.values });
  }
}

/** Sliders and grabbing, where the page can solve the mechanism; null where it cannot, and says why. */
function moveByHand(story, inspector, page) {
  if (!story.model) return null;
  try {
    const explorer = new Explorer(story, page);
    // What is see-through and stands still, such as a workspace, is grabbed through.
    const through = (mesh) => mesh.material.transparent && !explorer.movable(page.stage.groups.indexOf(mesh.parent));
    explorer.grabber = new Grabber(page.stage, explorer, page.layers.labels, document.getElementById("viewport"), (x, y) => inspector.picker.hit(x, y, through));
    explorer.onModel((model) => inspector.readings.read(model.document));
    explorer.editor = new Editor(explorer, inspector, document.getElementById("edit-button"));
    return explorer;
  } catch (error) {
    page.panel.append(section("Moving by hand", make("p", {}, `This mechanism cannot be moved in the page: ${error.message}`)));
    return null;
  }
}
