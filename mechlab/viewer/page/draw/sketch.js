// A sketch of a planar linkage, in metres: points (pivots), bars between two of them, sliders, gears, a motor; and the model
// document that it stands for. No page here: it also runs in Node.

const GEAR_MODULE = 0.0025, BAR_WIDTH = 0.08, SKETCH_COLORS = [[0.16, 0.42, 0.75, 1], [0.9, 0.55, 0.13, 1], [0.2, 0.58, 0.56, 1], [0.62, 0.35, 0.71, 1], [0.76, 0.27, 0.25, 1]];

function emptySketch() { return { name: "linkage", next: 0, points: [], bars: [], motor: null }; }

/** A point {id, x, y, ground, rail: angle of a slider or null, teeth: of a gear or 0, name}. */
function addPoint(sketch, [x, y], ground) {
  const id = ++sketch.next, letter = (k) => (k < 26 ? String.fromCharCode(65 + k) : `${String.fromCharCode(65 + (k % 26))}${Math.floor(k / 26)}`);
  const taken = sketch.points.map((p) => p.name);
  let k = 0;
  while (taken.includes(letter(k))) k++;
  const point = { id, name: letter(k), x, y, ground, rail: null, teeth: 0 };
  sketch.points.push(point);
  return point;
}

function pointOf(sketch, id) { return sketch.points.find((p) => p.id === id); }

/** A bar between two points; throws one sentence where there can be none. */
function addBar(sketch, a, b) {
  if (a.id === b.id) throw new Error("A bar needs two different ends.");
  if (a.ground && b.ground) throw new Error("Both ends are fixed to the ground; a bar there would do nothing.");
  if (sketch.bars.some((bar) => bar.ends.includes(a.id) && bar.ends.includes(b.id))) throw new Error(`${a.name} and ${b.name} are joined by a bar already.`);
  const bar = { id: ++sketch.next, ends: [a.id, b.id], length: Math.hypot(b.x - a.x, b.y - a.y) };
  sketch.bars.push(bar);
  if (sketch.motor === null && (a.ground || b.ground)) sketch.motor = (a.ground ? a : b).id;
  return bar;
}

function removePoint(sketch, id) {
  sketch.bars = sketch.bars.filter((bar) => !bar.ends.includes(id));
  sketch.points = sketch.points.filter((p) => p.id !== id);
  if (sketch.motor === id) sketch.motor = null;
}

function barName(sketch, bar) { return bar.ends.map((id) => pointOf(sketch, id).name).join(""); }

/** The model document of the sketch, and which body carries each point: {document, carriers: id -> {body, local}, loose: bars that
 * hang on no ground pivot}. The document is null while nothing moves. */
