// Forces and torques: arrows that keep one scale for each unit over the whole run. A torque has two heads.

const ARROW_COLORS = { force: 0x00795b, torque: 0x7b3fa0 };

class Arrows {
  constructor(stage, story, read) {
    this.stage = stage;
    this.step = story.framing.step;
    this.scales = story.arrowScales;
    this.width = 0.011 * story.framing.radius;
    this.items = story.arrows.map((arrow) => this.add(arrow, read));
    this.shown = true;
  }

  add(arrow, read) {
    const material = new THREE.MeshStandardMaterial({ color: new THREE.Color(ARROW_COLORS[arrow.kind]).convertSRGBToLinear(), roughness: 0.6 });
    const group = new THREE.Group();
    group.name = `arrow ${arrow.name}`;
    // Along +z: the shaft has unit length and is stretched, the heads keep their shape.
    const turn = (geometry) => geometry.rotateX(Math.PI / 2);
    const shaft = new THREE.Mesh(turn(new THREE.CylinderGeometry(1, 1, 1, 16).translate(0, 0.5, 0)), material);
    const heads = (arrow.kind === "torque" ? [0, 1] : [0]).map(() => new THREE.Mesh(turn(new THREE.ConeGeometry(1, 1, 20).translate(0, -0.5, 0)), material));
    group.add(shaft, ...heads);
    // What a part hides shows through it, faintly.
    const hidden = new THREE.MeshBasicMaterial({ color: material.color, transparent: true, opacity: 0.35, depthTest: false, depthWrite: false });
    for (const mesh of [shaft, ...heads]) {
      const faint = new THREE.Mesh(mesh.geometry, hidden);
      faint.renderOrder = 5;
      mesh.add(faint);
    }
    this.stage.root.add(group);
    return { ...arrow, points: read(arrow.points), vectors: read(arrow.vectors), group, shaft, heads, tip: new THREE.Vector3(), size: 0 };
  }

  /** Takes other arrows; `sign` -1 draws one the other way round. */
  replace(arrows, read) {
    for (const { group } of this.items) this.stage.root.remove(group);
    this.items = arrows.map((arrow) => this.add(arrow, read));
    if (this.onReplace) this.onReplace();
  }

  /** Shows the arrows at a place between two recorded frames. */
  apply(frame, share) {
    const along = new THREE.Vector3(0, 0, 1);
    const next = (values, k) => {
      const a = 3 * frame + k, b = a + 3 < values.length ? a + 3 : a;
      return values[a] + share * (values[b] - values[a]);
    };
    for (const item of this.items) {
      const vector = new THREE.Vector3(...[0, 1, 2].map((k) => next(item.vectors, k))).multiplyScalar(item.sign || 1);
      item.size = vector.length();
      const length = (item.size / (this.scales[item.unit] || 1)) * this.step;
      item.visible = this.shown && length > 0.02 * this.step;
      item.group.visible = item.visible;
      if (!item.visible) continue;
      item.group.position.set(...[0, 1, 2].map((k) => next(item.points, k)));
      item.group.quaternion.setFromUnitVectors(along, vector.clone().normalize());
      const head = Math.min(5.5 * this.width, 0.45 * length);
      const width = Math.min(this.width, 0.16 * length);
      item.shaft.scale.set(width, width, Math.max(1e-9, length - head * item.heads.length * 0.75));
      item.heads.forEach((cone, k) => {
        cone.scale.set(2.4 * width, 2.4 * width, head);
        cone.position.z = length - 0.72 * k * head;
      });
      item.tip.copy(vector).setLength(length).add(item.group.position);
    }
  }

  /** What an arrow as long as one grid step stands for. */
  get scaleText() {
    const units = new Set(this.items.map((item) => item.unit));
    const shown = Object.entries(this.scales).filter(([unit]) => units.has(unit)).map(([unit, amount]) => `${significant(amount)} ${unit}`);
    return shown.length && this.shown ? `arrow of one grid step: ${shown.join(" or ")}` : "";
  }
}
