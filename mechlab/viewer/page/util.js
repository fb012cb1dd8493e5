// Small tools: elements, numbers in words, arrays out of the block of bytes.

const THREE = typeof MeshCat === "undefined" ? null : MeshCat.THREE;

/** Ends when another story takes the place of the one that is shown (on a live page). */
let showing = new AbortController();

/** Listens to the document or the window, as long as the present story is shown. */
function listenTo(target, type, handler) { target.addEventListener(type, handler, { signal: showing.signal }); }

/** Calls `action` when the present story is shown no longer. */
function atEnd(action) { showing.signal.addEventListener("abort", action, { once: true }); }

/** An element: make("button", {class: "x", onclick: f}, "text", child). Texts are never parsed as HTML. */
function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name.replace(/^on/, ""), value);
    else if (value !== undefined && value !== false) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children);
  return element;
}

/** A name that may be broken behind its underscores, as children of an element. */
function breakable(name) { return name.split(/(?<=_)/).flatMap((part, k) => (k ? [document.createElement("wbr"), part] : [part])); }

/** Offers bytes as a download. */
function saveFile(name, blob) {
  const link = make("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

const ARRAYS = { f8: Float64Array, f4: Float32Array, i2: Int16Array, u2: Uint16Array, u4: Uint32Array, u1: Uint8Array };

/** Reads references {at, kind, count} out of zlib-compressed base64 text; with `steps` the sums of what is there. */
async function blockReader(base64) {
  const buffer = await unpacked(base64);
  const sums = new Map();
  return (reference) => {
    const values = new ARRAYS[reference.kind](buffer, reference.at, reference.count);
    if (!reference.steps) return values;
    if (!sums.has(reference.at)) {
      const out = values.slice();
      for (let i = 1; i < out.length; i++) out[i] += out[i - 1];
      sums.set(reference.at, out);
    }
    return sums.get(reference.at);
  };
}

/** `value` with as many decimals as a step of size `step` needs. */
function fixed(value, step) {
  const decimals = Math.min(12, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  const text = value.toFixed(decimals);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "\u2212");
}

/** `value` with `digits` significant digits, without trailing zeros. */
function significant(value, digits = 4) {
  if (!Number.isFinite(value)) return "\u2013";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    return `${Number(mantissa)}\u00b710${superscript(Number(exponent))}`.replace("-", "\u2212");
  }
  return String(Number(value.toPrecision(digits))).replace("-", "\u2212");
}

function superscript(number) {
  return String(number).replace(/./g, (c) => (c === "-" ? "\u207b" : "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"[c]));
}

/** A length in the unit that an engineer would write. */
function lengthText(metres) {
  const [size, unit] = lengthUnit(metres);
  return `${significant(metres / size, size < 1e-7 ? 2 : 4)} ${unit}`;
}

/** Size [m] and name of the unit in which a length is written. */
function lengthUnit(metres) {
  return metres > 0.49 || metres === 0 ? [1, "m"] : metres > 4.9e-5 ? [1e-3, "mm"] : metres > 4.9e-7 ? [1e-6, "\u00b5m"] : [1e-9, "nm"];
}

/** The smallest 1, 2 or 5 times a power of ten that divides `span` into at most `count` steps. */
function niceStep(span, count) {
  const raw = span / count;
  const power = Math.pow(10, Math.floor(Math.log10(raw)));
  return [1, 2, 5, 10].map((k) => k * power).find((step) => step >= raw * (1 - 1e-9));
}
