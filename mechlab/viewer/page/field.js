// A surface that is coloured by a quantity, such as a workspace by its dexterity, with a scale and values under the pointer.

// Cividis (Nunez, Anderton and Renslow 2018): even in brightness, the same for the colour-blind.
const FIELD_COLORS = [[0, 34, 78], [35, 62, 108], [87, 93, 109], [124, 123, 120], [165, 154, 118], [209, 189, 103], [253, 231, 55]];

/** Red, green, blue, 0 to 1, at a share from 0 to 1. */
function fieldColor(share) {
  const at = Math.min(1, Math.max(0, share)) * (FIELD_COLORS.length - 1), k = Math.min(FIELD_COLORS.length - 2, Math.floor(at));
  return [0, 1, 2].map((c) => (FIELD_COLORS[k][c] + (at - k) * (FIELD_COLORS[k + 1][c] - FIELD_COLORS[k][c])) / 255);
}

class FieldView {
  constructor(story, read, stage, inspector, show, holder) {
    Object.assign(this, { stage, read, fields: story.fields, chosen: null });
    this.mesh = stage.groups.flatMap((group) => group.children).find((x) => x.isMesh && x.name === story.fields[0].part);
    this.plain = this.mesh.material;
    // Its edges are those of the grid, not of the quantity.
    for (const edges of this.mesh.children) edges.visible = false;
    this.colored = this.plain.clone();
    Object.assign(this.colored, { vertexColors: true, opacity: 0.72 });
    this.colored.color.setRGB(1, 1, 1);
    this.select = make("select", { id: "field-select", onchange: () => this.choose(this.select.value) },
      ...this.fields.map((f) => make("option", { value: f.name }, f.name)), make("option", { value: "" }, "one colour"));
    const stops = FIELD_COLORS.map((color) => `rgb(${color.join(",")})`).join(", ");
    this.scale = make("div", { class: "bar", role: "img", style: `background: linear-gradient(to right, ${stops})` });
    this.ends = make("div", { class: "ends" }, make("span"), make("span"), make("span"));
    this.text = make("p", { class: "hint" });
    holder.querySelector("header").after(make("section", { id: "field", "aria-label": "Colours" },
      make("label", { for: "field-select" }, `Colour of the ${story.fields[0].part}: `), this.select, this.scale, this.ends, this.text));
    inspector.describers.push((hit) => (hit.mesh === this.mesh && this.chosen ? `${this.chosen.name} ${withUnit(this.valueAt(hit), this.chosen.unit)}` : ""));
    show.add("field", story.fields[0].part, true, (on) => { this.mesh.visible = on; });
    this.choose(this.fields[0].name);
  }

  /** Colours the surface by the field of that name; "" takes the colours away. */
  choose(name) {
    const field = this.fields.find((f) => f.name === name) || null;
    this.chosen = field;
    this.select.value = field ? name : "";
    this.mesh.material = field ? this.colored : this.plain;
    for (const item of [this.scale, this.ends, this.text]) item.hidden = !field;
    if (field) this.paint(field);
    this.stage.redraw();
  }

  paint(field) {
    this.values = this.read(field.values);
    const span = field.high - field.low || 1, colors = new Float32Array(3 * this.values.length), color = new THREE.Color();
    this.values.forEach((value, k) => {
      color.setRGB(...fieldColor((value - field.low) / span)).convertSRGBToLinear();
      colors.set([color.r, color.g, color.b], 3 * k);
    });
    this.mesh.geometry.setAttribute("color", new THREE.BufferAttribute(colors, 3));
    [field.low, (field.low + field.high) / 2, field.high].forEach((value, k) => { this.ends.children[k].textContent = withUnit(value, field.unit, 3); });
    this.scale.setAttribute("aria-label", `Scale from ${this.ends.children[0].textContent} to ${this.ends.children[2].textContent}`);
    this.text.textContent = field.text;
  }

  /** The value under the pointer, linear over the triangle that it meets. */
  valueAt({ mesh, face, point }) {
    const index = mesh.geometry.index.array, position = mesh.geometry.getAttribute("position");
    const corners = [0, 1, 2].map((k) => index[3 * face + k]);
    const [a, b, c] = corners.map((v) => new THREE.Vector3().fromBufferAttribute(position, v));
    const local = mesh.worldToLocal(toWorld(point));
    const weights = new THREE.Triangle(a, b, c).getBarycoord(local, new THREE.Vector3());
    return weights ? weights.toArray().reduce((sum, w, k) => sum + w * this.values[corners[k]], 0) : NaN;
  }
}

function addFields(story, read, stage, inspector, show, holder) {
  return story.fields.length ? new FieldView(story, read, stage, inspector, show, holder) : null;
}
