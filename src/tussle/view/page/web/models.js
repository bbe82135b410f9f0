// Models: one mesh drawn at many places at once.
/** @import { Colour, Mesh, PageData, Vector, View } from './types' */

import { add, cross, dot, minus, unit } from './geometry.js';
import { Instances, Renderer } from './renderer.js';
import { Layer } from './layer.js';

/** Angle between faces below which an edge looks round. */
const ROUND = Math.cos((40 * Math.PI) / 180);
/** Angle above which an edge is drawn in the wireframe. */
const SHARP = Math.cos((8 * Math.PI) / 180);
/** Of an instance: place, attitude, colour and lengths along its axes. */
const INSTANCE_BYTES = 44;
/** Quaternion of a body that is level and heads east. */
export const LEVEL = [1, 0, 0, 0];

/** Corners with normals, round or sharp by the angle of their edges, and the ends of sharp edges. @param {Mesh} mesh */
export function prepared({ vertices, faces }) {
  const place = (/** @type {number} */ corner) => vertices.slice(3 * corner, 3 * corner + 3);
  /** Place -> normals of the faces around it. @type {Map<string, number[][]>} */
  const around = new Map();
  /** Both ends -> normals of the faces beside the edge. @type {Map<string, { ends: number[][], normals: number[][] }>} */
  const edges = new Map();
  const triangles = Array.from({ length: faces.length / 3 }, (_, f) => [0, 1, 2].map((k) => place(faces[3 * f + k])));
  const normals = triangles.map(([a, b, c]) => cross(minus(b, a), minus(c, a)));
  triangles.forEach((corners, f) => corners.forEach((here, k) => {
    const there = corners[(k + 1) % 3];
    if (!around.has(`${here}`)) around.set(`${here}`, []);
    around.get(`${here}`).push(normals[f]);
    const key = [`${here}`, `${there}`].sort().join(' ');
    if (!edges.has(key)) edges.set(key, { ends: [here, there], normals: [] });
    edges.get(key).normals.push(unit(normals[f]));
  }));
  const corners = triangles.flatMap((triangle, f) => triangle.flatMap((here) => {
    const own = unit(normals[f]);
    const alike = around.get(`${here}`).filter((other) => dot(unit(other), own) > ROUND);
    return [...here, ...unit(alike.reduce(add, [0, 0, 0]))];
  }));
  const sharp = [...edges.values()].filter(({ normals: [a, b, ...more] }) => !b || more.length || dot(a, b) < SHARP);
  return { corners: new Float32Array(corners), lines: new Float32Array(sharp.flatMap(({ ends }) => ends.flatMap((end) => [...end, 0, 0, 1]))) };
}

/** One mesh and the instances of it that are drawn. */
export class Model extends Instances {
  /** @param {Renderer} renderer @param {Mesh} mesh */
  constructor(renderer, mesh) {
    super(renderer, INSTANCE_BYTES);
    const { corners, lines } = prepared(mesh);
    this.solid = this.shape(corners);
    this.wire = this.shape(lines);
  }

  /** @param {Float32Array<ArrayBuffer>} corners place and normal of each */
  shape(corners) {
    const { renderer } = this;
    const { gl } = renderer;
    const array = renderer.array(() => {
      renderer.corners(corners);
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
      renderer.attribute(2, 3, gl.FLOAT, INSTANCE_BYTES, 0, 1);
      renderer.attribute(3, 4, gl.FLOAT, INSTANCE_BYTES, 12, 1);
      renderer.attribute(4, 4, gl.UNSIGNED_BYTE, INSTANCE_BYTES, 28, 1);
      renderer.attribute(5, 3, gl.FLOAT, INSTANCE_BYTES, 32, 1);
    });
    return { array, n: corners.length / 6 };
  }

  /**
   * @param {number} x @param {number} y @param {number} z relative to the anchor
   * @param {ArrayLike<number>} quat list that has the attitude from number `at` on @param {number} at
   * @param {Colour} colour @param {number | Vector} size one length [m] or three @param {number} mark 255 for the chosen entity
   */
  add(x, y, z, quat, at, colour, size, mark = 0) {
    const f = (INSTANCE_BYTES / 4) * this.append(28, colour, mark);
    this.floats[f] = x;
    this.floats[f + 1] = y;
    this.floats[f + 2] = z;
    for (let k = 0; k < 4; k++) this.floats[f + 3 + k] = quat[at + k];
    for (let k = 0; k < 3; k++) this.floats[f + 8 + k] = typeof size === 'number' ? size : size[k];
  }

  /** @param {View} view @param {Record<string, number>} look values of the program beside the view; `least` is in pixels */
  draw(view, { scale = 1, least = 0, opacity = 1, flatness = 0, bright = 1 }, isWire = false) {
    if (!this.n) return;
    const { gl } = this.renderer;
    const { array, n } = isWire ? this.wire : this.solid;
    this.renderer.use('model', { clip: view.clip, scale, least: least * view.ratio * view.perPixel, opacity, flatness: isWire ? 1 : flatness, bright });
    gl.bindVertexArray(array);
    gl.drawArraysInstanced(isWire ? gl.LINES : gl.TRIANGLES, 0, n, this.n);
  }

  /** Draw it once at a place. @param {View} view @param {Vector} place @param {Colour} colour @param {number | Vector} size @param {Record<string, number>} look */
  drawAt(view, place, colour, size, look, quat = LEVEL) {
    const [x, y, z] = minus(place, view.anchor);
    this.n = 0;
    this.add(x, y, z, quat, 0, colour, size);
    this.upload();
    this.draw(view, look);
  }
}

/** All entities of a game. */
export class Entities {
  /** @param {Renderer} renderer @param {Layer} layer @param {PageData} page */
  constructor(renderer, layer, { blocks, models }) {
    this.layer = layer;
    const found = new Map(blocks.map(({ model }) => [model, new Model(renderer, models[model])]));
    this.models = [...found.values()];
    this.modelOf = blocks.map(({ model }) => found.get(model));
    this.sizeOf = blocks.map(({ lengths }) => lengths);
  }

  /** Place all that are shown. @param {Vector} anchor @param {Set<number>} hidden teams @param {number} chosen */
  place(anchor, hidden, chosen) {
    const { shown } = this.layer;
    for (const model of this.models) model.n = 0;
    for (let i = 0; i < shown.n; i++) {
      if (hidden.has(shown.team[i])) continue;
      const block = shown.block[i];
      const mark = shown.id[i] === chosen ? 255 : 0;
      const [x, y, z] = [shown.x[i] - anchor[0], shown.y[i] - anchor[1], shown.z[i] - anchor[2]];
      this.modelOf[block].add(x, y, z, shown.quat, 4 * i, this.layer.colourOf(i), this.sizeOf[block], mark);
    }
    for (const model of this.models) model.upload();
  }

  /** @param {View} view @param {Record<string, number>} look @param {boolean} isWire */
  draw(view, look, isWire) {
    for (const model of this.models) model.draw(view, look, isWire);
  }
}
