// Vectors are [x, y, z], East North Up, in metres; quaternions [w, x, y, z], body to world; matrices 16 numbers, column after column.

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const norm = (a) => Math.hypot(a[0], a[1], a[2]);
export const between = (value, low, high) => Math.min(high, Math.max(low, value));

/** A vector of length 1, or the given one where its length is 0. */
export function unit(a) {
  const size = norm(a);
  return size > 0 ? scaled(a, 1 / size) : a;
}

/** An angle within a half turn of 0. */
export function halfTurn(angle) {
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}

/** Where the nose of a body points. */
export function forward(q) {
  const [w, x, y, z] = q;
  return [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)];
}

/** Product of two matrices. */
function product(a, b) {
  const out = new Float64Array(16);
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[4 * k + row] * b[4 * column + k];
      out[4 * column + row] = sum;
    }
  }
  return out;
}

/** World to clip space for an eye with three axes: right, up, and away from what it looks at. */
export function perspective(eye, right, up, away, fieldOfView, aspect, near, far) {
  const f = 1 / Math.tan(fieldOfView / 2);
  const look = [
    right[0], up[0], away[0], 0, right[1], up[1], away[1], 0, right[2], up[2], away[2], 0,
    -dot(right, eye), -dot(up, eye), -dot(away, eye), 1,
  ];
  const lens = [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (near + far) / (near - far), -1, 0, 0, (2 * near * far) / (near - far), 0];
  return product(lens, look);
}