function sketchDocument(sketch) {
  const bodies = [], loops = [], frames = [], ground = { name: GROUND_NAME, x: 0, y: 0, angle: 0, depth: -1 };
  const carriers = new Map(), left = new Set(sketch.bars), queue = [];
  const localIn = (host, p) => { const [c, s] = [Math.cos(host.angle), Math.sin(host.angle)], [x, y] = [p.x - host.x, p.y - host.y]; return [c * x + s * y, c * y - s * x, 0]; };
  const turn = (angle) => [Math.cos(angle / 2), 0, 0, Math.sin(angle / 2)];
  const joint = (name, kind, zero, axis) => ({ name, kind, axis, zero, range: null, damping: 0, armature: 0, friction: 0, stiffness: 0, spring_rest: 0 });
  const attach = (host, p, body) => ({ ...body, parent: host.name, placement: { position: carriers.get(p.id) && carriers.get(p.id).host === host ? carriers.get(p.id).local : localIn(host, p), quaternion: turn(body.angle - host.angle) } });
  const reach = (p, host, local) => { carriers.set(p.id, { host, body: host.name, local }); queue.push(p); };
  const motorFirst = (a, b) => (b.id === sketch.motor ? 1 : 0) - (a.id === sketch.motor ? 1 : 0);
  for (const p of sketch.points.filter((x) => x.ground).sort(motorFirst)) reach(p, ground, [p.x, p.y, 0]);
  const gears = sketch.points.filter((p) => p.teeth > 0), joints = new Map(), gearBodies = new Map();
  const work = () => {
    while (queue.length) {
      const p = queue.shift(), { host } = carriers.get(p.id);
      for (const bar of [...left].filter((x) => x.ends.includes(p.id))) {
        left.delete(bar);
        const q = pointOf(sketch, bar.ends.find((id) => id !== p.id)), angle = Math.atan2(q.y - p.y, q.x - p.x), name = barName(sketch, bar);
        const link = { name, x: p.x, y: p.y, angle, depth: host.depth + 1, bar };
        const made = attach(host, p, { ...link, joints: [joint(`${name}_angle`, "revolute", wrapped(angle - host.angle), [0, 0, 1])] });
        Object.assign(made, barBody(bar, made.depth, bodies.length));
        bodies.push(made);
        if (!joints.has(p.id)) joints.set(p.id, `${name}_angle`);
        if (p.ground && p.teeth && !gearBodies.has(p.id)) { gearBodies.set(p.id, made); made.shapes.push(gearShape(p, made.depth)); }
        const far = [bar.length, 0, 0], known = carriers.get(q.id);
        if (known) loops.push({ name: `pin_${q.name}${loops.length}`, kind: "spherical", body_a: name, body_b: known.body, placement_a: { position: far, quaternion: turn(0) }, placement_b: { position: known.local, quaternion: turn(0) }, length: 0 });
        else reach(q, made, far);
      }
    }
  };
  work();
  for (const p of sketch.points.filter((x) => x.rail !== null && !x.ground)) {
    const slider = { name: `slider_${p.name}`, x: p.x, y: p.y, angle: p.rail, depth: 0 }, known = carriers.get(p.id), size = 0.03;
    const made = attach(ground, p, { ...slider, joints: [joint(`slide_${p.name}`, "prismatic", 0, [1, 0, 0])] });
    made.placement.position = [p.x, p.y, 0];
    Object.assign(made, { inertia: { mass: 0.1, com: [0, 0, 0], tensor: [1.5e-5, 1.5e-5, 1.5e-5, 0, 0, 0] }, shapes: [shapeOf("box", { x: size, y: 0.6 * size, z: 0.4 * size }, [0, 0, 0], [0.38, 0.44, 0.52, 1], made.name)] });
    const used = known || sketch.bars.some((bar) => bar.ends.includes(p.id));
    if (!used) continue;
    bodies.push(made);
    if (known) loops.push({ name: `pin_${p.name}${loops.length}`, kind: "spherical", body_a: known.body, body_b: made.name, placement_a: { position: known.local, quaternion: turn(0) }, placement_b: { position: [0, 0, 0], quaternion: turn(0) }, length: 0 });
    else { reach(p, made, [0, 0, 0]); work(); }
  }
  for (const p of gears) {
    if (gearBodies.has(p.id) || !carriers.has(p.id)) continue;
    const { host } = carriers.get(p.id), made = attach(host, p, { name: `gear_${p.name}`, x: p.x, y: p.y, angle: host.angle, depth: host.depth + 1, joints: [joint(`gear_${p.name}_angle`, "revolute", 0, [0, 0, 1])] });
    const radius = (GEAR_MODULE * p.teeth) / 2, mass = 20 * Math.PI * radius * radius;
    Object.assign(made, { inertia: { mass, com: [0, 0, 0], tensor: [(mass * radius ** 2) / 4, (mass * radius ** 2) / 4, (mass * radius ** 2) / 2, 0, 0, 0] }, shapes: [gearShape(p, made.depth)] });
    gearBodies.set(p.id, made);
    bodies.push(made);
    if (!joints.has(p.id)) joints.set(p.id, made.joints[0].name);
  }
  const relations = gearRelations(gears, gearBodies, carriers, bodies);
  for (const p of sketch.points) if (!p.ground && carriers.has(p.id)) frames.push({ name: p.name, body: carriers.get(p.id).body, placement: { position: carriers.get(p.id).local, quaternion: turn(0) } });
  const driven = joints.get(sketch.motor), drives = driven ? [{ name: "motor", on: driven, stiffness: 200, damping: 2, limit: null, winding: null }] : [];
  const pins = sketch.points.filter((p) => p.ground).map((p) => shapeOf("cylinder", { radius: 0.006, length: 0.02 }, [p.x, p.y, -0.008], [0.28, 0.31, 0.36, 1], `pivot_${p.name}`));
  const plain = depthFirst(bodies).map(({ name, parent, placement, joints: own, inertia, shapes }) => ({ name, parent, placement, joints: own, inertia, shapes }));
  const document = { format: "mechlab.mechanism", schema: 1, name: sketch.name, bodies: plain, loops, relations, shafts: [], springs: [], drives, frames,
    gravity: [0, -9.81, 0], ground_shapes: pins, summary: "a planar linkage, drawn" };
  return { document: plain.length ? document : null, carriers, loose: [...left], gearBodies };
}

