// The pose before the latest change: a faint second set of the parts that moved.

class PoseBefore {
  constructor(stage) {
    this.stage = stage;
    this.holder = new THREE.Group();
    this.holder.name = "pose before";
    this.material = faintMaterial();
    this.wanted = true;
    this.holder.visible = false;
    stage.root.add(this.holder);
  }

  /** Keeps the pose that is shown now. */
  keep() {
    this.poses = this.stage.groups.map((group) => ({ position: group.position.clone(), quaternion: group.quaternion.clone() }));
    this.drawn = false;
    this.holder.visible = false;
  }

  /** Draws the kept pose of all parts that stand elsewhere now. */
  show() {
    if (!this.poses || !this.wanted) { this.holder.visible = false; return; }
    if (!this.drawn) this.draw();
    const tiny = 1e-4 * this.stage.framing.radius;
    this.copies.forEach((copy, k) => {
      const { position, quaternion } = this.stage.groups[k];
      copy.visible = this.stage.groups[k].visible && (copy.position.distanceTo(position) > tiny || copy.quaternion.angleTo(quaternion) > 1e-3);
    });
    this.holder.visible = true;
  }

  draw() {
    this.holder.clear();
    this.copies = this.stage.groups.map((group, k) => {
      const copy = faintCopy(group, this.material);
      copy.position.copy(this.poses[k].position);
      copy.quaternion.copy(this.poses[k].quaternion);
      this.holder.add(copy);
      return copy;
    });
    this.drawn = true;
  }

  clear() { this.poses = null; this.holder.visible = false; }

  /** Whether it is shown at all. */
  want(on) { this.wanted = on; this.show(); }
}

function faintMaterial() {
  return new THREE.MeshStandardMaterial({ color: new THREE.Color(0x5a6b82).convertSRGBToLinear(), transparent: true, opacity: 0.28, depthWrite: false, roughness: 1 });
}

/** The solids of a group once more, in another material. */
function faintCopy(group, material) {
  const copy = new THREE.Group();
  for (const part of group.children) {
    if (!part.isMesh || part.userData.overlay) continue;
    const mesh = new THREE.Mesh(part.geometry, material);
    mesh.matrixAutoUpdate = false;
    mesh.matrix.copy(part.matrix);
    copy.add(mesh);
  }
  return copy;
}
