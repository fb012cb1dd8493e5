// Time: playing, stepping, scrubbing, keys. Whoever wants to follow the time registers with `onTime`.

class Player {
  constructor(motion, tempo, holder) {
    this.motion = motion;
    this.time = motion.start;
    this.playing = false;
    this.loop = true;
    this.followers = [];
    /** The part that is played. */
    this.start = motion.start;
    this.end = motion.end;
    this.step = Math.pow(10, Math.floor(Math.log10(this.duration || 1)) - 3);
    this.tempo = tempo;
    this.speed = tempo.speed;
    if (this.duration > 0) this.build(holder); else holder.hidden = true;
  }

  get duration() { return this.end - this.start; }

  /** Plays only the part from `start` to `end` [s]. */
  clip(start, end) {
    this.start = Math.max(this.motion.start, start);
    this.end = Math.min(this.motion.end, end);
    this.seek(this.start);
  }

  build(holder) {
    const button = (label, icon, action) => make("button", { type: "button", "aria-label": label, title: label, class: "icon", onclick: action }, icon);
    this.playButton = make("button", { type: "button", id: "play", "aria-label": "Play", title: "Play or pause (space)", onclick: () => this.toggle() }, icon("play"));
    this.slider = make("input", { type: "range", id: "time", min: 0, max: 1, step: "any", value: 0, "aria-label": "Time",
      oninput: () => { this.pause(); this.seek(this.start + this.slider.valueAsNumber * this.duration); } });
    this.clock = make("output", { id: "clock", for: "time" });
    const speeds = make("select", { id: "speed", "aria-label": "Playback speed", title: "Playback speed",
      onchange: (event) => { this.speed = Number(event.target.value); this.warn(); } },
      ...this.tempo.speeds.map((s) => make("option", { value: s, selected: s === this.speed }, `${s}\u00d7`)));
    const loop = make("input", { type: "checkbox", id: "loop", checked: true, onchange: (event) => { this.loop = event.target.checked; } });
    holder.append(
      button("One frame back (\u2190)", icon("back"), () => this.stepBy(-1)),
      this.playButton,
      button("One frame forward (\u2192)", icon("forward"), () => this.stepBy(1)),
      this.slider, this.clock, speeds, make("label", { class: "check" }, loop, "loop"));
    listenTo(document, "keydown", (event) => this.key(event));
  }

  /** Says so when teeth pass faster than a screen can show. */
  warn() {
    const notice = document.getElementById("notice");
    const fast = this.tempo.limit !== null && this.speed > this.tempo.limit;
    if (fast) { notice.textContent = "At this speed teeth may seem to run backwards"; notice.className = "stopped fast"; }
    else if (notice.classList.contains("fast")) { notice.textContent = ""; notice.className = ""; }
  }

  onTime(follower) { this.followers.push(follower); follower(this.time); }

  seek(time) {
    if (!Number.isFinite(time)) throw new Error(`cannot seek to ${time}: expected seconds`);
    this.time = Math.min(this.end, Math.max(this.start, time));
    for (const follower of this.followers) follower(this.time);
    if (!this.slider) return;
    this.slider.value = (this.time - this.start) / this.duration;
    this.clock.textContent = `${fixed(this.time, this.step)} s`;
    this.slider.setAttribute("aria-valuetext", `${fixed(this.time, this.step)} of ${fixed(this.end, this.step)} seconds`);
  }

  stepBy(frames) { this.pause(); this.seek(this.motion.neighbour(this.time, frames)); }
  toggle() { if (this.playing) this.pause(); else this.play(); }

  play() {
    if (this.playing || !this.slider) return;
    if (this.time >= this.end) this.seek(this.start);
    this.setPlaying(true);
    let last = null;
    const tick = (now) => {
      if (!this.playing) return;
      let time = this.time + (last === null ? 0 : ((now - last) / 1000) * this.speed);
      last = now;
      if (time >= this.end) {
        if (this.loop) time = this.start + ((time - this.end) % this.duration);
        else { this.setPlaying(false); time = this.end; }
      }
      this.seek(time);
      if (this.playing) this.request = requestAnimationFrame(tick);
    };
    this.request = requestAnimationFrame(tick);
  }

  pause() {
    if (!this.playing) return;
    cancelAnimationFrame(this.request);
    this.setPlaying(false);
    this.seek(this.time);
  }

  setPlaying(playing) {
    this.playing = playing;
    this.playButton.setAttribute("aria-label", playing ? "Pause" : "Play");
    this.playButton.replaceChildren(icon(playing ? "pause" : "play"));
  }

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const tag = event.target.tagName;
    const onSlider = event.target === this.slider;
    if (tag === "SELECT" || tag === "TEXTAREA" || (tag === "INPUT" && !onSlider)) return;
    if (event.key === " " && tag === "BUTTON") return;
    const jump = event.shiftKey ? 10 : 1;
    const actions = {
      " ": () => this.toggle(),
      ArrowLeft: () => this.stepBy(-jump),
      ArrowRight: () => this.stepBy(jump),
      Home: () => { this.pause(); this.seek(this.start); },
      End: () => { this.pause(); this.seek(this.end); },
    };
    if (!(event.key in actions)) return;
    event.preventDefault();
    actions[event.key]();
  }
}

const ICONS = { play: "M5 3v14l12-7z", pause: "M5 3h4v14H5zM11 3h4v14h-4z",
  locked: "M5 9V6.5a5 5 0 0 1 10 0V9h1v9H4V9zM7 9h6V6.5a3 3 0 0 0-6 0z", open: "M5 9V6a4.6 4.6 0 0 1 9-1.4l-1.9.6A2.6 2.6 0 0 0 7 6v3h9v9H4V9z", back: "M14 4v12l-8-6zM4 4h2v12H4z", forward: "M6 4v12l8-6zM14 4h2v12h-2z" };

function icon(name) {
  const namespace = "http://www.w3.org/2000/svg";
  const svg = document.createElementNS(namespace, "svg");
  svg.setAttribute("viewBox", "0 0 20 20");
  svg.setAttribute("aria-hidden", "true");
  svg.appendChild(document.createElementNS(namespace, "path")).setAttribute("d", ICONS[name]);
  return svg;
}
