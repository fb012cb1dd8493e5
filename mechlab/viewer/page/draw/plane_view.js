// The drawing as SVG: a grid, bars, pivots, sliders, gears, the motor. Metres on the plane, pixels on the screen.

const GRID = 0.005; // m

function svgOf(tag, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

class PlaneView {
  constructor(svg) {
    Object.assign(this, { svg, centre: [0.12, 0.06], scale: 2000, paths: new Map() }); // scale: pixels per metre
    this.layer = svgOf("g");
    svg.append(this.layer);
    new ResizeObserver(() => this.onResize && this.onResize()).observe(svg);
  }

  get size() { return [this.svg.clientWidth || 800, this.svg.clientHeight || 600]; }
  toScreen([x, y]) { const [w, h] = this.size; return [w / 2 + (x - this.centre[0]) * this.scale, h / 2 - (y - this.centre[1]) * this.scale]; }
  toPlane([px, py]) { const [w, h] = this.size; return [this.centre[0] + (px - w / 2) / this.scale, this.centre[1] - (py - h / 2) / this.scale]; }

  zoom(factor, at) {
    const before = this.toPlane(at);
    this.scale = Math.min(50000, Math.max(100, this.scale * factor));
    const after = this.toPlane(at);
    this.centre = [this.centre[0] + before[0] - after[0], this.centre[1] + before[1] - after[1]];
  }

  /** Shows all points with a margin; an empty plane 0.4 m wide. */
  fit(points) {
    const xs = points.map((p) => p.x), ys = points.map((p) => p.y), [w, h] = this.size;
    const [left, right, low, high] = points.length ? [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)] : [-0.08, 0.32, -0.06, 0.18];
    this.centre = [(left + right) / 2, (low + high) / 2];
    this.scale = Math.min(6000, 0.6 * Math.min(w / Math.max(0.1, right - left), h / Math.max(0.1, high - low)));
  }

  outline(points) { return `M${points.map((p) => this.toScreen(p).map((x) => x.toFixed(1)).join(" ")).join("L")}Z`; }

  /** draw: {sketch, built, selected, from, to, cursor, traces} */
  show(draw) {
    this.layer.replaceChildren(...this.grid(), ...this.curves(draw.traces), ...draw.sketch.points.filter((p) => p.rail !== null).map((p) => this.rail(draw, p)),
      ...draw.sketch.bars.map((bar, k) => this.bar(draw, bar, k)), ...draw.sketch.points.filter((p) => p.teeth > 0).map((p) => this.gear(draw, p)),
      ...draw.sketch.points.flatMap((p) => this.pivot(draw, p)), ...this.rubber(draw));
  }

  grid() {
    const [w, h] = this.size, [left, top] = this.toPlane([0, 0]), [right, bottom] = this.toPlane([w, h]);
    const step = GRID * (GRID * this.scale < 6 ? 10 : GRID * this.scale < 14 ? 2 : 1), lines = [[], []];
    const strong = (k) => (Math.round((k * step) / GRID) % 10 === 0 ? 1 : 0);
    for (let k = Math.ceil(left / step); k * step < right; k++) { const [x] = this.toScreen([k * step, 0]); lines[strong(k)].push(`M${x.toFixed(1)} 0V${h}`); }
    for (let k = Math.ceil(bottom / step); k * step < top; k++) { const [, y] = this.toScreen([0, k * step]); lines[strong(k)].push(`M0 ${y.toFixed(1)}H${w}`); }
    return lines.map((list, k) => svgOf("path", { d: list.join(""), class: k ? "grid strong" : "grid" }));
  }

  curves(traces) {
    return [...traces.values()].filter((list) => list.length > 1).map((list) => svgOf("path", { class: "trace", d: `M${list.map((p) => this.toScreen(p).map((x) => x.toFixed(1)).join(" ")).join("L")}` }));
  }

  bar({ sketch, built, selected }, bar, k) {
    const [a, b] = bar.ends.map((id) => pointOf(sketch, id)), radius = Math.max(7 / this.scale, Math.min(16 / this.scale, 0.04 * bar.length));
    const loose = built.loose.includes(bar), [red, green, blue] = SKETCH_COLORS[k % SKETCH_COLORS.length].map((x) => Math.round(255 * x));
    return svgOf("path", { d: this.outline(barOutline([[a.x, a.y], [b.x, b.y]], radius)), class: `bar${loose ? " loose" : ""}${selected === bar ? " selected" : ""}`, style: loose ? "" : `fill: rgb(${red} ${green} ${blue})` });
  }

  gear({ built }, p) {
    const body = built.gearBodies && built.gearBodies.get(p.id), angle = body && built.model ? built.angleOf(body.name) : 0;
    const c = Math.cos(angle), s = Math.sin(angle), points = gearOutline(p.teeth, GEAR_MODULE).map(([x, y]) => [p.x + c * x - s * y, p.y + s * x + c * y]);
    return svgOf("path", { d: this.outline(points), class: "gear" });
  }

  rail({ built }, p) {
    const [x, y] = this.toScreen([p.x, p.y]), turn = `translate(${x.toFixed(1)} ${y.toFixed(1)}) rotate(${((-180 * p.rail) / Math.PI).toFixed(2)})`;
    return svgOf("g", { transform: turn }, svgOf("path", { class: "rail", d: "M-400 13H400M-400 -13H400" }), svgOf("rect", { class: "block", x: -24, y: -12, width: 48, height: 24, rx: 3 }));
  }

  pivot({ sketch, selected }, p) {
    const [x, y] = this.toScreen([p.x, p.y]), marks = [];
    if (p.ground) marks.push(svgOf("path", { class: "ground", d: `M${x} ${y}l-13 22h26zM${x - 18} ${y + 22}h36m-30 0l-6 7m14 -7l-6 7m14 -7l-6 7m14 -7l-6 7` }));
    if (sketch.motor === p.id) marks.push(svgOf("path", { class: "motor", d: `M${x + 17} ${y - 6}A18 18 0 1 0 ${x + 15} ${y + 10}M${x + 9} ${y - 10}l9 5l2 -10` }));
    marks.push(svgOf("circle", { class: `pivot${selected === p ? " selected" : ""}`, cx: x, cy: y, r: 6 }), svgOf("text", { class: "name", x: x + 11, y: y - 11 }, p.name));
    return marks;
  }

  rubber({ from, to, cursor }) {
    const marks = [];
    if (from && to) { const [[a, b], [c, d]] = [from, to].map((p) => this.toScreen(p)); marks.push(svgOf("path", { class: "rubber", d: `M${a} ${b}L${c} ${d}` }), svgOf("text", { class: "size", x: (a + c) / 2 + 10, y: (b + d) / 2 - 10 }, lengthText(Math.hypot(to[0] - from[0], to[1] - from[1])))); }
    if (cursor) { const [x, y] = this.toScreen(cursor); marks.push(svgOf("path", { class: "cursor", d: `M${x - 12} ${y}h24M${x} ${y - 12}v24` })); }
    return marks;
  }
}
