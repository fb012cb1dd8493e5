// A plane that cuts the parts open: along an axis, at a place, and from which side.

const AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };

class Section {
  constructor(stage, picker, holder) {
    this.stage = stage;
    this.axis = null;
    this.at = 0;
    this.flipped = false;
    this.plane = new THREE.Plane();
    this.caps = new Caps(stage, this.plane);
    stage.viewer.renderer.localClippingEnabled = true;
    picker.seen = (point) => !this.axis || this.side(point) >= 0;
    this.slider = make("input", { type: "range", min: 0, max: 1, step: "any", "aria-label": "Place of the section", oninput: () => this.set(this.axis, this.from(this.slider.valueAsNumber), this.flipped) });
    this.words = make("output", {});
    this.choices = ["off", "x", "y", "z"].map((name) => make("button", { type: "button", value: name, onclick: () => this.choose(name) }, name === "off" ? "Off" : `\u22a5 ${name}`));
    this.flip = make("button", { type: "button", onclick: () => this.set(this.axis, this.at, !this.flipped) }, "Other side");
    this.heading = make("summary", {}, "Section");
    holder.append(this.heading, make("div", { class: "choices section" }, make("div", { class: "row", role: "group", "aria-label": "Direction of the section" }, ...this.choices), this.slider,
      make("div", { class: "row" }, this.words, this.flip)));
    closeOutside(holder);
    stage.onParts = () => { this.cut(); this.caps.show(Boolean(this.axis)); };
    this.set(null, 0, false);
  }

  get limits() {
    const { low, high } = this.stage.framing, k = "xyz".indexOf(this.axis || "z"), pad = 0.01 * this.stage.framing.radius;
    return [low[k] - pad, high[k] + pad];
  }

  from(share) { const [low, high] = this.limits; return low + share * (high - low); }

  choose(name) {
    if (name === "off") { this.set(null, 0, false); return; }
    this.axis = name;
    // At first the half that looks at the camera is taken away.
    const { camera, controls } = this.stage.viewer;
    const toward = fromWorld(camera.position.clone().sub(controls.target));
    this.set(name, this.from(0.5), toward[name] < 0);
  }

  /** Cuts across `axis` ("x", "y", "z", or null for no cut) at `at` [m]; what lies beyond is left out, flipped what lies before. */
  set(axis, at, flipped) {
    Object.assign(this, { axis, flipped });
    const [low, high] = this.limits;
    this.at = Math.min(high, Math.max(low, at));
    if (axis) this.plane.setFromNormalAndCoplanarPoint(toWorld(this.normal), toWorld(this.normal.clone().multiplyScalar((flipped ? 1 : -1) * this.at)));
    this.cut();
    this.caps.show(Boolean(axis));
    this.slider.value = (this.at - low) / (high - low);
    this.slider.disabled = this.flip.disabled = !axis;
    this.words.textContent = axis ? `${axis} = ${withUnit(this.at, "m")}` : "no section";
    this.slider.setAttribute("aria-valuetext", this.words.textContent);
    this.heading.textContent = axis ? `Section (${axis})` : "Section";
    for (const button of this.choices) button.setAttribute("aria-pressed", String(button.value === (axis || "off")));
    this.stage.redraw();
  }

  /** Unit normal towards what is kept. */
  get normal() { return new THREE.Vector3(...AXES[this.axis]).multiplyScalar(this.flipped ? 1 : -1); }

  /** Distance [m] of a point from the plane, positive where parts are kept. */
  side(point) { return this.normal.dot(point) + (this.flipped ? -1 : 1) * this.at; }

  /** Gives the plane to everything that belongs to a part; inside faces are seen through the cut. */
  cut() {
    const planes = this.axis ? [this.plane] : [];
    for (const group of this.stage.groups) {
      group.traverse((item) => {
        const { material } = item;
        if (!material || item.userData.uncut) return;
        if (material.userData.side === undefined) material.userData.side = material.side;
        const side = this.axis && item.isMesh ? THREE.DoubleSide : material.userData.side;
        if (material.side !== side || (material.clippingPlanes || []).length !== planes.length) material.needsUpdate = true;
        material.side = side;
        material.clippingPlanes = planes;
      });
    }
  }
}
