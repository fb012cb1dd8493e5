// The forces on the parts at the pose that is shown, while the drive of a mechanism with one freedom moves steadily.

const ARROW_SHARE = 0.7;     // largest length of an arrow, in radii of the mechanism

class FreeBody {
  /** Whether a mechanism has such forces: one freedom, one drive, a mass. */
  static fits(model, report) {
    return report.freedoms === 1 && model.drives.length === 1 && new SteadyForces(model).massive;
  }

  constructor(explorer) {
    this.explorer = explorer;
    this.choice = "none";
    const { stage } = explorer;
    const bodies = stage.bodies.map((name, k) => [name, k]).filter(([name, k]) => name !== "ground" && explorer.order[k] < explorer.model.parts.length);
    const options = [["none", "none"], ["all", "all joints"], ...bodies.map(([name]) => [name, `on ${name}`])];
    this.select = make("select", { id: "free-body", onchange: () => { this.choice = this.select.value; explorer.show(); } },
      ...options.map(([value, words]) => make("option", { value }, words)));
    this.note = make("span", { class: "hint" });
    const role = (name, words) => make("label", { class: "check" }, make("input", { type: "checkbox", id: `free-body-${name}`, onchange: (event) => {
      if (event.target.checked) this.roles.add(name); else this.roles.delete(name);
      explorer.show();
    } }), words);
    this.roles = new Set();
    this.effects = make("span", { class: "effects", hidden: true }, role("net", "net force m\u00b7a"), role("inertia", "inertia \u2212m\u00b7a"));
    this.element = make("p", { class: "forces" }, make("label", { for: "free-body" }, "Forces "), this.select, this.effects, this.note);
  }

  /** Shows the forces of a choice (none, all, or a part) and, of roles, "net" and "inertia"; another choice is left alone. */
  choose(choice, roles = []) {
    if (![...this.select.options].some((option) => option.value === choice)) return;
    this.choice = this.select.value = choice;
    for (const box of this.effects.querySelectorAll("input")) {
      const name = box.id.replace("free-body-", "");
      box.checked = roles.includes(name);
      if (box.checked) this.roles.add(name); else this.roles.delete(name);
    }
    this.explorer.show();
  }

  update() {
    const { explorer, choice } = this;
    const { arrows } = explorer.layers;
    this.effects.hidden = choice === "none" || choice === "all";
    if (choice === "none") { this.draw([]); this.note.textContent = ""; return; }
    const [name] = explorer.model.drives;
    const rate = (explorer.story.explore && explorer.story.explore.rates[name]) || 1;
    if (!this.forces || this.forces.model !== explorer.model) this.forces = new SteadyForces(explorer.model);
    const found = this.forces.at(explorer.solver, name, rate);
    const unit = explorer.drives[0].unit;
    this.note.textContent = ` with ${name} moving steadily at ${significant(rate)} ${unit}/s${found ? "" : "; here they have no bound"}`;
    const wanted = (found || []).filter((x) => (x.role && !this.roles.has(x.role) ? false : choice === "all" ? x.by : x.on === choice || x.by === choice));
    this.draw(wanted.map((x) => ({ ...x, sign: choice !== "all" && x.by === choice ? -1 : 1 })));
    arrows.apply(0, 0);
  }

  /** Arrows for these loads: new ones where others are wanted, the same ones moved otherwise. */
  draw(loads) {
    const { arrows } = this.explorer.layers, { radius, step } = this.explorer.stage.framing;
    for (const { kind, unit, vector } of loads) {
      const scale = niceStep((length3(vector) * step) / (ARROW_SHARE * (kind === "torque" ? 0.5 : 1) * radius), 1);
      if (!(arrows.scales[unit] >= scale)) arrows.scales[unit] = scale;
    }
    const key = loads.map((x) => `${x.name} ${x.sign}`).join("|");
    if (key !== this.key) {
      this.key = key;
      arrows.replace(loads.map((x) => ({ ...x, points: new Float64Array(3), vectors: new Float64Array(3) })), (values) => values);
    }
    loads.forEach((load, i) => { arrows.items[i].points.set(load.point); arrows.items[i].vectors.set(load.vector); });
  }
}
