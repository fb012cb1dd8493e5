// The three-dimensional view: meshcat's viewer with our own light, floor, grid and solids. The mechanism's frame has z up.

/** Height that the buttons over a picture of some width take [px]: they need two rows in a narrow one. */
function buttonRoom(width) { return width < 820 ? 100 : 56; }

class Stage {
  /** `renderer`: that of the story before, whose picture stays until this one is drawn. */
  constructor(viewport, story, read, renderer) {
    this.framing = story.framing;
    this.bodies = story.bodies;
    this.viewer = new MeshCat.Viewer(viewport, true, renderer);
    if (renderer) viewport.append(renderer.domElement);
    this.prepareViewer(viewport);
    this.root = this.viewer.scene_tree.find(["mechanism"]).object;
    this.addLights();
    if (story.floors.length) for (const floor of story.floors) this.addSheet(floor);
    else this.addFloor();
    this.groups = story.bodies.map((name) => {
      const group = new THREE.Group();
      group.name = name;
      this.root.add(group);
      return group;
    });
    this.addParts(story, read);
    this.quality = new Quality(this);
  }

  prepareViewer(viewport) {
    const viewer = this.viewer;
    for (const path of ["Lights", "Grid", "Axes"]) viewer.delete_path([path]);
    viewer.gui.domElement.remove();
    viewer.hide_background();
    viewer.scene.background = new THREE.Color(0xffffff);
    viewer.renderer.outputEncoding = THREE.sRGBEncoding;
    viewer.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
    viewer.renderer.domElement.setAttribute("role", "img");
    viewer.renderer.domElement.setAttribute("aria-label", `Moving mechanism of ${this.bodies.length} bodies; drag to turn, wheel to zoom`);
    // The viewer sizes itself from the window; here it is one part of a page.
    viewer.set_3d_pane_size = function () {
      const width = Math.max(1, viewport.clientWidth), height = Math.max(1, viewport.clientHeight);
      fitAspect(this.camera, width / height);
      // The buttons take the upper edge; the picture moves down by half of that.
      this.camera.setViewOffset(width, height, 0, -buttonRoom(width) / 2, width, height);
      this.camera.updateProjectionMatrix();
      this.renderer.setSize(width, height);
      this.set_dirty();
    };
    viewer.set_3d_pane_size();
  }

  get centre() {
    const { low, high } = this.framing;
    return low.map((value, i) => (value + high[i]) / 2);
  }

  addLights() {
    const { radius } = this.framing;
    const centre = new THREE.Vector3(...this.centre);
    this.root.add(new THREE.HemisphereLight(0xffffff, 0xb9c0cc, 0.62).translateZ(1));
    const shine = (x, y, z, strength) => {
      const light = new THREE.DirectionalLight(0xffffff, strength);
      light.position.copy(centre).addScaledVector(new THREE.Vector3(x, y, z).normalize(), 4 * radius);
      light.target.position.copy(centre);
      this.root.add(light, light.target);
      return light;
    };
    shine(0.9, 0.7, 0.35, 0.22);
    const key = this.key = shine(-0.55, -0.6, 1.25, 0.62);
    key.castShadow = true;
    key.shadow.mapSize.set(2048, 2048);
    key.shadow.bias = -0.0004;
    key.shadow.normalBias = 0.004 * radius;
    key.shadow.radius = 3;
    Object.assign(key.shadow.camera, { left: -1.1 * radius, right: 1.1 * radius, top: 1.1 * radius, bottom: -1.1 * radius,
      near: 0.1 * radius, far: 12 * radius });
  }

