// The card of the part that is picked: name, pose, velocity, mass, joints, and what can be done with it.

class Card {
  /** `actions`: [[words, title, action(body)], ...] */
  constructor(holder, readings, actions, onClose) {
    this.holder = holder;
    this.readings = readings;
    this.body = null;
    this.title = make("h2", {});
    this.rows = make("tbody", {});
    this.buttons = make("div", { class: "card-actions" }, ...actions.map(([words, title, action]) =>
      make("button", { type: "button", title, onclick: () => action(this.body) }, words)));
    holder.append(make("div", { class: "card-head" }, this.title, make("button", { type: "button", class: "close", "aria-label": "Close", title: "Close (Esc)", onclick: onClose }, "\u00d7")),
      this.buttons, make("table", {}, this.rows));
    holder.hidden = true;
  }

  show(body) {
    this.body = body;
    this.holder.hidden = body === null;
    this.update();
  }

  update() {
    if (this.body === null) return;
    const reading = this.readings.of(this.body);
    this.title.textContent = reading.name;
    const rows = cardRows(reading);
    // The same rows keep their elements, so that a text that is being selected stays.
    if (this.rows.children.length !== rows.length) {
      this.rows.replaceChildren(...rows.map(() => make("tr", {}, make("th", { scope: "row" }), make("td", {}))));
    }
    rows.forEach(([label, text], k) => {
      const [head, cell] = this.rows.children[k].children;
      if (head.textContent !== label) head.textContent = label;
      if (cell.textContent !== text) cell.textContent = text;
    });
  }
}

/** The rows [label, text] of a card. */
function cardRows(reading) {
  const rows = [["position", vectorText(reading.position, "m")], ["turned", turnText(reading.quaternion)]];
  if (reading.velocity) {
    const { linear, angular } = reading.velocity;
    rows.push(["velocity", vectorText(linear, "m/s")], ["speed", withUnit(Math.hypot(...linear), "m/s")]);
    rows.push(["turning", withUnit(Math.hypot(...angular), "rad/s") + aboutText(angular)]);
  }
  if (reading.inertia) rows.push(["mass", withUnit(reading.inertia.mass, "kg")], ["centre of mass", `${vectorText(reading.inertia.com, "m")} in the part`]);
  for (const joint of reading.joints) {
    rows.push(["joint", `${joint.name}: ${joint.kind}, on ${joint.parent}`]);
    if (joint.value !== null) rows.push(["\u2003value", withUnit(joint.value, joint.unit)]);
    rows.push(["\u2003range", joint.range ? rangeText(joint.range, joint.unit) : "no limits"]);
  }
  for (const loop of reading.loops) rows.push(["loop", `${loop.name}: ${loop.kind}, with ${loop.other}`]);
  return rows;
}
