// Which part lies under the pointer: hovering names it, a click or a tap picks it.

const CLICK_REACH = 6;  // [px] a pointer that moves farther turns the view or drags

class Picker {
  /** `onHover(hit, event)` and `onPick(hit, event)` get what `hit` returns; null beside all parts. */
  constructor(stage, surface, onHover, onPick) {
    this.stage = stage;
    this.ray = new THREE.Raycaster();
    /** Whether a point [m] of the mechanism's frame can be seen: a section takes away what lies beyond. */
    this.seen = () => true;
    this.pressed = null;
    surface.addEventListener("pointermove", (event) => {
      if (event.buttons || event.pointerType === "touch") { if (event.buttons) onHover(null, event); return; }
      this.last = event;
      if (this.waiting) return;
      this.waiting = true;
      requestAnimationFrame(() => { this.waiting = false; if (this.last) onHover(this.hit(this.last.clientX, this.last.clientY), this.last); });
    });
    surface.addEventListener("pointerleave", (event) => { this.last = null; onHover(null, event); });
    surface.addEventListener("pointerdown", (event) => { this.pressed = event.isPrimary && event.button === 0 ? [event.clientX, event.clientY] : null; });
    surface.addEventListener("pointerup", (event) => {
      const from = this.pressed;
      this.pressed = null;
      if (!from || Math.hypot(event.clientX - from[0], event.clientY - from[1]) > CLICK_REACH) return;
      onPick(this.hit(event.clientX, event.clientY), event);
    });
  }

  /** The nearest part that is seen at a place of the window [px]: {body (index), part (name), mesh, face, point, normal, distance};
   * point [m] and normal in the mechanism's frame. Null where there is none. Meshes for which
   * `through` holds are looked through. */
  hit(x, y, through = () => false) {
    const found = this.nearest(this.stage.groups.flatMap((group) => (group.visible ? group.children.filter((item) => item.isMesh && item.visible && !through(item)) : [])), x, y);
    if (!found) return null;
    const normal = fromWorld(found.face.normal.clone().transformDirection(found.object.matrixWorld));
    return { body: this.stage.groups.indexOf(found.object.parent), part: found.object.name, mesh: found.object, face: found.faceIndex, point: fromWorld(found.point), normal,
      distance: found.distance };
  }

  /** The nearest place of some meshes that is seen under a place of the window, as three.js gives it; null where there is none. */
  nearest(meshes, x, y) {
    const { camera, renderer } = this.stage.viewer;
    const box = renderer.domElement.getBoundingClientRect();
    const at = { x: ((x - box.left) / box.width) * 2 - 1, y: 1 - ((y - box.top) / box.height) * 2 };
    this.stage.viewer.scene.updateMatrixWorld();
    camera.updateMatrixWorld();
    this.ray.setFromCamera(at, camera);
    return this.ray.intersectObjects(meshes, false).find((found) => this.seen(fromWorld(found.point))) || null;
  }
}
