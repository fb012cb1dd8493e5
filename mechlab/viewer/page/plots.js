// Curves over time with one shared cursor: click or drag in a plot to seek.

// Wong's palette without its yellow (colour-blind-safe, dark enough on white); the dashes tell the curves apart without colour.
const CURVES = [["#0072b2", []], ["#d55e00", [7, 3]], ["#009e73", [2, 3]], ["#a64d79", [9, 3, 2, 3]], ["#3b3b3b", [1, 2]], ["#b58900", [12, 4]]];
const READING = 200; // ms between two readings while it plays
const EDGE = { left: 56, right: 14, top: 8, bottom: 34 };

class PlotView {
  constructor(plot, times, read, player) {
    this.times = times;
    this.player = player;
    this.series = plot.series.map((s, k) => ({ name: s.name, values: read(s.values), against: s.against ? read(s.against) : null, color: CURVES[k % CURVES.length][0], dash: CURVES[k % CURVES.length][1] }));
    this.unit = plot.unit;
    this.canvas = make("canvas", { role: "img", "aria-label": `Plot of ${plot.title}${plot.unit ? ` in ${plot.unit}` : ""} over time: ${this.series.map((s) => s.name).join(", ")}` });
    this.cursor = make("div", { class: "cursor" });
    this.frame = make("div", { class: "plot-area", title: "Click or drag to go to that time" }, this.canvas, this.cursor);
    this.legend = make("ul", { class: "legend" }, ...this.series.map((s) => this.legendItem(s)));
    this.element = make("figure", { class: "plot" }, make("figcaption", {}, plot.title), this.frame, this.legend);
    this.range();
    this.frame.addEventListener("pointerdown", (event) => { this.frame.setPointerCapture(event.pointerId); this.seek(event); });
    this.frame.addEventListener("pointermove", (event) => { if (event.buttons & 1) this.seek(event); });
    new ResizeObserver(() => { this.draw(); this.follow(player.time); }).observe(this.frame);
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

  /** Chooses the value axis: limits on nice steps, and a power of ten that keeps the labels short. */
  range() {
    let low = Infinity, high = -Infinity;
    for (const { values, against } of this.series) for (const list of [values, against || []]) for (const v of list) if (Number.isFinite(v)) { low = Math.min(low, v); high = Math.max(high, v); }
    if (low > high) [low, high] = [0, 1];
    // A curve that only shows rounding noise about a constant is drawn as that constant.
    const size = Math.max(Math.abs(low), Math.abs(high));
    if (high - low <= 1e-9 * size || size === 0) { const pad = size ? 0.1 * size : 1; low -= pad; high += pad; }
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
    return [factor, this.unit].filter(Boolean).join("\u00a0") || "1";
  }

  x(time) { return EDGE.left + ((time - this.times[0]) / this.span) * (this.width - EDGE.left - EDGE.right); }
  y(value) { return this.height - EDGE.bottom - ((value - this.low) / (this.high - this.low)) * (this.height - EDGE.bottom - EDGE.top); }
  get span() { return this.times[this.times.length - 1] - this.times[0] || 1; }

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
    const step = niceStep(this.span, Math.max(2, Math.floor(this.width / 55)));
    for (let k = Math.ceil(this.times[0] / step - 1e-9); k * step <= this.times[0] + this.span * (1 + 1e-9); k++) {
      const x = Math.round(this.x(k * step)) + 0.5;
      line(x, top, x, bottom + 4, "#e6e9ee");
      pen.fillText(fixed(k * step, step), x, bottom + 6);
    }
    pen.textBaseline = "alphabetic";
    pen.fillText("time, s", (left + right) / 2, this.height - 3);
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
    for (let i = 0; i < values.length; i++) {
      if (!Number.isFinite(values[i])) { gap = true; continue; }
      pen[gap ? "moveTo" : "lineTo"](this.x(this.times[i]), this.y(values[i]));
      gap = false;
    }
    pen.stroke();
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }

  seek(event) {
    const box = this.frame.getBoundingClientRect();
    const share = (event.clientX - box.left - EDGE.left) / (box.width - EDGE.left - EDGE.right);
    this.player.pause();
    this.player.seek(this.times[0] + Math.min(1, Math.max(0, share)) * this.span);
  }

  follow(time) {
    if (this.width) this.cursor.style.transform = `translateX(${this.x(time)}px)`;
    // Nobody reads numbers that change with every picture.
    const now = performance.now();
    if (this.player.playing && now - this.read < READING) return;
    this.read = now;
    const i = this.player.motion.frame(time);
    const next = Math.min(i + 1, this.times.length - 1);
    const share = next === i ? 0 : (time - this.times[i]) / (this.times[next] - this.times[i]);
    const at = (values) => significant(share === 0 ? values[i] : values[i] + share * (values[next] - values[i]));
    for (const { values, against, readout } of this.series) {
      const other = against ? ` (${at(against)})` : "";
      readout.textContent = `${at(values)}${other}${this.unit ? `\u00a0${this.unit}` : ""}`;
    }
  }
}

function addPlots(story, read, player, holder) {
  if (player.duration <= 0) return;
  for (const plot of story.plots) {
    const view = new PlotView(plot, player.motion.times, read, player);
    holder.append(view.element);
    player.onTime((time) => view.follow(time));
  }
}
