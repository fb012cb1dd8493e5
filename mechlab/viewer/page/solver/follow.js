// Drives to their targets: a straight line in the values of the drives, followed along the curve of closed poses, on which
// limit positions are regular points (pseudo-arclength continuation, Keller 1977).

const FIRST_STEP = 0.3, LONGEST_STEP = 0.6, SHORTEST_STEP = 1e-6, FOLD_STEP = 3e-5;
const MEETING = 1e-3; // a change of the determinant's sign is pinned down to this length
const MOST_STEPS = 2000;

/** Moves the holds `moving` to their targets while `held` keep theirs; returns why it stopped before: "", "fold", ... */
function follow(walk, moving, held) {
  const { manifold } = walk, errors = moving.map((hold) => hold.error(walk.q)), total = Math.hypot(...errors);
  const line = errors.map((x) => -x / total), along = new BlendHold(moving, line);
  const kept = [...held, ...BlendHold.across(moving, line)], goals = [...held, ...moving];
  let step = FIRST_STEP, aim = 0, highest = 0; // aim: the estimated way to the targets; highest: rate before a limit position
  for (let count = 0; count < MOST_STEPS; count++) {
    const rate = walk.heading(kept, along.row), left = -along.error(walk.q);
    if (rate < NO_MOTION) return heldBack(walk, count);
    const final = aim > 0 || left <= step * rate;
    const made = walk.step(aim || Math.min(step, left / rate), kept, final ? goals : kept, along.row);
    aim = 0;
    if (made.good && made.cosine > BEND) {
      const beyond = along.error(walk.next), { length } = made;
      if (!final && !made.stopped && beyond > 0) { // the drive speeds up on the way: left = rate x + bend x^2
        const bend = (left + beyond - rate * length) / (length * length);
        aim = 2 * left / (rate + Math.sqrt(rate * rate + 4 * Math.max(0, bend) * left));
        continue;
      }
      const slower = rate - made.rate;
      walk.take(made, !made.stopped);
      if (made.stopped) continue;
      if (final) return "";
      if (highest && made.rate < 1e-4 * highest) return "fold";
      if (highest) step = Math.max(FOLD_STEP, slower > 0 ? 0.9 * made.rate * length / slower : step);
      else if (made.off < 0.03 * length && made.cosine > 0.99) step = Math.min(made.cosine > 1 - 1e-12 ? Infinity : LONGEST_STEP, 1.7 * step);
    } else if (made.closed && made.cosine < -BEND && !made.stopped) { // the drive has turned back on the way
      highest = Math.max(highest, rate);
      step = Math.min(0.5, 0.9 * rate / (rate + made.rate)) * made.length;
      if (step < FOLD_STEP) return "fold";
    } else {
      step = 0.5 * made.length;
      if (step < SHORTEST_STEP || (made.flipped && step < MEETING)) return "singular";
    }
  }
  return "singular";
}

/** Why nothing moves the drives. */
function heldBack({ tails: [loops, holds], active }, count) {
  if (count && holds < 1e-4) return "fold";
  if (loops < NO_MOTION) return "singular";
  return holds < NO_MOTION || !active.length ? "locked" : "range";
}
