// Vectors of three numbers, matrices of nine (by rows): plain arrays.

function at3(values, k) { return [values[3 * k], values[3 * k + 1], values[3 * k + 2]]; }
function plus3(a, b) { return a.map((x, i) => x + b[i]); }
function minus3(a, b) { return a.map((x, i) => x - b[i]); }
function inner3(a, b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
function length3(a) { return Math.hypot(...a); }
function cross3(a, b) { return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]; }
function times33(m, v) { return [0, 3, 6].map((r) => m[r] * v[0] + m[r + 1] * v[1] + m[r + 2] * v[2]); }
function timesBack33(m, v) { return [0, 1, 2].map((c) => m[c] * v[0] + m[c + 3] * v[1] + m[c + 6] * v[2]); }
function timesTransposed33(a, b) { return [0, 1, 2].flatMap((i) => [0, 1, 2].map((j) => a[3 * i] * b[3 * j] + a[3 * i + 1] * b[3 * j + 1] + a[3 * i + 2] * b[3 * j + 2])); }
function skewPart(m) { return [(m[7] - m[5]) / 2, (m[2] - m[6]) / 2, (m[3] - m[1]) / 2]; }
/** The tensor xx, yy, zz, xy, xz, yz times a vector. */
function timesTensor([xx, yy, zz, xy, xz, yz], [x, y, z]) { return [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z]; }

function rotationOf(quaternion, i) {
  const [x, y, z, w] = quaternion.subarray(i, i + 4);
  return [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
    2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)];
}
/** From `point` by `s` along `direction`. */
function along3(point, direction, s) { return [0, 1, 2].map((k) => point[k] + s * direction[k]); }
function unit3(a) { const length = length3(a) || 1; return a.map((x) => x / length); }
