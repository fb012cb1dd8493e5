// Springs between two points: a coil as long as they are apart; a damper without stiffness is a rod in a tube, a string a line.

const TURNS = 9, COIL_SIDES = 6, STRAIGHT = 0.12;  // share of the length that is straight at either end

/** A coil along z from 0 to 1. */
class Coil extends THREE.Curve {
  constructor(radius) { super(); this.radius = radius; }
  getPoint(u, target = new THREE.Vector3()) {
    const inner = Math.min(1, Math.max(0, (u - STRAIGHT) / (1 - 2 * STRAIGHT)));
    const out = this.radius * Math.min(1, 12 * inner, 12 * (1 - inner)), angle = 2 * Math.PI * TURNS * inner;
    return target.set(out * Math.cos(angle), out * Math.sin(angle), u);
  }
}

class Springs {
  constructor(stage, model) {
    this.stage = stage;
    this.items = (model ? model.springs || [] : []).map((spring) => this.add(spring)).filter(Boolean);
    stage.attach(() => this.update());
    this.update();
  }

  add(spring) {
    const ends = [spring.body_a, spring.body_b].map((name) => this.stage.bodies.indexOf(name));
    if (ends.some((k) => k < 0)) return null;
    const { radius } = this.stage.framing;
    const material = new THREE.MeshStandardMaterial({ color: new THREE.Color(0x5d6673).convertSRGBToLinear(), roughness: 0.4, metalness: 0.35 });
    const group = new THREE.Group();
    group.name = `spring ${spring.name}`;
    const item = { spring, ends, points: [new THREE.Vector3(...spring.point_a), new THREE.Vector3(...spring.point_b)], group, length: 0 };
    // The wire keeps its thickness at the length that the spring has first.
    const first = this.ends(item)[0].distanceTo(this.ends(item)[1]) || radius;
    const wire = 0.006 * radius, coil = Math.min(0.032 * radius, 0.2 * first);
    const mesh = (geometry) => { const made = new THREE.Mesh(geometry, material); made.castShadow = true; group.add(made); };
    const rod = (thickness, from, to) => mesh(new THREE.CylinderGeometry(thickness, thickness, to - from, 12).translate(0, (from + to) / 2, 0).rotateX(Math.PI / 2));
    if (spring.stiffness > 0) {
      mesh(new THREE.TubeGeometry(new Coil(coil / first), 24 * TURNS, wire / first, COIL_SIDES, false).scale(first, first, 1));
    } else rod(wire, 0, 1);
    if (spring.damping > 0) { rod(0.45 * coil, 0.3, 0.62); rod(0.5 * wire + 0.15 * coil, 0, 1); }
    this.stage.root.add(group);
    return item;
  }

  /** The two ends [m] in the mechanism's frame. */
  ends({ ends, points }) {
    return ends.map((body, k) => points[k].clone().applyQuaternion(this.stage.groups[body].quaternion).add(this.stage.groups[body].position));
  }

  update() {
    for (const item of this.items) {
      const [a, b] = this.ends(item);
      const along = b.clone().sub(a);
      item.length = along.length();
      item.group.visible = item.length > 1e-9 && item.ends.some((k) => this.stage.groups[k].visible);
      if (!item.group.visible) continue;
      item.group.position.copy(a);
      item.group.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), along.divideScalar(item.length));
      item.group.scale.set(1, 1, item.length);
    }
  }

  /** The spring under a place of the window in words, unless a part `hit` is before it; "" for none. */
  wordsAt(picker, x, y, hit) {
    const shown = this.items.filter((item) => item.group.visible);
    const found = shown.length ? picker.nearest(shown.flatMap((item) => item.group.children), x, y) : null;
    if (!found || (hit && hit.distance < found.distance)) return "";
    const { spring, length } = shown.find((item) => item.group === found.object.parent);
    const longer = length - spring.rest_length;
    const rest = spring.stiffness > 0 ? `, ${withUnit(Math.abs(longer), "m")} ${longer < 0 ? "shorter" : "longer"} than at rest` : "";
    return `${spring.name.replace(/_/g, " ")}: ${withUnit(length, "m")} long${rest}`;
  }
}
