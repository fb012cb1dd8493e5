// The motion of a run: from coordinates where the story has a model (see knots.js), else from recorded poses and blends between them.

class Motion {
  constructor(story, read) {
    this.times = read(story.t);
    this.knots = story.knots && story.model ? new KnotMotion(story.knots, story.model, read) : null;
    this.tracks = story.motion.map((m) => ({ position: read(m.position), quaternion: read(m.quaternion) }));
    this.from = new THREE.Quaternion();
    this.to = new THREE.Quaternion();
  }

  get start() { return this.times[0]; }
  get end() { return this.times[this.times.length - 1]; }

  /** Index of the last recorded time that is not after `time`. */
  frame(time) {
    return frameBefore(this.times, time);
  }

  /** The recorded time `steps` frames away from `time`. */
  neighbour(time, steps) {
    const here = this.frame(time);
    const between = time > this.times[here] && steps < 0 ? 1 : 0;
    return this.times[Math.min(this.times.length - 1, Math.max(0, here + steps + between))];
  }

  /** The recorded frame before `time` and the share, 0 to 1, of the way to the next one. */
  place(time) {
    const frame = this.frame(time);
    const last = frame === this.times.length - 1;
    return { frame, share: last ? 0 : Math.max(0, (time - this.times[frame]) / (this.times[frame + 1] - this.times[frame])) };
  }

  /** Coordinates of the model at `time`, a new array; null for poses without a model. */
  coordinates(time) { return this.knots ? this.knots.at(time).slice() : null; }

  /** Moves every group to its pose at `time`; poses without a model: positions linearly, rotations along the shortest arc between
   * two frames. */
  apply(groups, time) {
    if (this.knots) { this.knots.apply(groups, time); return; }
    const { frame: i, share } = this.place(time);
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
