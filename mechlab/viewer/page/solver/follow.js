// Drives to their targets, on a straight line of their values, along the curve of closed poses: limit positions are regular
// points of it (pseudo-arclength continuation, Keller 1977).

const FIRST_STEP = 0.3, LONGEST_STEP = 0.6, SHORTEST_STEP = 1e-6, FOLD_STEP = 3e-5;
const MEETING = 1e-3, MOST_STEPS = 2000; // a change of the determinant's sign is pinned down to the first

/** Moves the holds `moving` to their targets while `held` keep theirs; returns why it stopped before: "", "fold", ... */
function follow(walk, moving, held) {
  const { manifold } = walk, errors = moving.map((hold) => hold.error(walk.q)), total = Math.hypot(...errors);
  const line = errors.map((x) => -x / total), along = new BlendHold(moving, line);
  const kept = [...held, ...BlendHold.across(moving, line)], goals = [...held, ...moving];
  let step = FIRST_STEP, aim = 0, highest = 0; // aim: way to the targets; highest: rate before a limit position
  for (let count = 0; count < MOST_STEPS; count++) {
    const rate = walk.heading(kept, along.row), left = -along.error(walk.q);
    if (rate < NO_MOTION) {
      if (!count && stepOff(walk, kept, along)) continue;
      return heldBack(walk, kept, along.row);
    }
    const final = aim > 0 || left <= step * rate;
    const made = walk.step(aim || Math.min(step, left / rate), kept, final ? goals : kept, along.row);
    aim = 0;
    if (made.good && made.cosine > BEND) {
      const beyond = along.error(walk.next), { length } = made;
      if (!final && !made.pins.length && beyond > 0) { // the drive speeds up on the way: left = rate x + bend x^2
        const bend = (left + beyond - rate * length) / (length * length);
        aim = 2 * left / (rate + Math.sqrt(rate * rate + 4 * Math.max(0, bend) * left));
        continue;
      }
      const slower = rate - made.rate;
      walk.take(made, !made.pins.length);
      if (made.pins.length) continue;
      if (final) return "";
      if (highest && made.rate < 1e-4 * highest) return "fold";
      if (highest) step = Math.max(FOLD_STEP, slower > 0 ? 0.9 * made.rate * length / slower : step);
      else if (made.off < 0.03 * length && made.cosine > 0.99) step = Math.min(made.cosine > 1 - 1e-12 ? Infinity : LONGEST_STEP, 1.7 * step);
    } else if (made.off >= 0 && made.cosine < -BEND && !made.pins.length) { // the drive has turned back on the way
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

/** Why nothing moves the drives along `row`. */
function heldBack(walk, kept, row) {
  const { manifold, tails, active, tangent } = walk;
  if (active.length && tails[1] > NO_MOTION) return "range";
  manifold.at(manifold.structure.generic);
  manifold.choose();
  manifold.factor([kept]);
  walk.placed = walk.ready = false;
  manifold.chosen = null;
  tangent.set(row);
  return manifold.factors.project(tangent) < NO_MOTION ? "locked" : "fold";
}

/** Steps off a limit position to the side where the drives come nearer to their targets; false where there is none. */
function stepOff(walk, kept, along) {
  const { manifold, tangent, q } = walk, start = along.error(q), way = tangent.slice();
  walk.turning.fill(0);
  for (let length = 0.01; length > 1e-5; length *= 0.1) for (const side of [1, -1]) {
    walk.factor(kept);
    if (manifold.factors.rank !== way.length - 1) return false;
    tangent.fill(0).fill(side, way.length - 1);
    way.set(manifold.factors.rotateBack(tangent));
    const made = walk.step(length, kept, kept, way), error = along.error(walk.next);
    if (!made.good || made.pins.length || error < start || error > 0) continue;
    walk.take(made, false);
    return true;
  }
  return false;
}