/** Parents first, depth-first. */
function depthFirst(bodies) {
  const below = (name) => bodies.filter((body) => body.parent === name).flatMap((body) => [body, ...below(body.name)]);
  return below(GROUND_NAME);
}

/** An angle within half a turn. */
function wrapped(angle) { return Math.atan2(Math.sin(angle), Math.cos(angle)); }

function shapeOf(kind, size, position, color, name) { return { kind, size, placement: { position, quaternion: [1, 0, 0, 0] }, color, name }; }

/** Inertia and shapes of a bar as Builder.bar gives them. */
function barBody(bar, depth, k) {
  const width = BAR_WIDTH * bar.length, layer = 0.004 * depth, ends = [[0, 0, 0], [bar.length, 0, 0]], color = SKETCH_COLORS[k % SKETCH_COLORS.length];
  return { inertia: rodInertia(bar.length, ends, width / 4), shapes: [shapeOf("link", { bore: 0.18 * width, length: bar.length, thickness: 0.4 * width, width }, [0, 0, layer], color, "bar"),
    ...ends.map(([x], i) => shapeOf("cylinder", { length: 0.9 * width, radius: 0.18 * width }, [x, 0, layer], [0.28, 0.31, 0.36, 1], `pin_${i}`))] };
}

function gearShape(p, depth) { return shapeOf("spur_gear", { bore: 0.004, module: GEAR_MODULE, phase: 0, teeth: p.teeth, width: 0.01 }, [0, 0, 0.004 * depth - 0.012], [0.83, 0.68, 0.29, 1], `gear_${p.name}`); }

/** Pairs of gears that touch: their centres as far apart as their teeth need, on one carrier. */
function meshingGears(gears) {
  return gears.flatMap((a, i) => gears.slice(i + 1).map((b) => [a, b])).filter(([a, b]) => Math.abs(Math.hypot(a.x - b.x, a.y - b.y) - (GEAR_MODULE * (a.teeth + b.teeth)) / 2) < 0.1 * GEAR_MODULE);
}

/** z_a (A - C) + z_b (B - C) = 0 for each pair that touches, with the sums over the joints from the ground to gear or carrier. */
function gearRelations(gears, gearBodies, carriers, bodies) {
  const path = (name) => { const body = bodies.find((x) => x.name === name); return body ? [...path(body.parent), ...body.joints.map((j) => j.name)] : []; };
  return meshingGears(gears).flatMap(([a, b]) => {
    const [A, B] = [gearBodies.get(a.id), gearBodies.get(b.id)];
    if (!A || !B) return [];
    // The carrier holds both centres: the ground, or a bar from one to the other.
    const host = a.ground && b.ground ? GROUND_NAME : (bodies.find((x) => x.bar && x.bar.ends.includes(a.id) && x.bar.ends.includes(b.id)) || {}).name;
    if (!host || A === B) return [];
    const sums = new Map();
    const add = (name, z) => { for (const j of path(name)) sums.set(j, (sums.get(j) || 0) + z); };
    add(A.name, a.teeth); add(B.name, b.teeth); add(host, -a.teeth - b.teeth);
    const terms = [...sums].filter(([, z]) => z !== 0), lead = terms.length ? terms[0][1] : 1;
    return terms.length < 2 ? [] : [{ name: `mesh_${a.name}${b.name}`, coefficients: Object.fromEntries(terms.map(([name, z]) => [name, ratioText(z, lead)])), kind: "external" }];
  });
}
