// Lines of sight: from a place of the screen into the scene. Points and directions are in the mechanism's frame, z up.

/** The line of sight {origin, direction} through a place of the window. */
function sightLine(stage, clientX, clientY) {
  const box = stage.viewer.renderer.domElement.getBoundingClientRect();
  const place = new THREE.Vector2((2 * (clientX - box.left)) / box.width - 1, 1 - (2 * (clientY - box.top)) / box.height);
  stage.viewer.camera.updateMatrixWorld();
  const caster = new THREE.Raycaster();
  caster.setFromCamera(place, stage.viewer.camera);
  return { origin: fromWorld(caster.ray.origin), direction: fromWorld(caster.ray.direction) };
}

/** What `hit(x, y)` finds; a finger is thick and finds what is at most `reach` pixels away too. */
function hitNear(hit, clientX, clientY, reach, wanted) {
  const rings = reach ? [reach / 2, reach] : [];
  const places = [[0, 0], ...rings.flatMap((distance) => [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [distance, (k * Math.PI) / 4]))];
  for (const [distance, angle] of places) {
    const found = hit(clientX + distance * Math.cos(angle), clientY + distance * Math.sin(angle));
    if (found && wanted(found)) return found;
  }
  return null;
}

/** Where a line of sight passes the plane through `point` with `normal`; null when it runs along it or away from it. */
function onPlane({ origin, direction }, point, normal) {
  const along = direction.dot(normal);
  if (Math.abs(along) < 1e-6) return null;
  const distance = point.clone().sub(origin).dot(normal) / along;
  return distance > 0 ? origin.clone().addScaledVector(direction, distance) : null;
}

/** Directions of the screen in the mechanism's frame: right, up, and away from the one who looks. */
function screenAxes(stage) {
  const turned = (x, y, z) => fromWorld(new THREE.Vector3(x, y, z).applyQuaternion(stage.viewer.camera.quaternion));
  return { right: turned(1, 0, 0), up: turned(0, 1, 0), away: turned(0, 0, -1) };
}

/** Where a point of the mechanism's frame is seen, in the window. */
function onScreen(stage, point) {
  const box = stage.viewer.renderer.domElement.getBoundingClientRect();
  stage.viewer.camera.updateMatrixWorld();
  const seen = toWorld(point).project(stage.viewer.camera);
  return [box.left + ((1 + seen.x) / 2) * box.width, box.top + ((1 - seen.y) / 2) * box.height];
}
