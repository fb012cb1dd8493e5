// The key=value that reproduces an edit, where the definition has named parameters: the numbers that follow them, inverted.

const POSE_KEYS = ["zero", "quaternion", "tensor"]; // of a pose, or not affine in lengths

/** Path -> number of a document, as viewer/named_numbers.py has them; numbers that a pose changes are left out. */
function flatNumbers(document, path = "", found = new Map()) {
  if (typeof document === "number") found.set(path, document);
  else if (document !== null && typeof document === "object") for (const [key, value] of Object.entries(document)) if (!POSE_KEYS.includes(key)) flatNumbers(value, path ? `${path}/${key}` : key, found);
  return found;
}

/** What lies where: the numbers on which the closed poses depend. */
function isGeometry(path) { return /^(bodies\/\d+|loops\/\d+|frames\/\d+)\/(placement(_[ab])?\/position\/\d|length)$/.test(path); }

/** Parameters that make the document `first` of a definition into `now`: {values: key -> value, numbers: path -> number they give}; null
 * where none do. */
function namedEdit(named, first, now) {
  const before = flatNumbers(first), after = flatNumbers(now), free = new Set();
  first.bodies.forEach((body, k) => { if (body.joints.length && body.joints[0].kind === "prismatic") for (const a of [0, 1, 2]) free.add(`bodies/${k}/placement/position/${a}`); });
  const near = (path, x) => Math.abs(after.get(path) - x) < 1e-9 * Math.max(0.01, Math.abs(x));
  const changed = [...before.keys()].filter((path) => isGeometry(path) && !free.has(path) && !near(path, before.get(path)));
  const steps = new Map();
  for (const path of changed) {
    const on = named.parameters.filter((p) => path in p.slopes);
    if (on.length === 1 && !steps.has(on[0])) steps.set(on[0], (after.get(path) - before.get(path)) / on[0].slopes[path]);
  }
  if (!steps.size) return null;
  const numbers = new Map();
  for (const [parameter, step] of steps) for (const [path, slope] of Object.entries(parameter.slopes)) {
    if (before.has(path) && !free.has(path)) numbers.set(path, (numbers.get(path) ?? before.get(path)) + slope * step);
  }
  if (changed.some((path) => !numbers.has(path) || !near(path, numbers.get(path)))) return null;
  return { values: new Map([...steps].map(([parameter, step]) => [parameter, parameter.value + step])), numbers };
}

/** The document with all numbers that follow the parameters of an edit; masses are those of bars, or kept. */
function followed(document, { numbers }) {
  const made = copied(document);
  for (const [path, x] of numbers) {
    if (path.includes("/inertia/")) continue;
    const keys = path.split("/"), last = keys.pop(), holder = keys.reduce((at, key) => at[key], made);
    if (Math.abs(holder[last] - x) > 1e-12 * Math.abs(x)) holder[last] = x;
  }
  return made;
}

/** "crank=120mm" as the verbs take it. */
function keyValue({ key, unit }, value) {
  const plain = (x) => String(Number(x.toPrecision(12)));
  return `${key}=${unit === "m" ? `${plain(1000 * value)}mm` : plain(value)}`;
}