  /** A floor that shows nothing but shadows, and a grid that fades out into the white around it. */
  addFloor() {
    const { radius, step, floor } = this.framing;
    const plane = this.shade = new THREE.Mesh(new THREE.PlaneGeometry(60 * radius, 60 * radius), new THREE.ShadowMaterial({ opacity: 0.2 }));
    plane.position.set(this.centre[0], this.centre[1], floor - 0.002 * radius);
    plane.receiveShadow = true;
    this.root.add(plane);

    const reach = Math.ceil((3.2 * radius) / step);
    const [cx, cy] = this.centre.map((value) => Math.round(value / step));
    const points = [], colors = [];
    const add = (i, j, strong) => {
      const distance = Math.hypot(i - cx, j - cy) / reach;
      const fade = Math.max(0, 1 - distance) ** 1.5 * (strong ? 0.5 : 0.26);
      points.push(i * step, j * step, 0);
      colors.push(1 - fade, 1 - 0.93 * fade, 1 - 0.82 * fade);
    };
    for (let i = -reach; i <= reach; i++) {
      for (let j = -reach; j < reach; j++) {
        add(cx + i, cy + j, (cx + i) % 5 === 0); add(cx + i, cy + j + 1, (cx + i) % 5 === 0);
        add(cx + j, cy + i, (cy + i) % 5 === 0); add(cx + j + 1, cy + i, (cy + i) % 5 === 0);
      }
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
    geometry.setAttribute("color", new THREE.Float32BufferAttribute(colors, 3));
    const grid = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ vertexColors: true, depthWrite: false }));
    grid.position.z = floor - 0.003 * radius;
    grid.renderOrder = -1;
    this.root.add(grid);
  }

  /** A floor of the model: checkered around the mechanism, fading out where it has no end. */
  addSheet({ placement, size, color }) {
    const { radius, step } = this.framing;
    const matrix = new THREE.Matrix4().fromArray(placement);
    const middle = new THREE.Vector3(...this.centre).applyMatrix4(matrix.clone().invert());
    const half = size.map((side) => (side > 0 ? Math.min(side / 2, 20 * radius) : 5 * radius));
    const at = size.map((side, i) => (side > 0 ? 0 : Math.round(middle.getComponent(i) / (2 * step)) * 2 * step));
    const surface = new THREE.MeshStandardMaterial({ map: checks(half, at, step, size, color), roughness: 0.9, metalness: 0,
      transparent: true, depthWrite: false, side: THREE.DoubleSide });
    const sheet = new THREE.Mesh(new THREE.PlaneGeometry(2 * half[0], 2 * half[1]), surface);
    sheet.name = "floor";
    sheet.matrixAutoUpdate = false;
    sheet.matrix.copy(matrix.multiply(new THREE.Matrix4().makeTranslation(at[0], at[1], -0.001 * radius)));
    sheet.receiveShadow = true;
    sheet.renderOrder = -1;
    this.root.add(sheet);
  }

  /** Draws the parts of another variant of the same bodies instead. */
  replaceParts(story, read) {
    for (const group of this.groups) for (const child of [...group.children]) if (child.isMesh) group.remove(child);
    this.addParts(story, read);
  }

  shapesOf(story, read) {
    this.shapes = this.shapes || new Map();
    return story.geometries.map((g) => {
      const key = `${g.positions.at} ${g.faces.at}`;
      if (this.shapes.has(key)) return this.shapes.get(key);
      const solid = new THREE.BufferGeometry();
      solid.setAttribute("position", new THREE.BufferAttribute(read(g.positions), 3));
      solid.setAttribute("normal", new THREE.BufferAttribute(read(g.normals), 3, true));
      solid.setIndex(new THREE.BufferAttribute(read(g.faces), 1));
      const lines = new THREE.BufferGeometry();
      lines.setAttribute("position", solid.getAttribute("position"));
      lines.setIndex(new THREE.BufferAttribute(read(g.edges), 1));
      const shape = { solid, lines, hasLines: g.edges.count > 0, closed: g.closed };
      this.shapes.set(key, shape);
      return shape;
    });
  }

  addParts(story, read) {
    const shapes = this.shapesOf(story, read);
    this.materials = this.materials || new Map();
    const materials = this.materials;
    for (const part of story.parts) {
      const { solid, lines, hasLines, closed } = shapes[part.geometry];
      const key = `${part.color} ${closed}`;
      if (!materials.has(key)) materials.set(key, partMaterials(part.color, closed));
      const { surface, edge } = materials.get(key);
      const mesh = new THREE.Mesh(solid, surface);
      mesh.name = part.name;
      mesh.userData.closed = closed && part.color[3] > 0.999;
      mesh.matrixAutoUpdate = false;
      mesh.matrix.fromArray(part.placement);
      mesh.castShadow = part.color[3] > 0.5;
      mesh.receiveShadow = true;
      if (hasLines) {
        const edges = new THREE.LineSegments(lines, edge);
        edges.layers.set(EDGE_LAYER);
        mesh.add(edges);
      }
      this.groups[part.body].add(mesh);
    }
    if (this.onParts) this.onParts();
  }

  /** The pose (4 rows of 4) of a body in the mechanism's frame, as the scene shows it now. */
  pose(body) {
    const k = this.bodies.indexOf(body);
    if (k < 0) throw new Error(`body '${body}' does not exist. Existing: ${this.bodies.join(", ")}.`);
    this.viewer.scene.updateMatrixWorld(true);
    const e = this.root.matrixWorld.clone().invert().multiply(this.groups[k].matrixWorld).elements;
    return [0, 1, 2, 3].map((row) => [0, 1, 2, 3].map((column) => e[4 * column + row]));
  }

  /** Gives up everything but the renderer, which the next stage takes. */
  end() {
    const { viewer } = this;
    viewer.animate = viewer.render = viewer.set_3d_pane_size = () => {};
    viewer.controls.dispose();
    viewer.scene.traverse((object) => {
      if (object.geometry) object.geometry.dispose();
      for (const material of [object.material || []].flat()) material.dispose();
      if (object.shadow && object.shadow.map) object.shadow.map.dispose();
    });
  }

  /** `update()` is called whenever bodies may have moved, before the picture is drawn. */
  attach(update) { (this.attached = this.attached || []).push(update); }

  redraw() {
    for (const update of this.attached || []) update();
    this.viewer.set_dirty();
    if (this.onRedraw) this.onRedraw();
  }
}

