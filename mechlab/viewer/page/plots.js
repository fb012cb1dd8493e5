// Curves over time with one shared cursor. A click seeks, a drag zooms all plots, a drag of the cursor scrubs, hovering reads values.

// Wong's palette without its yellow (colour-blind-safe, dark enough on white); the dashes tell the curves apart without colour.
const CURVES = [["#0072b2", []], ["#d55e00", [7, 3]], ["#009e73", [2, 3]], ["#a64d79", [9, 3, 2, 3]], ["#3b3b3b", [1, 2]], ["#b58900", [12, 4]]];
const READING = 200; // ms between two readings while it plays
const EDGE = { left: 56, right: 14, top: 8, bottom: 34 };
const GRIP = 7;  // [px] around the cursor in which it is dragged

class PlotView {
  /** curves: [{name, values, against (or null)}] over `times`; `time` is the TimeWindow that all plots share; onClose: what × does. */
  constructor({ title, unit, curves }, times, player, time, onClose = null) {
    Object.assign(this, { title, unit, times, player, window: time });
    this.canvas = make("canvas", { role: "img" });
    this.cursor = make("div", { class: "cursor" });
    this.chosen = make("div", { class: "chosen", hidden: true });
    this.tip = make("div", { class: "tip", hidden: true });
    this.frame = make("div", { class: "plot-area", tabindex: 0, title: "Click: go to that time. Drag: zoom. Double click: whole run. Keys: + \u2212 0" },
      this.canvas, this.chosen, this.cursor, this.tip);
    this.legend = make("ul", { class: "legend" });
    const tool = (words, label, action) => make("button", { type: "button", class: "plain", "aria-label": label, title: label, onclick: action }, words);
    this.whole = tool("Whole run", "Show the whole run in all plots", () => time.reset());
    this.element = make("figure", { class: "plot" }, make("figcaption", {}, make("span", {}, title),
      make("span", { class: "tools" }, this.whole, tool("CSV", `Save ${title} as a table`, () => this.saveCsv()), tool("SVG", `Save ${title} as a picture`, () => this.saveSvg()),
        ...(onClose ? [tool("\u00d7", `Remove the plot ${title}`, onClose)] : []))), this.frame, this.legend);
    this.take(curves);
    this.listen();
    this.redraw = () => this.refresh();
    time.onChange(this.redraw);
    this.observer = new ResizeObserver(() => this.refresh());
    this.observer.observe(this.frame);
  }

  remove() {
    this.element.remove();
    this.observer.disconnect();
    this.window.forget(this.redraw);
  }

  /** Draws other curves. */
  take(curves) {
    this.series = curves.map((s, k) => ({ ...s, color: CURVES[k % CURVES.length][0], dash: CURVES[k % CURVES.length][1] }));
    this.canvas.setAttribute("aria-label", `Plot of ${this.title}${this.unit ? ` in ${this.unit}` : ""} over time: ${curves.map((s) => s.name).join(", ")}`);
    this.legend.replaceChildren(...this.series.map((s) => this.legendItem(s)));
    this.refresh();
  }

  refresh() {
    this.whole.hidden = !this.window.zoomed;
    this.draw();
    this.follow(this.player.time);
  }

  legendItem(series) {
    series.readout = make("b");
    const sample = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    sample.setAttribute("viewBox", "0 0 24 8");
    sample.setAttribute("aria-hidden", "true");
    const line = sample.appendChild(document.createElementNS(sample.namespaceURI, "path"));
    for (const [name, value] of Object.entries({ d: "M0 4H24", stroke: series.color, "stroke-width": 2.4, "stroke-dasharray": series.dash.join(" ") })) line.setAttribute(name, value);
    return make("li", {}, sample, make("span", {}, series.name), series.readout);
  }

  /** First and last sample that the window shows, with one beyond each of its ends. */
  get shown() {
    const { times, window } = this;
    return [frameBefore(times, window.start), Math.min(times.length - 1, frameBefore(times, window.end) + 1)];
  }

  /** Chooses the value axis: limits on nice steps, and a power of ten that keeps the labels short. */
  range() {
    let low = Infinity, high = -Infinity;
    const [first, last] = this.shown;
    for (const { values, against } of this.series) {
      for (const list of [values, against || []]) {
        for (let i = first; i <= Math.min(last, list.length - 1); i++) if (Number.isFinite(list[i])) { low = Math.min(low, list[i]); high = Math.max(high, list[i]); }
      }
    }
    if (low > high) [low, high] = [0, 1];
    // A curve about a constant is drawn as that constant where only more digits than the axis has room for would tell its changes.
    const noise = 1e-5;
    const size = Math.max(Math.abs(low), Math.abs(high));
    if (high - low <= noise * size || size === 0) { const pad = size ? 0.1 * size : 1; low -= pad; high += pad; }
    const step = niceStep(high - low, 4);
    this.step = step;
    this.low = Math.floor(low / step + 1e-6) * step;
    this.high = Math.ceil(high / step - 1e-6) * step;
    const largest = Math.max(Math.abs(this.low), Math.abs(this.high));
    // Long numbers would run into the name of the unit.
    const long = [this.low, this.high].some((value) => fixed(value, this.step).length > 5);
    this.power = largest >= 1e4 || largest < 1e-2 || (long && largest < 0.1) ? 3 * Math.floor(Math.log10(largest) / 3 + 1e-9) : 0;
  }

