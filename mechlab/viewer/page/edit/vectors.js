// Vectors [x, y, z] and rotations (row-major 9) as the editor uses them.

const UNTURNED = new Float64Array([1, 0, 0, 0, 1, 0, 0, 0, 1]);

function plus(a, b) { return a.map((x, i) => x + b[i]); }
function minus(a, b) { return a.map((x, i) => x - b[i]); }
function times(s, a) { return a.map((x) => s * x); }
function inner(a, b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
function outer(a, b) { return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]; }
function lengthOf(a) { return Math.hypot(...a); }

/** R a, and its inverse R^T a. */
function turned(r, a) { return [0, 3, 6].map((i) => r[i] * a[0] + r[i + 1] * a[1] + r[i + 2] * a[2]); }
function turnedBack(r, a) { return [0, 1, 2].map((i) => r[i] * a[0] + r[i + 3] * a[1] + r[i + 6] * a[2]); }

/** a b, as a new rotation. */
function multiplied(a, b) {
  const out = new Float64Array(9);
  product33(a, 0, b, out);
  return out;
}

/** Rotation by an angle about a unit axis. */
function axisRotation(axis, angle) {
  const out = Float64Array.from(UNTURNED);
  turnedAbout(out, axis, angle);
  return out;
}

/** A vector of unit length; kept bit for bit where it is one. */
function unitVector(vector, what) {
  const length = lengthOf(vector);
  if (!(length > 1e-12)) throw new Error(`${what} is no direction.`);
  return Math.abs(length - 1) < 4e-16 ? [...vector] : times(1 / length, vector);
}

/** The number that a ratio such as "7/5" stands for. */
function ratioNumber(text) {
  const [over, under = 1] = String(text).split("/").map(Number);
  return over / under;
}

/** The part of a at right angles to the unit vector n; all of it where n is null. */
function across(a, n) { return n ? minus(a, times(inner(a, n), n)) : a; }

/** Quaternion w, x, y, z of a rotation, as the documents hold it. */
function quaternionList(rotation) {
  const out = new Float64Array(4);
  quaternionOf(rotation, 0, out, 0);
  return [out[3], out[0], out[1], out[2]];
}

/** Rotation of a rotation vector [rad], and the other way round. */
function rotationBy(vector) {
  const angle = lengthOf(vector), [x, y, z] = angle > 0 ? times(1 / angle, vector) : [0, 0, 1];
  return axisRotation([x, y, z], angle);
}

function rotationVector([w, x, y, z]) {
  const sign = w < 0 ? -1 : 1, sine = Math.hypot(x, y, z);
  return times(sine > 1e-300 ? (2 * sign * Math.atan2(sine, sign * w)) / sine : 0, [x, y, z]);
}

/** Angle from a to b about the unit vector n. */
function angleBetween(a, b, n) { return Math.atan2(inner(outer(a, b), n), inner(across(a, n), across(b, n))); }
