// An edited document is closed again: from the shown pose, in small steps of the edited number, so that the assembly mode is kept.

const FIRST_SHARE = 0.25, LEAST_SHARE = 1e-3; // steps of an edit, as shares of it
const FAR = 0.25; // most that one step may move the coordinates [rad, sizes]

/** Coordinates near q that close `model`, with the values of `held` (name -> value); null where there are none. */
function closedNear(model, q, held, far = FAR) {
  const manifold = new Manifold(model, structureOf(model)), found = Float64Array.from(q);
  const holds = Object.entries(held).map(([name, value]) => Object.assign(new Hold(manifold, name), { target: value }));
  manifold.at(found);
  manifold.choose();
  return manifold.correct(found, [holds], far, 20) < 0 ? null : found;
}

/** The model in the reference pose `q`, closed there to rounding. */
function settled(model, q) {
  let here = new PageModel(rebased(model, q));
  for (let pass = 0; pass < 3 && openBy(here) > 2e-16 * here.size; pass++) {
    const exact = closedNear(here, here.home, {});
    if (!exact) break;
    const next = new PageModel(rebased(here, exact));
    if (!(openBy(next) < openBy(here))) break;
    here = next;
  }
  return here;
}

function openBy(model) {
  model.closure.evaluate(model.tree.set(model.home));
  return Math.max(0, ...model.closure.residual.map(Math.abs));
}

/** An edit {from, to, apply(document, value)} made to `model` at its coordinates q, in steps. `drives` stay where they are as far as
 * they can. Returns {model, moved: whether a drive had to move}; throws one sentence where it cannot be closed. */
function reassembled(model, q, edit, drives) {
  const base = rebased(model, q), start = new PageModel(base);
  const values = Object.fromEntries(drives.map((name) => [name, start.value(name, start.home)]));
  const made = (share) => {
    const document = copied(base);
    edit.apply(document, typeof edit.to === "number" ? edit.from + share * (edit.to - edit.from) : edit.to);
    return new PageModel(document);
  };
  let reached = 0, here = start.home, closed = start;
  const go = (held) => {
    for (let step = typeof edit.to === "number" ? FIRST_SHARE : 1; reached < 1;) {
      const share = Math.min(1, reached + step), next = made(share), found = closedNear(next, here, held);
      if (found) { [reached, here, closed] = [share, found, next]; step *= 2; } else if ((step /= 2) < LEAST_SHARE) return;
    }
  };
  go(values);
  const moved = reached < 1;
  if (moved) go({});
  if (reached < 1) {
    const far = typeof edit.to === "number" && reached > 0 ? edit.from + reached * (edit.to - edit.from) : null;
    throw Object.assign(new Error("It cannot be assembled with that."), { reached: far });
  }
  return { model: settled(closed, here), moved };
}
