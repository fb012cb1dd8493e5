// A model document as text, with the digits and the layout of Python's writer (formats/json_text.py).

const TEXT_WIDTH = 120;

/** A number as Python's repr writes it: the shortest digits that read back exactly. */
function pythonNumber(x) {
  if (!Number.isFinite(x)) throw new Error(`${x} cannot be written.`);
  const [digits, power] = x.toExponential().split("e");
  const exponent = Number(power), sign = Object.is(x, -0) ? "-" : "";
  if (exponent < -4 || exponent >= 16) return `${sign}${digits}e${exponent < 0 ? "-" : "+"}${String(Math.abs(exponent)).padStart(2, "0")}`;
  const bare = digits.replace("-", "").replace(".", "");
  const text = exponent < 0 ? `0.${"0".repeat(-exponent - 1)}${bare}` : bare.padEnd(exponent + 1, "0").replace(new RegExp(`^(\\d{${exponent + 1}})`), "$1.");
  return `${x < 0 ? "-" : sign}${text.endsWith(".") ? `${text}0` : text}`;
}

/** Where documents hold whole numbers that Python writes without a decimal point. */
function documentText(value, indent = 0, key = "") {
  if (typeof value === "number") return key === "schema" ? String(value) : pythonNumber(value);
  if (value === null || typeof value !== "object") return JSON.stringify(value);
  const list = Array.isArray(value), items = Object.entries(value);
  if (!items.length) return list ? "[]" : "{}";
  const flatItems = items.map(([name, x]) => `${list ? "" : `${JSON.stringify(name)}: `}${flatText(x, name)}`);
  const flat = list ? `[${flatItems.join(", ")}]` : `{${flatItems.join(", ")}}`;
  if (indent && flat.length + indent <= TEXT_WIDTH && isPlain(value)) return flat;
  const pad = " ".repeat(indent + 1);
  const lines = items.map(([name, x]) => `${pad}${list ? "" : `${JSON.stringify(name)}: `}${documentText(x, indent + 1, name)}`);
  return `${list ? "[" : "{"}\n${lines.join(",\n")}\n${" ".repeat(indent)}${list ? "]" : "}"}`;
}

function flatText(value, key) {
  if (typeof value === "number") return key === "schema" ? String(value) : pythonNumber(value);
  if (value === null || typeof value !== "object") return JSON.stringify(value);
  if (Array.isArray(value)) return `[${value.map((x) => flatText(x, "")).join(", ")}]`;
  return `{${Object.entries(value).map(([name, x]) => `${JSON.stringify(name)}: ${flatText(x, name)}`).join(", ")}}`;
}

/** True for an object or list without an object inside. */
function isPlain(value) {
  return Object.values(value).every((x) => x === null || typeof x !== "object" || (Array.isArray(x) && isPlain(x)));
}
