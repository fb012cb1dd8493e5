// Every recorded channel as a plot: a list with a search; those of one unit share a plot.

class ChannelPicker {
  constructor(channels, read, player, time, holder) {
    Object.assign(this, { player, time, holder, read });
    this.times = read(channels.t);
    this.items = channels.items;
    this.chosen = [];
    this.views = new Map();
    this.search = make("input", { type: "search", placeholder: "Search: rate, force, C_x \u2026", "aria-label": "Search channels", oninput: () => this.filter() });
    this.list = make("div", { class: "channel-list" });
    this.count = make("p", { class: "hint", role: "status" });
    const some = this.times.length < channels.recorded ? [make("p", { class: "hint" }, `${this.times.length} of the ${channels.recorded} recorded times are in this page.`)] : [];
    this.element = make("details", { id: "channels" }, make("summary", {}, `Plot any of ${this.items.length} channels`), this.search, this.list, this.count, ...some);
    // The list is made when it is first opened: a run may have hundreds of channels.
    this.element.addEventListener("toggle", () => { if (this.element.open && !this.rows) this.fill(); });
    this.plots = make("div", {});
    holder.prepend(this.element, this.plots);
  }

  fill() {
    this.rows = this.items.map((item) => {
      const box = make("input", { type: "checkbox", value: item.name, onchange: (event) => this.choose(item.name, event.target.checked) });
      box.checked = this.chosen.includes(item.name);
      const row = make("label", { class: "check channel" }, box, make("span", {}, item.name), make("span", { class: "unit" }, unitText(item.unit)));
      return { item, box, row };
    });
    this.list.replaceChildren(...this.rows.map((x) => x.row));
    this.filter();
  }

  /** Shows the channels whose name or unit has every word of the search. */
  filter() {
    const words = this.search.value.toLowerCase().split(/\s+/).filter(Boolean);
    let count = 0;
    for (const { item, row } of this.rows) {
      const text = `${item.name} ${item.unit}`.toLowerCase();
      row.hidden = !words.every((word) => text.includes(word));
      if (!row.hidden) count++;
    }
    this.count.textContent = words.length ? `${count} of ${this.items.length} channels` : "";
  }

  /** Plots a channel, or no longer. Throws for a name that is not recorded. */
  choose(name, on = true) {
    if (!this.items.some((item) => item.name === name)) throw new Error(`channel '${name}' does not exist. Existing: ${this.items.map((x) => x.name).join(", ")}.`);
    this.chosen = this.chosen.filter((x) => x !== name).concat(on ? [name] : []);
    this.update();
  }

  curvesOf(unit) {
    return this.chosen.map((name) => this.items.find((item) => item.name === name)).filter((item) => item.unit === unit)
      .map((item) => ({ name: item.name, values: this.read(item.values), against: null }));
  }

  update() {
    for (const { item, box } of this.rows || []) box.checked = this.chosen.includes(item.name);
    const units = [...new Set(this.items.map((item) => item.unit))].filter((unit) => this.curvesOf(unit).length);
    for (const [unit, view] of this.views) if (!units.includes(unit)) { view.remove(); this.views.delete(unit); }
    for (const unit of units) {
      const curves = this.curvesOf(unit);
      if (this.views.has(unit)) { this.views.get(unit).take(curves); continue; }
      const close = () => { this.chosen = this.chosen.filter((name) => this.items.find((item) => item.name === name).unit !== unit); this.update(); };
      const view = new PlotView({ title: unit ? `channels in ${unitText(unit)}` : "channels", unit, curves }, this.times, this.player, this.time, close);
      this.views.set(unit, view);
      this.plots.append(view.element);
    }
  }

  follow(time) { for (const view of this.views.values()) view.follow(time); }

  /** The recorded value of a channel at a time, or null where there is none of that name. */
  value(name, time) {
    const item = this.items.find((x) => x.name === name);
    return item ? valueAt(this.times, this.read(item.values), time) : null;
  }
}
