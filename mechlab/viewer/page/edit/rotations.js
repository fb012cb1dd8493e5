// Rotations (row-major 9) and directions, as documents are edited with them.

const UNTURNED = new Float64Array([1, 0, 0, 0, 1, 0, 0, 0, 1]);

function times(s, a) { return a.map((x) => s * x); }

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
  const length = length3(vector);
  if (!(length > 1e-12)) throw new Error(`${what} is no direction.`);
  return Math.abs(length - 1) < 4e-16 ? [...vector] : times(1 / length, vector);
}

/** The number that a ratio such as "7/5" stands for. */
function ratioNumber(text) {
  const [over, under = 1] = String(text).split("/").map(Number);
  return over / under;
}

/** The part of a at right angles to the unit vector n; all of it where n is null. */
function across(a, n) { return n ? minus3(a, times(inner3(a, n), n)) : a; }

/** Quaternion w, x, y, z of a rotation, as the documents hold it. */
function quaternionList(rotation) {
  const out = new Float64Array(4);
  quaternionOf(rotation, 0, out, 0);
  return [out[3], out[0], out[1], out[2]];
}

/** Rotation of a rotation vector [rad], and the other way round. */
function rotationBy(vector) {
  const angle = length3(vector), [x, y, z] = angle > 0 ? times(1 / angle, vector) : [0, 0, 1];
  return axisRotation([x, y, z], angle);
}

function rotationVector([w, x, y, z]) {
  const sign = w < 0 ? -1 : 1, sine = Math.hypot(x, y, z);
  return times(sine > 1e-300 ? (2 * sign * Math.atan2(sine, sign * w)) / sine : 0, [x, y, z]);
}

/** Angle from a to b about the unit vector n. */
function angleBetween(a, b, n) { return Math.atan2(inner3(cross3(a, b), n), inner3(across(a, n), across(b, n))); }
