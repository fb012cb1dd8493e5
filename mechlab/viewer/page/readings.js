// What can be read off a body: its pose and velocity as shown, and what the model says about it.

class Readings {
  /** `velocity(body)` gives {linear, angular} of its origin, world axes, or null where there is no motion. */
  constructor(story, stage, sources) {
    this.stage = stage;
    this.sources = sources;
    this.read(story.model || null);
  }

  /** Takes over what another model document says. */
  read(document) {
    this.model = document;
    this.byName = new Map((document ? document.bodies : []).map((b) => [b.name, b]));
  }

  /** Everything that is known of a body (index): numbers in SI, quaternion x y z w. */
  of(body) {
    const name = this.stage.bodies[body];
    const group = this.stage.groups[body];
    const known = this.byName.get(name);
    return {
      name,
      position: group.position.toArray(),
      quaternion: group.quaternion.toArray(),
      velocity: this.sources.velocity(body),
      inertia: known && known.inertia.mass > 0 ? known.inertia : null,
      joints: known ? known.joints.map((joint) => this.joint(known, joint)) : [],
      loops: this.loops(name),
    };
  }

  joint(body, joint) {
    const prismatic = joint.kind === "prismatic";
    const recorded = this.sources.value(joint.name);
    const value = recorded !== null ? recorded : body.joints.length === 1 ? this.fromPoses(body, joint) : null;
    return { name: joint.name, kind: joint.kind, parent: body.parent, unit: prismatic ? "m" : "rad", value, range: joint.range || null };
  }

  /** The value of the only joint of a body from the poses that are shown; an angle within half a turn of the reference pose, of
   * a ball joint that from the identity. */
  fromPoses(body, joint) {
    const parent = this.stage.bodies.indexOf(body.parent), child = this.stage.bodies.indexOf(body.name);
    if (parent < 0 || child < 0) return null;
    const [w, x, y, z] = body.placement.quaternion;
    const base = new THREE.Matrix4().compose(this.stage.groups[parent].position, this.stage.groups[parent].quaternion, new THREE.Vector3(1, 1, 1))
      .multiply(new THREE.Matrix4().compose(new THREE.Vector3(...body.placement.position), new THREE.Quaternion(x, y, z, w), new THREE.Vector3(1, 1, 1)));
    const relative = base.invert().multiply(new THREE.Matrix4().compose(this.stage.groups[child].position, this.stage.groups[child].quaternion, new THREE.Vector3(1, 1, 1)));
    const shift = new THREE.Vector3(), turn = new THREE.Quaternion(), axis = new THREE.Vector3(...joint.axis);
    relative.decompose(shift, turn, new THREE.Vector3());
    if (joint.kind === "spherical") return 2 * Math.acos(Math.min(1, Math.abs(turn.w)));
    if (joint.kind === "prismatic") return joint.zero + shift.dot(axis);
    const half = Math.atan2(new THREE.Vector3(turn.x, turn.y, turn.z).dot(axis), turn.w);
    return joint.zero + 2 * (Math.abs(half) > Math.PI / 2 ? half - Math.sign(half) * Math.PI : half);
  }

  loops(name) {
    if (!this.model) return [];
    return this.model.loops.filter((x) => x.body_a === name || x.body_b === name)
      .map((x) => ({ name: x.name, kind: x.kind, other: x.body_a === name ? x.body_b : x.body_a }));
  }
}

/** Velocities {linear, angular} of body `k` of `count` at `time`: differences of the poses around it, close by where they come from
 * coordinates and their rates, else over a frame. */
function velocityFromMotion(motion, k, count, time) {
  const frame = motion.frame(time), last = motion.times.length - 1;
  if (last < 1) return null;
  const step = (motion.times[Math.min(last, frame + 1)] - motion.times[Math.min(last, frame + 1) - 1]) * (motion.knots ? 1e-3 : 1);
  // A parabola through three times; at an end all three lie inside.
  const middle = Math.min(motion.end - step, Math.max(motion.start + step, time));
  const at = (t) => {
    const groups = Array.from({ length: count }, () => ({ position: new THREE.Vector3(), quaternion: new THREE.Quaternion() }));
    motion.apply(groups, Math.min(motion.end, Math.max(motion.start, t)));
    return groups[k];
  };
  const [a, b, c] = [middle - step, middle, middle + step].map(at);
  const s = (time - middle) / step;
  const weights = [s - 0.5, -2 * s, s + 0.5].map((w) => w / step);
  const linear = new THREE.Vector3().addScaledVector(a.position, weights[0]).addScaledVector(b.position, weights[1]).addScaledVector(c.position, weights[2]);
  const turn = (from, to) => {
    const q = to.quaternion.clone().multiply(from.quaternion.clone().invert());
    if (q.w < 0) q.set(-q.x, -q.y, -q.z, -q.w);
    const sine = Math.hypot(q.x, q.y, q.z);
    return new THREE.Vector3(q.x, q.y, q.z).multiplyScalar(sine > 1e-12 ? (2 * Math.atan2(sine, q.w)) / sine : 2);
  };
  const [before, after] = [turn(a, b), turn(b, c)];
  const angular = before.multiplyScalar((0.5 - s) / step).addScaledVector(after, (0.5 + s) / step);
  return { linear: linear.toArray(), angular: angular.toArray() };
}
