// Measuring between two features that are picked in the view or chosen from lists; the result moves along with the parts.

const SNAP_POINT = 12, SNAP_CORNER = 9;  // [px]

class Measuring {
  constructor(story, inspector, labels, button, holder) {
    Object.assign(this, { story, inspector, button, holder });
    this.stage = inspector.stage;
    this.on = false;
    this.features = [null, null];
    this.next = 0;
    this.named = [
      ...story.marks.filter((m) => m.kind === "frame").map((m) => ({ kind: "point", body: m.body, name: `point ${m.name}`, point: m.point })),
      ...story.marks.filter((m) => m.direction).map((m) => ({ kind: "axis", body: m.body, name: `axis of ${m.name}`, point: m.point, direction: unit3(m.direction) })),
      ...story.bodies.map((name, body) => ({ kind: "point", body, name: `origin of ${name}`, point: [0, 0, 0] })),
    ];
    this.addLine();
    this.build();
    inspector.intercept((hit, event) => this.pick(hit, event));
    labels.add("measure", () => this.middle, () => this.words, () => this.on && Boolean(this.result));
    this.stage.attach(() => this.update());
  }

  addLine() {
    const geometry = new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3()]);
    this.line = new THREE.Line(geometry, new THREE.LineBasicMaterial({ color: 0xc2185b, depthTest: false, transparent: true }));
    this.dots = new THREE.Points(geometry, new THREE.PointsMaterial({ color: 0xc2185b, size: 7, sizeAttenuation: false, depthTest: false, transparent: true }));
    for (const item of [this.line, this.dots]) { item.renderOrder = 7; item.frustumCulled = false; item.visible = false; this.stage.root.add(item); }
  }

  build() {
    this.button.addEventListener("click", () => this.switch(!this.on));
    this.selects = [0, 1].map((slot) => make("select", { "aria-label": `feature ${slot + 1}`, onchange: (event) => {
      this.take(slot, event.target.value === "" ? null : this.named[Number(event.target.value)]);
    } }));
    this.answer = make("p", { class: "answer", role: "status", "aria-live": "polite" });
    this.holder.append(make("div", { class: "card-head" }, make("h2", {}, "Measure"),
      make("button", { type: "button", class: "close", "aria-label": "Stop measuring", title: "Close (Esc)", onclick: () => this.switch(false) }, "\u00d7")),
      make("p", { class: "hint" }, "Pick two features in the view: named points, corners, axes of holes and pins, faces. Or choose:"), ...this.selects, this.answer);
    listenTo(document, "keydown", (event) => { if (event.key === "Escape" && !event.defaultPrevented) this.switch(false); });
    this.switch(false);
  }

  switch(on) {
    this.on = on;
    this.holder.hidden = !on;
    this.button.setAttribute("aria-pressed", String(on));
    if (on) this.inspector.pin(null);
    this.features = [null, null];
    this.next = 0;
    this.list();
    this.stage.redraw();
  }

  list() {
    this.selects.forEach((select, slot) => {
      const feature = this.features[slot], at = this.named.indexOf(feature);
      const options = this.named.map((x, k) => make("option", { value: k, selected: k === at }, `${x.name} (${this.stage.bodies[x.body]})`));
      select.replaceChildren(make("option", { value: "", selected: at < 0 }, feature && at < 0 ? feature.name : `${slot + 1}: \u2013`), ...options);
    });
  }

  /** Puts a feature, fixed in its body, into slot 0 or 1; null empties it. */
  take(slot, feature) {
    this.features[slot] = feature;
    this.next = feature ? 1 - slot : slot;
    this.list();
    this.stage.redraw();
  }

  /** The feature under a place of the window: {kind, body, name, point, direction} in the axes of its body; null beside all parts. */
  featureAt(hit, x, y) {
    const near = (point) => { const [px, py] = onScreen(this.stage, new THREE.Vector3(...point)); return Math.hypot(px - x, py - y); };
    const points = this.named.filter((f) => f.kind === "point" && f.name.startsWith("point ") && this.stage.groups[f.body].visible);
    const nearest = points.map((f) => [near(this.world(f).point), f]).sort((a, b) => a[0] - b[0])[0];
    if (nearest && nearest[0] < SNAP_POINT) return nearest[1];
    if (!hit) return null;
    const { geometry, matrix } = hit.mesh;
    const positions = geometry.getAttribute("position").array, index = geometry.index.array;
    const toBody = (p) => new THREE.Vector3(...p).applyMatrix4(matrix).toArray();
    const body = hit.body, name = this.stage.bodies[body], group = this.stage.groups[body];
    const local = hit.point.clone().sub(group.position).applyQuaternion(group.quaternion.clone().invert());
    const corners = [0, 1, 2].map((k) => { const v = index[3 * hit.face + k]; return toBody([positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]]); });
    const closest = corners.map((point) => [near(this.world({ body, point }).point), point]).sort((a, b) => a[0] - b[0])[0];
    const surface = surfaceAround(positions, index, hit.face, local.clone().applyMatrix4(matrix.clone().invert()).toArray());
    // A round surface is known by its axis: its corners are those of the drawing.
    if (surface.kind !== "axis" && closest[0] < SNAP_CORNER) return { kind: "point", body, name: `corner of ${name}`, point: closest[1] };
    const direction = surface.direction && unit3(new THREE.Vector3(...surface.direction).transformDirection(matrix).toArray());
    const words = { face: `face of ${name}`, point: `point on ${name}`, axis: `${surface.hole ? "hole" : "round"} of ${name}, \u2300 ${withUnit(2 * (surface.radius || 0), "m")}` };
    return { kind: surface.kind, body, name: words[surface.kind], point: toBody(surface.point), direction };
  }

  pick(hit, event) {
    if (!this.on) return false;
    const feature = this.featureAt(hit, event.clientX, event.clientY);
    if (!feature) return true;
    // A third one begins anew.
    if (this.features.every(Boolean)) { this.features = [null, null]; this.next = 0; }
    this.take(this.next, feature);
    return true;
  }

  /** A feature where its body is now. */
  world({ kind, body, point, direction }) {
    const { position, quaternion } = this.stage.groups[body];
    return { kind, point: new THREE.Vector3(...point).applyQuaternion(quaternion).add(position).toArray(),
      direction: direction && new THREE.Vector3(...direction).applyQuaternion(quaternion).toArray() };
  }

  update() {
    const [a, b] = this.features;
    this.result = this.on && a && b ? measureBetween(this.world(a), this.world(b)) : null;
    const places = this.result ? [this.result.from, this.result.to] : this.on && (a || b) ? [this.world(a || b).point, this.world(a || b).point] : null;
    this.line.visible = Boolean(this.result && this.result.distance !== null);
    this.dots.visible = Boolean(places);
    if (places) {
      const position = this.line.geometry.getAttribute("position");
      places.forEach((p, k) => position.setXYZ(k, ...p));
      position.needsUpdate = true;
    }
    if (this.on) this.answer.textContent = this.sentence();
  }

  sentence() {
    if (!this.result) return this.features.some(Boolean) ? "Now the second feature." : "";
    const { distance, from, to, angle } = this.result;
    const parts = [];
    if (distance !== null) parts.push(`distance ${withUnit(distance, "m", 6)}`, `difference ${vectorText(minus3(to, from), "m")}`);
    if (angle !== null) parts.push(`angle ${degreesText(angle)} (${significant(angle, 6)} rad)`);
    if (distance === null) parts.push("they meet");
    return parts.join("; ");
  }

  get middle() { return this.result && new THREE.Vector3(...this.result.from).add(new THREE.Vector3(...this.result.to)).multiplyScalar(0.5); }
  get words() {
    const { distance, angle } = this.result;
    return [distance !== null ? withUnit(distance, "m", 5) : "", angle !== null && angle >= PARALLEL ? degreesText(angle) : ""].filter(Boolean).join(", ");
  }
}
