// Drawing curves with few strokes however many samples they have; a pen that writes SVG; files to save.

/** Places [x, y] that draw samples first..last of a curve, with a null where it has a gap. Of more samples than `most` in a column
 * of pixels the first, lowest, highest and last are kept: the picture is the same. */
function curvePlaces(times, values, first, last, x, y, most = 4) {
  const out = [];
  const dense = last - first > most * Math.abs(x(times[last]) - x(times[first]));
  if (!dense) {
    for (let i = first; i <= last; i++) out.push(Number.isFinite(values[i]) ? [x(times[i]), y(values[i])] : null);
    return out;
  }
  let i = first;
  while (i <= last) {
    const column = Math.floor(x(times[i]));
    if (!Number.isFinite(values[i])) { out.push(null); i++; continue; }
    let low = i, high = i, j = i;
    while (j + 1 <= last && Math.floor(x(times[j + 1])) === column && Number.isFinite(values[j + 1])) {
      j++;
      if (values[j] < values[low]) low = j;
      if (values[j] > values[high]) high = j;
    }
    for (const k of [...new Set([i, low, high, j])].sort((a, b) => a - b)) out.push([x(times[k]), y(values[k])]);
    i = j + 1;
  }
  return out;
}

/** Takes the calls of a canvas that plots make, and writes them as SVG. */
class SvgPen {
  constructor(width, height) {
    Object.assign(this, { width, height, marks: [], path: "", stack: [], dash: [], matrix: "", clipped: "", count: 0 });
    Object.assign(this, { strokeStyle: "#000", fillStyle: "#000", lineWidth: 1, globalAlpha: 1, font: "11px sans-serif", textAlign: "left", textBaseline: "alphabetic" });
  }

  beginPath() { this.path = ""; }
  moveTo(x, y) { this.path += `M${x.toFixed(2)} ${y.toFixed(2)}`; }
  lineTo(x, y) { this.path += `L${x.toFixed(2)} ${y.toFixed(2)}`; }
  rect(x, y, width, height) { this.path += `M${x} ${y}h${width}v${height}h${-width}z`; }
  setLineDash(dash) { this.dash = dash; }
  save() { this.stack.push([this.matrix, this.clipped]); }
  restore() { [this.matrix, this.clipped] = this.stack.pop(); }
  translate(x, y) { this.matrix += `translate(${x} ${y})`; }
  rotate(angle) { this.matrix += `rotate(${(angle * 180) / Math.PI})`; }

  clip() {
    const id = `clip${++this.count}`;
    this.marks.push(`<clipPath id="${id}"><path d="${this.path}"/></clipPath>`);
    this.clipped = ` clip-path="url(#${id})"`;
  }

  stroke() {
    if (!this.path) return;
    const dash = this.dash.length ? ` stroke-dasharray="${this.dash.join(" ")}"` : "";
    this.marks.push(`<path d="${this.path}" fill="none" stroke="${this.strokeStyle}" stroke-width="${this.lineWidth}" stroke-opacity="${this.globalAlpha}" stroke-linejoin="round"${dash}${this.clipped}/>`);
  }

  fillText(text, x, y) {
    const anchor = { left: "start", center: "middle", right: "end" }[this.textAlign];
    const base = { middle: "central", top: "hanging", alphabetic: "alphabetic" }[this.textBaseline];
    const words = String(text).replace(/&/g, "&amp;").replace(/</g, "&lt;");
    this.marks.push(`<text x="${x}" y="${y}" fill="${this.fillStyle}" font-family="sans-serif" font-size="11" text-anchor="${anchor}" dominant-baseline="${base}" transform="${this.matrix}">${words}</text>`);
  }

  text() {
    return `<svg xmlns="http://www.w3.org/2000/svg" width="${this.width}" height="${this.height}" viewBox="0 0 ${this.width} ${this.height}"><rect width="100%" height="100%" fill="#fff"/>${this.marks.join("\n")}</svg>\n`;
  }
}

/** The samples of curves over one list of times as CSV; numbers read back as they are, 32-bit ones with 7 digits. */
function curvesToCsv(times, series, unit, first, last) {
  const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text);
  const number = (values, i) => (!Number.isFinite(values[i]) ? "" : values instanceof Float32Array ? String(Number(values[i].toPrecision(7))) : String(values[i]));
  const lines = [["t [s]", ...series.map((s) => (unit ? `${s.name} [${unit}]` : s.name))].map(quoted).join(",")];
  for (let i = first; i <= last; i++) lines.push([String(times[i]), ...series.map((s) => number(s.values, i))].join(","));
  return `${lines.join("\r\n")}\r\n`;
}

function saveText(name, text, type) { saveFile(name, new Blob([text], { type })); }

function saveFile(name, blob) {
  const link = make("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

/** A text as the name of a file. */
function fileName(text) { return text.replace(/[^\w-]+/g, "-").replace(/^-|-$/g, "") || "mechanism"; }
