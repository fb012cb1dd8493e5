// What closes and couples a mechanism: residuals and Jacobian of loops, linear relations and curves, as in mechanism/constraints.py.

class Closure {
  constructor(model) {
    this.nv = model.nv;
    this.names = [];
    this.lengths = []; // per row: true where the residual is a length
    this.loops = (model.document.loops || []).map((loop) => this._loop(model, loop));
    this.relations = (model.document.relations || []).map((relation) => {
      const [columns, coefficients] = model.combination(relation.coefficients, `Relation ${relation.name}`);
      this.names.push(relation.name);
      this.lengths.push(columns.length > 0 && columns[0].kind === "prismatic");
      return { zero: 0, columns, coefficients };
    });
    this.curves = (model.document.curves || []).map((curve) => this._curve(model, curve));
    this.count = this.names.length;
    this.residual = new Float64Array(this.count);
    this.jacobian = new Float64Array(this.count * this.nv);
    [this._ra, this._rb, this._pa, this._pb, this._lever] = arrays(5, 9);
    this.relations.forEach(({ columns, coefficients }, k) => {
      const at = (this.count - this.curves.length - this.relations.length + k) * this.nv;
      columns.forEach((joint, c) => { this.jacobian[at + joint.v] += coefficients[c]; });
    });
  }

  _curve(model, { name, output, input, curve }) {
    const [to, from] = [output, input].map((joint) => model.combination({ [joint]: 1 }, `Curve ${name}`)[0][0]);
    const { knots = [], pieces = [] } = curve || {};
    if (!pieces.length || knots.length !== pieces.length + 1) throw new Error(`Curve ${name} has ${pieces.length} pieces and ${knots.length} knots.`);
    this.names.push(name);
    this.lengths.push(to.kind === "prismatic");
    return { to, from, curve };
  }

  _loop(model, loop) {
    if (!LOOP_ROWS[loop.kind]) throw new Error(`Loop ${loop.name} is of the unknown kind ${loop.kind}.`);
    const [first, ...pairs] = LOOP_ROWS[loop.kind], length = loop.kind === "distance" ? loop.length : 0;
    if (loop.kind === "distance" && !(length > 0)) throw new Error(`Loop ${loop.name} has no length.`);
    const names = [...first, ...(length ? ["length"] : []), ...pairs.map(([u, w]) => `${u}_${w}`)];
    names.forEach((name, k) => {
      this.names.push(`${loop.name}.${name}`);
      this.lengths.push(k < names.length - pairs.length);
    });
    const [offsets, ...angles] = [first, ...pairs].map((axes) => [...axes].map((axis) => "xyz".indexOf(axis)));
    const a = model.partIndex(loop.body_a, `Loop ${loop.name}`), b = model.partIndex(loop.body_b, `Loop ${loop.name}`);
    const [ofA, ofB] = [model.tree.columns[a], model.tree.columns[b]];
    // Rates that move both ends do not count.
    const path = [...ofB.filter((c) => !ofA.includes(c)), ...ofA.filter((c) => !ofB.includes(c))];
    const signs = path.map((c) => (ofB.includes(c) ? 1 : -1));
    return { a, b, placementA: placementOf(loop.placement_a), placementB: placementOf(loop.placement_b), offsets, angles, length, path, signs };
  }

  evaluate(tree) {
    let row = 0;
    for (const loop of this.loops) row = this._rows(tree, loop, row);
    for (const relation of this.relations) this.residual[row++] = quantityValue(relation, tree.q);
    for (const { to, from, curve } of this.curves) {
      const [value, slope] = curveAt(curve, from.zero + tree.q[from.q]);
      this.residual[row] = to.zero + tree.q[to.q] - value;
      this.jacobian[this.nv * row + to.v] = 1;
      this.jacobian[this.nv * row++ + from.v] = -slope;
    }
  }

  _rows(tree, { a, b, placementA, placementB, offsets, angles, length, path, signs }, first) {
    const { _ra: ra, _rb: rb, _pa: pa, _pb: pb, _lever: lever, residual, jacobian, nv } = this;
    tree.frame(a, placementA, ra, pa);
    tree.frame(b, placementB, rb, pb);
    const x = pb[0] - pa[0], y = pb[1] - pa[1], z = pb[2] - pa[2];
    let row = first;
    if (length) residual[row++] = (x * x + y * y + z * z - length * length) / (2 * length);
    for (const u of offsets) residual[row++] = ra[u] * x + ra[u + 3] * y + ra[u + 6] * z;
    for (const [u, w] of angles) residual[row++] = ra[u] * rb[w] + ra[u + 3] * rb[w + 3] + ra[u + 6] * rb[w + 6];
    for (let k = 0; k < path.length; k++) {
      const c = path[k], sign = signs[k];
      tree.lever(c, pb, 0, lever);
      row = first;
      if (length) jacobian[nv * row++ + c] = sign * (x * lever[0] + y * lever[1] + z * lever[2]) / length;
      for (const u of offsets) jacobian[nv * row++ + c] = sign * (ra[u] * lever[0] + ra[u + 3] * lever[1] + ra[u + 6] * lever[2]);
      if (!tree.turns[c]) continue;
      const ax = tree.axes[3 * c], ay = tree.axes[3 * c + 1], az = tree.axes[3 * c + 2];
      for (const [u, w] of angles) {
        const nx = ra[u + 3] * rb[w + 6] - ra[u + 6] * rb[w + 3], ny = ra[u + 6] * rb[w] - ra[u] * rb[w + 6];
        jacobian[nv * row++ + c] = -sign * (nx * ax + ny * ay + (ra[u] * rb[w + 3] - ra[u + 3] * rb[w]) * az);
      }
    }
    return first + (length ? 1 : 0) + offsets.length + angles.length;
  }
}

/** Value and slope of a curve {knots, pieces, rise} at x, as Curve.at in mechanism/curve.py. */
function curveAt({ knots, pieces, rise = null }, x) {
  const period = knots[knots.length - 1] - knots[0], turns = rise === null ? 0 : Math.floor((x - knots[0]) / period), place = x - turns * period;
  let [low, high] = [0, pieces.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (knots[middle] <= place) low = middle; else high = middle - 1;
  }
  const d = place - knots[low];
  let [value, slope] = [0, 0];
  for (let k = pieces[low].length - 1; k >= 0; k--) {
    slope = slope * d + value;
    value = value * d + pieces[low][k];
  }
  return [value + turns * (rise || 0), slope];
}
