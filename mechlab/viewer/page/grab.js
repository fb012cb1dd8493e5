// Grabbing a part with mouse, finger or keys. The grabbed point follows as far as the mechanism lets it.

const SHAKING = 4;        // pixels a pointer may shake before it drags
const FINGER = 14;      // pixels around a finger in which a part is found
const PUSH = 0.01;      // of the size, for an arrow key
const EDGE_ON = 0.2;    // cosine below which a plane is seen too flat to be dragged in
const OPENED = 1e-3;    // of the size: a miss that is said

class Grabber {
  /** `explorer` moves the mechanism: movable(body), handle(body), normal, begin(), drag(body, point, target), end(), say(words).
   * `hit(x, y)`: the part at a place of the window, {body, point}, or null. */
  constructor(stage, explorer, labels, viewport, hit) {
    Object.assign(this, { stage, explorer, viewport, hit });
    this.size = 2 * stage.framing.radius;
    this.rubber = new Rubber(stage, labels);
    this.held = null;
    this.pointers = new Map();
    viewport.addEventListener("pointerdown", (event) => this.down(event), true);
    viewport.addEventListener("pointermove", (event) => this.move(event), true);
    for (const kind of ["pointerup", "pointercancel"]) viewport.addEventListener(kind, (event) => this.up(event), true);
    this.prepareKeys();
  }

  get controls() { return this.stage.viewer.controls; }

  // With a pointer

  down(event) {
    const first = this.pointers.size === 0;
    this.pointers.set(event.pointerId, event.clientY);
    if (this.held && !this.held.byKeys) return;
    if (!first || event.button !== 0 || event.ctrlKey || event.metaKey) return;
    this.letGo();
    const reach = event.pointerType === "touch" ? FINGER : 0;
    const hit = hitNear(this.hit, event.clientX, event.clientY, reach, ({ body }) => this.explorer.movable(body));
    if (!hit) return;
    // The camera rests while a part is held; its own listener comes after this one.
    this.controls.enabled = false;
    event.target.setPointerCapture(event.pointerId);
    this.hold(hit.body, hit.point, { pointer: event.pointerId, x: event.clientX, y: event.clientY, last: [event.clientX, event.clientY] });
  }

  /** Takes hold of a point, given in the mechanism's frame. */
  hold(body, point, how) {
    const group = this.stage.groups[body];
    const { away } = screenAxes(this.stage);
    const { normal } = this.explorer;
    const flat = normal && Math.abs(normal.dot(away)) > EDGE_ON;
    this.held = { body, start: point.clone(), inBody: point.clone().sub(group.position).applyQuaternion(group.quaternion.clone().invert()),
      normal: flat ? normal.clone() : away, inPlane: flat, depth: 0, moving: false, target: point.clone(), ...how };
  }

  /** Where the grabbed point is now. */
  place() {
    const group = this.stage.groups[this.held.body];
    return this.held.inBody.clone().applyQuaternion(group.quaternion).add(group.position);
  }

  move(event) {
    const held = this.held;
    if (!held || held.byKeys || !this.pointers.has(event.pointerId)) return;
    const rise = this.pointers.get(event.pointerId) - event.clientY;
    this.pointers.set(event.pointerId, event.clientY);
    if (event.pointerId !== held.pointer) {
      if (held.moving) this.deepen(rise);
    } else {
      if (!held.moving && Math.hypot(event.clientX - held.x, event.clientY - held.y) < SHAKING) return;
      const [x, y] = held.last;
      held.last = [event.clientX, event.clientY];
      if (!held.moving) { held.moving = true; this.explorer.begin(); }
      if (event.shiftKey && !held.inPlane) this.deepen(rise);
      else { held.x += event.clientX - x; held.y += event.clientY - y; }
    }
    if (held.moving) this.pull(this.aim());
  }

