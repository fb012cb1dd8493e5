// Another story in the open page. All that the reader has set stays: camera, scrolling, switches, focus, speed and time. The
// renderer goes on with the new stage, so that the picture changes from one frame to the next.

/** What the reader has set in the page that shows `parts`. */
function readerState({ stage, rig, player }) {
  const { camera, controls } = stage.viewer;
  const focus = document.activeElement;
  return {
    camera: { position: camera.position.clone(), target: controls.target.clone(), zoom: camera.zoom, touched: rig.touched, radius: stage.framing.radius },
    scroll: [["#panel", document.getElementById("panel").scrollTop], ["html", document.documentElement.scrollTop]],
    switches: [...document.querySelectorAll("#lab input[type=checkbox][id]")].filter((x) => x.checked !== x.defaultChecked).map((x) => [x.id, x.checked]),
    choices: [...document.querySelectorAll("#lab select[id]")].filter((x) => ![...x.options].every((o) => o.selected === o.defaultSelected)).map((x) => [x.id, x.value]),
    open: [...document.querySelectorAll("#lab details[id]")].map((x) => [x.id, x.open]),
    focus: focus && focus.id ? { id: focus.id, from: focus.selectionStart, to: focus.selectionEnd } : null,
    time: player.time,
    playing: player.playing,
    live: document.getElementById("notice").className === "live",
  };
}

/** Sets in the page that shows `parts` what the reader had set, as far as the new story has it. */
function restoreState({ stage, rig, player }, state) {
  const find = (id) => document.getElementById(id);
  const set = (id, apply) => {
    const element = find(id);
    if (!element) return;
    apply(element);
    element.dispatchEvent(new Event("change"));
  };
  for (const [id, checked] of state.switches) set(id, (x) => { x.checked = checked; });
  for (const [id, value] of state.choices) if (find(id) && [...find(id).options].some((o) => o.value === value)) set(id, (x) => { x.value = value; });
  for (const [id, open] of state.open) if (find(id)) find(id).open = open;
  for (const [selector, top] of state.scroll) document.querySelector(selector).scrollTop = top;
  const { position, target, zoom, touched, radius } = state.camera;
  const alike = Math.abs(Math.log(stage.framing.radius / radius)) < 0.3;
  if (touched || alike) {
    const { camera, controls } = stage.viewer;
    camera.position.copy(position);
    camera.zoom = zoom;
    controls.target.copy(target);
    controls.update();
    rig.touched = touched;
  }
  // Live poses end where the run ends.
  if (player.duration > 0) player.seek(state.live ? player.motion.end : state.time);
  if (state.playing) player.play();
  const focus = state.focus && find(state.focus.id);
  if (focus) {
    focus.focus({ preventScroll: true });
    if (state.focus.from !== undefined && state.focus.from !== null) focus.setSelectionRange(state.focus.from, state.focus.to);
  }
}

/** Puts a story in the place of the one that `parts` show; `blank`: the page before anything was built into it; `adopt` adds what
 * depends on the new parts. */
function replaceStory(parts, story, read, blank, adopt) {
  const state = readerState(parts);
  const { renderer } = parts.stage.viewer;
  parts.player.pause();
  parts.stage.quality.set(0);
  showing.abort();
  showing = new AbortController();
  document.title = story.title;
  document.getElementById("lab").replaceWith(blank.cloneNode(true));
  const next = build(story, read, renderer);
  parts.stage.end();
  adopt(next);
  restoreState(next, state);
  next.stage.viewer.render();
  return next;
}
