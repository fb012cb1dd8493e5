// Forces on the parts of a mechanism with one freedom while its drive moves steadily: inverse dynamics in the page.
//
// Rates and accelerations are differences of five closed poses around the one that is shown (error of the order h^4). The
// reactions are the smallest ones that balance the motion where rows are redundant, as in Python. Springs, dampers, rotors
// and armatures count; dry friction does not.

const STENCIL_STEP = 2e-3;   // of the drive, in rad or sizes of the mechanism
const FIRST = [1 / 12, -8 / 12, 0, 8 / 12, -1 / 12];
const SECOND = [-1 / 12, 16 / 12, -30 / 12, 16 / 12, -1 / 12];
const NOTHING = 1e-9;        // N, N m

class SteadyForces {
  constructor(model) {
    this.model = model;
    const { document } = model;
    this.gravity = document.gravity || [0, 0, -9.81];
    this.massive = model.parts.some((body) => body.inertia && body.inertia.mass > 0);
  }

  /** Loads at the pose of `solver` with the drive `name` at the constant `rate`: [{name, kind, unit, on, by, point, vector}],
   * on, by: names of bodies ("" for a weight); null where they have no bound. */
  at(solver, name, rate) {
    const poses = this.around(solver, name, rate);
    if (!poses) return null;
    const { q, v, a, bodies } = this.motion(poses, rate);
    const { model } = this, n = model.parts.length;
    const levers = unitVelocities(model, q);
    const springs = this.springs(q, v, bodies);
    const needed = new Float64Array(model.nv);
    levers.forEach(({ linear, angular }, c) => {
      for (let k = 0; k < n; k++) {
        const { centre, force, moment } = bodies[k];
        const turn = at3(angular, k), arm = minus3(centre, bodies[k].origin);
        needed[c] += inner3(force, plus3(at3(linear, k), cross3(turn, arm))) + inner3(moment, turn);
      }
      for (const { a: one, b: other, force, ends } of springs)
        for (const [k, sign, point] of [[one, 1, ends[0]], [other, -1, ends[1]]])
          if (model.parts[k]) needed[c] += sign * inner3(force, plus3(at3(linear, k), cross3(at3(angular, k), minus3(point, bodies[k].origin))));
    });
    this.addRotors(q, v, a, needed);
    const { jacobian, names } = model.constraints(q);
    const found = leastReactions(jacobian, names.length, model.row(name), needed);
    return found && this.loads(q, name, bodies, springs, found).filter((load) => length3(load.vector) > NOTHING);
  }

  /** Coordinates at five values of the drive; null at a fold. */
  around(solver, name, rate) {
    const { model } = this, here = model.value(name, solver.q);
    const step = STENCIL_STEP * (model.quantity(name).slides ? model.size : 1) * (rate < 0 ? -1 : 1);
    const poses = [];
    for (const way of [-1, 1]) {
      const walker = solver.copy();
      for (const k of [1, 2]) {
        const report = walker.solve({ drives: { [name]: here + way * k * step }, locked: [], grab: null });
        if (!report.closed || Math.abs(model.value(name, walker.q) - here - way * k * step) > 1e-9) return null;
        poses[2 + way * k] = walker.q.slice();
      }
    }
    poses[2] = solver.q.slice();
    return { poses, step };
  }

  /** Rates, accelerations and, for each part, the force and the moment about its centre of mass that move it against its weight. */
  motion({ poses, step }, rate) {
    const { model } = this, [one, two] = [Math.abs(rate) / Math.abs(step), (rate / step) ** 2];
    const q = poses[2], v = new Float64Array(model.nv), a = new Float64Array(model.nv);
    for (const joint of model.joints) {
      const size = joint.kind === "spherical" ? 4 : 1;
      const of = (weights, factor) => Array.from({ length: size }, (_, i) => factor * poses.reduce((sum, p, k) => sum + weights[k] * p[joint.q + i], 0));
      const [rates, changes] = [of(FIRST, one), of(SECOND, two)];
      if (size === 1) { v[joint.v] = rates[0]; a[joint.v] = changes[0]; continue; }
      v.set(bodyRates(q, joint.q, rates), joint.v);
      a.set(bodyRates(q, joint.q, changes), joint.v);
    }
    const placed = poses.map((p) => model.poses(p));
    const bodies = model.parts.map((body, k) => this.bodyMotion(body, placed, k, one, two));
    return { q, v, a, bodies };
  }

