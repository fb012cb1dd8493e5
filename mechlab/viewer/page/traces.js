// Paths of points: faint where the point will go, strong where it has been.

/** A polyline through recorded points that TubeGeometry samples frame by frame instead of by arc length. */
class RecordedPath extends THREE.Curve {
  constructor(points) { super(); this.points = points; }
  getPoint(u, target = new THREE.Vector3()) {
    const at = u * (this.points.length - 1);
    const i = Math.min(this.points.length - 2, Math.floor(at));
    return target.lerpVectors(this.points[i], this.points[i + 1], at - i);
  }
  getPointAt(u, target) { return this.getPoint(u, target); }
  getTangentAt(u, target) { return this.getTangent(u, target); }
}

/** Points of a polyline from which it departs by at most `tolerance` (Douglas and Peucker 1973). */
function thinned(points, tolerance) {
  const kept = new Uint8Array(points.length);
  const pieces = [[0, points.length - 1]];
  const line = new THREE.Line3(), foot = new THREE.Vector3();
  kept[0] = kept[points.length - 1] = 1;
  while (pieces.length) {
    const [first, last] = pieces.pop();
    line.set(points[first], points[last]);
    let worst = tolerance, at = -1;
    for (let i = first + 1; i < last; i++) {
      const off = line.closestPointToPoint(points[i], true, foot).distanceTo(points[i]);
      if (off > worst) [worst, at] = [off, i];
    }
    if (at < 0) continue;
    kept[at] = 1;
    pieces.push([first, at], [at, last]);
  }
  return points.filter((_, i) => kept[i]);
}

const TRACE_COLORS = [0xc2185b, 0x00796b, 0x5e35b1, 0xb35900, 0x1565c0];
const SIDES = 5;

class Traces {
  /** opacity: of the way done and of the way ahead. */
  constructor(stage, story, read, opacity = { done: 1, ahead: 0.22 }) {
    this.opacity = opacity;
    this.tubes = [];
    this.group = new THREE.Group();
    stage.root.add(this.group);
    story.traces.forEach((trace, k) => this.add(stage, read(trace.points), TRACE_COLORS[k % TRACE_COLORS.length], trace.name));
  }

  add(stage, flat, color, name) {
    const radius = stage.framing.radius;
    // A point that rests adds nothing to the tube; `upTo` still maps every frame to the part of the tube it has drawn.
    const points = [], upTo = [];
    for (let i = 0; i < flat.length; i += 3) {
      const point = new THREE.Vector3(flat[i], flat[i + 1], flat[i + 2]);
      if (!points.length || point.distanceTo(points[points.length - 1]) > 1e-5 * radius) points.push(point);
      upTo.push(points.length - 1);
    }
    if (points.length < 2) return;
    const tube = (along, thickness, opacity) => {
      const geometry = new THREE.TubeGeometry(new RecordedPath(along), along.length - 1, thickness * radius, SIDES, false);
      const material = new THREE.MeshBasicMaterial({ color: new THREE.Color(color).convertSRGBToLinear(), opacity, transparent: opacity < 1 });
      const mesh = new THREE.Mesh(geometry, material);
      mesh.name = `trace ${name}`;
      this.group.add(mesh);
      return mesh;
    };
    tube(thinned(points, 3e-4 * radius), 0.0022, this.opacity.ahead);
    this.tubes.push({ mesh: tube(points, 0.004, this.opacity.done), upTo });
  }

  show(on) { this.group.visible = on; }

  clear() {
    this.tubes = [];
    for (const mesh of [...this.group.children]) { this.group.remove(mesh); mesh.geometry.dispose(); mesh.material.dispose(); }
  }

  /** Shows the traces up to recorded frame `frame`, from frame `first` on. */
  apply(frame, first = 0) {
    for (const { mesh, upTo } of this.tubes) {
      const [start, end] = [first, frame].map((k) => 6 * SIDES * upTo[Math.min(k, upTo.length - 1)]);
      mesh.geometry.setDrawRange(start, end - start);
    }
  }
}
