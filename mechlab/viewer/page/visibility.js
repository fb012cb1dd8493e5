// Which bodies are drawn, and which of them is marked.

class Visibility {
  constructor(stage, redraw) {
    this.stage = stage;
    this.redraw = redraw;
    this.hidden = new Set();
    this.followers = [];
    this.tints = {
      hover: new THREE.MeshBasicMaterial({ color: 0x1b5e9e, transparent: true, opacity: 0.22, depthWrite: false, side: THREE.DoubleSide }),
      pin: new THREE.MeshBasicMaterial({ color: 0xf2a900, transparent: true, opacity: 0.34, depthWrite: false, side: THREE.DoubleSide }),
    };
    for (const tint of Object.values(this.tints)) tint.color.convertSRGBToLinear();
    this.marked = { hover: null, pin: null };
    this.overlays = { hover: [], pin: [] };
  }

  /** `follower()` is called after every change. */
  onChange(follower) { this.followers.push(follower); }

  /** `follower()` is called when a body is tinted. */
  onMark(follower) { this.marker = follower; }

  /** Hides exactly the bodies of a list of indices. */
  set(bodies) {
    this.hidden = new Set(bodies);
    this.stage.groups.forEach((group, k) => { group.visible = !this.hidden.has(k); });
    for (const follower of this.followers) follower();
    this.redraw();
  }

  hide(body) { this.set([...this.hidden, body]); }
  show(body) { this.set([...this.hidden].filter((k) => k !== body)); }
  isolate(body) { this.set(this.stage.groups.map((_, k) => k).filter((k) => k !== body)); }
  showAll() { this.set([]); }

  /** Tints a body (index, or null for none); kind "hover" or "pin". */
  mark(kind, body) {
    if (this.marked[kind] === body) return;
    this.marked[kind] = body;
    for (const mesh of this.overlays[kind]) mesh.removeFromParent();
    this.overlays[kind] = [];
    if (body !== null) {
      for (const part of this.stage.groups[body].children.filter((x) => x.isMesh && !x.userData.overlay)) {
        const mesh = new THREE.Mesh(part.geometry, this.tints[kind]);
        mesh.matrixAutoUpdate = false;
        mesh.matrix.copy(part.matrix);
        mesh.userData.overlay = true;
        mesh.raycast = () => {};  // what is picked is the part under it
        mesh.renderOrder = 1;
        this.stage.groups[body].add(mesh);
        this.overlays[kind].push(mesh);
      }
    }
    if (this.marker) this.marker();
    this.stage.redraw();
  }
}
