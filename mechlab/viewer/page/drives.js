// The drives: for each one a slider, a field that takes numbers with units, and a lock.

class DriveRow {
  /** drive: {name, unit, low, high, home}; actions: move(value), release() after a change, lock(on). */
  constructor(drive, actions) {
    Object.assign(this, drive, actions);
    this.step = niceStep(this.high - this.low, 10000);
    const label = `${this.name}, ${this.unit}`;
    this.slider = make("input", { type: "range", min: this.low, max: this.high, step: "any", "aria-label": label,
      oninput: () => { this.move(this.slider.valueAsNumber + this.turns * 2 * Math.PI); }, onchange: () => this.release(), onkeydown: (event) => this.key(event) });
    this.field = make("input", { class: "quantity", autocomplete: "off", spellcheck: "false", "aria-label": `${this.name}, a number with a unit such as ${this.unit === "m" ? "5mm" : "37deg"}`,
      oninput: () => { this.editing = true; }, onchange: () => this.type(), onkeydown: (event) => this.fieldKey(event), onfocus: () => this.field.select() });
    this.degrees = make("span", { class: "unit" });
    this.button = make("button", { type: "button", class: "lock icon", "aria-pressed": "false", onclick: () => this.lock(!this.isLocked) });
    this.element = make("div", { class: "drive" }, make("span", { class: "name", title: this.name }, ...breakable(this.name)), this.slider, this.field, this.degrees, this.button);
    this.turns = 0;
    this.setLocked(false);
  }

  /** Arrow keys move by a hundredth of the slider, with shift by a tenth; Home goes home. */
  key(event) {
    const sign = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
    if (event.ctrlKey || event.altKey || event.metaKey || (event.key !== "Home" && !sign)) return;
    event.preventDefault();
    event.stopPropagation();
    const step = ((this.high - this.low) / 100) * (event.shiftKey ? 10 : 1);
    this.move(event.key === "Home" ? this.home : this.value + sign * step);
    this.release();
  }

  fieldKey(event) {
    event.stopPropagation();
    if (event.key !== "Escape") return;
    this.editing = false;
    this.field.blur();
    this.show(this.value);
  }

  type() {
    this.editing = false;
    let value = null;
    try { value = parseQuantity(this.field.value, this.unit); } catch (error) { this.refuse(error.message); return; }
    this.move(value);
    this.release();
  }

  /** Keeps what was typed, marked, and says why it is none. */
  refuse(words) {
    this.field.setAttribute("aria-invalid", "true");
    this.complain(`${this.name}: ${words}.`);
  }

  setLocked(on) {
    if (on === this.isLocked) return;
    this.isLocked = on;
    this.button.setAttribute("aria-pressed", String(on));
    this.button.setAttribute("aria-label", `${on ? "Unlock" : "Lock"} ${this.name}`);
    this.button.title = on ? "Locked: it holds still while parts are moved" : "Lock: hold this drive still while parts are moved";
    this.button.replaceChildren(icon(on ? "locked" : "open"));
    this.slider.disabled = this.field.disabled = on;
    this.element.classList.toggle("locked", on);
  }

  show(value) {
    this.value = value;
    const turning = this.unit === "rad" && !this.range;
    this.turns = turning ? Math.floor((value - this.low) / (2 * Math.PI) - 1e-9) : 0;
    this.slider.value = value - this.turns * 2 * Math.PI;
    const length = this.unit === "m";
    const text = length ? `${fixed(1000 * value, 1000 * this.step)} mm` : `${fixed(value, this.step)} rad`;
    if (!this.editing) { this.field.value = text; this.field.removeAttribute("aria-invalid"); }
    this.degrees.textContent = length ? "" : `${fixed((value * 180) / Math.PI, 0.1)}\u00b0`;
    this.slider.setAttribute("aria-valuetext", length ? text : `${text}, ${this.degrees.textContent}`);
  }
}
