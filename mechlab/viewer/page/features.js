// What a surface is where it is picked: a plane, a cylinder with its axis, or only a point. A surface ends at its sharp edges.

const FLAT = 2e-3;   // sine of the angle between normals of one plane
const ROUND = 2e-2;  // of the radius: deviation of the corners of a cylinder
const LARGE = 0.3;   // of the extent of a surface: a level part of it that counts as a face

/** The faces of one smooth surface around face `start`: vertex indices are shared inside of it and split at sharp edges. `fits(face)`
 * says which faces may belong to it. */
function smoothPatch(index, start, fits = () => true) {
  const byVertex = new Map();
  for (let f = 0; f < index.length / 3; f++) {
    for (let k = 0; k < 3; k++) { const v = index[3 * f + k]; if (byVertex.has(v)) byVertex.get(v).push(f); else byVertex.set(v, [f]); }
  }
  const found = new Set([start]), waiting = [start];
  while (waiting.length) {
    const f = waiting.pop();
    for (let k = 0; k < 3; k++) for (const other of byVertex.get(index[3 * f + k])) if (!found.has(other) && fits(other)) { found.add(other); waiting.push(other); }
  }
  return [...found];
}

/** The surface of a mesh {positions, index} around a face: {kind: "face", point, direction}, {kind: "axis", point, direction, radius,
 * hole} or {kind: "point"}, in the axes of the mesh. `at`: the place that was picked. */
function surfaceAround(positions, index, start, at) {
  const corner = (v) => [positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]];
  const corners = (f) => [0, 1, 2].map((k) => corner(index[3 * f + k]));
  const normal = (f) => { const [a, b, c] = corners(f); return unit3(cross3(minus3(b, a), minus3(c, a))); };
  const own = normal(start);
  const patch = smoothPatch(index, start);
  const normals = patch.map(normal);
  const flat = (n) => length3(cross3(own, n)) < FLAT;
  if (normals.every(flat)) return { kind: "face", point: at, direction: own };
  const cylinder = fitCylinder(patch, normals, corners);
  if (cylinder) {
    const middle = along3(cylinder.point, cylinder.direction, inner3(minus3(at, cylinder.point), cylinder.direction));
    return { kind: "axis", ...cylinder, point: middle, hole: inner3(minus3(corners(start)[0], middle), own) < 0 };
  }
  const level = smoothPatch(index, start, (f) => flat(normal(f)));
  // The facets of a bent surface are small.
  return spread(level.flatMap(corners)) > LARGE * spread(patch.flatMap(corners)) ? { kind: "face", point: at, direction: own } : { kind: "point", point: at };
}

/** The diagonal of the box around points. */
function spread(points) {
  return Math.hypot(...[0, 1, 2].map((k) => { let low = Infinity, high = -Infinity; for (const p of points) { low = Math.min(low, p[k]); high = Math.max(high, p[k]); } return high - low; }));
}

/** The cylinder {point, direction, radius} on which all corners of faces lie, or null. */
function fitCylinder(faces, normals, corners) {
  const [first] = normals;
  let direction = null, most = 0.05;
  for (const n of normals) { const turned = cross3(first, n), size = Math.hypot(...turned); if (size > most) { most = size; direction = turned; } }
  if (!direction) return null;
  direction = unit3(direction);
  if (normals.some((n) => Math.abs(inner3(n, direction)) > 0.02)) return null;
  const u = unit3(cross3(direction, Math.abs(direction[0]) < 0.7 ? [1, 0, 0] : [0, 1, 0])), w = cross3(direction, u);
  const points = faces.flatMap(corners);
  const [origin] = points;
  const flat = points.map((p) => { const r = minus3(p, origin); return [inner3(r, u), inner3(r, w)]; });
  // Circle x^2 + y^2 = 2 a x + 2 b y + c, least squares about the mean (Kasa 1976).
  const mean = [0, 1].map((k) => flat.reduce((s, p) => s + p[k], 0) / flat.length);
  let xx = 0, xy = 0, yy = 0, xr = 0, yr = 0;
  for (const [px, py] of flat) {
    const x = px - mean[0], y = py - mean[1], r = x * x + y * y;
    xx += x * x; xy += x * y; yy += y * y; xr += x * r; yr += y * r;
  }
  const det = xx * yy - xy * xy;
  if (det < 1e-9 * (xx + yy) ** 2) return null;
  const a = mean[0] + (xr * yy - yr * xy) / (2 * det), b = mean[1] + (yr * xx - xr * xy) / (2 * det);
  const radii = flat.map(([x, y]) => Math.hypot(x - a, y - b));
  const radius = radii.reduce((s, r) => s + r, 0) / radii.length;
  if (radii.some((r) => Math.abs(r - radius) > ROUND * radius)) return null;
  return { point: along3(along3(origin, u, a), w, b), direction, radius };
}
