// Forces and torques with one scale for each unit over the whole run: a force is an arrow, a torque an arrow around its axis.

const ARROW_COLORS = { force: 0x00795b, torque: 0x7b3fa0 };
/** What forces make together, and what balances them. */
const ROLE_COLORS = { net: 0x1b5e9e, inertia: 0xb35900 };
const TURN = 1.5 * Math.PI;  // [rad] of the way around that the arrow of a torque goes

class Arrows {
  constructor(stage, story, read) {
    this.stage = stage;
    this.step = story.framing.step;
    this.scales = story.arrowScales;
    this.width = 0.011 * story.framing.radius;
    this.items = story.arrows.map((arrow) => this.add(arrow, read));
    this.shown = true;
  }

  add(arrow, read) {
    const material = new THREE.MeshStandardMaterial({ color: new THREE.Color(ROLE_COLORS[arrow.role] || ARROW_COLORS[arrow.kind]).convertSRGBToLinear(), roughness: 0.6 });
    const group = new THREE.Group();
    group.name = `arrow ${arrow.name}`;
    const along = new THREE.CylinderGeometry(1, 1, 1, 16).translate(0, 0.5, 0).rotateX(Math.PI / 2);
    const shaft = new THREE.Mesh(arrow.kind === "torque" ? ringGeometry() : along, material);
    const head = new THREE.Mesh(new THREE.ConeGeometry(1, 1, 20).translate(0, -0.5, 0).rotateX(Math.PI / 2), material);
    group.add(shaft, head);
    // What a part hides shows through it, faintly.
    const hidden = new THREE.MeshBasicMaterial({ color: material.color, transparent: true, opacity: 0.35, depthTest: false, depthWrite: false });
    for (const mesh of [shaft, head]) {
      mesh.frustumCulled = false;
      const faint = new THREE.Mesh(mesh.geometry, hidden);
      faint.renderOrder = 5;
      faint.frustumCulled = false;
      mesh.add(faint);
    }
    this.stage.root.add(group);
    const item = { ...arrow, points: read(arrow.points), vectors: read(arrow.vectors), group, shaft, head, tip: new THREE.Vector3(), size: 0 };
    item.label = forceLabel(item);
    return item;
  }

  /** Takes other arrows; `sign` -1 draws one the other way round. */
  replace(arrows, read) {
    for (const { group } of this.items) this.stage.root.remove(group);
    this.items = arrows.map((arrow) => this.add(arrow, read));
    if (this.onReplace) this.onReplace();
  }

