// What can move, and how: from the velocities that each coordinate gives to the bodies.

/** The velocities of all bodies for each coordinate moving alone at unit rate. */
function unitVelocities(model, q) {
  return model.joints.flatMap((joint) => {
    const size = joint.kind === "spherical" ? 3 : 1;
    return Array.from({ length: size }, (_, i) => {
      const v = new Float64Array(model.nv);
      v[joint.v + i] = 1;
      return model.velocities(q, v);
    });
  });
}

/** Indices of the bodies that some coordinate moves. */
function movingBodies(model) {
  const moving = new Set();
  for (const { linear, angular } of unitVelocities(model, model.home))
    for (let k = 0; k < model.bodies.length; k++)
      if (Math.max(...[0, 1, 2].map((i) => Math.max(Math.abs(linear[3 * k + i]), Math.abs(angular[3 * k + i])))) > 1e-12) moving.add(k);
  return moving;
}

/** The normal of the plane in which all bodies of a planar mechanism move; null for a spatial one. */
function planeNormal(model) {
  const at = (values, k) => new THREE.Vector3().fromArray(values, 3 * k);
  const all = unitVelocities(model, model.home);
  const turns = all.flatMap(({ angular }) => model.bodies.map((_, k) => at(angular, k))).filter((w) => w.length() > 1e-9);
  if (!turns.length) return null;
  const normal = turns[0].clone().normalize();
  if (turns.some((w) => w.clone().cross(normal).length() > 1e-9 * w.length())) return null;
  const slides = all.flatMap(({ linear }) => model.bodies.map((_, k) => at(linear, k)));
  return slides.every((u) => Math.abs(u.dot(normal)) <= 1e-9 * Math.max(u.length(), 1e-9)) ? normal : null;
}

/** How far a point (in the body, drawn as `group`) goes by unit rates of all coordinates, root of the sum of squares. */
function mobility(model, q, body, point, group) {
  const arm = point.clone().applyQuaternion(group.quaternion);
  let sum = 0;
  for (const { linear, angular } of unitVelocities(model, q))
    sum += new THREE.Vector3().fromArray(angular, 3 * body).cross(arm).add(new THREE.Vector3().fromArray(linear, 3 * body)).lengthSq();
  return Math.sqrt(sum);
}

/** The middles of the six sides of a box. */
function boxEnds(box) {
  const middle = box.getCenter(new THREE.Vector3());
  return ["x", "y", "z"].flatMap((axis) => [box.min, box.max].map((corner) => { const end = middle.clone(); end[axis] = corner[axis]; return end; }));
}
