// Another story in the open page. All that the reader has set stays: camera, scrolling, switches, focus, speed and time. The
// renderer goes on with the new stage, so that the picture changes from one frame to the next.

/** What the reader has set in the page that shows `parts`. */
function readerState({ stage, rig, player, address }) {
  const { camera, controls } = stage.viewer;
  const focus = document.activeElement;
  return {
    view: address.text(),
    camera: { position: camera.position.clone(), target: controls.target.clone(), zoom: camera.zoom, top: camera.top, touched: rig.touched, radius: stage.framing.radius },
    scroll: [["#panel", document.getElementById("panel").scrollTop], ["html", document.documentElement.scrollTop]],
    choices: [...document.querySelectorAll("#lab select[id]")].map((x) => [x.id, x.value]),
    boxes: [...document.querySelectorAll("#player input[type=checkbox][id]")].map((x) => [x.id, x.checked]),
    open: [...document.querySelectorAll("#lab details[id]")].map((x) => [x.id, x.open]),
    focus: focus && focus.id ? { id: focus.id, from: focus.selectionStart, to: focus.selectionEnd } : null,
    time: player.time,
    playing: player.playing,
    live: document.getElementById("notice").className === "live",
  };
}

/** Sets in the page that shows `parts` what the reader had set, as far as the new story has it. */
function restoreState({ stage, rig, player, address, explorer }, state) {
  const find = (id) => document.getElementById(id);
  for (const [id, value] of state.choices) {
    const select = find(id);
    if (!select || select.value === value || ![...select.options].some((o) => o.value === value)) continue;
    select.value = value;
    select.dispatchEvent(new Event("change"));
  }
  for (const [id, checked] of state.boxes) if (find(id) && find(id).checked !== checked) find(id).click();
  for (const [id, open] of state.open) if (find(id)) find(id).open = open;
  const alike = Math.abs(Math.log(stage.framing.radius / state.camera.radius)) < 0.3;
  const view = new URLSearchParams(state.view);
  for (const key of ["t", "camera"]) view.delete(key);
  address.apply(view.toString());
  if (state.camera.touched || alike) setCamera(stage, rig, state.camera);
  // Live poses end where the run ends.
  const byHand = explorer && explorer.byHand;
  if (player.duration > 0 && !byHand) player.seek(state.live ? player.motion.end : state.time);
  if (state.playing) player.play();
  for (const [selector, top] of state.scroll) document.querySelector(selector).scrollTop = top;
  const focus = state.focus && find(state.focus.id);
  if (!focus) return;
  focus.focus({ preventScroll: true });
  if (state.focus.from !== undefined && state.focus.from !== null) focus.setSelectionRange(state.focus.from, state.focus.to);
}

function setCamera({ viewer }, rig, { position, target, zoom, top, touched }) {
  const { camera, controls } = viewer;
  camera.position.copy(position);
  camera.zoom = zoom;
  if (camera.isOrthographicCamera) {
    Object.assign(camera, { top, bottom: -top });
    viewer.set_3d_pane_size();
  }
  controls.target.copy(target);
  controls.update();
  camera.updateProjectionMatrix();
  rig.touched = touched;
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
