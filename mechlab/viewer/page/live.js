// A live page: the server sends poses, which are shown at once, and says when it has another story, which replaces the one
// that is shown, in the open page, as soon as the reader has nothing in hand. Parameters are sent to the server, which builds the
// mechanism anew.

const RETRY = [500, 5000]; // ms between two attempts to reach a server that has gone: first, longest

class Live {
  /** `replace(story, read, adopt)` puts another story into the page and hands its parts to `adopt`; `parts` are the present ones. */
  constructor(story, parts, replace) {
    Object.assign(this, { replace, shown: story.live, wanted: story.live, controls: story.controls, typed: {}, sent: null, refused: "", pose: null, asked: false, wait: RETRY[0] });
    this.adopt(parts);
    this.connect();
  }

  connect() {
    const socket = this.socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`);
    socket.onopen = () => { this.wait = RETRY[0]; this.say("", ""); };
    socket.onmessage = (event) => this.take(JSON.parse(event.data));
    socket.onclose = () => {
      this.asked = false;
      this.say("the server has stopped; the page goes on when it is back", "stopped");
      setTimeout(() => this.connect(), this.wait);
      this.wait = Math.min(RETRY[1], 2 * this.wait);
    };
  }

  take(message) {
    if (message.type === "poses") { this.pose = message; this.show(); }
    if (message.type === "story") this.follow(message);
    if (message.type === "document") this.receive(message);
    if (message.type === "built") { this.sent = null; this.refresh(); this.letGo(); }
    if (message.type === "refused") {
      this.typed = { ...this.sent, ...this.typed };
      this.sent = null;
      this.refused = message.message;
      this.refresh();
      if (!this.form) this.say(message.message, "stopped");
    }
  }

  follow({ session, number }) {
    this.wanted = { session, number };
    if (session !== this.shown.session) this.sent = null;
    this.catchUp();
  }

  /** Asks for the story that the server shows now, unless it is the one shown here, or on its way, or would take something away. */
  catchUp() {
    const { session, number } = this.wanted;
    if ((session === this.shown.session && number <= this.shown.number) || this.socket.readyState !== WebSocket.OPEN) return;
    if (this.inHand) { this.offer(); return; }
    if (!this.asked) this.socket.send('{"type": "show"}');
    this.asked = true;
  }

  /** Whether the reader has something in hand that another story would take away: a part, or an edit that is not built. */
  get inHand() {
    const { explorer } = this.parts;
    return Boolean(explorer && !this.free && (explorer.begun || explorer.editor.on || explorer.source.drawnAs));
  }

  offer() {
    const { notice, explorer } = this.parts;
    if (explorer.begun || notice.className === "waiting") return;
    this.say("A newer page is ready; this edit is not in it. ", "waiting");
    notice.append(make("button", { type: "button", id: "take-newer", onclick: () => this.letGo() }, "Show it"));
  }

  /** What the reader has in hand is built, or given up. */
  letGo() { this.free = true; this.catchUp(); }

  async receive({ document: story, block }) {
    const read = await blockReader(block);
    this.asked = false;
    if (this.inHand) { this.offer(); return; }
    this.shown = story.live;
    this.controls = story.controls;
    this.replace(story, read, (parts) => this.adopt(parts));
    this.show();
    this.catchUp();
  }

  adopt(parts) {
    this.parts = parts;
    this.free = false;
    this.form = this.controls.length ? addControls(this, parts.panel) : null;
    parts.player.onTime(() => { this.leave(); this.catchUp(); });
    if (!parts.explorer) return;
    parts.explorer.onMove(() => this.catchUp());
    parts.explorer.editor.connect((values) => { Object.assign(this.typed, values); this.ask(); }, (text) => this.build(text));
  }

  /** Shows the newest poses, where they are those of the story that is shown. */
  show() {
    const message = this.pose, { stage, player, explorer } = this.parts;
    if (!message || message.number !== this.shown.number) return;
    if (explorer && explorer.byHand) { this.leave(); return; }
    player.pause();
    if (explorer) explorer.live = message.q;
    message.position.forEach((position, k) => {
      stage.groups[k].position.fromArray(position);
      stage.groups[k].quaternion.fromArray(message.quaternion[k]).normalize();
    });
    stage.redraw();
    this.say("live", "live");
  }

  /** Whoever moves the time looks at the recording again, whoever moves a part at what it does. */
  leave() {
    if (this.parts.explorer) this.parts.explorer.live = null;
    if (this.parts.notice.className === "live") this.say("", "");
  }

  say(words, kind) {
    this.parts.notice.textContent = words;
    this.parts.notice.className = kind;
  }

  /** Sends the parameters that were changed. */
  ask() {
    const values = Object.fromEntries(this.controls.filter((c) => c.key in this.typed).map((c) => [c.key, this.typed[c.key]]));
    this.refused = Object.keys(values).length ? "" : "Nothing is changed yet.";
    if (!this.refused && this.socket.readyState !== WebSocket.OPEN) this.refused = "The server has stopped; nothing was sent.";
    if (!this.refused) {
      this.socket.send(JSON.stringify({ type: "values", values }));
      [this.sent, this.typed] = [{ ...this.sent, ...values }, {}];
    }
    this.refresh();
  }

  /** Sends a model as text, to be built and checked as it is. */
  build(text) {
    if (this.socket.readyState !== WebSocket.OPEN) { this.say("the server has stopped; nothing was sent", "stopped"); return; }
    this.socket.send(JSON.stringify({ type: "model", text }));
    this.sent = { ...this.sent };
    this.refresh();
  }

  refresh() { if (this.form) this.form.refresh(); }
}

/** A form of all parameters. What is typed, sent and refused is kept by `live`, whatever becomes of the form. */
function addControls(live, panel) {
  const { controls } = live;
  const said = make("p", { class: "said", role: "alert" });
  const type = ({ key, value }, text) => { if (text === value) delete live.typed[key]; else live.typed[key] = text; };
  const fields = controls.map((c) => make("input", { id: `set-${c.key}`, name: c.key, autocomplete: "off", spellcheck: "false", title: c.text,
    value: live.typed[c.key] ?? (live.sent || {})[c.key] ?? c.value, oninput: (event) => type(c, event.target.value.trim()) }));
  const button = make("button", { type: "submit" });
  const rows = controls.map((c, k) => make("tr", {}, make("th", { scope: "row" }, make("label", { for: `set-${c.key}` }, c.key)), make("td", {}, fields[k]), make("td", { class: "unit" }, unitText(c.unit))));
  const form = make("form", { id: "controls", onsubmit: (event) => { event.preventDefault(); live.ask(); } },
    make("h2", {}, "Change and rebuild"), make("table", {}, make("tbody", {}, ...rows)), button, said);
  panel.querySelector("header").after(form);
  const refresh = () => {
    button.textContent = live.sent ? "Rebuilding\u2026" : "Rebuild";
    said.textContent = live.refused;
  };
  refresh();
  return { refresh };
}
