// Edit mode: the numbers of the picked part in a table, the pivots of a planar mechanism as handles, saving.

const MODEL_NAME = /[^A-Za-z0-9_.-]/g;

class Editor {
  /** `explorer` moves the mechanism by hand; `inspector` tells which part is picked. */
  constructor(explorer, inspector, button) {
    Object.assign(this, { explorer, inspector, button });
    this.on = false;
    this.words = "";
    this.pairs = meshesOf(explorer.model);
    this.normal = planeOf(explorer.model);
    this.table = new EditTable(this);
    this.handles = new Handles(this);
    this.holder = this.table.holder;
    explorer.controls.holder.before(this.holder);
    button.hidden = false;
    button.addEventListener("click", () => this.switch(!this.on));
    listenTo(document, "keydown", (event) => this.key(event));
    inspector.onPin(() => this.refresh());
    explorer.onMove(() => { if (this.on && !this.busy) this.refresh(); });
    explorer.onModel(({ document }) => {
      for (const mark of explorer.story.marks) {
        const frame = mark.kind === "frame" && document.frames.find((f) => f.name === mark.name);
        if (frame) mark.point = frame.placement.position;
      }
    });
    this.refresh();
  }

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || event.defaultPrevented || event.target.matches("input:not([type=range]):not([type=checkbox]), textarea, select")) return;
    if (event.key.toLowerCase() === "e") { event.preventDefault(); this.switch(!this.on); }
    if (event.key === "Escape" && this.on) { event.preventDefault(); this.switch(false); }
  }

  switch(on) {
    if (on === this.on) return;
    this.on = on;
    this.words = "";
    this.button.setAttribute("aria-pressed", String(on));
    document.getElementById("stage").classList.toggle("editing", on);
    if (on) this.explorer.takeOver();
    this.explorer.show();
    this.refresh();
  }

  /** The shown pose as the reference pose of a model. */
  here() {
    const { model, solver } = this.explorer;
    if (!this.shown || this.shown.of !== model || solver.q.some((x, i) => x !== this.shown.q[i])) {
      this.shown = { of: model, q: solver.q.slice(), model: new PageModel(rebased(model, solver.q)) };
    }
    return this.shown.model;
  }

  /** The name of the picked part, or of the first one. */
  get part() {
    const { body } = this.inspector.card, { stage } = this.explorer;
    const name = body === null ? null : stage.bodies[body];
    return this.explorer.model.index.has(name) ? name : this.explorer.model.parts.length ? this.explorer.model.parts[0].name : GROUND_NAME;
  }

  rows() { return numbersOf(this.here(), this.part, this.normal, this.pairs); }

  /** Takes a number that was typed for a row; says why where it cannot be. */
  set(row, text) {
    const { explorer } = this;
    let kept = new Set();
    try {
      const to = typedNumber(text, row.unit);
      if (to === row.value) { this.say("", ""); return; }
      const here = this.here(), steps = row.unit !== "teeth" && row.unit !== "ratio";
      const edit = { from: steps ? row.value : null, to: steps ? to : null, apply: (document, x) => { kept = new Set(row.apply(document, steps ? x : to) || []); } };
      const { model, moved } = reassembled(here, here.home, edit, explorer.model.drives);
      this.take(model, kept, moved);
    } catch (error) {
      const reached = Number.isFinite(error.reached) ? ` It closes as far as ${quantityText(error.reached, row.unit)}.` : "";
      this.say("error", `${row.name} = ${text.trim()}: ${error.message}${reached} Shown is the last one that closes.`);
    }
    this.refresh();
  }

  /** Moves a pivot (see pivotsOf) by a vector [m] from where it was in `here`; `last`: the move has ended. */
  drag(here, pivot, by) {
    try {
      const { document, kept } = movePivot(here, this.normal, pivot, by);
      let model = new PageModel(document);
      if (openBy(model) > 1e-14 * model.size) {
        const closed = closedNear(model, model.home, {});
        if (!closed) throw new Error("It cannot be assembled with that.");
        model = settled(model, closed);
      }
      this.take(model, new Set(kept), false);
    } catch (error) {
      this.say("error", `${pivot.name}: ${error.message} Shown is the last one that closes.`);
      this.refresh();
    }
  }

  /** Shows an edited mechanism. */
  take(model, kept, moved) {
    const { explorer } = this, { story } = explorer;
    this.busy = true;
    if (!explorer.begun) explorer.history.push(explorer.state());
    model = this.follow(model);
    const { document } = model;
    const marks = explorer.source.marks.map((mark) => {
      const frame = mark.kind === "frame" && document.frames.find((f) => f.name === mark.name);
      return frame ? { ...mark, point: frame.placement.position } : mark;
    });
    explorer.showSource({ ...story, model: document, marks, drawnAs: explorer.source.drawnAs || explorer.source });
    explorer.values = explorer.valuesNow();
    explorer.accept(explorer.solver.solve({ drives: explorer.values, locked: [], grab: null }));
    explorer.otherMode = false;
    this.remark();
    explorer.show();
    if (!explorer.begun) explorer.drawCurves();
    this.busy = false;
    const faults = meshFaults(model, this.pairs);
    const still = [...kept];
    const words = [...faults, moved ? "A drive had to move." : "", still.length ? `Mass and inertia of ${still.join(", ")} stay as they were.` : ""].filter(Boolean).join(" ");
    this.say(faults.length ? "warning" : "ok", words || "Assembled; all loops are closed.");
    this.refresh();
  }

  /** Where an edit is one of named parameters, all numbers follow them; else the model as it is. */
  follow(model) {
    const { named, model: first } = this.explorer.story;
    const edit = named && namedEdit(named, first, model.document);
    if (!edit) return model;
    const next = new PageModel(followed(model.document, edit)), closed = openBy(next) > 1e-14 * next.size ? closedNear(next, next.home, {}) : next.home;
    return closed ? settled(next, closed) : model;
  }

  /** In a live page: `send(values)` has Python build a shape from named parameters, `sendModel(text)` from the model as it is;
   * both are checked by all witnesses. */
  connect(send, sendModel) {
    Object.assign(this, { send, sendModel });
    this.refresh();
  }

  build() {
    const edit = this.edit();
    if (edit) this.send(Object.fromEntries([...edit.values].map(([{ key }, value]) => [key, String(value)])));
    else this.sendModel(this.text());
  }

  /** What named parameters make the shown mechanism of the story's, or null. */
  edit() {
    const { story, source } = this.explorer;
    return story.named && source.drawnAs ? namedEdit(story.named, story.model, source.model) : null;
  }

  /** The line that reproduces what is shown; empty where none does. */
  line() {
    const { named } = this.explorer.story, edit = this.edit();
    if (!edit) return "";
    const given = named.given.filter((text) => ![...edit.values.keys()].some(({ key }) => text.startsWith(`${key}=`)));
    return ["mechlab view", named.name, ...given, ...[...edit.values].map(([parameter, value]) => keyValue(parameter, value))].join(" ");
  }

  /** The tints of the picked part, which new shapes have lost. */
  remark() {
    const { visibility } = this.inspector, { pin } = visibility.marked;
    for (const kind of ["hover", "pin"]) visibility.mark(kind, null);
    visibility.mark("pin", pin);
  }

  say(kind, words) { this.words = words; this.kind = kind; }

  refresh() {
    if (this.on) this.table.show(this.rows());
    this.table.tell();
    this.handles.show();
  }

  /** The model as text, with the shown pose as its reference pose. */
  text() {
    const { model, solver } = this.explorer;
    return `${documentText(settled(model, solver.q).document)}\n`;
  }

  save() {
    const { model, solver } = this.explorer, name = `${String(model.document.name).replace(MODEL_NAME, "_")}.json`;
    saveFile(name, new Blob([this.text()], { type: "application/json" }));
    const lost = rangesLost(model, solver.q);
    this.say("ok", `Saved as ${name}; try: mechlab run ${name}.${lost.length ? ` The range of ${lost.join(", ")} counts from this pose now.` : ""}`);
    this.refresh();
  }
}
