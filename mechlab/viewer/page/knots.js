// Poses from few coordinates and their rates: cubic Hermite polynomials between knots, bodies by the model of the page.

class KnotMotion {
  /** knots: references {t, q, rates} of a story; document: its model. */
  constructor(knots, document, read) {
    this.model = new PageModel(document);
    this.times = read(knots.t);
    this.q = read(knots.q);
    this.rates = read(knots.rates);
    this.now = new Float64Array(this.model.nq);
    this.placed = undefined;
  }

  /** The coordinates at `time`; the same array at every call. */
  at(time) {
    const { times, q, rates, now } = this, n = now.length;
    const last = times.length - 1;
    const i = Math.max(0, Math.min(last - 1, frameBefore(times, time)));
    const h = times[i + 1] - times[i];
    const s = Math.min(1, Math.max(0, (time - times[i]) / h)), rest = 1 - s;
    const [a, b, c, d] = [rest * rest * (1 + 2 * s), s * s * (1 + 2 * rest), h * s * rest * rest, -h * s * s * rest];
    for (let k = 0; k < n; k++) {
      const j = n * i + k;
      now[k] = a * q[j] + b * q[j + n] + c * rates[j] + d * rates[j + n];
    }
    return now;
  }

  /** Moves every group to its pose at `time`. */
  apply(groups, time) {
    this.placed = this.model.poses(this.at(time), this.placed);
    const { position, quaternion } = this.placed;
    groups.forEach((group, k) => {
      group.position.fromArray(position, 3 * k);
      group.quaternion.fromArray(quaternion, 4 * k);
    });
  }
}

/** Index of the last of increasing `times` that is not after `time`; 0 before the first. */
function frameBefore(times, time) {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= time) low = middle; else high = middle - 1;
  }
  return low;
}
