// The part of the run that all plots show, and values at a time between two samples.

class TimeWindow {
  constructor(start, end) {
    Object.assign(this, { first: start, last: end, start, end });
    this.followers = [];
  }

  get zoomed() { return this.start > this.first || this.end < this.last; }
  get span() { return this.end - this.start || 1; }

  onChange(follower) { this.followers.push(follower); }
  forget(follower) { this.followers = this.followers.filter((x) => x !== follower); }

  /** Shows the times from `a` to `b` [s], in either order, at least a millionth of the run. */
  zoom(a, b) {
    const least = 1e-6 * (this.last - this.first);
    let [start, end] = [Math.max(this.first, Math.min(a, b)), Math.min(this.last, Math.max(a, b))];
    if (!(end - start >= least)) return;
    this.start = start;
    this.end = end;
    for (const follower of this.followers) follower();
  }

  reset() { this.zoom(this.first, this.last); }

  /** Shows `factor` times as much about `time`, which keeps its place. */
  scale(factor, time) {
    const about = Math.min(this.end, Math.max(this.start, time));
    this.zoom(about - factor * (about - this.start), about + factor * (this.end - about));
  }
}

/** The value at a time, linear between two samples, held beyond the ends. */
function valueAt(times, values, time) {
  const i = frameBefore(times, time);
  if (i === times.length - 1 || time <= times[i]) return values[i];
  const share = (time - times[i]) / (times[i + 1] - times[i]);
  return share === 0 ? values[i] : values[i] + share * (values[i + 1] - values[i]);
}
