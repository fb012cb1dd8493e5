// A live page: the server sends poses, which are shown at once; moving the time slider goes back to the recording. Parameters
// are sent to the server, which builds the mechanism anew.

function listen(story, stage, player, notice, panel) {
  const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`);
  const form = story.controls.length ? addControls(story.controls, panel, (values) => socket.send(JSON.stringify({ type: "values", values }))) : null;
  socket.onmessage = (event) => {
    const message = JSON.parse(event.data);
    if (message.type === "story") { if (form) form.keep(); location.reload(); }
    if (message.type === "refused" && form) form.refuse(message.message);
    if (message.type !== "poses" || stage.byHand) return;
    player.pause();
    message.position.forEach((position, k) => {
      stage.groups[k].position.fromArray(position);
      stage.groups[k].quaternion.fromArray(message.quaternion[k]).normalize();
    });
    stage.redraw();
    notice.textContent = "live";
    notice.className = "live";
  };
  socket.onclose = () => { notice.textContent = "the server has stopped"; notice.className = "stopped"; };
  player.onTime(() => { if (notice.className === "live") { notice.textContent = ""; notice.className = ""; } });
}

/** A form of all parameters; `send` gets those that were changed, as texts. */
function addControls(controls, panel, send) {
  const said = make("p", { class: "said", role: "alert" });
  const fields = controls.map((c) => make("input", { id: `set-${c.key}`, name: c.key, value: c.value, autocomplete: "off", spellcheck: "false", title: c.text }));
  const button = make("button", { type: "submit" }, "Rebuild");
  const rows = controls.map((c, k) => make("tr", {}, make("th", { scope: "row" }, make("label", { for: `set-${c.key}` }, c.key)), make("td", {}, fields[k]), make("td", { class: "unit" }, c.unit)));
  const changed = () => Object.fromEntries(fields.filter((f, k) => f.value.trim() !== controls[k].value).map((f) => [f.name, f.value.trim()]));
  const form = make("form", { id: "controls", onsubmit: (event) => {
    event.preventDefault();
    const values = changed();
    if (!Object.keys(values).length) { said.textContent = "Nothing is changed yet."; return; }
    said.textContent = "";
    button.disabled = true;
    button.textContent = "Rebuilding\u2026";
    send(values);
  } }, make("h2", {}, "Change and rebuild"), make("table", {}, make("tbody", {}, ...rows)), button, said);
  panel.querySelector("header").after(form);
  // The page is loaded anew when a run ends; what is typed but not sent yet outlives that.
  const kept = JSON.parse(sessionStorage.getItem("typed") || "{}");
  sessionStorage.removeItem("typed");
  for (const field of fields) if (kept[field.name] !== undefined) field.value = kept[field.name];
  const keep = () => { if (!button.disabled) sessionStorage.setItem("typed", JSON.stringify(changed())); };
  return { keep, refuse: (message) => { said.textContent = message; button.disabled = false; button.textContent = "Rebuild"; } };
}
