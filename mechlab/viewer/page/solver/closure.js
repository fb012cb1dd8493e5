// What closes and couples a mechanism: residuals and Jacobian of loops and linear relations, row by row as in
// mechanism/constraints.py.

class Closure {
  constructor(model) {
    this.nv = model.nv;
    this.names = [];
    this.lengths = []; // per row: true where the residual is a length
    this.loops = (model.document.loops || []).map((loop) => this._loop(model, loop));
    this.relations = (model.document.relations || []).map((relation) => {
      const [columns, coefficients] = model.combination(relation.coefficients, `relation ${relation.name}`);
      this.names.push(relation.name);
      this.lengths.push(columns.length > 0 && columns[0].kind === "prismatic");
      return { columns, coefficients };
    });
    this.count = this.names.length;
    this.residual = new Float64Array(this.count);
    this.jacobian = new Float64Array(this.count * this.nv);
    this._work = { ra: new Float64Array(9), rb: new Float64Array(9), pa: new Float64Array(3), pb: new Float64Array(3), lever: new Float64Array(3) };
  }

  _loop(model, loop) {
    const kind = LOOP_ROWS[loop.kind];
    if (!kind) throw new Error(`Loop ${loop.name} is of the unknown kind ${loop.kind}.`);
    const [offsets, angles] = kind, axis = "xyz";
    if (loop.kind === "distance") this.names.push(`${loop.name}.length`);
    for (const u of offsets) this.names.push(`${loop.name}.${axis[u]}`);
    for (const [u, w] of angles) this.names.push(`${loop.name}.${axis[u]}_${axis[w]}`);
    const lengths = loop.kind === "distance" ? 1 : offsets.length;
    for (let k = 0; k < lengths + angles.length; k++) this.lengths.push(k < lengths);
    if (loop.kind === "distance" && !(loop.length > 0)) throw new Error(`Loop ${loop.name} has no length.`);
    const a = model.partIndex(loop.body_a, `loop ${loop.name}`), b = model.partIndex(loop.body_b, `loop ${loop.name}`);
    const above = a < 0 ? [] : [...model.tree.columns[a]], below = b < 0 ? [] : [...model.tree.columns[b]];
    // Rates that move both ends alike do not change the loop.
    const path = [...below.filter((c) => !above.includes(c)), ...above.filter((c) => !below.includes(c))];
    const signs = path.map((c) => (below.includes(c) ? 1 : -1));
    return {
      a, b, placementA: placementOf(loop.placement_a), placementB: placementOf(loop.placement_b), offsets, angles,
      length: loop.kind === "distance" ? loop.length : 0, path: Int32Array.from(path), signs: Int8Array.from(signs),
    };
  }

  /** Residuals, and the Jacobian if it is wanted, at the pose of the tree. */
  evaluate(tree, wanted) {
    this.q = tree.q;
    let row = 0;
    for (const loop of this.loops) row = loop.length ? this._distance(tree, loop, row, wanted) : this._rows(tree, loop, row, wanted);
    for (const { columns, coefficients } of this.relations) {
      let total = 0;
      for (let k = 0; k < columns.length; k++) total += coefficients[k] * this.q[columns[k].q];
      this.residual[row++] = total;
    }
    if (wanted && !this._constant) this._writeRelations();
  }

  _writeRelations() {
    this.relations.forEach(({ columns, coefficients }, k) => {
      const at = (this.count - this.relations.length + k) * this.nv;
      columns.forEach((joint, c) => { this.jacobian[at + joint.v] += coefficients[c]; });
    });
    this._constant = true;
  }

  _distance(tree, loop, row, wanted) {
    const { ra, rb, pa, pb, lever } = this._work;
    tree.frame(loop.a, loop.placementA, ra, 0, pa, 0);
    tree.frame(loop.b, loop.placementB, rb, 0, pb, 0);
    const x = pb[0] - pa[0], y = pb[1] - pa[1], z = pb[2] - pa[2];
    this.residual[row] = (x * x + y * y + z * z - loop.length * loop.length) / (2 * loop.length);
    if (wanted) {
      for (let k = 0; k < loop.path.length; k++) {
        tree.lever(loop.path[k], pb, 0, lever, 0);
        this.jacobian[row * this.nv + loop.path[k]] = loop.signs[k] * (x * lever[0] + y * lever[1] + z * lever[2]) / loop.length;
      }
    }
    return row + 1;
  }

  _rows(tree, loop, first, wanted) {
    const { ra, rb, pa, pb, lever } = this._work, { residual, jacobian, nv } = this, { offsets, angles, path, signs } = loop;
    tree.frame(loop.a, loop.placementA, ra, 0, pa, 0);
    tree.frame(loop.b, loop.placementB, rb, 0, pb, 0);
    const x = pb[0] - pa[0], y = pb[1] - pa[1], z = pb[2] - pa[2];
    let row = first;
    for (const u of offsets) residual[row++] = ra[u] * x + ra[u + 3] * y + ra[u + 6] * z;
    for (const [u, w] of angles) residual[row++] = ra[u] * rb[w] + ra[u + 3] * rb[w + 3] + ra[u + 6] * rb[w + 6];
    if (!wanted) return row;
    for (let k = 0; k < path.length; k++) {
      const c = path[k], sign = signs[k];
      tree.lever(c, pb, 0, lever, 0);
      row = first;
      for (const u of offsets) jacobian[nv * row++ + c] = sign * (ra[u] * lever[0] + ra[u + 3] * lever[1] + ra[u + 6] * lever[2]);
      if (!tree.turns[c]) continue;
      const ax = tree.axes[3 * c], ay = tree.axes[3 * c + 1], az = tree.axes[3 * c + 2];
      for (const [u, w] of angles) {
        const nx = ra[u + 3] * rb[w + 6] - ra[u + 6] * rb[w + 3], ny = ra[u + 6] * rb[w] - ra[u] * rb[w + 6];
        const nz = ra[u] * rb[w + 3] - ra[u + 3] * rb[w];
        jacobian[nv * row++ + c] = -sign * (nx * ax + ny * ay + nz * az);
      }
    }
    return first + offsets.length + angles.length;
  }
}
