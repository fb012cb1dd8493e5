// The camera: standard views, and a fit that shows everything the mechanism ever reaches. A planar mechanism opens face on.

const VIEWS = { iso: null, top: [0, 0, 1], front: [0, -1, 0], right: [1, 0, 0] };

class CameraRig {
  constructor(stage) {
    this.stage = stage;
    this.framing = stage.framing;
    this.toward = new THREE.Vector3(...this.framing.threeQuarter).normalize();
    this.touched = false;
    const { camera, controls } = stage.viewer;
    camera.fov = (this.framing.fieldOfView * 180) / Math.PI;
    camera.near = 0.02 * this.framing.radius;
    camera.far = 100 * this.framing.radius;
    this.projection = new Projection(stage.viewer);
    this.views = { ...VIEWS, face: this.framing.face };
    controls.addEventListener("start", () => { this.touched = true; });
    const resized = new ResizeObserver(() => {
      stage.viewer.set_3d_pane_size();
      if (!this.touched) this.fit();
    });
    resized.observe(stage.viewer.dom_element);
    atEnd(() => resized.disconnect());
  }

  /** The view that the page opens with. */
  open() {
    this.view(this.framing.face ? "face" : "iso");
    this.projection.set(Boolean(this.framing.face));
    this.fit();
  }

  view(name) {
    this.toward.set(...(this.views[name] || this.framing.threeQuarter)).normalize();
    this.fit();
  }

  /** Looks from a place towards another [m]. */
  look(from, at) {
    const { controls } = this.stage.viewer;
    const { camera } = this.projection;
    controls.target.copy(toWorld(new THREE.Vector3(...at)));
    camera.position.copy(toWorld(new THREE.Vector3(...from)));
    this.projection.show(camera.position.distanceTo(controls.target));
    controls.update();
    this.touched = true;
    this.stage.redraw();
  }

  /** Fits all points into the picture, seen from where the camera stands now. */
  fitHere() {
    const { camera, controls } = this.stage.viewer;
    this.toward.copy(fromWorld(camera.position.clone().sub(controls.target))).normalize();
    this.fit();
  }

  fit() {
    const { controls } = this.stage.viewer;
    const { camera, flat } = this.projection;
    const back = this.toward;
    const right = new THREE.Vector3(0, 0, 1).cross(back);
    if (right.length() < 1e-6) right.set(1, 0, 0);
    right.normalize();
    const up = back.clone().cross(right);
    const wide = Math.tan(this.framing.fieldOfView / 2) / this.framing.margin;
    const canvas = this.stage.viewer.renderer.domElement;
    const height = Math.max(1, canvas.clientHeight);
    const half = wide * Math.max(0.5, 1 - buttonRoom(canvas.clientWidth) / height);
    const points = this.framing.points.map((p) => new THREE.Vector3(...p));
    const target = new THREE.Vector3(...this.stage.centre);
    let distance = this.framing.radius;
    for (let pass = 0; pass < 5; pass++) {
      // Without perspective the depth of a point does not matter.
      const seen = points.map((p) => p.clone().sub(target)).map((p) => [p.dot(right), p.dot(up), flat ? 0 : p.dot(back)]);
      distance = Math.max(...seen.map(([x, y, z]) => z + Math.max(Math.abs(x) / (wide * this.projection.aspect), Math.abs(y) / half)));
      if (pass === 4) break;
      const middle = [0, 1].map((i) => {
        const angles = seen.map((p) => p[i] / (distance - p[2]));
        return ((Math.min(...angles) + Math.max(...angles)) / 2) * distance;
      });
      target.addScaledVector(right, middle[0]).addScaledVector(up, middle[1]);
    }
    controls.target.copy(toWorld(target));
    camera.position.copy(toWorld(target.clone().addScaledVector(back, distance)));
    this.projection.show(distance);
    controls.update();
    this.touched = false;
    this.stage.redraw();
  }
}

/** The mechanism's frame has z up, three.js has y up. */
function toWorld(p) { return new THREE.Vector3(p.x, p.z, -p.y); }
function fromWorld(p) { return new THREE.Vector3(p.x, -p.z, p.y); }

function addViewButtons(rig, holder) {
  const button = (text, title, action) => holder.append(make("button", { type: "button", title, onclick: action }, text));
  if (rig.framing.face) button("Face", "Face on: along the axes of a planar mechanism", () => rig.view("face"));
  button("Iso", "Three-quarter view", () => rig.view("iso"));
  button("Top", "View from above (along \u2212z)", () => rig.view("top"));
  button("Front", "View from the front (along +y)", () => rig.view("front"));
  button("Right", "View from the right (along \u2212x)", () => rig.view("right"));
  button("Fit", "Show everything, from the present direction", () => rig.fitHere());
  const flat = make("button", { type: "button", id: "flat", title: "Flat (no perspective) or in perspective", onclick: () => rig.projection.set(!rig.projection.flat) }, "Flat");
  rig.projection.onChange((on) => { flat.setAttribute("aria-pressed", String(on)); rig.stage.redraw(); });
  holder.append(flat);
  button("PNG", "Save the picture as it is now", () => savePicture(rig.stage));
}

function savePicture({ quality, viewer }) {
  quality.full();
  viewer.renderer.domElement.toBlob((blob) => {
    saveFile(`${document.title.replace(/[^\w-]+/g, "-") || "mechanism"}.png`, blob);
  });
}

/** Draws the directions x, y, z of the mechanism's frame as the camera sees them. */
function addTriad(rig, svg) {
  const axes = [["x", [1, 0, 0], "#b3261e"], ["y", [0, 1, 0], "#2e7d32"], ["z", [0, 0, 1], "#1b5e9e"]];
  const create = (tag) => svg.appendChild(document.createElementNS(svg.namespaceURI, tag));
  const drawn = axes.map(([name, direction, color]) => {
    const line = create("line"), text = create("text");
    line.setAttribute("stroke", color);
    text.setAttribute("fill", color);
    text.textContent = name;
    return { direction: new THREE.Vector3(...direction), line, text };
  });
  const turn = () => {
    const inverse = rig.stage.viewer.camera.quaternion.clone().invert();
    for (const { direction, line, text } of drawn) {
      const seen = toWorld(direction).applyQuaternion(inverse);
      line.setAttribute("x2", 24 * seen.x); line.setAttribute("y2", -24 * seen.y);
      text.setAttribute("x", 32 * seen.x); text.setAttribute("y", -32 * seen.y);
    }
  };
  rig.stage.viewer.controls.addEventListener("change", turn);
  turn();
}
