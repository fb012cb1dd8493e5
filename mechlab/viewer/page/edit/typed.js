// Numbers of the editor as text, and back.

/** A typed number for a row: with units for lengths and angles, a ratio as text. */
function typedNumber(text, unit) {
  if (unit === "ratio") {
    const bare = text.trim().replace(/\u2212/g, "-").replace(/\s/g, "");
    if (!/^[+-]?\d+(\.\d+)?$|^[+-]?\d+\/\d+$/.test(bare) || !(Math.abs(ratioNumber(bare)) > 0) || !Number.isFinite(ratioNumber(bare))) throw new Error("expected a ratio other than 0, such as -3/2 or 1.5.");
    return bare;
  }
  const value = parseQuantity(text, unit === "teeth" ? "" : unit);
  if (!(Math.abs(value) < 1e9)) throw new Error("that is too large.");
  return value;
}

/** A number as the fields show it. */
function quantityText(value, unit) {
  const plain = (x) => String(Number(x.toPrecision(8)));
  if (unit === "m") return `${plain(1000 * value)} mm`;
  if (unit === "rad") return `${plain((180 * value) / Math.PI)}\u00b0`;
  return typeof value === "number" ? plain(value) : String(value);
}
