// The text beside the picture: what this is, can it be trusted, what was it computed with.

const SEVERITIES = { ok: ["\u2713", "OK"], warning: ["!", "Warning"], error: ["\u2715", "Error"] };

const isWide = () => !window.matchMedia("(max-width: 760px)").matches;

/** A part of the panel that folds, and is folded from the start in a narrow window. */
function section(title, ...content) { return fold(title, isWide(), content); }

function fold(title, open, content) {
  return make("details", { class: "fold", open }, make("summary", {}, make("h2", {}, title)), ...content);
}

/** What two runs that are compared were computed from differently. */
function differences(story) {
  const cells = (tag, words) => words.map((text) => make(tag, tag === "th" ? { scope: "col" } : {}, text));
  const rows = story.differences.map(([what, ...values]) => make("tr", {}, make("th", { scope: "row" }, what), ...cells("td", values)));
  return fold("What differs", true, [rows.length
    ? make("table", { class: "differences" }, make("thead", {}, make("tr", {}, ...cells("th", ["", "this run", story.ghost.name]))), make("tbody", {}, ...rows))
    : make("p", {}, "Mechanism, parameters, initial values, duration and settings are the same.")]);
}

function addPanel(story, holder) {
  const worst = ["error", "warning", "ok"].find((s) => story.health.some(([severity]) => severity === s));
  const verdict = { error: "Do not trust this result", warning: "Usable, with reservations", ok: "Every health check passed" }[worst];
  holder.append(make("header", {}, make("h1", {}, story.title), ...(story.summary ? [make("p", { class: "summary" }, story.summary)] : [])));
  if (worst) holder.append(make("p", { class: `verdict ${worst}` }, make("span", { class: "mark", "aria-hidden": "true" }, SEVERITIES[worst][0]), verdict));
  if (story.ghost && story.ghost.shown) holder.append(differences(story));
  const plots = make("div", { id: "plots" });
  holder.append(plots);
  if (story.health.length) {
    holder.append(fold("Health", worst !== "ok" || isWide(), [make("ul", { class: "health" }, ...story.health.map(([severity, sentence]) =>
      make("li", { class: severity }, make("span", { class: "mark", "aria-hidden": "true" }, SEVERITIES[severity][0]),
        make("span", {}, make("span", { class: "word" }, `${SEVERITIES[severity][1]}: `), sentence))))]));
  }
  if (story.facts.length) {
    holder.append(section("Parameters and settings", make("table", {}, make("tbody", {},
      ...story.facts.map(([label, text]) => make("tr", {}, make("th", { scope: "row" }, label), make("td", {}, text)))))));
  }
  if (story.reconstructed.length) {
    holder.append(section("Reconstructed", make("p", {},
      "The solver did not compute the poses of these bodies; they are rebuilt from its result: ", story.reconstructed.join(", "), ".")));
  }
  const notes = [story.tempo.sentence, story.playback, story.ghost && story.ghost.shown ? `The ghost and the dotted curves (values in brackets) are ${story.ghost.name}.` : ""].filter(Boolean);
  if (notes.length) holder.append(section("How it is shown", ...notes.map((text) => make("p", {}, text))));
  if (story.explore) return plots;
  const playing = story.t.count > 1 ? "Space plays and pauses, \u2190 and \u2192 step one frame (with shift ten), Home and End jump. " : "";
  const plotted = story.t.count > 1 && story.plots.length ? ", a click in a plot goes to that time" : "";
  holder.append(make("footer", {}, `${playing}${story.model ? "Drag a part to move it by hand, beside it to turn the view;" : "Drag turns the view,"} the wheel zooms${plotted}.`));
  return plots;
}
