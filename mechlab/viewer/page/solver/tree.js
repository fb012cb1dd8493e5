// Kinematics of the tree of bodies, as TreeKinematics in Python: poses, axes and anchors of the rates, velocities.
// Rotations are row-major 3 x 3, body to world.

function dot3(a, at, b) { return a[at] * b[0] + a[at + 1] * b[1] + a[at + 2] * b[2]; }

function product33(a, b, out = new Float64Array(9)) { return product33At(a, 0, b, 0, out, 0); }

function product33At(a, i, b, j, out, k) {
  for (let r = 0; r < 9; r += 3) {
    const x = a[i + r], y = a[i + r + 1], z = a[i + r + 2];
    out[k + r] = x * b[j] + y * b[j + 3] + z * b[j + 6];
    out[k + r + 1] = x * b[j + 1] + y * b[j + 4] + z * b[j + 7];
    out[k + r + 2] = x * b[j + 2] + y * b[j + 5] + z * b[j + 8];
  }
  return out;
}

/** Rotation of the quaternion (w, x, y, z) at q[i], which is normalised first. */
function quaternionMatrix(q, i, out) {
  const w = q[i], x = q[i + 1], y = q[i + 2], z = q[i + 3], s = 2 / (w * w + x * x + y * y + z * z);
  out[0] = 1 - s * (y * y + z * z); out[1] = s * (x * y - w * z); out[2] = s * (x * z + w * y);
  out[3] = s * (x * y + w * z); out[4] = 1 - s * (x * x + z * z); out[5] = s * (y * z - w * x);
  out[6] = s * (x * z - w * y); out[7] = s * (y * z + w * x); out[8] = 1 - s * (x * x + y * y);
  return out;
}

/** Rotation by an angle about a unit axis (Rodrigues). */
function axisMatrix(x, y, z, angle, out) {
  const c = Math.cos(angle), s = Math.sin(angle), k = 1 - c;
  out[0] = c + k * x * x; out[1] = k * x * y - s * z; out[2] = k * x * z + s * y;
  out[3] = k * x * y + s * z; out[4] = c + k * y * y; out[5] = k * y * z - s * x;
  out[6] = k * x * z - s * y; out[7] = k * y * z + s * x; out[8] = c + k * z * z;
  return out;
}

const TURN_WORK = new Float64Array(9), COPY_WORK = new Float64Array(9);

/** out = rotation, then turned by an angle about an axis of its own. */
function turnedAbout(rotation, x, y, z, angle, out) {
  axisMatrix(x, y, z, angle, TURN_WORK);
  COPY_WORK.set(rotation);
  return product33(COPY_WORK, TURN_WORK, out);
}

/** Quaternion x, y, z, w at out[j] of the rotation at r[i] (Shepperd's method). */
function quaternionOf(r, i, out, j) {
  const a = r[i], b = r[i + 4], c = r[i + 8], trace = a + b + c;
  let x, y, z, w;
  if (trace >= a && trace >= b && trace >= c) {
    w = 1 + trace; x = r[i + 7] - r[i + 5]; y = r[i + 2] - r[i + 6]; z = r[i + 3] - r[i + 1];
  } else if (a >= b && a >= c) {
    w = r[i + 7] - r[i + 5]; x = 1 + a - b - c; y = r[i + 3] + r[i + 1]; z = r[i + 6] + r[i + 2];
  } else if (b >= c) {
    w = r[i + 2] - r[i + 6]; x = r[i + 3] + r[i + 1]; y = 1 + b - a - c; z = r[i + 7] + r[i + 5];
  } else {
    w = r[i + 3] - r[i + 1]; x = r[i + 6] + r[i + 2]; y = r[i + 7] + r[i + 5]; z = 1 + c - a - b;
  }
  const n = (w < 0 ? -1 : 1) / Math.sqrt(x * x + y * y + z * z + w * w);
  out[j] = x * n; out[j + 1] = y * n; out[j + 2] = z * n; out[j + 3] = w * n;
}

/** {rotation (9), position (3)} of a placement of the document. */
function placementOf(placement) {
  const quaternion = (placement && placement.quaternion) || [1, 0, 0, 0];
  return {
    rotation: quaternionMatrix(quaternion, 0, new Float64Array(9)),
    position: Float64Array.from((placement && placement.position) || [0, 0, 0]),
  };
}

