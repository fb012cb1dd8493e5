"use strict";
// Shows the cards that have every word of the search, and the sections that have such a card.
const search = document.getElementById("search"), found = document.getElementById("found");
const cards = [...document.querySelectorAll("article")], sections = [...document.querySelectorAll("section")];
function choose() {
  const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
  let shown = 0;
  for (const card of cards) {
    card.hidden = !words.every((w) => card.dataset.words.includes(w));
    shown += !card.hidden;
  }
  for (const section of sections) section.hidden = !section.querySelector("article:not([hidden])");
  found.textContent = words.length ? `${shown} of ${cards.length}` : "";
}
search.addEventListener("input", choose);
choose();

// Moves a card's mechanism on a canvas over its picture (see mechlab/viewer/thumbnail.py) while the pointer or the focus is there;
// where there is no pointer that hovers, while the card stands in the middle of the window. Nobody who asked for less motion sees it.
const motions = JSON.parse(document.getElementById("motions").textContent);
const still = matchMedia("(prefers-reduced-motion: reduce)"), touch = matchMedia("(hover: none)");
const playing = new Map();
const HULL_TURN = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);

function outline(points) {
  points.sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (list) => {
    const out = [];
    for (const p of list) {
      while (out.length > 1 && HULL_TURN(out[out.length - 2], out[out.length - 1], p) <= 0) out.pop();
      out.push(p);
    }
    out.pop();
    return out;
  };
  return [...half(points), ...half(points.reverse())];
}

function draw(card, motion, phase) {
  const { context, canvas } = playing.get(card), s = canvas.width / 800;
  const place = (rows) => {
    const at = phase * (rows.length - 1), k = Math.min(Math.floor(at), rows.length - 2), f = at - k;
    return rows.length < 2 ? rows[0] : rows[k].map((x, i) => x + f * (rows[k + 1][i] - x));
  };
  const places = {};
  for (const body in motion.bodies) places[body] = place(motion.bodies[body]);
  const put = (m, p) => [
    canvas.width / 2 + s * ((m[0] * p[0] + m[1] * p[1] + m[2] * p[2]) / 400 + m[6]),
    canvas.height / 2 - s * ((m[3] * p[0] + m[4] * p[1] + m[5] * p[2]) / 400 + m[7]),
  ];
  const add = (points, close) => {
    points.forEach((p, i) => (i ? context.lineTo(...p) : context.moveTo(...p)));
    if (close) context.closePath();
  };
  const line = (points) => {
    context.beginPath();
    add(points, false);
  };
  context.fillStyle = "#fff";
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.lineJoin = context.lineCap = "round";
  for (const part of motion.parts) {
    context.beginPath();
    for (const loop of part.loops || [part.points]) {
      const seen = loop.map((p) => put(places[part.body], p));
      add(part.loops ? seen : outline(seen), true);
    }
    context.fillStyle = part.color;
    context.fill("evenodd");
    context.strokeStyle = "rgba(20, 28, 40, .75)";
    context.lineWidth = 1.6 * s;
    context.stroke();
    if (part.mark.length) {
      line(part.mark.map((p) => put(places[part.body], p)));
      context.lineWidth = 4 * s;
      context.stroke();
    }
  }
  context.strokeStyle = "#c2175b";
  context.lineWidth = 2.4 * s;
  for (const path of motion.paths) {
    line(path.map((p) => [canvas.width / 2 + s * p[0], canvas.height / 2 - s * p[1]]));
    context.stroke();
  }
}

function play(card) {
  const motion = motions[card.dataset.name];
  if (still.matches || !motion || !motion.parts || playing.has(card)) return;
  const image = card.querySelector("img"), canvas = document.createElement("canvas");
  canvas.width = Math.min(2, devicePixelRatio || 1) * image.clientWidth;
  canvas.height = Math.round(0.75 * canvas.width);
  image.parentNode.append(canvas);
  const state = { canvas, context: canvas.getContext("2d"), frame: 0, begin: performance.now() };
  playing.set(card, state);
  const next = (now) => {
    const turns = Math.max(0, now - state.begin) / 1000 / motion.seconds, part = turns % 1;
    draw(card, motion, motion.loop ? part : Math.floor(turns) % 2 ? 1 - part : part);
    state.frame = requestAnimationFrame(next);
  };
  next(state.begin);
}

function stop(card) {
  const state = playing.get(card);
  if (!state) return;
  cancelAnimationFrame(state.frame);
  state.canvas.remove();
  playing.delete(card);
}

const middle = new IntersectionObserver((seen) => {
  for (const { target, isIntersecting } of seen) (isIntersecting && touch.matches ? play : stop)(target);
}, { rootMargin: "-35% 0px -35% 0px" });
for (const card of cards) {
  card.addEventListener("pointerenter", (event) => event.pointerType === "mouse" && play(card));
  card.addEventListener("pointerleave", (event) => event.pointerType === "mouse" && stop(card));
  card.addEventListener("focusin", () => play(card));
  card.addEventListener("focusout", () => touch.matches || stop(card));
  if (touch.matches) middle.observe(card);
}
still.addEventListener("change", () => cards.forEach(stop));
