// A camera that moves along with a body, so that it keeps its place in the picture.

class Follow {
  constructor(stage, chip) {
    this.stage = stage;
    this.chip = chip;
    this.body = null;
    stage.attach(() => this.update());
  }

  /** Follows a body (index), or none. */
  set(body) {
    this.body = body;
    this.last = body === null ? null : this.stage.groups[body].position.clone();
    this.chip.hidden = body === null;
    if (body === null) return;
    this.chip.replaceChildren(`The camera follows ${this.stage.bodies[body]} `,
      make("button", { type: "button", class: "plain", "aria-label": "Stop following", onclick: () => this.set(null) }, "\u00d7"));
  }

  update() {
    if (this.body === null) return;
    const here = this.stage.groups[this.body].position;
    const step = toWorld(here.clone().sub(this.last));
    this.last.copy(here);
    const { camera, controls } = this.stage.viewer;
    controls.target.add(step);
    camera.position.add(step);
  }
}
