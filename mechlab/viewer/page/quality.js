// Fewer details while a slow machine moves the picture: no shadow, no feature edges, fewer pixels. Without a graphics card a
// frame with everything takes half a second. All details are back as soon as the picture stands still.

const SLOW = 50;
const STILL = 300;
const IN_A_ROW = 2;
/** Share of the pixels' side length at each level; level 0 draws everything. */
const LEVELS = [1, 1, 0.66, 0.5];
/** The layer of the feature edges: a camera that does not see it draws none. */
const EDGE_LAYER = 1;

class Quality {
  constructor(stage) {
    this.stage = stage;
    this.viewer = stage.viewer;
    this.pixels = this.viewer.renderer.getPixelRatio();
    this.level = 0;
    this.shown = 0;
    this.slow = 0;
    this.ended = 0;
    // The viewer's own loop calls this from its next frame on.
    this.viewer.animate = (now) => this.tick(now ?? performance.now());
  }

  tick(now) {
    requestAnimationFrame((next) => this.viewer.animate(next));
    if (this.began !== undefined) this.judge(now - this.began);
    this.began = undefined;
    if (this.viewer.needs_render) {
      this.set(this.level);
      this.viewer.render();
      this.began = this.ended = now;
    } else if (this.shown && now - this.ended > STILL) this.full();
  }

  /** Takes the time that a frame took [ms]; several slow ones in a row lower the level. */
  judge(took) {
    if (document.hidden) return;
    this.slow = took > SLOW ? this.slow + 1 : 0;
    if (this.slow < IN_A_ROW || this.level === LEVELS.length - 1) return;
    this.level = Math.min(LEVELS.length - 1, this.level + (took > 3 * SLOW ? 2 : 1));
    this.slow = 0;
  }

  /** Draws everything, now. A movement that begins later tries again with one detail more. */
  full() {
    this.level = Math.max(0, this.level - (this.level > 1 ? 0 : 1));
    this.set(0);
    this.viewer.render();
    this.began = undefined;
  }

  set(level) {
    const { renderer, camera } = this.viewer;
    const edges = camera.layers;
    if (level) edges.disable(EDGE_LAYER); else edges.enable(EDGE_LAYER);
    if (level === this.shown) return;
    const details = !level;
    this.stage.key.castShadow = details;
    if (this.stage.shade) this.stage.shade.visible = details;
    if (LEVELS[level] !== LEVELS[this.shown]) renderer.setPixelRatio(this.pixels * LEVELS[level]);
    this.shown = level;
  }
}
