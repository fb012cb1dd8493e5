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
  const between = (from, to, angle) => ({ distance: Math.hypot(...vectorFrom(from, to)), from, to, angle });
  const d = second.direction, p = first.point, q = second.point;
  if (second.kind === "point") return between(p, q, null);
  const foot = (point) => (second.kind === "axis" ? along(q, d, dotOf(vectorFrom(q, point), d)) : along(point, d, -dotOf(vectorFrom(q, point), d)));
  if (first.kind === "point") return between(p, foot(p), null);
  const e = first.direction;
  const sine = Math.hypot(...crossOf(d, e)), cosine = Math.abs(dotOf(d, e));
  if (second.kind === "axis") {
    const angle = Math.atan2(sine, cosine);
    if (angle < PARALLEL) return between(p, foot(p), angle);
    // Ends of the common perpendicular of two lines.
    const w = vectorFrom(p, q), c = dotOf(d, e), below = 1 - c * c;
    return between(along(p, e, (dotOf(w, e) - c * dotOf(w, d)) / below), along(q, d, (c * dotOf(w, e) - dotOf(w, d)) / below), angle);
  }
  const angle = first.kind === "axis" ? Math.atan2(cosine, sine) : Math.atan2(sine, cosine);
  return angle < PARALLEL ? between(p, foot(p), angle) : { distance: null, from: p, to: q, angle };
}

function dotOf(a, b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
function crossOf(a, b) { return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]; }
function vectorFrom(a, b) { return [b[0] - a[0], b[1] - a[1], b[2] - a[2]]; }
function along(point, direction, s) { return [0, 1, 2].map((k) => point[k] + s * direction[k]); }
function unitOf(a) { const length = Math.hypot(...a) || 1; return a.map((x) => x / length); }
