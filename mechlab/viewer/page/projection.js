// Perspective or flat: two cameras that show the same things in the same size where the view turns about.

class Projection {
  constructor(viewer) {
    this.viewer = viewer;
    this.perspective = viewer.camera;
    const { near, far, layers, up } = this.perspective;
    this.orthographic = new THREE.OrthographicCamera(-1, 1, 1, -1, near, far);
    this.orthographic.layers = layers;
    this.orthographic.up.copy(up);
    this.followers = [];
  }

  get flat() { return this.viewer.camera === this.orthographic; }
  get camera() { return this.viewer.camera; }
  /** Width over height of the picture. */
  get aspect() { const { clientWidth, clientHeight } = this.viewer.renderer.domElement; return Math.max(1, clientWidth) / Math.max(1, clientHeight); }

  /** `follower(flat)` is called now and at every change. */
  onChange(follower) { this.followers.push(follower); follower(this.flat); }

  /** Half the height of what a perspective camera sees at a distance. */
  halfHeight(distance) { return distance * Math.tan((this.perspective.fov * Math.PI) / 360); }

  /** The distance at which a perspective camera sees what is shown now. */
  get distance() {
    if (!this.flat) return this.camera.position.distanceTo(this.viewer.controls.target);
    return this.orthographic.top / this.orthographic.zoom / Math.tan((this.perspective.fov * Math.PI) / 360);
  }

  /** Shows as much as from a distance in perspective. */
  show(distance) {
    if (!this.flat) return;
    const height = this.halfHeight(distance), { orthographic } = this;
    orthographic.zoom = 1;
    Object.assign(orthographic, { top: height, bottom: -height });
    fitAspect(orthographic, this.aspect);
    orthographic.updateProjectionMatrix();
  }

  set(flat) {
    if (flat !== this.flat) {
      const { viewer } = this, { controls } = viewer;
      const distance = this.distance;
      const back = viewer.camera.position.clone().sub(controls.target).normalize();
      viewer.camera = controls.object = flat ? this.orthographic : this.perspective;
      viewer.camera.position.copy(controls.target).addScaledVector(back, distance);
      this.show(distance);
      controls.update();
      viewer.set_3d_pane_size();
    }
    for (const follower of this.followers) follower(this.flat);
  }
}

/** Makes a camera fill a picture of a width over its height. */
function fitAspect(camera, aspect) {
  if (camera.isOrthographicCamera) Object.assign(camera, { left: camera.bottom * aspect, right: camera.top * aspect });
  else camera.aspect = aspect;
}
