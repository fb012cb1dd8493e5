// Values that a solve holds or drives. `row`: the rate per scaled rate, of unit length; error(q): how far from `target`, alike.

class Hold {
  constructor(manifold, name) {
    const { model, scale } = manifold;
    this.name = name;
    this.quantity = model.quantity(name);
    this.range = this.quantity.range;
    this.row = model.row(name).map((x, k) => x * scale[k]);
    this.norm = norm(this.row) || 1;
    divide(this.row, this.norm);
    this.target = 0;
  }

  value(q) { return quantityValue(this.quantity, q); }
  error(q) { return (quantityValue(this.quantity, q) - this.target) / this.norm; }
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

class BlendHold {
  constructor(holds, weights) {
    this.holds = holds;
    this.weights = weights;
    this.row = new Float64Array(holds[0].row.length);
    holds.forEach((hold, i) => addTo(this.row, weights[i], hold.row));
  }

  error(q) { return this.holds.reduce((sum, hold, i) => sum + this.weights[i] * hold.error(q), 0); }
  update() {}

  /** The sums at right angles to `line`, unit weights of the holds: the other rows of a reflection onto it. */
  static across(holds, line) {
    const mirror = [line[0] + (line[0] < 0 ? -1 : 1), ...line.slice(1)], size = dot(mirror, mirror);
    return line.slice(1).map((_, i) => new BlendHold(holds, line.map((_x, j) => (i + 1 === j ? 1 : 0) - 2 * mirror[i + 1] * mirror[j] / size)));
  }
}
