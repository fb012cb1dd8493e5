// Values that a solve holds or drives. `row`: the rate of the value per scaled rate, of unit length; error(q): how far the
// value is from `target`, in the same unit; update(q): of a row that depends on the pose.

/** A joint or shaft with one value. */
class Hold {
  constructor(manifold, name) {
    const { model, scale } = manifold;
    this.name = name;
    this.quantity = model.quantity(name);
    this.range = this.quantity.range;
    this.row = model.row(name).map((x, k) => x * scale[k]);
    this.norm = norm(this.row) || 1;
    for (let k = 0; k < this.row.length; k++) this.row[k] /= this.norm;
    this.target = 0;
  }

  value(q) { return quantityValue(this.quantity, q); }
  error(q) { return (quantityValue(this.quantity, q) - this.target) / this.norm; }
  update() {}
}

/** One of the three rotations of a spherical joint, held where it is in q. */
class TurnHold {
  constructor(manifold, joint, axis, q) {
    this.name = joint.name;
    this.at = joint.q;
    this.axis = axis;
    this.row = new Float64Array(manifold.model.nv);
    this.row[joint.v + axis] = 1;
    this.kept = q.slice(joint.q, joint.q + 4);
  }

  error(q) {
    const { kept, at, axis } = this, b = 1 + (axis + 1) % 3, c = 1 + (axis + 2) % 3, a = 1 + axis;
    const even = kept[0] * q[at] + kept[1] * q[at + 1] + kept[2] * q[at + 2] + kept[3] * q[at + 3];
    const odd = kept[0] * q[at + a] - kept[a] * q[at] - kept[b] * q[at + c] + kept[c] * q[at + b];
    return even < 0 ? -2 * odd : 2 * odd;
  }

  update() {}
}

/** The angle of a spherical joint from the identity, which its range limits. */
class TiltHold {
  constructor(manifold, joint) {
    Object.assign(this, { name: joint.name, at: joint.q, v: joint.v, range: joint.range, norm: 1, target: 0 });
    this.row = new Float64Array(manifold.model.nv);
  }

  value(q) { return 2 * Math.atan2(this._sine(q), Math.abs(q[this.at])); }
  error(q) { return this.value(q) - this.target; }
  _sine(q) { return Math.hypot(q[this.at + 1], q[this.at + 2], q[this.at + 3]); }

  update(q) {
    const length = this._sine(q) * (q[this.at] < 0 ? -1 : 1);
    for (let k = 0; k < 3; k++) this.row[this.v + k] = Math.abs(length) > 1e-12 ? q[this.at + 1 + k] / length : 0;
  }
}

/** A weighted sum of holds. */
class BlendHold {
  constructor(holds, weights) {
    this.holds = holds;
    this.weights = weights;
    this.row = new Float64Array(holds[0].row.length);
    holds.forEach((hold, i) => { for (let k = 0; k < this.row.length; k++) this.row[k] += weights[i] * hold.row[k]; });
  }

  error(q) {
    let sum = 0;
    for (let i = 0; i < this.holds.length; i++) sum += this.weights[i] * this.holds[i].error(q);
    return sum;
  }

  update() {}

  /** The sums at right angles to `line` (unit, one weight for each hold): the other rows of a reflection onto it. */
  static across(holds, line) {
    const mirror = [line[0] + (line[0] < 0 ? -1 : 1), ...line.slice(1)], size = dot(mirror, mirror);
    return line.slice(1).map((_, i) => new BlendHold(holds, line.map((_x, j) => (i + 1 === j ? 1 : 0) - 2 * mirror[i + 1] * mirror[j] / size)));
  }
}
