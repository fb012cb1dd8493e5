// The pivots of a planar mechanism as handles over the picture: dragged with mouse or finger, pushed with arrow keys.

const NUDGE = 0.005; // of the size, for an arrow key; with shift ten times as much

class Handles {
  constructor(editor) {
    this.editor = editor;
    this.layer = make("div", { id: "handles", role: "group", "aria-label": "Pivots" });
    document.getElementById("labels").after(this.layer);
    this.items = [];
    this.held = null;
    const { stage } = editor.explorer;
    stage.attach(() => this.place());
    stage.viewer.controls.addEventListener("change", () => this.place());
  }

  /** Shows a handle for each pivot of the shown pose; none where edit mode is off or nothing is planar. */
  show() {
    const { editor } = this, { normal } = editor;
    this.pivots = editor.on && normal ? pivotsOf(editor.here(), normal) : [];
    while (this.items.length < this.pivots.length) this.items.push(this.button(this.items.length));
    this.items.forEach((item, k) => {
      const pivot = this.pivots[k];
      item.hidden = !pivot;
      if (!pivot) return;
      item.classList.toggle("point", !pivot.pinned);
      item.classList.toggle("ground", pivot.places.some((place) => place.body === GROUND_NAME));
      item.setAttribute("aria-label", `${pivot.pinned ? "Pivot" : "Point"} ${pivot.name}: drag it, or push it with the arrow keys`);
      item.title = pivot.name.replace(/_/g, " ");
    });
    this.place();
  }

  place() {
    if (!this.editor.on || !this.pivots) return;
    const { stage } = this.editor.explorer, box = this.layer.getBoundingClientRect();
    this.pivots.forEach(({ point }, k) => {
      const [x, y] = onScreen(stage, new THREE.Vector3(...point));
      this.items[k].style.transform = `translate(${(x - box.left).toFixed(1)}px, ${(y - box.top).toFixed(1)}px)`;
    });
  }

  button(k) {
    const item = make("button", { type: "button", class: "handle" });
    item.addEventListener("pointerdown", (event) => this.down(event, k));
    item.addEventListener("pointermove", (event) => this.move(event));
    for (const kind of ["pointerup", "pointercancel"]) item.addEventListener(kind, (event) => this.up(event));
    item.addEventListener("keydown", (event) => this.key(event, k));
    this.layer.append(item);
    return item;
  }

  /** The place of the plane of a pivot under the pointer. */
  under(event, point) {
    const { editor } = this;
    return onPlane(sightLine(editor.explorer.stage, event.clientX, event.clientY), new THREE.Vector3(...point), new THREE.Vector3(...editor.normal));
  }

  down(event, k) {
    if (event.button !== 0 || this.held) return;
    event.preventDefault();
    event.stopPropagation();
    this.items[k].focus();
    this.items[k].setPointerCapture(event.pointerId);
    const pivot = this.pivots[k], start = this.under(event, pivot.point);
    if (!start) return;
    this.editor.explorer.begin();
    this.held = { pivot, start, here: this.editor.here(), pointer: event.pointerId, changed: false };
  }

  move(event) {
    const { held, editor } = this;
    if (!held || event.pointerId !== held.pointer) return;
    const at = this.under(event, held.pivot.point);
    if (!at) return;
    held.changed = true;
    editor.drag(held.here, held.pivot, across(at.sub(held.start).toArray(), editor.normal));
  }

  up(event) {
    const { held, editor } = this;
    if (!held || event.pointerId !== held.pointer) return;
    this.held = null;
    const { explorer } = editor, { begun } = explorer;
    if (held.changed && begun.source !== explorer.source) explorer.history.push(begun);
    explorer.begun = null;
    explorer.before.clear();
    explorer.show();
    explorer.drawCurves();
    editor.refresh();
  }

  key(event, k) {
    const ways = { ArrowRight: ["right", 1], ArrowLeft: ["right", -1], ArrowUp: ["up", 1], ArrowDown: ["up", -1] };
    if (!(event.key in ways) || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    event.stopPropagation();
    const { editor } = this, { stage } = editor.explorer, [axis, sign] = ways[event.key];
    const way = across(screenAxes(stage)[axis].toArray(), editor.normal), length = length3(way);
    if (length < 0.05) return;
    const here = editor.here();
    editor.drag(here, this.pivots[k], times((sign * NUDGE * here.size * (event.shiftKey ? 10 : 1)) / length, way));
  }
}
