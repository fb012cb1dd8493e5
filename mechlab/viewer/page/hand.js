// The controls for moving by hand: drives, undo, what is held, and the state of the pose in words.

class HandControls {
  constructor(explorer) {
    this.explorer = explorer;
    const { story } = explorer;
    this.holder = make("section", { id: "hand", "aria-label": "Move by hand", hidden: explorer.recorded });
    const tool = (words, title, action) => make("button", { type: "button", title, "aria-label": title, onclick: action }, words);
    this.undo = tool("\u21b6 Undo", "Undo (Ctrl+Z)", () => explorer.undo());
    this.redo = tool("\u21b7 Redo", "Redo (Ctrl+Shift+Z)", () => explorer.redo());
    const home = tool("Home", "Go to the pose in which the page opened", () => explorer.goHome());
    this.list = make("div", { class: "drives" });
    this.complaint = make("p", { class: "said", role: "alert" });
    this.state = make("p", { class: "state", role: "status", "aria-live": "polite" });
    this.holder.append(make("div", { class: "hand-head" }, make("h2", {}, "Move it"), make("div", { class: "tools" }, this.undo, this.redo, ...(explorer.recorded ? [] : [home]))),
      make("p", { class: "hint" }, `Grab any part and pull it, or move a drive.${explorer.normal ? "" : " With Shift, or a second finger, a part goes away from you and back."}`),
      this.list, this.complaint, this.state, ...(explorer.freeBody ? [explorer.freeBody.element] : []));
    this.choices = story.variants.map((v, j) => this.choice(v, j));
    if (this.choices.length) this.holder.append(make("p", { class: "hint" }, `Each step of a parameter is a mechanism of its own${this.choices.length > 1 ? "; one parameter differs at a time" : ""}.`));
    explorer.panel.querySelector("header").after(this.holder);
    this.addReturn();
    this.refresh();
  }

  /** The rows of the drives of the present mechanism. */
  refresh() {
    const { explorer } = this;
    this.rows = explorer.drives.map((drive) => new DriveRow(drive, {
      move: (value) => { this.complaint.textContent = ""; explorer.move(drive.name, value); },
      release: () => explorer.end(),
      lock: (on) => explorer.lock(drive.name, on),
      complain: (words) => { this.complaint.textContent = words; },
    }));
    this.list.replaceChildren(...this.rows.map((row) => row.element), ...this.choices.map(({ element }) => element));
  }

  choice(variant, j) {
    const value = make("output", { class: "value" });
    const home = (event) => { if (event.key === "Home") { event.preventDefault(); this.explorer.pick(j, variant.home); } event.stopPropagation(); };
    const slider = make("input", { type: "range", min: 0, max: variant.values.length - 1, step: 1, value: variant.home,
      "aria-label": `parameter ${variant.key}, ${variant.unit || "a number"}`, oninput: () => this.explorer.pick(j, slider.valueAsNumber), onkeydown: home });
    return { slider, value, element: make("div", { class: "drive parameter" }, make("span", { class: "name" }, variant.key), slider, value) };
  }

  show() {
    const { explorer } = this;
    for (const row of this.rows) { row.show(explorer.values[row.name]); row.setLocked(explorer.locked.has(row.name)); }
    this.choices.forEach(({ slider, value }, j) => {
      const { values, unit, home } = explorer.story.variants[j];
      const index = explorer.picked[j];
      slider.value = index;
      value.textContent = unit === "m" ? lengthText(values[index]) : `${significant(values[index])} ${unit}`;
      slider.setAttribute("aria-valuetext", value.textContent);
      slider.parentElement.classList.toggle("away", index === home);
      slider.parentElement.hidden = Boolean(explorer.source.drawnAs); // a variant is none of an edited mechanism
    });
    this.undo.disabled = !explorer.history.canUndo;
    this.redo.disabled = !explorer.history.canRedo;
    this.tell();
  }

  /** The state of the pose: what was said or what holds it, then the mode, the closeness to a singularity, the gap. */
  tell() {
    const { explorer } = this;
    const { report, refused } = explorer;
    const impossible = Boolean(refused) || !report.closed || explorer.missed;
    const near = !impossible && report.closeness < NEAR;
    const out = explorer.outOfReach;
    const kind = impossible ? "error" : near || out ? "warning" : "ok";
    const first = refused ? `No mechanism here: ${refused} Shown is the last one that exists.`
      : [explorer.said, out ? report.sentence || this.held() : impossible ? report.sentence : "",
        near ? "Near a singularity." : ""].filter(Boolean).join(" ");
    const mode = explorer.otherMode ? "another one than at the start: a fold was passed" : "that of the start";
    const loops = (explorer.model.document.loops || []).length ? `loops open by ${report.gap < 1e-9 ? "less than 1\u00a0nm" : lengthText(report.gap)}` : "no loops";
    const facts = `Assembly mode: ${mode}. ${Math.round(100 * Math.max(0, report.closeness))}\u00a0% away from the nearest singularity, ${loops}.`;
    this.state.className = `state ${kind}`;
    this.state.replaceChildren(make("span", { class: "mark", "aria-hidden": "true" }, { error: "\u2715", warning: "!", ok: "\u2713" }[kind]),
      make("span", {}, ...(first ? [make("strong", {}, first), " "] : []), ...(refused ? [] : [facts])));
    document.getElementById("stage").classList.toggle("impossible", impossible || near);
  }

  /** What keeps a grabbed point from its target where nothing has come to an end. */
  held() {
    const { locked } = this.explorer;
    return `The grabbed point is as near as the mechanism lets it come${locked.size ? ` with ${[...locked].join(", ")} locked` : ""}.`;
  }

  // In the page of a recording

  addReturn() {
    this.bar = make("p", { id: "by-hand", role: "status", hidden: true }, make("span", {}, "Moved by hand.", this.where = make("span", { class: "wide" })),
      this.back = make("button", { type: "button", onclick: () => this.explorer.comeBack() }));
    document.getElementById("stage").append(this.bar);
  }

  leavePlayback({ duration, time }) {
    this.where.textContent = duration > 0 ? ` The recording waits at ${significant(time)}\u00a0s.` : "";
    this.back.textContent = duration > 0 ? "Back to the recording" : "Back to the pose before";
    this.bar.hidden = this.holder.hidden = false;
  }

  enterPlayback() {
    this.bar.hidden = this.holder.hidden = true;
    document.getElementById("stage").classList.remove("impossible");
  }
}
