// Puts the page together and offers it to scripts as window.lab.

async function start() {
  const blank = document.getElementById("lab").cloneNode(true);
  const story = JSON.parse(document.getElementById("story").textContent);
  const read = await blockReader(document.getElementById("block").textContent);
  let parts = build(story, read);
  parts.address.apply(location.hash.slice(1));
  if (story.live) new Live(story, parts, (next, block, adopt) => { parts = replaceStory(parts, next, block, blank, adopt); });
}

/** Builds the page of a story, and returns its parts. `renderer`: that of the story shown before. */
function build(story, read, renderer) {
  const byId = (id) => document.getElementById(id);
  for (const source of [story, ...story.variants.flatMap((v) => v.choices)]) if (source.model) source.model = JSON.parse(new TextDecoder().decode(read(source.model)));
  const plots = addPanel(story, byId("panel"));
  const motion = new Motion(story, read);
  const stage = new Stage(byId("viewport"), story, read, renderer);
  // Of clips each draws its own paths, and only where it has been.
  const traces = new Traces(stage, story, read, story.clips.length ? { done: 1, ahead: 0 } : undefined);
  let explorer = null, curves = null;
  const rig = new CameraRig(stage);
  rig.open();
  addViewButtons(rig, byId("views"));
  addTriad(rig, byId("triad"));
  const springs = new Springs(stage, story.model);
  const player = new Player(motion, story.tempo, byId("player"));
  const layers = addShow(story, read, stage, traces, byId("show"), () => { refresh(player.time); });
  const sources = {
    value: (name) => {
      if (explorer && explorer.byHand) return explorer.value(name);
      const recorded = curves && curves.picker ? curves.picker.value(name, player.time) : null;
      const q = recorded === null && explorer ? motion.coordinates(player.time) : null;
      return q && explorer.model.names.includes(name) ? explorer.model.value(name, q) : recorded;
    },
    velocity: (body) => ((explorer && explorer.byHand) || motion.end <= motion.start ? null : velocityFromMotion(motion, body, stage.groups.length, player.time)),
  };
  const inspector = new Inspector(story, stage, layers.labels, sources, () => stage.redraw());
  inspector.springs = springs;
  const refresh = (time) => {
    const { frame, share } = motion.place(time);
    if (!explorer || !explorer.byHand) layers.arrows.apply(frame, share);
    if (layers.ghost) layers.ghost.apply(time);
    byId("scale").textContent = [`grid ${lengthText(story.framing.step)}`, layers.arrows.scaleText].filter(Boolean).join(", ");
    inspector.update();
    stage.redraw();
  };
  player.onTime((time) => {
    if (explorer) explorer.comeBack();
    if (!explorer || !explorer.byHand) {
      motion.apply(stage.groups, time);
      traces.apply(motion.frame(time), motion.frame(player.start));
    }
    refresh(time);
  });
  curves = addPlots(story, read, player, plots);
  player.seek(motion.start);
  const field = addFields(story, read, stage, inspector, layers.show, byId("panel"));
  const clips = addClips(story.clips, player, curves, byId("panel"));
  explorer = moveByHand(story, inspector, { stage, traces, layers, read, player, panel: byId("panel"), redraw: () => refresh(player.time), shown: () => motion.coordinates(player.time) });

  const address = new Address({ stage, player, rig, inspector, section: inspector.section, follow: inspector.follow, layers, curves, explorer, clips, field });
  addLinkButton(address, byId("views"));

  window.lab = {
    ready: false,
    bodies: [...story.bodies],
    model: story.model,
    PageModel,
    PoseSolver,
    seek: (time) => player.seek(time),
    play: () => player.play(),
    pause: () => player.pause(),
    pose: (body) => stage.pose(body),
    view: (name) => rig.view(name),
    onScreen: (point) => onScreen(stage, new THREE.Vector3(...point)),
    rig,
    explorer,
    inspector,
    springs,
    traces,
    address,
    clips,
    field,
    curves,
    ghostPose: (body) => layers.ghost.groups[story.bodies.indexOf(body)].position.toArray(),
    ghostPaths: () => layers.ghost.traces.group.children.map((mesh) => ({ name: mesh.name, shown: layers.ghost.traces.group.visible })),
    get arrows() { return layers.arrows.items; },
    get time() { return player.time; },
    get playing() { return player.playing; },
    viewer: stage.viewer,
    quality: stage.quality,
  };
  listenTo(window, "hashchange", () => address.apply(location.hash.slice(1)));
  const handle = window.lab;
  requestAnimationFrame(() => requestAnimationFrame(() => { handle.ready = true; }));
  return { stage, rig, player, explorer, address, panel: byId("panel"), notice: byId("notice") };
}

start().catch((error) => {
  const notice = document.getElementById("notice");
  notice.textContent = `The view could not start (is WebGL switched off?): ${error.message}`;
  notice.className = "stopped";
  throw error;
});