  get unitText() {
    const factor = this.power ? `10${superscript(this.power)}` : "";
    return `[${[factor, unitText(this.unit)].filter(Boolean).join("\u00a0") || "1"}]`;
  }

  x(time) { return EDGE.left + ((time - this.window.start) / this.window.span) * (this.width - EDGE.left - EDGE.right); }
  y(value) { return this.height - EDGE.bottom - ((value - this.low) / (this.high - this.low)) * (this.height - EDGE.bottom - EDGE.top); }

  /** The time under a place of the window [px]. */
  timeAt(clientX) {
    const box = this.frame.getBoundingClientRect();
    const share = (clientX - box.left - EDGE.left) / (box.width - EDGE.left - EDGE.right);
    return this.window.start + Math.min(1, Math.max(0, share)) * this.window.span;
  }

  draw() {
    this.width = this.frame.clientWidth;
    this.height = this.frame.clientHeight;
    if (!this.width || !this.height) return;
    const ratio = window.devicePixelRatio || 1;
    this.canvas.width = Math.round(this.width * ratio);
    this.canvas.height = Math.round(this.height * ratio);
    const pen = this.canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, this.width, this.height);
    this.drawWith(pen);
  }

  drawWith(pen) {
    this.range();
    this.drawAxes(pen);
    pen.save();
    pen.beginPath();
    pen.rect(EDGE.left, EDGE.top - 3, this.width - EDGE.left - EDGE.right, this.height - EDGE.top - EDGE.bottom + 6);
    pen.clip();
    for (const series of this.series) if (series.against) this.drawCurve(pen, { values: series.against, color: series.color, dash: [1.5, 3.5], width: 2.6, alpha: 0.55 });
    for (const series of this.series) this.drawCurve(pen, series);
    pen.restore();
  }

  drawAxes(pen) {
    pen.font = "11px system-ui, sans-serif";
    pen.lineWidth = 1;
    const line = (x1, y1, x2, y2, color) => { pen.strokeStyle = color; pen.beginPath(); pen.moveTo(x1, y1); pen.lineTo(x2, y2); pen.stroke(); };
    const [left, right, top, bottom] = [EDGE.left, this.width - EDGE.right, EDGE.top, this.height - EDGE.bottom];
    pen.fillStyle = "#4a5361";
    pen.textAlign = "right"; pen.textBaseline = "middle";
    for (let k = 0; k <= Math.round((this.high - this.low) / this.step); k++) {
      const value = this.low + k * this.step;
      const y = Math.round(this.y(value)) + 0.5;
      line(left, y, right, y, Math.abs(value) < this.step * 1e-6 ? "#a3acb8" : "#e6e9ee");
      pen.fillText(fixed(value / 10 ** this.power, this.step / 10 ** this.power), left - 6, y);
    }
    pen.textAlign = "center"; pen.textBaseline = "top";
    const { start, span } = this.window;
    const step = niceStep(span, Math.max(2, Math.floor(this.width / 60)));
    for (let k = Math.ceil(start / step - 1e-9); k * step <= start + span * (1 + 1e-9); k++) {
      const x = Math.round(this.x(k * step)) + 0.5;
      line(x, top, x, bottom + 4, "#e6e9ee");
      pen.fillText(fixed(k * step, step), x, bottom + 6);
    }
    pen.textBaseline = "alphabetic";
    pen.fillText("time [s]", (left + right) / 2, this.height - 3);
    pen.save();
    pen.translate(11, (top + bottom) / 2);
    pen.rotate(-Math.PI / 2);
    pen.fillText(this.unitText, 0, 0);
    pen.restore();
  }

  drawCurve(pen, { values, color, dash, width = 1.7, alpha = 1 }) {
    pen.strokeStyle = color;
    pen.globalAlpha = alpha;
    pen.lineWidth = width;
    pen.lineJoin = "round";
    pen.setLineDash(dash);
    pen.beginPath();
    let gap = true;
    const [first, last] = this.shown;
    for (const place of curvePlaces(this.times, values, first, last, (t) => this.x(t), (v) => this.y(v))) {
      if (place) pen[gap ? "moveTo" : "lineTo"](place[0], place[1]);
      gap = !place;
    }
    pen.stroke();
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }

  listen() {
    const { frame } = this;
    let from = null, mode = "";
    frame.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      frame.setPointerCapture(event.pointerId);
      from = event.clientX;
      const cursor = frame.getBoundingClientRect().left + this.x(this.player.time);
      mode = Math.abs(event.clientX - cursor) <= GRIP ? "scrub" : "";
    });
    frame.addEventListener("pointermove", (event) => {
      if (from === null) { this.point(event.pointerType === "touch" ? null : event.clientX); return; }
      if (mode === "scrub") { this.seek(event.clientX); return; }
      if (!mode && Math.abs(event.clientX - from) > 5) mode = "zoom";
      this.choose(mode === "zoom" ? [from, event.clientX] : null);
    });
    frame.addEventListener("pointerup", (event) => {
      if (from === null) return;
      if (mode === "zoom") this.window.zoom(this.timeAt(from), this.timeAt(event.clientX)); else this.seek(event.clientX);
      from = null;
      this.choose(null);
    });
    frame.addEventListener("pointercancel", () => { from = null; this.choose(null); });
    frame.addEventListener("pointerleave", () => this.point(null));
    frame.addEventListener("dblclick", () => this.window.reset());
    frame.addEventListener("keydown", (event) => {
      const actions = { "+": () => this.window.scale(0.5, this.player.time), "=": () => this.window.scale(0.5, this.player.time),
        "-": () => this.window.scale(2, this.player.time), 0: () => this.window.reset() };
      const answer = actions[event.key];
      if (!answer || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      event.stopPropagation();
      answer();
    });
  }

  seek(clientX) { this.player.pause(); this.player.seek(this.timeAt(clientX)); }

  /** Marks the times between two places of the window, about to be zoomed to. */
  choose(ends) {
    this.chosen.hidden = !ends;
    if (!ends) return;
    this.point(null);
    const [a, b] = ends.map((x) => this.x(this.timeAt(x))).sort((p, q) => p - q);
    Object.assign(this.chosen.style, { left: `${a}px`, width: `${b - a}px` });
  }

  /** Reads the values under a place of the window. */
  point(clientX) {
    this.tip.hidden = clientX === null;
    if (clientX === null) return;
    const time = this.timeAt(clientX);
    const rows = this.series.map((s) => make("li", {}, make("i", { style: `background:${s.color}` }), `${s.name} `, make("b", {}, this.valueText(s, time))));
    this.tip.replaceChildren(make("span", {}, `${fixed(time, this.window.span / 1000)} s`), make("ul", {}, ...rows));
    const x = this.x(time), room = this.width - this.tip.offsetWidth;
    this.tip.style.left = `${Math.max(0, x + 10 > room ? x - 10 - this.tip.offsetWidth : x + 10)}px`;
  }

  valueText({ values, against }, time) {
    const at = (list) => significant(valueAt(this.times, list, time));
    const other = against ? ` (${at(against)})` : "";
    return `${at(values)}${other}${this.unit ? `\u00a0${unitText(this.unit)}` : ""}`;
  }

  follow(time) {
    if (this.width) {
      this.cursor.style.transform = `translateX(${this.x(time)}px)`;
      this.cursor.hidden = time < this.window.start || time > this.window.end;
    }
    // Nobody reads numbers that change with every picture.
    const now = performance.now();
    if (this.player.playing && now - this.told < READING) return;
    this.told = now;
    for (const series of this.series) series.readout.textContent = this.valueText(series, time);
  }

  saveCsv() {
    const inside = ([first, last]) => [this.times[first] < this.window.start ? first + 1 : first, this.times[last] > this.window.end ? last - 1 : last];
    const curves = this.series.flatMap((s) => [s, ...(s.against ? [{ name: `${s.name} (compared)`, values: s.against }] : [])]);
    saveText(`${fileName(`${document.title}-${this.title}`)}.csv`, curvesToCsv(this.times, curves, this.unit, ...inside(this.shown)), "text/csv");
  }

  saveSvg() {
    const pen = new SvgPen(this.width, this.height + 16 * this.series.length + 8);
    this.drawWith(pen);
    this.series.forEach((s, k) => {
      const y = this.height + 10 + 16 * k;
      Object.assign(pen, { strokeStyle: s.color, lineWidth: 2, fillStyle: "#1c2430", textAlign: "left", textBaseline: "middle" });
      pen.setLineDash(s.dash);
      pen.beginPath(); pen.moveTo(EDGE.left, y); pen.lineTo(EDGE.left + 24, y); pen.stroke();
      pen.fillText(s.name, EDGE.left + 32, y);
    });
    saveText(`${fileName(`${document.title}-${this.title}`)}.svg`, pen.text(), "image/svg+xml");
  }
}

/** The plots of a run; returns {views, window, picker}, or null for a story that stands still. */
function addPlots(story, read, player, holder) {
  if (player.duration <= 0) return null;
  const time = new TimeWindow(player.motion.start, player.motion.end);
  const views = story.plots.map((plot) => new PlotView({ title: plot.title, unit: plot.unit,
    curves: plot.series.map((s) => ({ name: s.name, values: read(s.values), against: s.against ? read(s.against) : null })) }, player.motion.times, player, time));
  holder.append(...views.map((view) => view.element));
  const picker = story.channels.items.length ? new ChannelPicker(story.channels, read, player, time, holder) : null;
  player.onTime((now) => { for (const view of views) view.follow(now); if (picker) picker.follow(now); });
  return { views, window: time, picker, placesOf: curvePlaces };
}
