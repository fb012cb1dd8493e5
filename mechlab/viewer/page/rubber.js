// The grabbed point, the place it is pulled to, and the line between them.

const PULLED = 0x1b5e9e, OUT_OF_REACH = 0xa3123a;

class Rubber {
  constructor(stage, labels) {
    this.stage = stage;
    this.radius = stage.framing.radius;
    const material = () => new THREE.MeshBasicMaterial({ color: new THREE.Color(PULLED).convertSRGBToLinear(), depthTest: false, depthWrite: false, transparent: true, opacity: 0.9 });
    const ball = (size) => new THREE.Mesh(new THREE.SphereGeometry(size * this.radius, 20, 14), material());
    this.dot = ball(0.014);
    this.goal = ball(0.009);
    this.line = new THREE.Mesh(new THREE.CylinderGeometry(1, 1, 1, 10).rotateX(Math.PI / 2).translate(0, 0, 0.5), material());
    this.group = new THREE.Group();
    this.group.name = "rubber line";
    this.group.add(this.line, this.goal, this.dot);
    for (const mesh of this.group.children) mesh.renderOrder = 8;
    this.group.visible = false;
    stage.root.add(this.group);
    const name = (kind, shown) => labels.add(kind, () => this.dot.position.clone(), () => this.words, () => this.group.visible && Boolean(this.words) && shown());
    name("held", () => !this.out);
    name("missed", () => this.out);
  }

  /** From a point to the place it is pulled to; `words` stand beside the point. */
  show(point, target, out, words) {
    const pull = target.clone().sub(point);
    const length = pull.length();
    this.group.visible = true;
    this.words = words;
    this.out = out;
    this.dot.position.copy(point);
    this.goal.position.copy(target);
    this.line.visible = this.goal.visible = length > 2e-3 * this.radius;
    for (const mesh of this.group.children) mesh.material.color.set(out ? OUT_OF_REACH : PULLED).convertSRGBToLinear();
    if (!this.line.visible) return;
    this.line.position.copy(point);
    this.line.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), pull.normalize());
    this.line.scale.set(0.0035 * this.radius, 0.0035 * this.radius, length);
  }

  hide() { this.group.visible = false; this.words = ""; this.out = false; }
}