  bodyMotion(body, placed, k, one, two) {
    const rotations = placed.map(({ quaternion }) => rotationOf(quaternion, 4 * k));
    const origins = placed.map(({ position }) => at3(position, k));
    const { mass = 0, com = [0, 0, 0], tensor = [0, 0, 0, 0, 0, 0] } = body.inertia || {};
    const centres = origins.map((p, i) => plus3(p, times33(rotations[i], com)));
    const sum = (weights, factor, items) => items[0].map((_, j) => factor * items.reduce((s, item, i) => s + weights[i] * item[j], 0));
    const rotation = rotations[2];
    const spin = skewPart(timesTransposed33(sum(FIRST, one, rotations), rotation));
    const turning = skewPart(timesTransposed33(sum(SECOND, two, rotations), rotation));
    const force = minus3(sum(SECOND, two, centres), this.gravity).map((x) => mass * x);
    const inertia = (w) => times33(rotation, timesTensor(tensor, timesBack33(rotation, w)));
    return { mass, rotation, origin: origins[2], centre: centres[2], force, moment: plus3(inertia(turning), cross3(spin, inertia(spin))) };
  }

  /** Ends of the springs between points, and the force on their first body. */
  springs(q, v, bodies) {
    const { model } = this;
    if (!(model.document.springs || []).length) return [];
    const { linear, angular } = model.velocities(q, v);
    return model.document.springs.map((spring) => {
      const [a, b] = [spring.body_a, spring.body_b].map((body) => model.partIndex(body, `spring ${spring.name}`));
      const end = (k, point) => (model.parts[k] ? plus3(bodies[k].origin, times33(bodies[k].rotation, point)) : [...point]);
      const speed = (k, point) => (!model.parts[k] ? [0, 0, 0] : plus3(at3(linear, k), cross3(at3(angular, k), minus3(point, bodies[k].origin))));
      const ends = [end(a, spring.point_a), end(b, spring.point_b)];
      const line = minus3(ends[1], ends[0]), length = length3(line);
      if (length < 1e-12) return { a, b, ends, force: [0, 0, 0] };
      const along = line.map((x) => x / length);
      const rate = inner3(along, minus3(speed(b, ends[1]), speed(a, ends[0])));
      const tension = (spring.stiffness || 0) * (length - (spring.rest_length || 0)) + (spring.damping || 0) * rate;
      // `needed` counts what the drive must give: the pull on a is against it.
      return { a, b, ends, force: along.map((x) => -tension * x) };
    });
  }

  /** Inertia of shafts and armatures, dampers and springs of joints and shafts. */
  addRotors(q, v, a, needed) {
    const { model } = this;
    const add = (item, row, value, inertia) => {
      const along = (rates) => row.reduce((sum, c, k) => sum + c * rates[k], 0);
      const load = inertia * along(a) + (item.damping || 0) * along(v) + (item.stiffness ? item.stiffness * (value - (item.spring_rest || 0)) : 0);
      if (load) row.forEach((c, k) => { needed[k] += c * load; });
    };
    for (const body of model.parts) for (const joint of body.joints || []) {
      if (joint.kind !== "spherical") { add(joint, model.row(joint.name), model.value(joint.name, q), joint.armature || 0); continue; }
      const at = model.jointNamed.get(joint.name).v;
      for (let k = at; k < at + 3; k++) needed[k] += (joint.armature || 0) * a[k] + (joint.damping || 0) * v[k];
    }
    for (const shaft of model.document.shafts || []) add(shaft, model.row(shaft.name), model.value(shaft.name, q), shaft.inertia || 0);
  }

  /** What all forces on a part make together: m a at its centre of mass, the rate of its spin; and the inertia that balances them. */
  effects({ mass, centre, force, moment }, name) {
    const net = plus3(force, this.gravity.map((g) => mass * g));
    const effect = (words, role, kind, vector) => ({ name: `${words} of ${name}`, role, kind, unit: kind === "force" ? "N" : "N m", on: name, by: "", point: centre, vector });
    return [effect("net force m\u00b7a", "net", "force", net), effect("net torque", "net", "torque", moment),
      effect("inertia \u2212m\u00b7a", "inertia", "force", net.map((x) => -x)), effect("inertia torque", "inertia", "torque", moment.map((x) => -x))];
  }

