// Moving the drives by hand. Every position is blended from closed poses that were solved beforehand, so it is closed too.

const BLEND = 6;
const NEAR = 0.05;

class Sweep {
  constructor(sweep, bodies, read) {
    Object.assign(this, sweep);
    this.tracks = sweep.motion.map((m) => ({ position: read(m.position), quaternion: read(m.quaternion) }));
    this.near = read(sweep.closeness);
    for (const { quaternion } of this.tracks) {
      // Opposite quaternions are the same turn; blending needs the nearer one.
      for (let i = 4; i < quaternion.length; i += 4) {
        const dot = [0, 1, 2, 3].reduce((sum, k) => sum + quaternion[i + k] * quaternion[i + k - 4], 0);
        if (dot < 0) for (let k = 0; k < 4; k++) quaternion[i + k] *= -1;
      }
    }
  }

  exists(value) { const tiny = 1e-9 * (this.last - this.first); return value >= this.first - tiny && value <= this.last + tiny; }

  /** First sample and weights of the polynomial through the samples around a value. */
  weights(value) {
    let share = Math.min(1, Math.max(0, (value - this.first) / (this.last - this.first)));
    if (this.cosine) share = Math.acos(1 - 2 * share) / Math.PI;
    const position = share * (this.count - 1);
    const first = Math.min(Math.max(Math.floor(position) - (BLEND / 2 - 1), 0), this.count - BLEND);
    const weights = [];
    for (let i = 0; i < BLEND; i++) {
      let w = 1;
      for (let j = 0; j < BLEND; j++) if (j !== i) w *= (position - first - j) / (i - j);
      weights.push(w);
    }
    return { first, weights };
  }

  apply(groups, value) {
    const { first, weights } = this.weights(value);
    const blend = (values, width, still) => {
      const out = [];
      for (let k = 0; k < width; k++) {
        if (still) { out.push(values[k]); continue; }
        let sum = 0;
        for (let i = 0; i < BLEND; i++) sum += weights[i] * values[width * (first + i) + k];
        out.push(sum);
      }
      return out;
    };
    groups.forEach((group, k) => {
      const { position, quaternion } = this.tracks[k];
      const still = quaternion.length === 4;
      group.position.fromArray(blend(position, 3, still));
      group.quaternion.fromArray(blend(quaternion, 4, still)).normalize();
    });
  }

  nearness(value) {
    const { first, weights } = this.weights(value);
    return weights.reduce((sum, w, i) => sum + w * this.near[first + i], 0);
  }
}

class Explorer {
  constructor(story, stage, traces, read, holder, redraw) {
    this.stage = stage;
    this.redraw = redraw;
    this.data = story.explore;
    this.sweeps = this.data.sweeps.map((s) => new Sweep(s, story.bodies, read));
    this.traces = traces;
    this.frames = story.marks.filter((m) => m.kind === "frame");
    this.active = null;
    this.values = this.sweeps.map((s) => s.home);
    this.build(holder);
    this.move(0, this.sweeps[0].home);
  }

  build(holder) {
    holder.hidden = false;
    holder.className = "explore";
    const drives = make("div", { class: "drives" });
    holder.append(drives);
    this.rows = this.sweeps.map((sweep, k) => {
      const step = niceStep(sweep.high - sweep.low, 1000);
      const value = make("output", { class: "value" });
      const slider = make("input", { type: "range", min: sweep.low, max: sweep.high, step: "any", value: sweep.home, "aria-label": `${sweep.name}, ${sweep.unit}`,
        oninput: () => this.move(k, slider.valueAsNumber),
        onkeydown: (event) => this.key(event, k) });
      drives.append(make("div", { class: "drive" }, make("span", { class: "name" }, sweep.name), slider, value));
      return { slider, value, step };
    });
    this.state = make("p", { class: "state", role: "status", "aria-live": "polite" });
    const others = this.sweeps.length > 1 ? " One drive moves at a time; the others stay at home." : "";
    holder.append(this.state, make("p", { class: "hint" }, `Arrow keys move by a hundredth of the slider, with shift a tenth; Home goes home.${others}`));
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
    this.values = this.sweeps.map((s, i) => (i === k ? value : s.home));
    const exists = sweep.exists(value);
    sweep.apply(this.stage.groups, value);
    if (this.active !== k) this.draw(k);
    this.rows.forEach(({ slider, value: words, step }, i) => {
      slider.value = this.values[i];
      const text = `${fixed(this.values[i], step)} ${this.sweeps[i].unit}`;
      const degrees = this.sweeps[i].unit === "rad" ? ` (${((this.values[i] * 180) / Math.PI).toFixed(1)}\u00b0)`.replace("-", "\u2212") : "";
      words.textContent = text + degrees;
      slider.setAttribute("aria-valuetext", text);
      slider.parentElement.classList.toggle("away", i !== k);
    });
    this.tell(sweep, value, exists);
    this.redraw();
  }

  tell(sweep, value, exists) {
    const closeness = sweep.nearness(value);
    const near = exists && closeness < NEAR;
    this.state.className = `state ${exists ? (near ? "warning" : "ok") : "error"}`;
    document.getElementById("stage").classList.toggle("impossible", !exists || near);
    const mark = make("span", { class: "mark", "aria-hidden": "true" }, exists ? (near ? "!" : "\u2713") : "\u2715");
    const words = !exists
      ? `${value < sweep.first ? sweep.lowReason : sweep.highReason}; shown is the last pose that closes.`
      : `${near ? "Near a singularity. " : ""}Assembly mode: ${this.data.mode}. Distance from the nearest singularity: ` +
        `${Math.round(100 * Math.max(0, closeness))}\u00a0% of the largest. ${this.data.loops.length ? `Loops open by ${this.gap() < 1e-9 ? "less than 1 nm" : lengthText(this.gap())}.` : "No loops."}`;
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

  /** The paths of all named points over the whole reach of drive `k`. */
  draw(k) {
    this.active = k;
    this.traces.clear();
    const sweep = this.sweeps[k];
    const count = 240;
    const groups = this.stage.groups.map(() => new THREE.Group());
    const paths = this.frames.map(() => []);
    for (let i = 0; i <= count; i++) {
      const share = sweep.cosine ? (1 - Math.cos((Math.PI * i) / count)) / 2 : i / count;
      sweep.apply(groups, sweep.first + share * (sweep.last - sweep.first));
      this.frames.forEach((frame, j) => {
        const at = new THREE.Vector3(...frame.point).applyQuaternion(groups[frame.body].quaternion).add(groups[frame.body].position);
        paths[j].push(at.x, at.y, at.z);
      });
    }
    this.frames.forEach((frame, j) => this.traces.add(this.stage, paths[j], TRACE_COLORS[j % TRACE_COLORS.length], frame.name));
    this.traces.apply(count);
  }
}