/** A texture of squares `step` wide for a sheet of half sides `half` around `at`; it fades out along sides without end. */
function checks(half, at, step, size, [red, green, blue]) {
  const pixels = 1024;
  const canvas = make("canvas", { width: pixels, height: pixels });
  const context = canvas.getContext("2d");
  const shade = (share) => `rgb(${[red, green, blue].map((x) => Math.round(255 * share * (0.4 + 0.6 * x))).join()})`;
  context.fillStyle = shade(0.8);
  context.fillRect(0, 0, pixels, pixels);
  context.fillStyle = shade(0.68);
  const first = half.map((h, i) => Math.floor((at[i] - h) / step)), last = half.map((h, i) => Math.ceil((at[i] + h) / step));
  const x = (i, axis) => ((i * step - at[axis] + half[axis]) / (2 * half[axis])) * pixels;
  for (let i = first[0]; i < last[0]; i++)
    for (let j = first[1]; j < last[1]; j++)
      if ((i + j) % 2) context.fillRect(x(i, 0), pixels - x(j + 1, 1), x(i + 1, 0) - x(i, 0), x(j + 1, 1) - x(j, 1));
  if (size.some((side) => !side)) {
    const fade = context.createRadialGradient(pixels / 2, pixels / 2, 0.15 * pixels, pixels / 2, pixels / 2, pixels / 2);
    fade.addColorStop(0, "#000f");
    fade.addColorStop(1, "#0000");
    context.globalCompositeOperation = "destination-in";
    context.fillStyle = fade;
    context.fillRect(0, 0, pixels, pixels);
  }
  const texture = new THREE.CanvasTexture(canvas);
  texture.encoding = THREE.sRGBEncoding;
  texture.anisotropy = 8;
  return texture;
}

/** `closed`: nobody sees the inside of such a surface, unless it is see-through. */
function partMaterials([red, green, blue, opacity], closed) {
  const color = new THREE.Color(red, green, blue).convertSRGBToLinear();
  const seeThrough = opacity < 0.999;
  return {
    surface: new THREE.MeshStandardMaterial({ color, roughness: 0.55, metalness: 0.05, opacity,
      side: closed && !seeThrough ? THREE.FrontSide : THREE.DoubleSide, shadowSide: THREE.DoubleSide,
      transparent: seeThrough, depthWrite: !seeThrough, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }),
    edge: new THREE.LineBasicMaterial({ color: color.clone().multiplyScalar(0.12), transparent: true, opacity: 0.75 * opacity }),
  };
}
