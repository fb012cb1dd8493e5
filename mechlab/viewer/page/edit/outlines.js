// Outlines of flat parts as points [x, y], counter-clockwise: bars and plates round their pins, circles, gears.

const HALF_TURN_POINTS = 20; // points of half a turn

/** The convex hull of points, counter-clockwise. */
function hullOf(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const left = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0;
  const chain = (list) => list.reduce((out, p) => { while (out.length > 1 && !left(out[out.length - 2], out[out.length - 1], p)) out.pop(); out.push(p); return out; }, []);
  const [low, high] = [chain(sorted), chain(sorted.reverse())];
  return [...low.slice(0, -1), ...high.slice(0, -1)];
}

/** All points within `radius` of the convex hull of `points`. */
function barOutline(points, radius) {
  const hull = hullOf(points);
  if (hull.length < 2) return circleOutline(radius, points[0]);
  const turn = (a, b) => Math.atan2(a[0] - b[0], b[1] - a[1]); // of the outward normal of the side a b
  return hull.flatMap((p, k) => {
    const from = turn(hull[(k + hull.length - 1) % hull.length], p);
    let to = turn(p, hull[(k + 1) % hull.length]);
    while (to < from - 1e-12) to += 2 * Math.PI;
    const count = Math.max(1, Math.ceil(((to - from) / Math.PI) * HALF_TURN_POINTS));
    return Array.from({ length: count + 1 }, (_, i) => { const t = from + ((to - from) * i) / count; return [p[0] + radius * Math.cos(t), p[1] + radius * Math.sin(t)]; });
  });
}

function circleOutline(radius, [x, y] = [0, 0]) {
  return Array.from({ length: 2 * HALF_TURN_POINTS }, (_, i) => { const t = (Math.PI * i) / HALF_TURN_POINTS; return [x + radius * Math.cos(t), y + radius * Math.sin(t)]; });
}

/** Teeth as trapezoids about the involute's chords: a picture, not a cutter. A tooth stands at the angle `phase`. */
function gearOutline(teeth, module, phase = 0) {
  const pitch = (teeth * module) / 2, rings = [[pitch - 1.25 * module, 0.36], [pitch, 0.25], [pitch + module, 0.12]];
  const points = [];
  for (let k = 0; k < teeth; k++) {
    for (const [sign, order] of [[-1, rings], [1, [...rings].reverse()]]) {
      for (const [r, half] of order) {
        const t = phase + ((k + sign * half) * 2 * Math.PI) / teeth;
        points.push([r * Math.cos(t), r * Math.sin(t)]);
      }
    }
  }
  return points;
}

/** {outline, holes, thickness} of a flat shape of a document, in its xy plane; null for other kinds. */
function flatShape({ kind, size }) {
  const eyes = (points) => (size.bore > 0 ? points.map((p) => circleOutline(size.bore, p)) : []);
  const bore = size.bore ?? 0.25 * size.width;
  if (kind === "link") { const ends = [[0, 0], [size.length, 0]]; return { outline: barOutline(ends, size.width / 2), holes: bore > 0 ? ends.map((p) => circleOutline(bore, p)) : [], thickness: size.thickness }; }
  if (kind === "plate_link") {
    const pins = Array.from({ length: size.points }, (_, k) => [size[`x_${k + 1}`], size[`y_${k + 1}`]]);
    return { outline: barOutline(pins, size.width / 2), holes: bore > 0 ? pins.map((p) => circleOutline(bore, p)) : [], thickness: size.thickness };
  }
  if (kind === "spur_gear") return { outline: gearOutline(size.teeth, size.module, size.phase || 0), holes: eyes([[0, 0]]), thickness: size.width };
  return null;
}