  /** Shows the arrows at a place between two recorded frames. */
  apply(frame, share) {
    const next = (values, k) => {
      const a = 3 * frame + k, b = a + 3 < values.length ? a + 3 : a;
      return values[a] + share * (values[b] - values[a]);
    };
    const rings = [];
    for (const item of this.items) {
      const vector = new THREE.Vector3(...[0, 1, 2].map((k) => next(item.vectors, k))).multiplyScalar(item.sign || 1);
      item.size = vector.length();
      const length = (item.size / (this.scales[item.unit] || 1)) * this.step;
      item.visible = this.shown && length > 0.02 * this.step;
      item.group.visible = item.visible;
      if (!item.visible) continue;
      item.group.position.set(...[0, 1, 2].map((k) => next(item.points, k)));
      item.group.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), vector.clone().normalize());
      if (item.kind === "torque") this.turnRing(item, length, rings); else this.stretch(item, vector, length);
    }
  }

  stretch({ group, shaft, head, tip }, vector, length) {
    const cone = Math.min(5.5 * this.width, 0.45 * length);
    const width = Math.min(this.width, 0.16 * length);
    shaft.scale.set(width, width, Math.max(1e-9, length - 0.75 * cone));
    head.scale.set(2.4 * width, 2.4 * width, cone);
    head.position.z = length;
    tip.copy(vector).setLength(length).add(group.position);
  }

  /** A ring of half the length as its radius, seen against the vector counter-clockwise; torques about one line stand side by side. */
  turnRing(item, length, rings) {
    const { group, shaft, head, tip } = item;
    const radius = 0.5 * length, width = Math.min(0.8 * this.width, 0.16 * radius);
    const axis = new THREE.Vector3(0, 0, 1).applyQuaternion(group.quaternion);
    const same = rings.filter((other) => {
      const between = group.position.clone().sub(other.at);
      return Math.abs(other.axis.dot(axis)) > 0.999 && between.cross(axis).length() < 0.1 * this.step;
    }).length;
    rings.push({ at: group.position.clone(), axis });
    group.position.addScaledVector(axis, 6 * this.width * same);
    const cone = Math.min(5 * this.width, 0.9 * radius);
    bendRing(shaft.geometry, radius, width, TURN - (0.7 * cone) / radius);
    head.scale.set(2.6 * width, 2.6 * width, cone);
    // The point of the head lies on the circle, a little beyond its base.
    const end = TURN - (0.35 * cone) / radius;
    const tangent = new THREE.Vector3(-Math.sin(end), Math.cos(end), 0);
    head.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), tangent);
    head.position.set(radius * Math.cos(end), radius * Math.sin(end), 0).addScaledVector(tangent, 0.5 * cone);
    tip.set(0, radius, 0).applyQuaternion(group.quaternion).add(group.position);
  }

  /** What one grid step of an arrow or a ring stands for. */
  get scaleText() {
    const kinds = new Map(this.items.map((item) => [item.unit, item.kind]));
    const shown = Object.entries(this.scales).filter(([unit]) => kinds.has(unit))
      .map(([unit, amount]) => `${kinds.get(unit) === "torque" ? "ring one grid step wide" : "arrow one grid step long"}: ${significant(amount)} ${unitText(unit)}`);
    return this.shown ? shown.join(", ") : "";
  }
}

const RING_STEPS = 48, RING_SIDES = 8;

/** A bent tube about z, to be given its radius by bendRing. */
function ringGeometry() {
  const geometry = new THREE.BufferGeometry();
  const count = (RING_STEPS + 1) * RING_SIDES, index = [];
  for (let i = 0; i < RING_STEPS; i++) {
    for (let j = 0; j < RING_SIDES; j++) {
      const a = i * RING_SIDES + j, b = i * RING_SIDES + ((j + 1) % RING_SIDES);
      index.push(a, a + RING_SIDES, b, b, a + RING_SIDES, b + RING_SIDES);
    }
  }
  geometry.setIndex(index);
  for (const name of ["position", "normal"]) geometry.setAttribute(name, new THREE.BufferAttribute(new Float32Array(3 * count), 3));
  return geometry;
}

/** Bends the tube to an arc of `radius` [m] from 0 to `angle` [rad] that is `width` [m] thick. */
function bendRing(geometry, radius, width, angle) {
  const position = geometry.getAttribute("position"), normal = geometry.getAttribute("normal");
  for (let i = 0; i <= RING_STEPS; i++) {
    const a = (angle * i) / RING_STEPS;
    for (let j = 0; j < RING_SIDES; j++) {
      const b = (2 * Math.PI * j) / RING_SIDES;
      const out = [Math.cos(a) * Math.cos(b), Math.sin(a) * Math.cos(b), Math.sin(b)];
      normal.setXYZ(i * RING_SIDES + j, ...out);
      position.setXYZ(i * RING_SIDES + j, radius * Math.cos(a) + width * out[0], radius * Math.sin(a) + width * out[1], width * out[2]);
    }
  }
  position.needsUpdate = normal.needsUpdate = true;
}

/** A force in words: the joint that it passes and the part it acts on, as in "pin, on rocker". A joint of the tree is named after
 * its parts: its own name is that of its coordinate. */
function forceLabel({ name, on, by, sign, tree }) {
  if (!on || !by) return name;
  const [taker, giver] = sign === -1 ? [by, on] : [on, by];
  const acts = /\((drive|load)\)$/.exec(name);
  if (acts) return `${acts[1]}, on ${taker}`;
  return `${tree ? `joint with ${giver}` : name}, on ${taker}`;
}
