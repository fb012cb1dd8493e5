// Recorded poses, and the poses between them. Seeking to a recorded time gives the recorded pose, not a blend.

class Motion {
  constructor(story, read) {
    this.times = read(story.t);
    this.tracks = story.motion.map((m) => ({ position: read(m.position), quaternion: read(m.quaternion) }));
    this.from = new THREE.Quaternion();
    this.to = new THREE.Quaternion();
  }

  get start() { return this.times[0]; }
  get end() { return this.times[this.times.length - 1]; }

  /** Index of the last recorded time that is not after `time`. */
  frame(time) {
    let low = 0, high = this.times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.times[middle] <= time) low = middle; else high = middle - 1;
    }
    return low;
  }

  /** The recorded time `steps` frames away from `time`. */
  neighbour(time, steps) {
    const here = this.frame(time);
    const between = time > this.times[here] && steps < 0 ? 1 : 0;
    return this.times[Math.min(this.times.length - 1, Math.max(0, here + steps + between))];
  }

  /** Moves every group to its pose at `time`: positions linearly, rotations along the shortest arc between two frames. */
  apply(groups, time) {
    const i = this.frame(time);
    const last = i === this.times.length - 1;
    const share = last ? 0 : Math.max(0, (time - this.times[i]) / (this.times[i + 1] - this.times[i]));
    groups.forEach((group, k) => {
      const { position, quaternion } = this.tracks[k];
      const still = quaternion.length === 4;
      const a = still ? 0 : i;
      const b = still || share === 0 ? a : i + 1;
      const [p, q] = [3 * a, 3 * b];
      group.position.set(
        position[p] + share * (position[q] - position[p]),
        position[p + 1] + share * (position[q + 1] - position[p + 1]),
        position[p + 2] + share * (position[q + 2] - position[p + 2]));
      this.from.fromArray(quaternion, 4 * a).normalize();
      if (b !== a) this.from.slerp(this.to.fromArray(quaternion, 4 * b).normalize(), share);
      group.quaternion.copy(this.from);
    });
  }
}
