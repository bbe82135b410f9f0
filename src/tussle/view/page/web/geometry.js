// Vectors are [x, y, z], East North Up, in metres; quaternions [w, x, y, z], body to world; matrices 16 numbers, column after column.
/** @import { Vector } from './types' */

/** @param {Vector} a @param {Vector} b */
export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
/** @param {Vector} a @param {Vector} b */
export const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
/** @param {Vector} a @param {number} s */
export const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
/** @param {Vector} a @param {Vector} b */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @param {Vector} a @param {Vector} b */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** @param {Vector} a */
export const norm = (a) => Math.hypot(a[0], a[1], a[2]);
/** @param {number} value @param {number} low @param {number} high */
export const between = (value, low, high) => Math.min(high, Math.max(low, value));

/** A vector of length 1, or the given one where its length is 0. @param {Vector} a @returns {number[]} */
export function unit(a) {
  return scaled(a, 1 / (norm(a) || 1));
}

/** An angle within a half turn of 0. @param {number} angle */
export function halfTurn(angle) {
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}

/** Direction of the nose of a body. @param {Vector} q quaternion */
export function forward(q) {
  const [w, x, y, z] = [q[0], q[1], q[2], q[3]];
  return [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)];
}

/** The rotation b, then a. @param {Vector} a quaternion @param {Vector} b quaternion */
export function turned(a, b) {
  const [v, u] = [[a[1], a[2], a[3]], [b[1], b[2], b[3]]];
  return [a[0] * b[0] - dot(v, u), ...add(add(scaled(u, a[0]), scaled(v, b[0])), cross(v, u))];
}

/** A vector of a body in the world. @param {Vector} q quaternion @param {Vector} a */
export function rotated(q, a) {
  const v = [q[1], q[2], q[3]];
  const twice = scaled(cross(v, a), 2);
  return add(add(a, scaled(twice, q[0])), cross(v, twice));
}

/** Product of two matrices. @param {ArrayLike<number>} a @param {ArrayLike<number>} b */
function product(a, b) {
  return Float64Array.from({ length: 16 }, (_, i) => [0, 1, 2, 3].reduce((sum, k) => sum + a[4 * k + (i % 4)] * b[(i & 12) + k], 0));
}

/**
 * World to clip space for an eye with three axes: right, up, and away from what it looks at.
 * @param {Vector} eye @param {Vector} right @param {Vector} up @param {Vector} away
 * @param {number} fieldOfView radians @param {number} aspect @param {number} near @param {number} far
 */
export function perspective(eye, right, up, away, fieldOfView, aspect, near, far) {
  const f = 1 / Math.tan(fieldOfView / 2);
  const look = [
    right[0], up[0], away[0], 0, right[1], up[1], away[1], 0, right[2], up[2], away[2], 0,
    -dot(right, eye), -dot(up, eye), -dot(away, eye), 1,
  ];
  const lens = [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (near + far) / (near - far), -1, 0, 0, (2 * near * far) / (near - far), 0];
  return product(lens, look);
}

/**
 * The corners of a line on the ground without those that are nearer than a tolerance [m] to the rest: Douglas and Peucker, Algorithms for
 * the reduction of the number of points required to represent a digitized line, The Canadian Cartographer 10(2), 1973.
 * @param {number[][]} line @param {number} tolerance @returns {number[][]}
 */
export const simplified = (line, tolerance) => {
  const [[x, y], [endX, endY]] = [line[0], line[line.length - 1]];
  const [alongX, alongY] = [endX - x, endY - y];
  const square = alongX * alongX + alongY * alongY;
  const distances = line.map(([px, py]) => {
    const share = square ? Math.min(1, Math.max(0, ((px - x) * alongX + (py - y) * alongY) / square)) : 0;
    return Math.hypot(px - x - share * alongX, py - y - share * alongY);
  });
  const furthest = distances.reduce((best, distance, i) => (distance > distances[best] ? i : best), 0);
  if (distances[furthest] <= tolerance) return [line[0], line[line.length - 1]];
  return [...simplified(line.slice(0, furthest + 1), tolerance).slice(0, -1), ...simplified(line.slice(furthest), tolerance)];
};
