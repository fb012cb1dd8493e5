// Moving the drives by hand, and changing a parameter. Every pose is blended from poses that were solved beforehand.

const NEAR = 0.05;
const PIECES = 240;

class Explorer {
  constructor(story, stage, traces, layers, read, holder, redraw) {
    Object.assign(this, { story, stage, traces, layers, read, redraw });
    this.picked = story.variants.map((v) => v.home);
    this.active = 0;
    this.freeBody = null;
    this.take(story);
    this.values = this.sweeps.map((s) => s.home);
    this.build(holder);
    this.addReach();
    this.show();
  }

  /** Takes over the sweeps of a variant, or of the story itself. */
  take(source) {
    this.data = source.explore;
    this.known = this.known || new Map();
    if (!this.known.has(source)) this.known.set(source, source.explore.sweeps.map((s) => new Sweep(s, this.read)));
    this.sweeps = this.known.get(source);
    this.marks = source.marks.filter((m) => m.kind === "frame");
    this.drawn = null;
  }

  build(holder) {
    holder.hidden = false;
    holder.className = "explore";
    const drives = make("div", { class: "drives" });
    this.rows = this.sweeps.map((sweep, k) => {
      const row = this.row(drives, sweep.name, "drive", { min: sweep.low, max: sweep.high, step: "any", value: sweep.home, "aria-label": `${sweep.name}, ${sweep.unit}` },
        (value) => this.move(k, value), (event) => this.key(event, k));
      return { ...row, step: niceStep(sweep.high - sweep.low, 1000) };
    });
    this.choices = this.story.variants.map((v, j) => this.row(drives, v.key, "drive parameter",
      { min: 0, max: v.values.length - 1, step: 1, value: v.home, "aria-label": `parameter ${v.key}, ${v.unit || "a number"}` },
      (index) => this.pick(j, index), (event) => { if (event.key === "Home") { event.preventDefault(); this.pick(j, v.home); } else event.stopPropagation(); }));
    this.state = make("p", { class: "state", role: "status", "aria-live": "polite" });
    const others = [this.sweeps.length > 1 ? " One drive moves at a time; the others stay at home." : "",
      this.choices.length ? ` Each step of a parameter is a mechanism of its own, solved beforehand${this.choices.length > 1 ? "; one parameter differs at a time" : ""}.` : ""].join("");
    holder.append(drives, this.bodyChoice(), this.state, make("p", { class: "hint" }, `Arrow keys move by a hundredth of the slider, with shift a tenth; Home goes home.${others}`));
  }

  row(holder, name, kind, attributes, oninput, onkeydown) {
    const value = make("output", { class: "value" });
    const slider = make("input", { type: "range", ...attributes, oninput: () => oninput(slider.valueAsNumber), onkeydown });
    holder.append(make("div", { class: kind }, make("span", { class: "name" }, name), slider, value));
    return { slider, value };
  }

  /** Which forces are drawn: all, or those on one part with its weight. */
  bodyChoice() {
    const loads = this.sweeps.flatMap((s) => s.loads);
    if (!loads.length) return "";
    const bodies = [...new Set(loads.flatMap((x) => [x.on, x.by]))].filter((k) => k >= 0 && this.stage.bodies[k] !== "ground").sort((a, b) => a - b);
    const options = [["none", "none"], ["all", "all joints"], ...bodies.map((k) => [String(k), `on ${this.stage.bodies[k]}`])];
    this.freeBody = "none";
    this.bodySelect = make("select", { id: "free-body", onchange: (event) => { this.freeBody = event.target.value; this.show(); } },
      ...options.map(([value, words]) => make("option", { value }, words)));
    return make("p", { class: "forces" }, make("label", { for: "free-body" }, "Forces "), this.bodySelect, this.bodyNote = make("span", { class: "hint" }));
  }

  key(event, k) {
    const sweep = this.sweeps[k];
    const sign = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
    if (event.key !== "Home" && !sign) return;
    event.preventDefault();
    const step = ((sweep.high - sweep.low) / 100) * (event.shiftKey ? 10 : 1);
    this.move(k, event.key === "Home" ? sweep.home : this.values[k] + sign * step);
  }

  /** Moves drive `k` to a value (clipped to its slider); all other drives go home. */
  move(k, asked) {
    if (!Number.isFinite(asked)) throw new Error(`cannot move to ${asked}: expected a number`);
    const sweep = this.sweeps[k];
    const value = Math.min(sweep.high, Math.max(sweep.low, asked));
    this.active = k;
    this.values = this.sweeps.map((s, i) => (i === k ? value : s.home));
    this.show();
  }

  /** Takes choice `index` of parameter `j`; the other parameter goes home, the drive stays where it is. */
  pick(j, index) {
    const variant = this.story.variants[j];
    this.picked = this.story.variants.map((v, i) => (i === j ? Math.min(v.values.length - 1, Math.max(0, Math.round(index))) : v.home));
    const at = this.picked[j];
    const choice = at === variant.home ? this.story : variant.choices[at];
    this.refused = typeof choice === "string" ? choice : "";
    if (!this.refused) {
      const value = this.values[this.active];
      this.take(choice);
      this.stage.replaceParts(choice, this.read);
      this.sweeps.forEach((s, k) => { Object.assign(this.rows[k].slider, { min: s.low, max: s.high }); });
      const s = this.sweeps[this.active];
      this.values = this.sweeps.map((sweep, i) => (i === this.active ? Math.min(s.high, Math.max(s.low, value)) : sweep.home));
    }
    this.show();
  }

