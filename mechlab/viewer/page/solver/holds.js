// Values that a solve holds or drives: a joint or shaft, a locked spherical joint, the tilt of a spherical joint with a range.
// `row`: its rate per scaled rate, of unit length; error(q): how far it is from `target`, in the same unit.

class Hold {
  constructor(solver, name) {
    this.name = name;
    this.quantity = solver.model.quantity(name);
    this.row = new Float64Array(solver.model.nv);
    this.quantity.columns.forEach((joint, k) => { this.row[joint.v] += this.quantity.coefficients[k] * solver.scale[joint.v]; });
    this.norm = Math.hypot(...this.row) || 1;
    for (let k = 0; k < this.row.length; k++) this.row[k] /= this.norm;
    this.target = 0;
    this.range = this.quantity.range;
  }

  value(q) { return quantityValue(this.quantity, q); }
  error(q) { return (quantityValue(this.quantity, q) - this.target) / this.norm; }
  update() {}
}

/** One of the three rotations of a locked spherical joint. */
class TurnHold {
  constructor(solver, joint, axis) {
    this.name = joint.name;
    this.at = joint.q;
    this.axis = axis;
    this.row = new Float64Array(solver.model.nv);
    this.row[joint.v + axis] = 1;
    this.norm = 1;
    this.locked = Float64Array.from([1, 0, 0, 0]);
  }

  keep(q) { for (let k = 0; k < 4; k++) this.locked[k] = q[this.at + k]; }

  error(q) {
    const [w, ...xyz] = this.locked, i = this.at, a = this.axis, b = (a + 1) % 3, c = (a + 2) % 3;
    const even = w * q[i] + xyz[0] * q[i + 1] + xyz[1] * q[i + 2] + xyz[2] * q[i + 3];
    const part = w * q[i + 1 + a] - xyz[a] * q[i] - xyz[b] * q[i + 1 + c] + xyz[c] * q[i + 1 + b];
    return even < 0 ? -2 * part : 2 * part;
  }

  update() {}
}

/** The angle of a spherical joint from the identity. */
class TiltHold {
  constructor(solver, joint) {
    this.name = joint.name;
    this.at = joint.q;
    this.v = joint.v;
    this.row = new Float64Array(solver.model.nv);
    this.norm = 1;
    this.target = 0;
    this.range = joint.range;
  }

  value(q) { return 2 * Math.atan2(Math.hypot(q[this.at + 1], q[this.at + 2], q[this.at + 3]), Math.abs(q[this.at])); }
  error(q) { return this.value(q) - this.target; }

  update(q) {
    const length = Math.hypot(q[this.at + 1], q[this.at + 2], q[this.at + 3]) * (q[this.at] < 0 ? -1 : 1);
    for (let k = 0; k < 3; k++) this.row[this.v + k] = Math.abs(length) > 1e-12 ? q[this.at + 1 + k] / length : 0;
  }
}

/** Several drives on a straight line towards their targets: along = false: one of the directions at right angles to it. */
class BlendHold {
  constructor(holds, weights) {
    this.name = holds.map((hold) => hold.name).join(", ");
    this.holds = holds;
    this.weights = weights;
    this.row = new Float64Array(holds[0].row.length);
    holds.forEach((hold, i) => { for (let k = 0; k < this.row.length; k++) this.row[k] += weights[i] * hold.row[k]; });
  }

  error(q) { return this.holds.reduce((sum, hold, i) => sum + this.weights[i] * hold.error(q), 0); }
  update() {}

  /** The directions at right angles to `line` (unit, one number per hold): the other rows of a reflection onto it. */
  static across(holds, line) {
    const count = holds.length, mirror = line.slice();
    mirror[0] += line[0] < 0 ? -1 : 1;
    const size = mirror.reduce((sum, x) => sum + x * x, 0);
    return Array.from({ length: count - 1 }, (_, i) =>
      new BlendHold(holds, line.map((_, j) => (i + 1 === j ? 1 : 0) - 2 * mirror[i + 1] * mirror[j] / size)));
  }
}
