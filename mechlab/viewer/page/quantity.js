// Numbers with units, as people type them: 37deg, 5 mm, 0.2 rev. Inside, everything is in radians and metres.

const TYPED_UNITS = {
  rad: { rad: 1, mrad: 1e-3, deg: Math.PI / 180, "\u00b0": Math.PI / 180, rev: 2 * Math.PI },
  m: { m: 1, cm: 0.01, mm: 0.001, um: 1e-6, "\u00b5m": 1e-6 },
};

/** The number in `unit` ("rad", "m" or "") that a text stands for; without a unit it is in `unit`. Throws one sentence. */
function parseQuantity(text, unit) {
  const known = TYPED_UNITS[unit] || {};
  const parts = /^([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)\s*(\S*)$/i.exec(text.trim().replace(/\u2212/g, "-").replace(/^([+-]?\d*),(\d)/, "$1.$2"));
  const example = { rad: "37deg or 0.65", m: "5mm or 0.005" }[unit] || "0.5";
  if (!parts) throw new Error(`${text.trim() || "nothing"} is not a number; expected one such as ${example}`);
  if (parts[2] && !Object.hasOwn(known, parts[2])) throw new Error(`${parts[2]} does not fit here; expected ${Object.keys(known).join(", ") || "a bare number"}`);
  const value = Number(parts[1]) * (parts[2] ? known[parts[2]] : 1);
  if (!Number.isFinite(value)) throw new Error(`${text.trim()} is too large; expected a number such as ${example}`);
  return value;
}