  show() {
    const sweep = this.sweeps[this.active];
    const value = this.values[this.active];
    const place = sweep.place(value);
    sweep.apply(this.stage.groups, place);
    if (this.drawn !== sweep) this.draw(sweep);
    this.rows.forEach(({ slider, value: words, step }, i) => {
      slider.value = this.values[i];
      const text = `${fixed(this.values[i], step)} ${this.sweeps[i].unit}`;
      const degrees = this.sweeps[i].unit === "rad" ? ` (${((this.values[i] * 180) / Math.PI).toFixed(1)}\u00b0)`.replace("-", "\u2212") : "";
      words.textContent = text + degrees;
      slider.setAttribute("aria-valuetext", text);
      slider.parentElement.classList.toggle("away", i !== this.active);
    });
    this.choices.forEach(({ slider, value: words }, j) => {
      const { values, unit, home } = this.story.variants[j];
      slider.value = this.picked[j];
      words.textContent = unit === "m" ? lengthText(values[this.picked[j]]) : `${significant(values[this.picked[j]])} ${unit}`;
      slider.setAttribute("aria-valuetext", words.textContent);
      slider.parentElement.classList.toggle("away", this.picked[j] === home);
    });
    this.drawLoads(sweep, place);
    this.tell(sweep, value, place);
    this.redraw();
  }

  drawLoads(sweep, place) {
    if (this.freeBody === null) return;
    const arrows = this.layers.arrows;
    const choice = this.freeBody;
    const body = Number(choice);
    const shown = sweep.loads.filter((x) => (choice === "all" ? x.by >= 0 : choice !== "none" && (x.on === body || x.by === body)));
    const key = `${choice} ${this.picked} ${this.active}`;
    if (this.loadKey !== key) {
      this.loadKey = key;
      arrows.replace(shown.map((x) => ({ ...x, sign: choice !== "all" && x.by === body ? -1 : 1 })), this.read);
    }
    arrows.apply(place.here, place.share);
    const unbounded = shown.some((x, i) => !Number.isFinite(arrows.items[i].size));
    this.bodyNote.textContent = choice === "none" ? "" : ` with ${sweep.name} moving steadily at ${significant(sweep.rate)} ${sweep.unit}/s${unbounded ? "; here they have no bound" : ""}`;
  }

  tell(sweep, value, place) {
    const closeness = sweep.nearness(place);
    const exists = sweep.exists(value) && !this.refused;
    const near = exists && closeness < NEAR;
    this.state.className = `state ${exists ? (near ? "warning" : "ok") : "error"}`;
    document.getElementById("stage").classList.toggle("impossible", !exists || near);
    const mark = make("span", { class: "mark", "aria-hidden": "true" }, exists ? (near ? "!" : "\u2713") : "\u2715");
    const gap = this.gap();
    const loops = this.data.loops.length ? `Loops open by ${gap < 1e-9 ? "less than 1 nm" : lengthText(gap)}.` : "No loops.";
    const words = this.refused
      ? `No mechanism here: ${this.refused} Shown is the last one that exists.`
      : !exists
      ? `${value < sweep.first ? sweep.lowReason : sweep.highReason}; shown is the last pose that closes.`
      : `${near ? "Near a singularity. " : ""}Assembly mode: ${this.data.mode}. Distance from the nearest singularity: ` +
        `${Math.round(100 * Math.max(0, closeness))}\u00a0% of the largest. ${loops}`;
    this.state.replaceChildren(mark, make("span", {}, words));
    this.exists = exists;
    this.near = near;
  }

  /** Largest opening of a loop [m] in the scene as it is shown. */
  gap() {
    let worst = 0;
    for (const loop of this.data.loops) {
      const [a, b] = [this.stage.groups[loop.a], this.stage.groups[loop.b]];
      a.updateMatrix(); b.updateMatrix();
      const frame = a.matrix.clone().multiply(new THREE.Matrix4().fromArray(loop.placement));
      const end = new THREE.Vector3(...loop.point).applyMatrix4(b.matrix).applyMatrix4(frame.invert());
      if (loop.axes === 2) end.z = 0;
      worst = Math.max(worst, Math.abs(end.length() - loop.length));
    }
    return worst;
  }

  /** The paths of all named points over the whole reach of a drive: coupler curves. */
  draw(sweep) {
    this.drawn = sweep;
    this.traces.clear();
    const paths = sweep.paths(this.marks, PIECES);
    this.marks.forEach((mark, j) => this.traces.add(this.stage, paths[j], TRACE_COLORS[j % TRACE_COLORS.length], mark.name));
    this.traces.apply(PIECES);
  }

  /** A region that a point can be in, see-through. */
  addReach() {
    const { reach } = this.data;
    if (!reach) return;
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(this.read(reach.positions), 3));
    geometry.setIndex(new THREE.BufferAttribute(this.read(reach.faces), 1));
    geometry.computeVertexNormals();
    const color = new THREE.Color(0x1b5e9e).convertSRGBToLinear();
    // The far side first, then the near one, so that the inside can be seen.
    this.reach = new THREE.Group();
    for (const side of [THREE.BackSide, THREE.FrontSide]) {
      const mesh = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ color, transparent: true, opacity: 0.16, depthWrite: false, side, roughness: 0.9 }));
      mesh.renderOrder = side === THREE.BackSide ? 1 : 2;
      this.reach.add(mesh);
    }
    this.reach.name = "reach";
    this.stage.root.add(this.reach);
    this.layers.show.add("reach", `reach: ${reach.name}`, true, (on) => { this.reach.visible = on; });
  }
}
