// Quantities in words: one way to write a number with its unit everywhere in the page.

/** A value with its unit: a length in mm where it is short, an angle with its degrees. */
function withUnit(value, unit, digits = 4) {
  if (!Number.isFinite(value)) return "\u2013";
  const text = unitText(unit);
  if (unit === "rad") return `${significant(value, digits)} rad (${degreesText(value)})`;
  if (unit === "m" || unit === "m/s") {
    const [size, prefix] = lengthUnit(Math.abs(value));
    return `${significant(value / size, digits)} ${text.replace("m", prefix)}`;
  }
  return text ? `${significant(value, digits)} ${text}` : significant(value, digits);
}

function degreesText(radians) { return `${((radians * 180) / Math.PI).toFixed(1)}\u00b0`.replace("-", "\u2212").replace(/^\u22120\.0/, "0.0"); }

/** m/s2 as m/s², N m as N·m; "" stays. */
function unitText(unit) {
  return unit.replace(/([a-zA-Z])(-?\d+)/g, (_, letter, power) => letter + superscript(Number(power))).replace(/(\w) (\w)/g, "$1\u00b7$2");
}

/** A vector with one unit for all its numbers: (12, 0, −3) mm. Numbers below a millionth of the largest are 0. */
function vectorText(values, unit, digits = 4) {
  const largest = Math.max(...values.map(Math.abs));
  const [size, prefix] = unit[0] === "m" ? lengthUnit(largest) : [1, ""];
  const numbers = values.map((v) => (Math.abs(v) <= 1e-6 * largest ? "0" : significant(v / size, digits)));
  return `(${numbers.join(", ")}) ${prefix ? unitText(unit).replace("m", prefix) : unitText(unit)}`;
}

/** A turn from the axes of the world: its angle and axis. */
function turnText([x, y, z, w]) {
  const sine = Math.hypot(x, y, z);
  const angle = 2 * Math.atan2(sine, Math.abs(w));
  if (angle < 1e-6) return "not at all";
  const sign = w < 0 ? -1 : 1;
  return `${degreesText(angle)}${aboutText([sign * x, sign * y, sign * z])}`;
}

/** " about z", or a direction with two decimals; "" for none. */
function aboutText(vector) {
  const length = Math.hypot(...vector);
  if (length < 1e-9) return "";
  const unit = vector.map((v) => v / length);
  const along = unit.findIndex((v) => Math.abs(v) > 1 - 1e-6);
  if (along >= 0) return ` about ${unit[along] < 0 ? "\u2212" : ""}${"xyz"[along]}`;
  return ` about (${unit.map((v) => fixed(v, 0.01)).join(", ")})`;
}

function rangeText([low, high], unit) {
  const end = (value) => (Math.abs(value) > 1e9 || !Number.isFinite(value) ? "no limit" : withUnit(value, unit));
  return `${end(low)} to ${end(high)}`;
}
