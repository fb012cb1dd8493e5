// The whole view in the address: camera, time, hidden parts, section, layers, plots, drives, parameters, forces, measuring. A link shows what its sender saw.

class Address {
  constructor(lab) { this.lab = lab; }

  /** The part of a link after #. */
  text() {
    const { stage, player, rig, inspector, section, follow, layers, curves, explorer, clips, field } = this.lab;
    const wishes = new URLSearchParams();
    const number = (x) => String(Number(x.toPrecision(9)));
    if (clips && clips.chosen) wishes.set("clip", clips.chosen);
    if (player.duration > 0) wishes.set("t", number(player.time));
    const { camera, controls } = stage.viewer;
    const eye = controls.target.clone().addScaledVector(camera.position.clone().sub(controls.target).normalize(), rig.projection.distance);
    wishes.set("camera", [...fromWorld(eye).toArray(), ...fromWorld(controls.target).toArray()].map((x) => String(Number(x.toPrecision(6)))).join());
    wishes.set("flat", rig.projection.flat ? "1" : "0");
    for (const k of [...inspector.visibility.hidden].sort((a, b) => a - b)) wishes.append("hide", stage.bodies[k]);
    if (inspector.card.body !== null) wishes.set("pin", stage.bodies[inspector.card.body]);
    if (follow.body !== null) wishes.set("follow", stage.bodies[follow.body]);
    if (section.axis) wishes.set("section", [section.axis, number(section.at), section.flipped ? "after" : "before"].join());
    for (const [id, { box, first }] of layers.show.switches) if (box.checked !== first) wishes.append("show", `${id},${box.checked ? 1 : 0}`);
    if (curves) {
      for (const name of curves.picker ? curves.picker.chosen : []) wishes.append("plot", name);
      if (curves.window.zoomed) wishes.set("zoom", [curves.window.start, curves.window.end].map(number).join());
    }
    if (explorer) this.tellByHand(wishes, explorer);
    if (field) wishes.set("color", field.chosen ? field.chosen.name : "");
    const { measuring } = inspector;
    // A feature that was picked has no name that another page knows.
    if (measuring.on) for (const feature of measuring.features) wishes.append("measure", measuring.named.includes(feature) ? feature.name : "");
    return wishes.toString();
  }

  tellByHand(wishes, explorer) {
    explorer.story.variants.forEach(({ key, values, home }, j) => {
      if (explorer.picked[j] !== home) wishes.append("parameter", `${values[explorer.picked[j]]},${key}`);
    });
    for (const [name, value] of Object.entries(explorer.given())) wishes.append("drive", `${value},${name}`);
    const { freeBody } = explorer;
    if (freeBody && freeBody.choice !== "none") for (const word of [freeBody.choice, ...freeBody.roles]) wishes.append("forces", word);
  }

  moveByHand(wishes, explorer) {
    // "1.25,crank": a name may have a comma too.
    const pairs = (key) => wishes.getAll(key).map((item) => [item.slice(item.indexOf(",") + 1), Number(item.slice(0, item.indexOf(",")))]).filter(([, value]) => Number.isFinite(value));
    for (const [key, value] of pairs("parameter")) {
      const j = explorer.story.variants.findIndex((v) => v.key === key);
      if (j < 0) continue;
      const away = explorer.story.variants[j].values.map((x) => Math.abs(x - value));
      explorer.pick(j, away.indexOf(Math.min(...away)));
    }
    if (wishes.has("drive")) explorer.give(Object.fromEntries(pairs("drive").filter(([name]) => Object.hasOwn(explorer.values, name))));
    const [choice, ...roles] = wishes.getAll("forces");
    if (choice && explorer.freeBody) explorer.freeBody.choose(choice, roles);
  }

  /** Shows what an address tells; what does not exist here is left as it is. */
  apply(text) {
    const { stage, player, rig, inspector, section, follow, layers, curves, explorer, clips, field } = this.lab;
    const wishes = new URLSearchParams(text);
    const numbers = (key) => (wishes.get(key) || "").split(",").map(Number);
    const finite = (list, count) => list.length === count && list.every(Number.isFinite);
    const body = (name) => { const k = stage.bodies.indexOf(name); return k < 0 ? null : k; };
    for (const item of wishes.getAll("show")) {
      const [id, on] = item.split(",");
      const known = layers.show.switches.get(id);
      if (known && known.box.checked !== (on === "1")) known.box.click();
    }
    if (wishes.has("hide")) inspector.visibility.set(wishes.getAll("hide").map(body).filter((k) => k !== null));
    const [axis, place, side] = (wishes.get("section") || "").split(",");
    if (Object.hasOwn(AXES, axis) && Number.isFinite(Number(place))) section.set(axis, Number(place), side === "after");
    if (clips && wishes.has("clip")) clips.choose(wishes.get("clip"));
    if (wishes.has("t") && Number.isFinite(Number(wishes.get("t")))) player.seek(Number(wishes.get("t")));
    if (explorer) this.moveByHand(wishes, explorer);
    if (field && wishes.has("color")) field.choose(wishes.get("color"));
    if (wishes.has("measure")) {
      inspector.measuring.switch(true);
      wishes.getAll("measure").slice(0, 2).forEach((name, slot) => inspector.measuring.take(slot, inspector.measuring.named.find((x) => x.name === name) || null));
    }
    if (wishes.has("flat")) rig.projection.set(wishes.get("flat") === "1");
    const camera = numbers("camera"), eye = camera.slice(0, 3), at = camera.slice(3);
    if (finite(camera, 6) && canLook(eye, at, stage.framing.radius)) rig.look(eye, at);
    if (wishes.has("pin")) inspector.pin(body(wishes.get("pin")));
    if (wishes.has("follow")) follow.set(body(wishes.get("follow")));
    if (curves && curves.picker) for (const name of wishes.getAll("plot")) if (curves.picker.items.some((item) => item.name === name)) curves.picker.choose(name);
    if (curves && wishes.has("zoom") && finite(numbers("zoom"), 2)) curves.window.zoom(...numbers("zoom"));
    if (wishes.has("play")) player.play();
  }

  /** Puts the view into the address of the page and its link on the clipboard; true when it is there. */
  async copy() {
    const link = `${location.href.split("#")[0]}#${this.text()}`;
    try { history.replaceState(null, "", link); } catch (error) { /* A page without an address of its own, as in a notebook. */ }
    try { await navigator.clipboard.writeText(link); return true; } catch (error) { return false; }
  }
}

/** Whether a camera can look from `eye` to `at`: not from the very place, nor from where nothing can be told apart. */
function canLook(eye, at, radius) {
  return length3(minus3(eye, at)) > 1e-6 * radius && Math.max(length3(eye), length3(at)) < 1e6 * radius;
}

/** The button that copies the link, with an answer that a reader hears too. */
function addLinkButton(address, holder) {
  const button = make("button", { type: "button", id: "copy-link", title: "Copy a link to this view: camera, time, hidden parts, section, plots", onclick: async () => {
    const done = await address.copy();
    button.textContent = done ? "Copied" : "In the address bar";
    setTimeout(() => { button.textContent = "Link"; }, 1800);
  } }, "Link");
  button.setAttribute("aria-live", "polite");
  holder.append(button);
}
