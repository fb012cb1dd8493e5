// Names beside their points. A name that would cover another one moves aside and points back with a thin line.

const PLACES = [];
for (const distance of [16, 30, 48, 70]) for (const angle of [-45, 45, -135, 135, -90, 90, 0, 180]) PLACES.push([distance, (angle * Math.PI) / 180]);

const MOST_LABELS = 12;  // at once; those of the part under the pointer or of the picked one come first

class Labels {
  constructor(stage, holder, obstacles) {
    this.stage = stage;
    this.holder = holder;
    this.obstacles = obstacles;
    this.items = [];
    stage.viewer.controls.addEventListener("change", () => this.place());
    stage.onRedraw = () => this.place();
  }

  /** `point()` gives the place in the mechanism's frame, or null; `text()` the words; `shown()` whether they are wanted;
   * body: the index of the one it belongs to. */
  add(kind, point, text, shown, body = null) {
    const element = make("span", { class: `label ${kind}` });
    const line = make("i", {});
    this.holder.append(line, element);
    this.items.push({ kind, body, element, line, point, text, shown, last: 0, width: 0, words: null });
  }

  /** Takes away the labels of some kinds. */
  remove(kinds) {
    for (const item of this.items.filter((x) => kinds.includes(x.kind))) { item.element.remove(); item.line.remove(); }
    this.items = this.items.filter((x) => !kinds.includes(x.kind));
  }

  /** Names of this body (index, or null) come before all others. */
  focus(body) {
    if (this.focused === body) return;
    this.focused = body;
    this.place();
  }

  ordered() {
    const rank = (item) => (item.kind === "measure" ? 0 : item.body !== null && item.body === this.focused ? 1 : item.kind === "force" || item.kind === "torque" ? 2 : 3);
    return [...this.items].sort((a, b) => rank(a) - rank(b));
  }

  place() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.placeNow(); });
  }

  placeNow() {
    const { camera } = this.stage.viewer;
    const width = this.holder.clientWidth, height = this.holder.clientHeight;
    const base = this.holder.getBoundingClientRect();
    const taken = this.obstacles.map((o) => o.getBoundingClientRect()).filter((r) => r.width).map((r) => [r.left - base.left, r.top - base.top, r.right - base.left, r.bottom - base.top]);
    camera.updateMatrixWorld();
    let room = MOST_LABELS;
    for (const item of this.ordered()) {
      const at = room > 0 && item.shown() ? item.point() : null;
      const seen = at && toWorld(at).project(camera);
      const visible = seen && Math.abs(seen.z) < 1 && Math.abs(seen.x) < 1 && Math.abs(seen.y) < 1;
      item.element.hidden = !visible;
      item.line.style.display = visible ? "" : "none";
      if (!visible) continue;
      room--;
      const words = item.text();
      if (words !== item.words) {
        item.element.textContent = item.words = words;
        item.width = item.element.offsetWidth;
        item.height = item.element.offsetHeight;
      }
      const x = ((1 + seen.x) / 2) * width, y = ((1 - seen.y) / 2) * height;
      const box = ([distance, angle]) => {
        const cx = x + Math.cos(angle) * (distance + item.width / 2), cy = y + Math.sin(angle) * (distance + item.height / 2);
        return [cx - item.width / 2, cy - item.height / 2, cx + item.width / 2, cy + item.height / 2];
      };
      // The place of the last picture comes first, so that names do not jump about.
      const order = [item.last, ...PLACES.keys()];
      const free = order.find((k) => {
        const [l, t, r, b] = box(PLACES[k]);
        return l >= 2 && t >= 2 && r <= width - 2 && b <= height - 2 && taken.every(([L, T, R, B]) => r < L || l > R || b < T || t > B);
      });
      item.element.hidden = free === undefined;
      item.line.style.display = free === undefined ? "none" : "";
      if (free === undefined) continue;
      item.last = free;
      const [l, t, r, b] = box(PLACES[free]);
      taken.push([l - 2, t - 1, r + 2, b + 1]);
      item.element.style.transform = `translate(${l.toFixed(1)}px, ${t.toFixed(1)}px)`;
      const near = [Math.min(r, Math.max(l, x)), Math.min(b, Math.max(t, y))];
      // A line that is moved, turned and stretched costs the browser no painting.
      const [dx, dy] = [near[0] - x, near[1] - y];
      item.line.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) rotate(${Math.atan2(dy, dx).toFixed(4)}rad) scaleX(${Math.hypot(dx, dy).toFixed(1)})`;
    }
  }
}

/** Where a mark fixed in a body is now, in the mechanism's frame. */
function markPoint(stage, mark) {
  const group = stage.groups[mark.body];
  return new THREE.Vector3(...mark.point).applyQuaternion(group.quaternion).add(group.position);
}
