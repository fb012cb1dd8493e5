// The numbers of a part as fields; what was said about the latest edit; saving.

class EditTable {
  constructor(editor) {
    this.editor = editor;
    this.title = make("h2", {});
    this.rows = make("tbody", {});
    this.more = make("tbody", {});
    this.details = make("details", { class: "more" }, make("summary", {}, "Everything else: directions, placements, sizes"), make("table", {}, this.more));
    this.said = make("p", { class: "state", role: "status", "aria-live": "polite", hidden: true });
    this.line = make("p", { class: "reproduce", hidden: true });
    const tool = (words, title, action) => make("button", { type: "button", title, onclick: action }, words);
    const parts = make("select", { "aria-label": "Part", onchange: () => editor.inspector.pin(editor.explorer.stage.bodies.indexOf(parts.value)) });
    this.parts = parts;
    this.holder = make("section", { id: "edit", "aria-label": "Edit the geometry", hidden: true },
      make("div", { class: "hand-head" }, this.title, make("div", { class: "tools" }, tool("Save", "Download the model as JSON for mechlab run", () => editor.save()), tool("Done", "Leave edit mode (E)", () => editor.switch(false)))),
      make("p", { class: "hint" }, editor.normal ? "Drag a pivot, or type a number with its unit (120mm, 37deg). The loops stay closed; Undo takes it back."
        : "Type a number with its unit (120mm, 37deg). The loops stay closed; Undo takes it back."),
      make("label", { class: "edit-part" }, "Part ", parts), make("table", {}, this.rows), this.details, this.said, this.line);
    this.key = "";
    this.fields = [];
  }

  /** Shows rows (see numbersOf); the same rows keep their fields, so that one that is typed in stays. */
  show(rows) {
    const { editor } = this, { stage, model } = editor.explorer;
    this.current = rows;
    const names = stage.bodies.filter((name) => model.index.has(name));
    if (this.parts.children.length !== names.length) this.parts.replaceChildren(...names.map((name) => make("option", { value: name }, name)));
    this.parts.value = editor.part;
    const key = [editor.part, ...rows.map((row) => row.name)].join("|");
    if (key !== this.key) {
      this.key = key;
      this.fields = rows.map((row, k) => this.field(row, k));
      const lines = (main) => this.fields.filter((_, k) => rows[k].main === main).map(({ row }) => row);
      this.rows.replaceChildren(...lines(true));
      this.more.replaceChildren(...lines(false));
      this.details.hidden = !this.more.children.length;
    }
    this.fields.forEach(({ input }, k) => { if (document.activeElement !== input || !input.dataset.typed) input.value = quantityText(rows[k].value, rows[k].unit); });
  }

  field({ name, unit }, k) {
    const id = `edit-${k}`;
    const done = () => {
      if (!input.dataset.typed) return;
      delete input.dataset.typed;
      this.editor.set(this.current[k], input.value);
    };
    const input = make("input", { id, class: "quantity", autocomplete: "off", spellcheck: "false", inputmode: unit === "teeth" ? "numeric" : "text",
      oninput: () => { input.dataset.typed = "1"; }, onchange: done, onkeydown: (event) => {
        event.stopPropagation();
        if (event.key === "Enter") done();
        if (event.key === "Escape") { delete input.dataset.typed; input.value = quantityText(this.current[k].value, unit); input.blur(); }
      } });
    return { input, row: make("tr", {}, make("th", { scope: "row" }, make("label", { for: id }, name.replace(/_/g, " "))), make("td", {}, input)) };
  }

  tell() {
    const { editor } = this;
    this.holder.hidden = !editor.on;
    this.title.textContent = "Edit the geometry";
    this.said.hidden = !editor.words;
    this.said.className = `state ${editor.kind || "ok"}`;
    const { story, source } = editor.explorer, line = editor.on ? editor.line() : "";
    this.line.hidden = !source.drawnAs || !(story.named || editor.send);
    const how = line ? ["The same, with the masses of the definition: ", make("code", {}, line)] : story.named ? ["No named parameters give this shape; save the model."] : [];
    this.line.replaceChildren(...how, ...(editor.send ? [make("button", { type: "button", id: "edit-send", onclick: () => editor.build() }, "Build and check in Python")] : []));
    this.said.replaceChildren(make("span", { class: "mark", "aria-hidden": "true" }, { error: "\u2715", warning: "!" }[editor.kind] || "\u2713"), make("span", {}, editor.words));
  }
}
