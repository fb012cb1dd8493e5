// Faces of a cut: where the plane of a section runs through solid material. The stencil counts the surfaces behind the plane:
// what was entered and not left is inside. Only surfaces that enclose a solid are counted.

const CAP_COLOR = 0xe8a33d;

class Caps {
  constructor(stage, plane) {
    this.stage = stage;
    this.plane = plane;
    this.counters = [];
    const count = (side, way) => new THREE.MeshBasicMaterial({ side, colorWrite: false, depthWrite: false, depthTest: false, stencilWrite: true,
      stencilFunc: THREE.AlwaysStencilFunc, stencilFail: way, stencilZFail: way, stencilZPass: way, clippingPlanes: [plane] });
    this.sides = [count(THREE.BackSide, THREE.IncrementWrapStencilOp), count(THREE.FrontSide, THREE.DecrementWrapStencilOp)];
    const keep = THREE.ReplaceStencilOp, size = 40 * stage.framing.radius;
    this.face = new THREE.Mesh(new THREE.PlaneGeometry(size, size), new THREE.MeshStandardMaterial({ color: new THREE.Color(CAP_COLOR).convertSRGBToLinear(),
      roughness: 0.9, side: THREE.DoubleSide, stencilWrite: true, stencilRef: 0, stencilFunc: THREE.NotEqualStencilFunc, stencilFail: keep, stencilZFail: keep,
      stencilZPass: keep, polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -1 }));
    this.face.onAfterRender = (renderer) => renderer.clearStencil();
    this.face.renderOrder = 0.6;
    this.face.visible = false;
    this.face.name = "section";
    this.face.raycast = () => {};
    stage.root.add(this.face);
  }

  /** Draws the faces of the cut through all parts, or none. */
  show(on) {
    for (const mesh of this.counters) mesh.removeFromParent();
    this.counters = [];
    this.face.visible = on;
    if (!on) return;
    for (const part of this.stage.groups.flatMap((group) => group.children.filter((x) => x.isMesh && x.userData.closed && !x.userData.uncut))) {
      for (const material of this.sides) {
        const mesh = new THREE.Mesh(part.geometry, material);
        mesh.matrixAutoUpdate = false;
        mesh.matrix.copy(part.matrix);
        mesh.userData = { overlay: true, uncut: true };
        mesh.raycast = () => {};
        mesh.renderOrder = 0.5;
        part.parent.add(mesh);
        this.counters.push(mesh);
      }
    }
    // The plane is that of the world; its face hangs in the mechanism's frame.
    const normal = fromWorld(this.plane.normal), at = fromWorld(this.plane.coplanarPoint(new THREE.Vector3()));
    this.face.position.copy(at);
    this.face.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), normal);
  }
}
