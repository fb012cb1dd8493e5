// What sits at a point of a part moves along with it: joints of other parts, loop ends, frames, springs, pins, ends of links.

/** Moves what part `name` has at the point `from` (in the part, [m]) by `by`. normal: of the plane of a planar mechanism in the axes
 * of the part: what lies above or below the point moves along too. Returns the names of the parts whose mass does not follow. */
function moveAttached(document, name, from, by, normal, size) {
  const here = (point) => length3(across(minus3(point, from), normal)) < 1e-9 * size;
  const move = (holder, key = "position") => { if (here(holder[key])) holder[key] = plus3(holder[key], by); };
  for (const body of document.bodies) if ((body.parent || GROUND_NAME) === name) move(body.placement);
  for (const loop of document.loops || []) {
    if (loop.body_a === name) move(loop.placement_a);
    if (loop.body_b === name) move(loop.placement_b);
  }
  for (const frame of document.frames || []) if ((frame.body || GROUND_NAME) === name) move(frame.placement);
  for (const shaft of document.shafts || []) if ((shaft.body || GROUND_NAME) === name && (shaft.shapes || []).length) move(shaft.placement);
  for (const spring of document.springs || []) {
    if (spring.body_a === name) move(spring, "point_a");
    if (spring.body_b === name) move(spring, "point_b");
  }
  const body = document.bodies.find((x) => x.name === name);
  const bar = body && barOf(body, normal);
  const shapes = body ? body.shapes || [] : document.ground_shapes || [];
  for (const shape of shapes) moveShape(shape, here, by);
  if (bar) remakeBar(body, bar);
  return body && !bar && body.inertia && body.inertia.mass > 0 && length3(by) > 0 ? [name] : [];
}

const TWO_ENDED = ["link", "arm"];

/** Ends of a bar, or pins of a plate, in the part; the place of any other shape. */
function shapePoints(shape) {
  const { rotation, position } = placementOf(shape.placement), at = (x, y) => plus3([...position], times33(rotation, [x, y, 0]));
  if (TWO_ENDED.includes(shape.kind)) return [at(0, 0), at(shape.size.length, 0)];
  if (shape.kind !== "plate_link") return [[...position]];
  return Array.from({ length: shape.size.points }, (_, k) => at(shape.size[`x_${k + 1}`], shape.size[`y_${k + 1}`]));
}

function moveShape(shape, here, by) {
  const points = shapePoints(shape), moved = points.map((p) => (here(p) ? plus3(p, by) : p));
  if (moved.every((p, k) => p === points[k])) return;
  const { rotation } = placementOf(shape.placement);
  if (TWO_ENDED.includes(shape.kind)) {
    const along = minus3(moved[1], moved[0]), x = times33(rotation, [1, 0, 0]), z = times33(rotation, [0, 0, 1]);
    shape.size.length = length3(along);
    const turn = length3(cross3(x, along)) < 1e-15 * length3(along) && inner3(x, along) > 0 ? null : rotationBy(times(angleBetween(x, along, z), z));
    shape.placement = { position: moved[0], quaternion: turn ? quaternionList(multiplied(turn, rotation)) : shape.placement.quaternion };
  } else if (shape.kind === "plate_link") {
    moved.forEach((p, k) => {
      const [x, y] = timesBack33(rotation, minus3(p, shape.placement.position));
      shape.size[`x_${k + 1}`] = x;
      shape.size[`y_${k + 1}`] = y;
    });
  } else shape.placement = { ...shape.placement, position: moved[0] };
}

/** A body with the mass of a uniform bar along its link, as Builder.bar gives it: {link, ends (in the plane of the joint), mass,
 * width: null where the width is not 8 % of the length, perMetre}; null for any other. */
function barOf(body, normal) {
  const link = (body.shapes || []).find((shape) => shape.kind === "link"), { mass, com, tensor } = body.inertia || {};
  if (!link || !(mass > 0)) return null;
  const ends = barEnds(link, normal), length = length3(minus3(ends[1], ends[0]));
  const like = rodInertia(mass, ends, barRadius(mass, ends, tensor));
  const close = (a, b, unit) => a.every((x, i) => Math.abs(x - b[i]) <= 1e-9 * unit);
  if (!close(com, like.com, length) || !close(tensor, like.tensor, mass * length * length)) return null;
  const { width } = link.size;
  return { link, normal, mass, perMetre: Math.abs(mass - length) < 1e-9 * length, usual: Math.abs(width - 0.08 * length) < 1e-9 * length, radius: barRadius(mass, ends, tensor) };
}

function barEnds(link, normal) {
  const ends = shapePoints(link), lift = normal ? times(inner3(ends[0], normal), normal) : [0, 0, 0];
  return ends.map((p) => minus3(p, lift));
}

/** The radius of a bar with this spin inertia m r^2 / 2 about its length. */
function barRadius(mass, ends, tensor) {
  const d = minus3(ends[1], ends[0]), [x, y, z] = times(1 / length3(d), d), [xx, yy, zz, xy, xz, yz] = tensor;
  return Math.sqrt(Math.max(0, (2 * (x * x * xx + y * y * yy + z * z * zz + 2 * (x * y * xy + x * z * xz + y * z * yz))) / mass));
}

/** Inertia of a uniform round rod between two points, as Inertia.rod. */
function rodInertia(mass, [a, b], radius) {
  const d = minus3(b, a), length = length3(d), [x, y, z] = times(1 / length, d);
  const cross = mass * (length ** 2 / 12 + radius ** 2 / 4), more = (mass * radius ** 2) / 2 - cross;
  return { mass, com: times(0.5, plus3(a, b)), tensor: [cross + more * x * x, cross + more * y * y, cross + more * z * z, more * x * y, more * x * z, more * y * z] };
}

function remakeBar(body, { link, normal, mass, perMetre, usual, radius }) {
  const ends = barEnds(link, normal), length = length3(minus3(ends[1], ends[0]));
  if (usual) {
    const width = 0.08 * length;
    Object.assign(link.size, { width, thickness: 0.4 * width, ...("bore" in link.size ? { bore: 0.18 * width } : {}) });
    for (const shape of body.shapes) if (shape.kind === "cylinder" && /^pin_\d+$/.test(shape.name)) Object.assign(shape.size, { radius: 0.18 * width, length: 0.9 * width });
    radius = width / 4;
  }
  body.inertia = rodInertia(perMetre ? length : mass, ends, radius);
}
