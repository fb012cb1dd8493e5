// The panel of the drawing: name, tools, what they do, the state of the mechanism, the numbers of what is selected.

class DrawPanel {
  constructor(holder) { this.holder = holder; }

  /** Puts the panel together, once there is a drawing. */
  fill(drawing) {
    this.drawing = drawing;
    const button = (words, title, action) => make("button", { type: "button", title, onclick: action }, words);
    this.tools = Object.entries(TOOLS).map(([tool, [words]]) => [tool, button(words, TOOLS[tool][1], () => drawing.choose(tool))]);
    this.hint = make("p", { id: "draw-hint" });
    this.state = make("p", { class: "state", role: "status", "aria-live": "polite" });
    this.name = make("input", { id: "draw-name", value: drawing.sketch.name, maxlength: 40, spellcheck: "false", autocomplete: "off", onchange: () => this.rename() });
    this.undo = button("\u21b6 Undo", "Undo (Ctrl+Z)", () => drawing.undo());
    this.redo = button("\u21b7 Redo", "Redo (Ctrl+Shift+Z)", () => drawing.redo());
    this.play = button("Run", "Turn the motor", () => { if (drawing.running) drawing.stop(); else drawing.run(); });
    this.saveButton = button("Save", "Download the model as JSON for mechlab run", () => drawing.save());
    this.numbers = make("table", { id: "draw-numbers" });
    const snap = make("input", { type: "checkbox", id: "draw-snap", checked: true, onchange: () => { drawing.snap = snap.checked; } });
    this.holder.append(make("header", {}, make("h1", {}, "Draw a linkage"), make("p", { class: "summary" }, "Put ground pivots, join them with bars, add a motor. A loop closes as soon as a bar ends on a pivot.")),
      make("div", { class: "tool-row", role: "toolbar", "aria-label": "Tools" }, ...this.tools.map(([, element]) => element)), this.hint,
      make("div", { class: "tool-row" }, this.undo, this.redo, this.play, button("Fit", "Show everything", () => { drawing.view.fit(drawing.sketch.points); drawing.show(); }), this.saveButton),
      this.state, this.numbers, make("p", { class: "options" }, make("label", { class: "check" }, snap, "snap to 5 mm"), make("label", { for: "draw-name" }, " name ", this.name)),
      make("footer", {}, "Keys in the plane: arrows move a cross, Enter presses there, Space begins and ends a bar. The wheel zooms."));
  }

  rename() {
    const name = this.name.value.trim().replace(/[^A-Za-z0-9_.-]/g, "_") || "linkage";
    this.drawing.change(() => { this.drawing.sketch.name = name; });
  }

  show(drawing) {
    if (!this.tools) return;
    const { sketch, built, history } = drawing;
    for (const [tool, element] of this.tools) element.setAttribute("aria-pressed", String(tool === drawing.tool));
    this.hint.textContent = TOOLS[drawing.tool][1];
    this.name.value = sketch.name;
    this.undo.disabled = !history.canUndo;
    this.redo.disabled = !history.canRedo;
    this.play.disabled = !built.drive;
    this.play.textContent = drawing.running ? "Stop" : "Run";
    this.saveButton.disabled = !built.model;
    const words = drawing.said || stateWords(sketch, built);
    this.state.className = `state ${drawing.said ? "warning" : "ok"}`;
    if (this.state.textContent !== words) this.state.textContent = words;
    this.showNumbers(drawing);
  }

  /** Fields of the selected bar or pivot. */
  showNumbers(drawing) {
    const item = drawing.selected, { sketch } = drawing;
    const bar = item && item.ends ? item : null, point = item && !bar ? item : null;
    const rows = bar ? [["length", bar.length, "m", (x) => drawing.setLength(bar, x)]] : point ? [
      ["x", point.x, "m", (x) => this.put(point, x, point.y)], ["y", point.y, "m", (y) => this.put(point, point.x, y)],
      ...(point.rail !== null ? [["rail", point.rail, "rad", (angle) => drawing.change(() => { point.rail = angle; })]] : []),
      ...(point.teeth ? [["teeth", point.teeth, "teeth", (z) => drawing.change(() => { point.teeth = z === 0 ? 0 : toothCount(z); })]] : []),
    ] : [];
    const key = item ? `${item.id} ${rows.map(([name]) => name).join()}` : "";
    if (key !== this.key) {
      this.key = key;
      this.fields = rows.map(([name], k) => make("input", { class: "quantity", id: `draw-${name}`, autocomplete: "off", spellcheck: "false", onchange: () => this.take(k) }));
      const title = bar ? `Bar ${barName(sketch, bar)}` : point ? `Pivot ${point.name}` : "";
      this.numbers.replaceChildren(...(item ? [make("caption", {}, title)] : []), ...this.fields.map((field, k) => make("tr", {}, make("th", { scope: "row" }, make("label", { for: field.id }, rows[k][0])), make("td", {}, field))));
    }
    this.current = rows;
    this.fields.forEach((field, k) => { if (document.activeElement !== field) field.value = quantityText(rows[k][1], rows[k][2]); });
  }

  take(k) {
    const [name, value, unit, action] = this.current[k], { drawing } = this;
    try { action(typedNumber(this.fields[k].value, unit)); } catch (error) { drawing.say(`${name}: ${error.message}`); }
    const now = this.current[k];
    if (now) this.fields[k].value = quantityText(now[1], unit); else this.fields[k].value = quantityText(value, unit);
    drawing.show();
  }

  put(point, x, y) {
    const { drawing } = this;
    drawing.change(() => {
      [point.x, point.y] = [x, y];
      for (const bar of drawing.sketch.bars) if (bar.ends.includes(point.id)) bar.length = drawing.span(bar);
    });
  }
}

/** What the sketch is as a mechanism, in words. */
function stateWords(sketch, built) {
  if (!sketch.points.length) return "The plane is empty: click to put the first ground pivot.";
  if (!sketch.bars.length && !built.model) return "Drag from a pivot to draw the first bar.";
  const count = (n, word) => `${n} ${word}${n === 1 ? "" : "s"}`;
  const parts = [];
  if (built.model) {
    const loops = built.model.document.loops.length, n = built.freedoms;
    parts.push(`${count(n, "freedom")}${n === 0 ? ": it is rigid" : n > 1 ? `: ${n} motors would fix it` : built.drive ? `: the motor at ${pointOf(sketch, sketch.motor).name} moves it` : ": a motor on a ground pivot would move it"}.`, `${count(built.model.parts.length, "part")}, ${count(loops, "loop")}, all closed.`);
    const meshes = built.model.document.relations.length;
    if (meshes) parts.push(`${count(meshes, "mesh").replace("meshs", "meshes")} of gears.`);
    const gears = sketch.points.filter((p) => p.teeth > 0);
    if (gears.length > 1 && !meshes) parts.push("No two gears touch: their centres must be half the sum of their teeth times 2.5 mm apart.");
  }
  if (built.loose.length) parts.push(`${built.loose.map((bar) => barName(sketch, bar)).join(", ")} ${built.loose.length === 1 ? "hangs" : "hang"} on no ground pivot yet.`);
  return parts.join(" ");
}
