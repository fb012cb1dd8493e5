// Rows A of a linear system A y = b as A = L Q^T, by Householder reflections with row pivoting.

class RowFactors {
  /** Room for `capacity` rows of length n; `stage` takes them in from `matrix`. */
  constructor(capacity, n) {
    this.n = n;
    this.matrix = new Float64Array(capacity * n);
    this.order = new Int32Array(capacity); // rows of L in the order of their pivots
    this.taken = new Uint8Array(capacity);
    this.rank = 0;
    [this._diagonal, this._beta, this._z, this._w] = arrays(4, n);
    this._squares = new Float64Array(capacity); // of what is left of each row
  }

  clear() {
    this.rank = 0;
    this.taken.fill(0);
  }

  /** Takes in the rows from..to-1, the best first, while a row adds more than `tolerance`; returns the smallest pivot. */
  stage(from, to, tolerance, most = Infinity) {
    const { n, matrix, taken, _squares: squares } = this;
    for (let i = from; i < to; i++) {
      for (let k = 0; k < this.rank; k++) this._reflect(k, matrix, i * n);
      squares[i] = this._square(i);
    }
    let smallest = Infinity;
    const last = Math.min(n, this.rank + Math.min(most, to - from));
    while (this.rank < last) {
      let best = -1;
      for (let i = from; i < to; i++) if (!taken[i] && (best < 0 || squares[i] > squares[best])) best = i;
      const size = best < 0 ? 0 : Math.sqrt(this._square(best));
      if (!(size > tolerance)) break;
      smallest = Math.min(smallest, size);
      this._take(best, size);
      for (let i = from; i < to; i++) if (!taken[i]) this._reduce(i);
    }
    return smallest;
  }

  _take(row, size) {
    const k = this.rank++, at = row * this.n + k, x = this.matrix[at], alpha = x > 0 ? -size : size;
    this._diagonal[k] = alpha;
    this._beta[k] = -1 / (alpha * (x - alpha));
    this.matrix[at] = x - alpha;
    this.order[k] = row;
    this.taken[row] = 1;
  }

  _reduce(i) {
    const k = this.rank - 1, { _squares: squares } = this;
    this._reflect(k, this.matrix, i * this.n);
    const entry = this.matrix[i * this.n + k];
    squares[i] -= entry * entry;
    if (!(squares[i] > 1e-4)) squares[i] = this._square(i); // before rounding counts
  }

  _square(i) {
    let sum = 0;
    const { matrix, n } = this;
    for (let j = i * n + this.rank, end = (i + 1) * n; j < end; j++) sum += matrix[j] * matrix[j];
    return sum;
  }

  _reflect(k, x, at) {
    const { n, matrix } = this, v = this.order[k] * n;
    let sum = 0;
    for (let j = k; j < n; j++) sum += matrix[v + j] * x[at + j];
    sum *= this._beta[k];
    if (sum !== 0) for (let j = k; j < n; j++) x[at + j] -= sum * matrix[v + j];
  }

  /** z with L z = b, b by row. */
  _forward(b, z) {
    const { n, matrix, order } = this;
    for (let k = 0; k < this.rank; k++) {
      let sum = b[order[k]];
      for (let j = 0, at = order[k] * n; j < k; j++) sum -= matrix[at + j] * z[j];
      z[k] = sum / this._diagonal[k];
    }
  }

  /** x with L^T x = z. */
  _backward(z, x) {
    const { n, matrix, order } = this;
    for (let k = this.rank - 1; k >= 0; k--) {
      let sum = z[k];
      for (let i = k + 1; i < this.rank; i++) sum -= matrix[order[i] * n + k] * x[i];
      x[k] = sum / this._diagonal[k];
    }
  }

  /** Least-norm y (n) with A y = b, b by row, over the rows taken in. */
  solve(b, y) {
    this._forward(b, y);
    y.fill(0, this.rank);
    return this.rotateBack(y);
  }

  /** x becomes Q^T x: its entries from `rank` on are what the rows leave of it. */
  rotate(x) {
    for (let k = 0; k < this.rank; k++) this._reflect(k, x, 0);
    return x;
  }

  rotateBack(x) {
    for (let k = this.rank - 1; k >= 0; k--) this._reflect(k, x, 0);
    return x;
  }

  /** x becomes its part that the rows leave free; returns the length of that. */
  project(x) {
    this.rotate(x).fill(0, 0, this.rank);
    return norm(this.rotateBack(x));
  }

  /** Coefficients (by row) c with which sum c x row is the part of x that the rows hold; x is Q^T x from `rotate`. */
  shares(x, out) {
    this._backward(x, this._w);
    out.fill(0);
    for (let k = 0; k < this.rank; k++) out[this.order[k]] = this._w[k];
    return out;
  }

  /** Sign of the determinant of the rows taken in, bordered by the rows of Q^T that are left. */
  sign() {
    const { rank, order } = this;
    let sign = rank % 2 ? -1 : 1;
    for (let k = 0; k < rank; k++) {
      if (this._diagonal[k] < 0) sign = -sign;
      for (let j = 0; j < k; j++) if (order[j] > order[k]) sign = -sign;
    }
    return sign;
  }

  /** Smallest singular value of the rows taken in, by inverse iteration. */
  smallest() {
    const { rank, order, _z: z, _w: w, _squares: b } = this;
    if (!rank) return 1;
    for (let k = 0; k < rank; k++) w[k] = 1 + 0.37 * ((k * 7) % 5);
    let size = 1;
    for (let pass = 0; pass < 4; pass++) {
      for (let k = 0; k < rank; k++) b[order[k]] = w[k];
      this._forward(b, z);
      this._backward(z, w);
      size = 0;
      for (let k = 0; k < rank; k++) size += w[k] * w[k];
      size = Math.sqrt(size);
      if (!(size < 1e300)) return 0;
      for (let k = 0; k < rank; k++) w[k] /= size;
    }
    return 1 / Math.sqrt(size);
  }
}

/** `count` arrays of n zeros. */
function arrays(count, n) { return Array.from({ length: count }, () => new Float64Array(n)); }

function divide(x, by) { for (let k = 0; k < x.length; k++) x[k] /= by; }

function addTo(x, share, y) { for (let k = 0; k < x.length; k++) x[k] += share * y[k]; }

function dot(a, b) {
  let sum = 0;
  for (let k = 0; k < a.length; k++) sum += a[k] * b[k];
  return sum;
}

function norm(x, from = 0) {
  let sum = 0;
  for (let k = from; k < x.length; k++) sum += x[k] * x[k];
  return Math.sqrt(sum);
}
