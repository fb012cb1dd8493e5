// What is shown beside the parts, and the menu that switches it.

const FEW = 12;

/** A dash-dotted line for every joint axis, fixed in its body. */
function addAxes(stage, marks) {
  const { radius } = stage.framing;
  const material = new THREE.LineDashedMaterial({ color: 0xb3261e, dashSize: 0.05 * radius, gapSize: 0.02 * radius });
  return marks.filter((m) => m.direction).map((mark) => {
    const half = new THREE.Vector3(...mark.direction).setLength(0.22 * radius);
    const middle = new THREE.Vector3(...mark.point);
    const line = new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints([middle.clone().sub(half), middle.clone().add(half)]), material);
    line.computeLineDistances();
    line.name = `axis ${mark.name}`;
    line.visible = false;
    stage.groups[mark.body].add(line);
    return line;
  });
}

/** A second, faint set of the moving parts; of another run with its own parts and paths. */
class Ghost {
  constructor(stage, story, read) {
    this.motion = new Motion({ ...story, motion: story.ghost.motion, knots: null }, read);
    this.holder = new THREE.Group();
    this.holder.name = "ghost";
    const material = faintMaterial();
    const draw = (group, geometry, matrix) => {
      const mesh = new THREE.Mesh(geometry, material);
      mesh.matrixAutoUpdate = false;
      mesh.matrix.copy(matrix);
      group.add(mesh);
    };
    this.groups = stage.groups.map((group, k) => {
      const copy = new THREE.Group();
      // What never moves apart from the original would only double it.
      const moves = story.moving[k] || story.ghost.motion[k].quaternion.count > 4;
      if (moves && !story.ghost.parts.length) for (const part of group.children) if (part.isMesh) draw(copy, part.geometry, part.matrix);
      this.holder.add(copy);
      return copy;
    });
    const shapes = stage.shapesOf(story, read);
    for (const part of story.ghost.parts) draw(this.groups[part.body], shapes[part.geometry].solid, new THREE.Matrix4().fromArray(part.placement));
    this.traces = new Traces(stage, story.ghost, read, { done: 0.45, ahead: 0.12 });
    this.paths = true;
    stage.root.add(this.holder);
  }

  show(on) { this.holder.visible = on; this.traces.show(on && this.paths); }

  /** Whether its paths are shown too. */
  showPaths(on) { this.paths = on; this.show(this.holder.visible); }

  apply(time) {
    if (!this.holder.visible) return;
    this.motion.apply(this.groups, time);
    this.traces.apply(this.motion.frame(time));
  }
}

class Show {
  constructor(holder, redraw) {
    this.holder = holder;
    this.list = make("div", { class: "choices" });
    this.redraw = redraw;
    this.switches = new Map();
    holder.append(make("summary", {}, "Show"), this.list);
    closeOutside(holder);
  }

  /** A switch; `action(on)` is called at once and at every change. */
  add(id, words, on, action) {
    const change = (event) => { action(event.target.checked); this.redraw(); };
    const box = make("input", { type: "checkbox", id: `show-${id}`, checked: on, onchange: change });
    this.switches.set(id, { box, first: on });
    this.list.append(make("label", { class: "check" }, box, words));
    action(on);
  }
}

function addShow(story, read, stage, traces, holder, redraw) {
  const show = new Show(holder, redraw);
  const labels = new Labels(stage, document.getElementById("labels"), [document.getElementById("views"), document.getElementById("menus"), document.getElementById("triad"), document.getElementById("scale")]);
  const arrows = new Arrows(stage, story, read);
  const axes = addAxes(stage, story.marks);
  const wanted = {};
  if (story.explore) wanted.values = true;
  const layer = { show, arrows, ghost: story.ghost ? new Ghost(stage, story, read) : null, labels, wanted };
  const name = (mark, kind) => labels.add(kind, () => markPoint(stage, mark), () => mark.name, () => wanted[kind] && stage.groups[mark.body].visible, mark.body);
  const kinds = { points: story.marks.filter((m) => m.kind === "frame"), bodies: story.marks.filter((m) => m.kind === "body"), axes: story.marks.filter((m) => m.direction) };
  for (const [kind, marks] of Object.entries(kinds)) for (const mark of marks) name(mark, kind);
  const nameArrows = () => {
    labels.remove(Object.keys(ARROW_COLORS));
    for (const item of arrows.items) labels.add(item.kind, () => item.tip, () => `${item.label} ${significant(item.size, 3)} ${unitText(item.unit)}`, () => item.visible && wanted.values);
  };
  arrows.onReplace = nameArrows;
  nameArrows();
  if (kinds.points.length) show.add("points", "names of points", kinds.points.length <= FEW, (on) => { wanted.points = on; });
  if (kinds.bodies.length) show.add("bodies", "names of parts", false, (on) => { wanted.bodies = on; });
  if (axes.length) show.add("axes", "joint axes", false, (on) => { wanted.axes = on && axes.length <= 2 * FEW; for (const axis of axes) axis.visible = on; });
  if (story.traces.length || story.explore) show.add("traces", "paths of points", true, (on) => { traces.show(on); if (layer.ghost) layer.ghost.showPaths(on); });
  if (arrows.items.length) show.add("arrows", "forces and torques", arrows.items.length <= 3, (on) => { arrows.shown = wanted.values = on; });
  if (layer.ghost) show.add("ghost", `ghost: ${story.ghost.name}`, story.ghost.shown, (on) => layer.ghost.show(on));
  holder.hidden = !show.list.children.length && !story.explore;
  return layer;
}
