// Rows A of a linear system A y = b as A = L Q^T by Householder reflections with row pivoting: rank, least-norm
// solutions, projections on the null space, multipliers, the smallest singular value. Allocates only when it is made.

class RowFactors {
  /** Room for `capacity` rows of length n; rows are written to `matrix` before they are taken in by `stage`. */
  constructor(capacity, n) {
    this.n = n;
    this.matrix = new Float64Array(capacity * n);
    this.order = new Int32Array(capacity); // rows of L in the order of their pivots
    this.rank = 0;
    this.taken = new Uint8Array(capacity);
    this._diagonal = new Float64Array(n + 1);
    this._beta = new Float64Array(n + 1);
    this._norms = new Float64Array(capacity);
    this._z = new Float64Array(n + 1);
    this._w = new Float64Array(n + 1);
  }

  clear() {
    this.rank = 0;
    this.taken.fill(0);
  }

  /** Takes in the rows from..to-1, the best first, while a row adds more than `tolerance`; returns the smallest pivot. */
  stage(from, to, tolerance = 1e-9, most = Infinity) {
    const { n, matrix, _norms: norms } = this;
    for (let i = from; i < to; i++) {
      for (let k = 0; k < this.rank; k++) this._reflectRow(k, i);
      norms[i] = this._tail(i);
    }
    let smallest = Infinity;
    const last = Math.min(n, this.rank + Math.min(most, to - from));
    while (this.rank < last) {
      let best = -1;
      for (let i = from; i < to; i++) if (!this.taken[i] && (best < 0 || norms[i] > norms[best])) best = i;
      if (best < 0 || !(norms[best] > tolerance)) break;
      const k = this.rank, at = best * n, alpha = matrix[at + k] > 0 ? -norms[best] : norms[best];
      smallest = Math.min(smallest, norms[best]);
      this._diagonal[k] = alpha;
      this._beta[k] = -1 / (alpha * (matrix[at + k] - alpha));
      matrix[at + k] -= alpha;
      this.order[k] = best;
      this.taken[best] = 1;
      this.rank++;
      for (let i = from; i < to; i++) {
        if (this.taken[i]) continue;
        this._reflectRow(k, i);
        norms[i] = this._tail(i);
      }
    }
    return smallest;
  }

  _tail(i) {
    let sum = 0;
    const { matrix, n } = this;
    for (let j = i * n + this.rank, end = (i + 1) * n; j < end; j++) sum += matrix[j] * matrix[j];
    return Math.sqrt(sum);
  }

  _reflectRow(k, i) {
    const { n, matrix } = this, v = this.order[k] * n, x = i * n;
    let sum = 0;
    for (let j = k; j < n; j++) sum += matrix[v + j] * matrix[x + j];
    sum *= this._beta[k];
    if (sum !== 0) for (let j = k; j < n; j++) matrix[x + j] -= sum * matrix[v + j];
  }

  _reflect(k, x) {
    const { n, matrix } = this, v = this.order[k] * n;
    let sum = 0;
    for (let j = k; j < n; j++) sum += matrix[v + j] * x[j];
    sum *= this._beta[k];
    if (sum !== 0) for (let j = k; j < n; j++) x[j] -= sum * matrix[v + j];
  }

  /** Least-norm y (n) with A y = b, b by row, over the rows taken in. */
  solve(b, y) {
    const { n, matrix, order, rank } = this;
    for (let k = 0; k < rank; k++) {
      let sum = b[order[k]];
      for (let j = 0, at = order[k] * n; j < k; j++) sum -= matrix[at + j] * y[j];
      y[k] = sum / this._diagonal[k];
    }
    y.fill(0, rank, n);
    for (let k = 0; k < rank; k++) this._z[k] = y[k];
    for (let k = rank - 1; k >= 0; k--) this._reflect(k, y);
    return y;
  }

  /** Multipliers (by row) of the latest solution: y = sum of multiplier x row. */
  multipliers(out) {
    const { n, matrix, order, rank, _z: z } = this;
    out.fill(0);
    for (let k = rank - 1; k >= 0; k--) {
      let sum = z[k];
      for (let i = k + 1; i < rank; i++) sum -= matrix[order[i] * n + k] * out[order[i]];
      out[order[k]] = sum / this._diagonal[k];
    }
    return out;
  }

  /** x becomes Q^T x: its entries from `rank` on are what the rows leave of it. */
  rotate(x) {
    for (let k = 0; k < this.rank; k++) this._reflect(k, x);
    return x;
  }

  /** x becomes Q x. */
  rotateBack(x) {
    for (let k = this.rank - 1; k >= 0; k--) this._reflect(k, x);
    return x;
  }

  /** Coefficients (by row) c with which sum c x row is the part of x that the rows hold; x is Q^T x from `rotate`. */
  shares(x, out) {
    for (let k = 0; k < this.rank; k++) this._z[k] = x[k];
    return this.multipliers(out);
  }

  /** Sign of the determinant of the rows taken in first..: those of the first `rank` pivots, bordered by their null space. */
  sign(rank = this.rank) {
    let sign = rank % 2 ? -1 : 1;
    for (let k = 0; k < rank; k++) {
      if (this._diagonal[k] < 0) sign = -sign;
      for (let j = 0; j < k; j++) if (this.order[j] > this.order[k]) sign = -sign;
    }
    return sign;
  }

  /** Smallest singular value of the rows taken in, by inverse iteration. */
  smallest() {
    const { n, matrix, order, rank, _z: z, _w: w } = this;
    if (!rank) return 1;
    for (let k = 0; k < rank; k++) w[k] = 1 + 0.37 * ((k * 7) % 5);
    let norm = 1;
    for (let pass = 0; pass < 4; pass++) {
      for (let k = 0; k < rank; k++) {
        let sum = w[k];
        for (let j = 0, at = order[k] * n; j < k; j++) sum -= matrix[at + j] * z[j];
        z[k] = sum / this._diagonal[k];
      }
      for (let k = rank - 1; k >= 0; k--) {
        let sum = z[k];
        for (let i = k + 1; i < rank; i++) sum -= matrix[order[i] * n + k] * w[i];
        w[k] = sum / this._diagonal[k];
      }
      norm = 0;
      for (let k = 0; k < rank; k++) norm += w[k] * w[k];
      norm = Math.sqrt(norm);
      if (!(norm < 1e300)) return 0;
      for (let k = 0; k < rank; k++) w[k] /= norm;
    }
    return 1 / Math.sqrt(norm);
  }
}
