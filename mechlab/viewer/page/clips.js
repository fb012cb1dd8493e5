// Buttons that play one part of a story each, such as the modes of a mechanism with their frequencies.

class Clips {
  constructor(clips, player, curves, holder) {
    Object.assign(this, { clips, player, curves, chosen: "" });
    this.buttons = clips.map((clip) => make("button", { type: "button", title: clip.text, onclick: () => { this.choose(clip.name); player.play(); } },
      make("b", {}, clip.value), make("span", {}, clip.name)));
    holder.querySelector("header").after(make("div", { id: "clips", role: "group", "aria-label": "What is played" }, ...this.buttons));
    this.choose(clips[0].name);
  }

  /** Plays the clip of a name; another name is left alone. */
  choose(name) {
    const clip = this.clips.find((x) => x.name === name);
    if (!clip) return;
    this.chosen = name;
    this.player.clip(clip.start, clip.end);
    if (this.curves) this.curves.window.zoom(clip.start, clip.end);
    this.buttons.forEach((button, k) => button.setAttribute("aria-pressed", String(this.clips[k] === clip)));
  }
}

function addClips(clips, player, curves, holder) { return clips.length && player.duration > 0 ? new Clips(clips, player, curves, holder) : null; }
