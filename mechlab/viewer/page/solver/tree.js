// Kinematics of the tree of bodies, as TreeKinematics in Python: poses, axes and anchors of the rates, velocities.
// Rotations are row-major 3 x 3, body to world.

function dot3(a, at, b) { return a[at] * b[0] + a[at + 1] * b[1] + a[at + 2] * b[2]; }

/** out = a[i] b, matrices 3 x 3; out may be a. */
function product33(a, i, b, out) {
  for (let r = 0; r < 9; r += 3) {
    const x = a[i + r], y = a[i + r + 1], z = a[i + r + 2];
    for (let c = 0; c < 3; c++) out[r + c] = x * b[c] + y * b[c + 3] + z * b[c + 6];
  }
}

function write33(out, a, b, c, d, e, f, g, h, i) {
  out[0] = a; out[1] = b; out[2] = c; out[3] = d; out[4] = e; out[5] = f; out[6] = g; out[7] = h; out[8] = i;
  return out;
}

/** Rotation of the quaternion (w, x, y, z) at q[i], which is normalized first. */
function quaternionMatrix(q, i, out) {
  const w = q[i], x = q[i + 1], y = q[i + 2], z = q[i + 3], s = 2 / (w * w + x * x + y * y + z * z);
  return write33(out, 1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y), s * (x * y + w * z),
    1 - s * (x * x + z * z), s * (y * z - w * x), s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y));
}

const WORK33 = new Float64Array(9);

/** Turns a rotation by an angle about a unit axis of its own (Rodrigues). */
function turnedAbout(rotation, [x, y, z], angle) {
  const c = Math.cos(angle), s = Math.sin(angle), k = 1 - c;
  write33(WORK33, c + k * x * x, k * x * y - s * z, k * x * z + s * y, k * x * y + s * z, c + k * y * y, k * y * z - s * x,
    k * x * z - s * y, k * y * z + s * x, c + k * z * z);
  product33(rotation, 0, WORK33, rotation);
}

/** Quaternion x, y, z, w at out[at] of the rotation at r[i] (Shepperd's method). */
function quaternionOf(r, i, out, at) {
  const trace = r[i] + r[i + 4] + r[i + 8], largest = Math.max(trace, r[i], r[i + 4], r[i + 8]);
  if (trace === largest) {
    out[at] = r[i + 7] - r[i + 5]; out[at + 1] = r[i + 2] - r[i + 6]; out[at + 2] = r[i + 3] - r[i + 1]; out[at + 3] = 1 + trace;
  } else {
    const a = r[i] === largest ? 0 : r[i + 4] === largest ? 1 : 2, b = (a + 1) % 3, c = (a + 2) % 3;
    out[at + a] = 1 + 2 * largest - trace;
    out[at + b] = r[i + 3 * b + a] + r[i + 3 * a + b];
    out[at + c] = r[i + 3 * c + a] + r[i + 3 * a + c];
    out[at + 3] = r[i + 3 * c + b] - r[i + 3 * b + c];
  }
  const n = (out[at + 3] < 0 ? -1 : 1) / Math.hypot(out[at], out[at + 1], out[at + 2], out[at + 3]);
  for (let k = at; k < at + 4; k++) out[k] *= n;
}

function placementOf(placement) {
  const { quaternion, position } = placement || {};
  return {
    rotation: quaternionMatrix(quaternion || [1, 0, 0, 0], 0, new Float64Array(9)),
    position: Float64Array.from(position || [0, 0, 0]),
  };
}

class Tree {
  constructor(model) {
    const n = model.parts.length;
    this.count = n;
    this.parent = Int32Array.from(model.parts, (body) => model.partIndex(body.parent));
    this.placements = model.parts.map((body) => placementOf(body.placement));
    this.jointsOf = model.parts.map((_, k) => model.joints.filter((joint) => joint.part === k));
    this.turns = new Uint8Array(model.nv);
    this.columns = []; // of each body: the rates that move it
    this.columns[n] = [];
    for (let k = 0; k < n; k++) {
      this.columns[k] = [...this.columns[this.parent[k]]];
      for (const { kind, v, rates } of this.jointsOf[k]) for (let c = v; c < v + rates; c++) {
        this.columns[k].push(c);
        this.turns[c] = kind === "prismatic" ? 0 : 1;
      }
    }
    this.rotation = new Float64Array(9 * n + 9); // the ground comes last
    this.rotation[9 * n] = this.rotation[9 * n + 4] = this.rotation[9 * n + 8] = 1;
    this.origin = new Float64Array(3 * n + 3);
    [this.axes, this.anchors] = arrays(2, 3 * model.nv);
    this._here = new Float64Array(9);
    this._point = new Float64Array(3);
  }

  set(q) {
    this.q = q;
    const { axes, anchors, _here: here, _point: p } = this;
    for (let k = 0; k < this.count; k++) {
      this.frame(this.parent[k], this.placements[k], here, p);
      for (const { kind, q: i, v, axis } of this.jointsOf[k]) {
        const at = 3 * v;
        if (kind === "spherical") {
          product33(here, 0, quaternionMatrix(q, i, WORK33), here);
          for (let c = 0; c < 9; c++) {
            axes[at + c] = here[3 * (c % 3) + Math.floor(c / 3)];
            anchors[at + c] = p[c % 3];
          }
          continue;
        }
        for (let a = 0; a < 3; a++) {
          axes[at + a] = dot3(here, 3 * a, axis);
          if (kind === "prismatic") p[a] += axes[at + a] * q[i];
          anchors[at + a] = p[a];
        }
        if (kind === "revolute") turnedAbout(here, axis, q[i]);
      }
      this.rotation.set(here, 9 * k);
      this.origin.set(p, 3 * k);
    }
    return this;
  }

  /** A frame placed in a body, into rotation (9) and origin (3). */
  frame(k, placement, rotation, origin) {
    product33(this.rotation, 9 * k, placement.rotation, rotation);
    for (let a = 0; a < 3; a++) origin[a] = this.origin[3 * k + a] + dot3(this.rotation, 9 * k + 3 * a, placement.position);
  }

  placed(k, placement) {
    const rotation = new Float64Array(9), origin = new Float64Array(3);
    this.frame(k, placement, rotation, origin);
    return { rotation, origin };
  }

  /** Velocity of the world point p[i] of a body for a unit of the rate c, into out (3). */
  lever(c, p, i, out) {
    const { axes, anchors } = this, at = 3 * c, ax = axes[at], ay = axes[at + 1], az = axes[at + 2];
    if (!this.turns[c]) {
      out[0] = ax; out[1] = ay; out[2] = az;
      return;
    }
    const rx = p[i] - anchors[at], ry = p[i + 1] - anchors[at + 1], rz = p[i + 2] - anchors[at + 2];
    out[0] = ay * rz - az * ry; out[1] = az * rx - ax * rz; out[2] = ax * ry - ay * rx;
  }
}
