// Inspecting: hover, pin, hide and isolate parts, with the mouse, by touch and from a list of the parts.

class Inspector {
  constructor(story, stage, labels, sources, redraw) {
    const byId = (id) => document.getElementById(id);
    this.stage = stage;
    this.labels = labels;
    this.readings = new Readings(story, stage, sources);
    this.visibility = new Visibility(stage, redraw);
    this.hover = byId("hover");
    this.follow = new Follow(stage, byId("following"));
    this.pickers = [];
    this.pinFollowers = [];
    this.describers = [];
    this.card = new Card(byId("card"), this.readings, [
      ["Hide", "Hide this part (show it again in the list of parts)", (body) => { this.visibility.hide(body); this.pin(null); }],
      ["Isolate", "Hide all other parts; again: show all", (body) => this.isolate(body)],
      ["Follow", "The camera moves along with this part; again: it stays", (body) => this.follow.set(this.follow.body === body ? null : body)],
    ], () => this.pin(null));
    this.picker = new Picker(stage, byId("viewport"), (hit, event) => this.name(hit, event), (hit, event) => this.pick(hit, event));
    this.section = new Section(stage, this.picker, byId("section"));
    this.visibility.onMark(() => this.section.cut());
    this.measuring = new Measuring(story, this, labels, byId("measure-button"), byId("measure"));
    this.list = new PartList(byId("parts"), stage, this);
    listenTo(document, "keydown", (event) => { if (event.key === "Escape" && !event.defaultPrevented) this.pin(null); });
  }

  /** Takes over the clicks for a while: `picker(hit, event)` returns true when it has used one. */
  intercept(picker) { this.pickers.push(picker); }

  /** `follower(body)` is called when another part is picked. */
  onPin(follower) { this.pinFollowers.push(follower); }

  name(hit, event) {
    const feature = this.measuring.on && event.pointerType !== "touch" && !event.buttons ? this.measuring.featureAt(hit, event.clientX, event.clientY) : null;
    const spring = this.springs && !feature && event.pointerType !== "touch" && !event.buttons ? this.springs.wordsAt(this.picker, event.clientX, event.clientY, hit) : "";
    this.hover.hidden = !hit && !feature && !spring;
    this.visibility.mark("hover", hit && hit.body !== this.card.body ? hit.body : null);
    this.labels.focus(hit ? hit.body : this.card.body);
    document.getElementById("viewport").classList.toggle("over", Boolean(hit));
    if (this.hover.hidden) return;
    this.hover.textContent = feature ? feature.name : spring || this.partName(hit);
    const box = this.hover.parentElement.getBoundingClientRect();
    const x = Math.min(event.clientX - box.left + 14, box.width - this.hover.offsetWidth - 4), y = Math.max(4, event.clientY - box.top - 26);
    this.hover.style.transform = `translate(${x.toFixed(0)}px, ${y.toFixed(0)}px)`;
  }

  /** What is under the pointer, in words; a function of `describers` that knows more comes first. */
  partName(hit) {
    const { body, part } = hit;
    for (const describe of this.describers) { const words = describe(hit); if (words) return words; }
    const name = this.stage.bodies[body];
    return !part || part === name ? name : `${name} \u00b7 ${part.replace(/_/g, " ")}`;
  }

  pick(hit, event) {
    if (this.pickers.some((picker) => picker(hit, event))) return;
    this.pin(hit ? hit.body : null);
  }

  /** Pins the card of a body (index), or none. */
  pin(body) {
    this.visibility.mark("hover", null);
    this.visibility.mark("pin", body);
    this.card.show(body);
    this.list.update();
    for (const follower of this.pinFollowers) follower(body);
  }

  isolate(body) {
    if (this.visibility.hidden.size === this.stage.groups.length - 1 && !this.visibility.hidden.has(body)) this.visibility.showAll();
    else this.visibility.isolate(body);
  }

  update() { this.card.update(); }
}

/** The menu of all parts: a switch for each, and its name, which pins it. */
class PartList {
  constructor(holder, stage, inspector) {
    this.inspector = inspector;
    const drawn = stage.groups.map((group, k) => k).filter((k) => stage.groups[k].children.some((x) => x.isMesh));
    const { visibility } = inspector;
    this.rows = drawn.map((body) => {
      const box = make("input", { type: "checkbox", checked: true, "aria-label": `show ${stage.bodies[body]}`,
        onchange: (event) => (event.target.checked ? visibility.show(body) : visibility.hide(body)) });
      const name = make("button", { type: "button", class: "plain", onclick: () => inspector.pin(inspector.card.body === body ? null : body) }, stage.bodies[body]);
      const only = make("button", { type: "button", class: "plain only", "aria-label": `isolate ${stage.bodies[body]}`, onclick: () => inspector.isolate(body) }, "only");
      return { body, box, name, element: make("div", { class: "part-row" }, box, name, only) };
    });
    this.all = make("button", { type: "button", id: "show-all", onclick: () => visibility.showAll() }, "Show all");
    this.heading = make("summary", {}, "Parts");
    holder.append(this.heading, make("div", { class: "choices" }, this.all, ...this.rows.map((row) => row.element)));
    closeOutside(holder);
    holder.hidden = !this.rows.length;
    visibility.onChange(() => this.update());
    this.update();
  }

  update() {
    const { visibility, card } = this.inspector;
    const shown = this.rows.filter((row) => !visibility.hidden.has(row.body)).length;
    this.heading.textContent = shown < this.rows.length ? `Parts (${shown} of ${this.rows.length})` : "Parts";
    this.all.disabled = shown === this.rows.length;
    for (const { body, box, name } of this.rows) {
      box.checked = !visibility.hidden.has(body);
      name.setAttribute("aria-pressed", String(card.body === body));
    }
  }
}

/** A menu (a details element) closes by a press elsewhere and by Escape. */
function closeOutside(holder) {
  listenTo(document, "pointerdown", (event) => { if (!holder.contains(event.target)) holder.open = false; });
  holder.addEventListener("keydown", (event) => {
    if (event.key !== "Escape" || !holder.open) return;
    holder.open = false;
    event.preventDefault();
    holder.querySelector("summary").focus();
  });
}