class Tree {
  constructor(model) {
    const n = model.parts.length;
    this.count = n;
    this.parent = Int32Array.from(model.parts, (body) => model.partIndex(body.parent || GROUND_NAME, `body ${body.name}`));
    this.placements = model.parts.map((body) => placementOf(body.placement));
    this.jointsOf = model.parts.map((_, k) => model.joints.filter((joint) => joint.part === k));
    this.turns = new Uint8Array(model.nv);
    this.columns = [];
    for (let k = 0; k < n; k++) {
      const own = [];
      for (const joint of this.jointsOf[k]) {
        for (let c = 0; c < (joint.kind === "spherical" ? 3 : 1); c++) {
          own.push(joint.v + c);
          this.turns[joint.v + c] = joint.kind === "prismatic" ? 0 : 1;
        }
      }
      this.columns.push(Int32Array.from([...(this.parent[k] < 0 ? [] : this.columns[this.parent[k]]), ...own]));
    }
    this.rotation = new Float64Array(9 * n);
    this.origin = new Float64Array(3 * n);
    this.axes = new Float64Array(3 * model.nv);
    this.anchors = new Float64Array(3 * model.nv);
    this._turn = new Float64Array(9);
    this._here = new Float64Array(9);
    this._point = new Float64Array(3);
  }

  /** Moves to the coordinates q. */
  set(q) {
    this.q = q;
    const { rotation, origin, axes, anchors, _turn: turn, _here: here, _point: p } = this;
    for (let k = 0; k < this.count; k++) {
      const up = this.parent[k], placement = this.placements[k];
      if (up < 0) {
        here.set(placement.rotation);
        p.set(placement.position);
      } else {
        product33At(rotation, 9 * up, placement.rotation, 0, here, 0);
        for (let a = 0; a < 3; a++) p[a] = origin[3 * up + a] + dot3(rotation, 9 * up + 3 * a, placement.position);
      }
      for (const joint of this.jointsOf[k]) {
        const at = 3 * joint.v;
        if (joint.kind === "spherical") {
          turn.set(here);
          product33(turn, quaternionMatrix(q, joint.q, TURN_WORK), here);
          for (let c = 0; c < 3; c++) for (let a = 0; a < 3; a++) {
            axes[at + 3 * c + a] = here[3 * a + c];
            anchors[at + 3 * c + a] = p[a];
          }
          continue;
        }
        for (let a = 0; a < 3; a++) axes[at + a] = dot3(here, 3 * a, joint.axis);
        if (joint.kind === "prismatic") for (let a = 0; a < 3; a++) p[a] += axes[at + a] * q[joint.q];
        for (let a = 0; a < 3; a++) anchors[at + a] = p[a];
        if (joint.kind === "revolute") {
          turn.set(here);
          product33(turn, axisMatrix(joint.axis[0], joint.axis[1], joint.axis[2], q[joint.q], TURN_WORK), here);
        }
      }
      rotation.set(here, 9 * k);
      origin.set(p, 3 * k);
    }
    return this;
  }

  /** {rotation, origin} of a frame placed in a body (-1: the ground); new arrays. */
  placed(k, placement) {
    const rotation = new Float64Array(9), origin = new Float64Array(3);
    this.frame(k, placement, rotation, 0, origin, 0);
    return { rotation, origin };
  }

  /** The same into rotation[i], origin[j]. */
  frame(k, placement, rotation, i, origin, j) {
    if (k < 0) {
      rotation.set(placement.rotation, i);
      origin.set(placement.position, j);
      return;
    }
    product33At(this.rotation, 9 * k, placement.rotation, 0, rotation, i);
    for (let a = 0; a < 3; a++) origin[j + a] = this.origin[3 * k + a] + dot3(this.rotation, 9 * k + 3 * a, placement.position);
  }

  /** Velocity of the world point p[i] of a body for a unit of the rate c, into out[j]. */
  lever(c, p, i, out, j) {
    const { axes, anchors } = this, at = 3 * c;
    const ax = axes[at], ay = axes[at + 1], az = axes[at + 2];
    if (!this.turns[c]) {
      out[j] = ax; out[j + 1] = ay; out[j + 2] = az;
      return;
    }
    const rx = p[i] - anchors[at], ry = p[i + 1] - anchors[at + 1], rz = p[i + 2] - anchors[at + 2];
    out[j] = ay * rz - az * ry; out[j + 1] = az * rx - ax * rz; out[j + 2] = ax * ry - ay * rx;
  }

  /** Velocity of the world point p[i] of the body k and its angular velocity at rates v, into linear[j], angular[j]. */
  velocity(k, p, i, v, linear, angular, j) {
    linear.fill(0, j, j + 3);
    angular.fill(0, j, j + 3);
    if (k < 0) return;
    for (const c of this.columns[k]) {
      this.lever(c, p, i, this._point, 0);
      for (let a = 0; a < 3; a++) {
        linear[j + a] += v[c] * this._point[a];
        if (this.turns[c]) angular[j + a] += v[c] * this.axes[3 * c + a];
      }
    }
  }
}
