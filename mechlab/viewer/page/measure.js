// Distance and angle between two features: points, axes (lines) and faces (planes). Plain arrays, no scene.

const PARALLEL = 1e-6;  // [rad] below which directions count as parallel

/** Between features {kind: "point", "axis" or "face", point, direction}: {distance, from, to, angle}. The distance is the shortest one
 * [m], null between a line or plane and a plane that meet; from, to: its ends; angle [rad], 0 to a right angle, null with a point. */
function measureBetween(first, second) {
  const order = ["point", "axis", "face"];
  if (order.indexOf(first.kind) > order.indexOf(second.kind)) {
    const { distance, from, to, angle } = measureBetween(second, first);
    return { distance, from: to, to: from, angle };
  }
  const between = (from, to, angle) => ({ distance: length3(minus3(to, from)), from, to, angle });
  const d = second.direction, p = first.point, q = second.point;
  if (second.kind === "point") return between(p, q, null);
  const foot = (point) => (second.kind === "axis" ? along3(q, d, inner3(minus3(point, q), d)) : along3(point, d, -inner3(minus3(point, q), d)));
  if (first.kind === "point") return between(p, foot(p), null);
  const e = first.direction;
  const sine = length3(cross3(d, e)), cosine = Math.abs(inner3(d, e));
  if (second.kind === "axis") {
    const angle = Math.atan2(sine, cosine);
    if (angle < PARALLEL) return between(p, foot(p), angle);
    // Ends of the common perpendicular of two lines.
    const w = minus3(q, p), c = inner3(d, e), below = 1 - c * c;
    return between(along3(p, e, (inner3(w, e) - c * inner3(w, d)) / below), along3(q, d, (c * inner3(w, e) - inner3(w, d)) / below), angle);
  }
  const angle = first.kind === "axis" ? Math.atan2(cosine, sine) : Math.atan2(sine, cosine);
  return angle < PARALLEL ? between(p, foot(p), angle) : { distance: null, from: p, to: q, angle };
}