  loads(q, name, bodies, springs, { reactions, drive }) {
    const { model } = this, tree = model.tree.set(q), ground = (k) => (model.parts[k] ? model.parts[k].name : "ground");
    const through = bodies.map(({ force }) => [...force]);
    const add = (k, force, sign) => { if (through[k]) through[k] = through[k].map((x, i) => x - sign * force[i]); };
    const out = [];
    let row = 0;
    model.document.loops && model.closure.loops.forEach((loop, i) => {
      const { rotation } = tree.placed(loop.a, loop.placementA), first = tree.placed(loop.a, loop.placementA).origin;
      const point = [...tree.placed(loop.b, loop.placementB).origin];
      let force = [0, 0, 0];
      if (loop.length) force = minus3(point, [...first]).map((x) => (x * reactions[row++]) / loop.length);
      for (const u of loop.offsets) { force = force.map((x, k) => x + reactions[row] * rotation[u + 3 * k]); row++; }
      row += loop.angles.length;
      add(loop.b, force, 1);
      add(loop.a, force, -1);
      out.push({ name: model.document.loops[i].name, kind: "force", unit: "N", on: ground(loop.b), by: ground(loop.a), point, vector: force });
    });
    for (const { a, b, force } of springs) { add(a, force, -1); add(b, force, 1); }
    for (let k = through.length - 1; k >= 0; k--) add(tree.parent[k], through[k], -1);
    model.parts.forEach((body, k) => {
      const joint = (body.joints || [])[(body.joints || []).length - 1];
      if (joint) out.push({ name: joint.name, tree: true, kind: "force", unit: "N", on: body.name, by: ground(tree.parent[k]), point: at3(tree.anchors, model.jointNamed.get(joint.name).v), vector: through[k] });
    });
    bodies.forEach(({ mass, centre }, k) => out.push({ name: `weight of ${model.parts[k].name}`, kind: "force", unit: "N", on: model.parts[k].name, by: "", point: centre, vector: this.gravity.map((g) => mass * g) }));
    bodies.forEach((body, k) => out.push(...this.effects(body, model.parts[k].name)));
    const joint = model.jointNamed.get(name);
    if (joint) {
      const slides = joint.kind === "prismatic";
      out.push({ name: `${name} (drive)`, kind: slides ? "force" : "torque", unit: slides ? "N" : "N m", on: joint.body, by: ground(tree.parent[joint.part]),
        point: at3(tree.anchors, joint.v), vector: at3(tree.axes, joint.v).map((x) => x * drive) });
    }
    return out;
  }
}

/** The least x with A^T x = needed, A the rows of the closure and the drive: x = A y, (A^T A) y = needed. Null at a singularity. */
function leastReactions(jacobian, count, driveRow, needed) {
  const n = needed.length, rows = [...Array.from({ length: count }, (_, i) => jacobian.subarray(i * n, (i + 1) * n)), driveRow];
  const square = new Float64Array(n * n);
  for (const row of rows) for (let i = 0; i < n; i++) if (row[i]) for (let j = 0; j <= i; j++) square[i * n + j] += row[i] * row[j];
  const most = Math.max(...Array.from({ length: n }, (_, i) => square[i * n + i]));
  for (let i = 0; i < n; i++) {
    for (let j = 0; j <= i; j++) {
      let sum = square[i * n + j];
      for (let k = 0; k < j; k++) sum -= square[i * n + k] * square[j * n + k];
      if (i > j) square[i * n + j] = sum / square[j * n + j];
      else if (sum > 1e-14 * most) square[i * n + i] = Math.sqrt(sum);
      else return null;
    }
  }
  const y = Float64Array.from(needed);
  for (let i = 0; i < n; i++) { for (let k = 0; k < i; k++) y[i] -= square[i * n + k] * y[k]; y[i] /= square[i * n + i]; }
  for (let i = n - 1; i >= 0; i--) { for (let k = i + 1; k < n; k++) y[i] -= square[k * n + i] * y[k]; y[i] /= square[i * n + i]; }
  const found = rows.map((row) => row.reduce((sum, x, k) => sum + x * y[k], 0));
  return { reactions: found.slice(0, count), drive: found[count] };
}

/** 2 vec(conj(q) p): rates in the body of a unit quaternion (w, x, y, z) at q[i] with derivative p. */
function bodyRates(q, i, p) {
  const w = q[i], u = [q[i + 1], q[i + 2], q[i + 3]], d = p.slice(1), turned = cross3(u, d);
  return [0, 1, 2].map((k) => 2 * (w * d[k] - p[0] * u[k] - turned[k]));
}
