// The picture of an edited mechanism: shapes that have changed are moved, made anew, or stretched.

/** A geometry for a shape of a document; null for kinds that only Python draws. */
function solidOf(shape) {
  const flat = flatShape(shape), { size } = shape;
  if (flat) {
    const outline = new THREE.Shape(flat.outline.map(([x, y]) => new THREE.Vector2(x, y)));
    outline.holes = flat.holes.map((hole) => new THREE.Path(hole.map(([x, y]) => new THREE.Vector2(x, y))));
    return new THREE.ExtrudeGeometry(outline, { depth: flat.thickness, bevelEnabled: false }).translate(0, 0, -flat.thickness / 2);
  }
  if (shape.kind === "cylinder") return new THREE.CylinderGeometry(size.radius, size.radius, size.length, 40).rotateX(Math.PI / 2);
  if (shape.kind === "box") return new THREE.BoxGeometry(size.x, size.y, size.z);
  if (shape.kind === "sphere") return new THREE.SphereGeometry(size.radius, 32, 20);
  return null;
}

function shapeMatrix({ position, quaternion: [w, x, y, z] }) {
  return new THREE.Matrix4().compose(new THREE.Vector3(...position), new THREE.Quaternion(x, y, z, w), new THREE.Vector3(1, 1, 1));
}

/** Draws the shapes of the document `after` where those of `before` are drawn. */
function redrawShapes(stage, before, after) {
  const drawn = (document, name) => shapesOf(document, name).filter((shape) => shape.kind !== "floor");
  stage.bodies.forEach((name, k) => {
    const meshes = stage.groups[k].children.filter((x) => x.isMesh && !x.userData.overlay), old = drawn(before, name), now = drawn(after, name);
    if (old.length && old.length === meshes.length) now.forEach((shape, i) => redraw(meshes[i], old[i], shape));
    if (!old.length) stretchLines(meshes, ends(before, name), ends(after, name));
  });
}

function shapesOf(document, name) {
  if (name === GROUND_NAME) return document.ground_shapes || [];
  const body = document.bodies.find((x) => x.name === name) || (document.shafts || []).find((x) => x.name === name || `${x.name} (shaft)` === name);
  return (body && body.shapes) || [];
}

function redraw(mesh, old, shape) {
  mesh.matrix.copy(shapeMatrix(shape.placement));
  if (JSON.stringify(old.size) === JSON.stringify(shape.size)) return;
  const solid = solidOf(shape);
  if (solid) {
    mesh.geometry = solid;
    for (const lines of mesh.children) if (lines.isLineSegments) lines.geometry = new THREE.EdgesGeometry(solid, 30);
  } else if (old.size.length > 0 && shape.size.length > 0) {
    // What Python alone draws: its far half moves along.
    const change = shape.size.length - old.size.length;
    const stretched = (geometry) => {
      const made = geometry.clone(), points = made.getAttribute("position");
      for (let i = 0; i < points.count; i++) if (points.getX(i) > old.size.length / 2) points.setX(i, points.getX(i) + change);
      return made;
    };
    mesh.geometry = stretched(mesh.geometry);
    for (const lines of mesh.children) if (lines.isLineSegments) lines.geometry = stretched(lines.geometry);
  }
}

/** Points of a part without shapes to which lines are drawn, as viewer/lines.py has them. */
function ends(document, name) {
  const points = document.bodies.filter((body) => (body.parent || GROUND_NAME) === name).map((body) => body.placement.position);
  for (const loop of document.loops || []) {
    if (loop.body_a === name) points.push(loop.placement_a.position);
    if (loop.body_b === name) points.push(loop.placement_b.position);
  }
  for (const spring of document.springs || []) {
    if (spring.body_a === name) points.push(spring.point_a);
    if (spring.body_b === name) points.push(spring.point_b);
  }
  return [...points, ...(document.frames || []).filter((f) => f.body === name).map((f) => f.placement.position)];
}

/** Lines from the origin of a part: each one follows the point at which it ended. */
function stretchLines(meshes, before, after) {
  const far = new THREE.Vector3();
  for (const mesh of meshes) {
    if (!/^line_/.test(mesh.name)) continue;
    mesh.geometry.computeBoundingBox();
    const { max } = mesh.geometry.boundingBox, length = Math.max(max.x, max.y, max.z);
    far.setFromMatrixColumn(mesh.matrix, 2).multiplyScalar(length);
    const near = before.map((p, i) => [far.distanceTo(new THREE.Vector3(...p)), i]).sort((a, b) => a[0] - b[0])[0];
    if (!near || near[0] > 0.1 * length) continue;
    const end = new THREE.Vector3(...after[near[1]]), share = end.length() / length3(before[near[1]]);
    mesh.matrix.compose(new THREE.Vector3(), new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 0, 1), end.clone().normalize()), new THREE.Vector3(1, 1, share));
  }
}
