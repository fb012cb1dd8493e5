// One drive moved through its reach: poses between solved ones, blended along the arc of the curve.

const BLEND = 6;

class Sweep {
  constructor(sweep, read) {
    Object.assign(this, sweep);
    this.tracks = sweep.motion.map((m) => ({ position: read(m.position), quaternion: Float32Array.from(read(m.quaternion)) }));
    this.near = read(sweep.closeness);
    this.arc = read(sweep.arc);
    this.values = read(sweep.values);
    this.count = this.arc.length;
    this.first = this.values[0];
    this.last = this.values[this.count - 1];
    for (const { quaternion } of this.tracks) {
      // Opposite quaternions are the same turn; blending needs the nearer one.
      for (let i = 4; i < quaternion.length; i += 4) {
        const dot = [0, 1, 2, 3].reduce((sum, k) => sum + quaternion[i + k] * quaternion[i + k - 4], 0);
        if (dot < 0) for (let k = 0; k < 4; k++) quaternion[i + k] *= -1;
      }
    }
  }

  exists(value) { const tiny = 1e-9 * (this.last - this.first); return value >= this.first - tiny && value <= this.last + tiny; }

  /** First sample and weights of the polynomial through the samples around an arc. */
  weights(arc, here) {
    const first = Math.min(Math.max(here - (BLEND / 2 - 1), 0), this.count - BLEND);
    const weights = [];
    for (let i = 0; i < BLEND; i++) {
      let w = 1;
      for (let j = 0; j < BLEND; j++) if (j !== i) w *= (arc - this.arc[first + j]) / (this.arc[first + i] - this.arc[first + j]);
      weights.push(w);
    }
    return { first, weights };
  }

  /** The place of a value of the drive: the sample before it, and the weights there. Outside of the reach, the end. */
  place(value) {
    let [low, high] = [0, this.count - 1];
    if (value <= this.first) return { here: 0, share: 0, ...this.weights(this.arc[0], 0) };
    if (value >= this.last) return { here: high - 1, share: 1, ...this.weights(this.arc[high], high - 1) };
    while (high - low > 1) { const middle = (low + high) >> 1; if (this.values[middle] <= value) low = middle; else high = middle; }
    const here = low;
    let [a, b] = [this.arc[here], this.arc[here + 1]];
    for (let k = 0; k < 50; k++) {
      const middle = (a + b) / 2;
      const { first, weights } = this.weights(middle, here);
      if (weights.reduce((sum, w, i) => sum + w * this.values[first + i], 0) < value) a = middle; else b = middle;
    }
    const share = ((a + b) / 2 - this.arc[here]) / (this.arc[here + 1] - this.arc[here]);
    return { here, share, ...this.weights((a + b) / 2, here) };
  }

  apply(groups, { first, weights }) {
    const blend = (values, width, still) => {
      const out = [];
      for (let k = 0; k < width; k++) {
        if (still) { out.push(values[k]); continue; }
        let sum = 0;
        for (let i = 0; i < BLEND; i++) sum += weights[i] * values[width * (first + i) + k];
        out.push(sum);
      }
      return out;
    };
    groups.forEach((group, k) => {
      const { position, quaternion } = this.tracks[k];
      const still = quaternion.length === 4;
      group.position.fromArray(blend(position, 3, still));
      group.quaternion.fromArray(blend(quaternion, 4, still)).normalize();
    });
  }

  /** Paths of points (marks) over the whole reach, flat arrays of coordinates. */
  paths(marks, pieces) {
    const groups = this.tracks.map(() => new THREE.Group());
    const paths = marks.map(() => []);
    const total = this.arc[this.count - 1];
    let here = 0;
    for (let i = 0; i <= pieces; i++) {
      const arc = (total * i) / pieces;
      while (here < this.count - 2 && this.arc[here + 1] <= arc) here++;
      this.apply(groups, this.weights(arc, here));
      marks.forEach((mark, j) => {
        const { position, quaternion } = groups[mark.body];
        const at = new THREE.Vector3(...mark.point).applyQuaternion(quaternion).add(position);
        paths[j].push(at.x, at.y, at.z);
      });
    }
    return paths;
  }

  nearness({ here, share }) { return (1 - share) * this.near[here] + share * this.near[here + 1]; }
}