  /** Moves the drag plane away by as much as `rise` pixels are there. */
  deepen(rise) {
    const { camera, renderer } = this.stage.viewer;
    const distance = this.place().distanceTo(fromWorld(camera.position));
    const height = renderer.domElement.clientHeight;
    this.held.depth += (rise * 2 * distance * Math.tan((camera.fov * Math.PI) / 360)) / (height * camera.zoom);
  }

  aim() {
    const { start, normal, depth, x, y, target } = this.held;
    return onPlane(sightLine(this.stage, x, y), start.clone().addScaledVector(normal, depth), normal) || target;
  }

  pull(target) {
    this.held.target = target;
    this.report = this.explorer.drag(this.held.body, this.held.inBody, target);
    this.draw();
  }

  draw() {
    if (!this.held) return;
    const { body, target, byKeys } = this.held;
    const point = this.place();
    const miss = point.distanceTo(target);
    const out = miss > OPENED * this.size;
    const words = out ? `${lengthText(Number(miss.toPrecision(3)))} out of reach` : byKeys ? this.stage.bodies[body] : "";
    this.rubber.show(point, target, out, words);
    this.stage.redraw();
  }

  up(event) {
    this.pointers.delete(event.pointerId);
    const held = this.held;
    if (!held || held.byKeys || event.pointerId !== held.pointer) return;
    this.letGo();
  }

  letGo() {
    this.controls.enabled = true;
    if (!this.held) return;
    const { moving } = this.held;
    this.held = null;
    this.rubber.hide();
    if (moving) this.explorer.end();
    this.stage.redraw();
  }

  // With keys

  prepareKeys() {
    this.viewport.tabIndex = 0;
    this.viewport.setAttribute("role", "application");
    this.viewport.setAttribute("aria-label", "Mechanism: Tab takes the next part, arrow keys push it, Page Up and Page Down push it away and near, Escape lets go");
    this.viewport.addEventListener("keydown", (event) => this.key(event));
    this.viewport.addEventListener("focus", () => { this.released = false; });
    this.viewport.addEventListener("blur", () => { if (this.held && this.held.byKeys) this.letGo(); });
  }

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.key === "Tab") { this.next(event); return; }
    if (event.key === "Escape" && this.held) { this.released = true; this.letGo(); event.stopPropagation(); return; }
    if (!this.held || !this.held.byKeys) return;
    const ways = { ArrowRight: ["right", 1], ArrowLeft: ["right", -1], ArrowUp: ["up", 1], ArrowDown: ["up", -1], PageUp: ["away", 1], PageDown: ["away", -1] };
    if (!(event.key in ways)) return;
    event.preventDefault();
    event.stopPropagation();
    const [axis, sign] = ways[event.key];
    this.push(axis, sign * PUSH * (event.shiftKey ? 10 : 1), event.repeat);
  }

  /** Tab goes from part to part and after the last one on to the rest of the page. */
  next(event) {
    if (this.released) return;
    const parts = this.stage.bodies.map((_, k) => k).filter((k) => this.explorer.movable(k));
    const here = this.held ? parts.indexOf(this.held.body) : event.shiftKey ? parts.length : -1;
    const body = parts[here + (event.shiftKey ? -1 : 1)];
    if (this.held) this.letGo();
    if (body === undefined) return;
    event.preventDefault();
    this.hold(body, this.explorer.handle(body), { byKeys: true });
    this.explorer.say(`${this.stage.bodies[body]} is held; arrow keys push it, Escape lets go.`);
    this.draw();
  }

  push(axis, share, again) {
    const { normal } = this.explorer;
    const way = screenAxes(this.stage)[axis];
    if (normal && axis !== "away") way.addScaledVector(normal, -way.dot(normal));
    if (way.length() < 1e-3) return;
    if (!again || !this.held.moving) { if (this.held.moving) this.explorer.end(); this.explorer.begin(); }
    this.held.moving = true;
    this.pull(this.place().addScaledVector(way.normalize(), share * this.size));
  }
}
