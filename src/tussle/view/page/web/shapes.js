// The shapes that plugins draw, as drawing.py sends them.
/** @import { ShapesHeader, Vector, View } from './types' */

import { add, minus, norm, unit } from './geometry.js';
import { circle, Lines } from './lines.js';
import { LEVEL, Model } from './models.js';
import { PlainRenderer } from './plain.js';
import { Renderer } from './renderer.js';

/** Least size of a point [pixels]. */
const MIN_POINT = 4;
/** Numbers of a row of a kind. @type {Record<string, number>} */
const ROW_SIZES = { points: 7, lines: 9, arrows: 9, sphere: 14, box: 14, cone: 14 };
const BOX = {
  vertices: [0, 1, 2, 3, 4, 5, 6, 7].flatMap((i) => [(i & 1) - 0.5, ((i >> 1) & 1) - 0.5, (i >> 2) - 0.5]),
  faces: [0, 3, 1, 0, 2, 3, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 1, 3, 7, 1, 7, 5, 3, 2, 6, 3, 6, 7, 2, 0, 4, 2, 4, 6],
};

export class Shapes {
  /** @param {Renderer | PlainRenderer} renderer @param {import('./types').Mesh} ball */
  constructor(renderer, ball) {
    this.renderer = renderer;
    this.lines = new Lines(renderer);
    /** @type {Record<string, import('./types').Mesh>} */
    this.meshes = { points: ball, sphere: ball, box: BOX, cone: flatCone(1), head: flatCone(-1) };
    /** Instances of a mesh that are as opaque as each other. @type {Map<string, { kind: string, opacity: number, model: Model }>} */
    this.groups = new Map();
    this.take({ parts: [], texts: [], width: 2 }, new Uint8Array(0));
  }

  /** @param {ShapesHeader} header @param {Uint8Array} bytes */
  take(header, bytes) {
    this.header = header;
    this.data = new Float32Array(bytes.slice().buffer);
    /** Meshes that plugins have made. */
    this.own = header.parts.filter(({ kind }) => kind === 'mesh').map(({ at, nVertices, nFaces }) => {
      const numbers = Array.from(this.data.subarray(at, at + 11 + 3 * (nVertices + nFaces)));
      const end = 11 + 3 * nVertices;
      return { numbers, model: new Model(this.renderer, { vertices: numbers.slice(11, end), faces: numbers.slice(end) }) };
    });
  }

  /** @param {string} kind @param {number} opacity */
  group(kind, opacity) {
    const key = `${kind} ${opacity.toFixed(2)}`;
    if (!this.groups.has(key)) this.groups.set(key, { kind, opacity, model: new Model(this.renderer, this.meshes[kind]) });
    return this.groups.get(key).model;
  }

  /** Lay all out. @param {Vector} anchor */
  place(anchor) {
    for (const { model } of this.groups.values()) model.n = 0;
    this.lines.begin(anchor);
    for (const { kind, n, at } of this.header.parts) {
      const size = ROW_SIZES[kind];
      for (let i = 0; size && i < n; i++) this.add(kind, this.data.subarray(at + i * size, at + (i + 1) * size), anchor);
    }
    this.lines.upload();
    for (const { model } of this.groups.values()) model.upload();
  }

  /** @param {string} kind @param {Float32Array} row @param {Vector} anchor */
  add(kind, row, anchor) {
    const [x, y, z] = minus(row, anchor);
    if (kind === 'points') {
      this.group(kind, 1).add(x, y, z, LEVEL, 0, row.subarray(4), row[3]);
    } else if (kind === 'lines' || kind === 'arrows') {
      const [from, to, colour] = [row.subarray(0, 3), row.subarray(3, 6), row.subarray(6)];
      this.lines.segment(from, to, colour);
      const way = minus(to, from);
      const head = norm(way) / 5;
      const [tipX, tipY, tipZ] = minus(to, anchor);
      if (kind === 'arrows' && head > 0) this.group('head', 1).add(tipX, tipY, tipZ, turningXTo(unit(way)), 0, colour, [head, head / 3, head / 3]);
    } else {
      this.group(kind, row[13]).add(x, y, z, row, 3, row.subarray(10, 13), row.subarray(7, 10));
    }
  }

  /** Draw what is opaque, or what is seen through. @param {View} view @param {boolean} isSeenThrough */
  draw(view, isSeenThrough) {
    for (const { kind, opacity, model } of this.groups.values()) {
      const isPoint = kind === 'points';
      if (opacity < 1 === isSeenThrough) model.draw(view, { opacity, least: isPoint ? MIN_POINT : 0, flatness: isPoint ? 0.7 : 0.25 });
    }
    for (const { model, numbers } of this.own) {
      const opacity = numbers[10];
      if (opacity < 1 === isSeenThrough) model.drawAt(view, numbers, numbers.slice(7, 10), 1, { opacity, flatness: 0.25 }, numbers.slice(3, 7));
    }
    if (isSeenThrough) this.lines.draw(view, this.header.width, 1);
  }
}

/** A cone 1 m long along x and 1 m in radius: with its tip at the origin, or (-1) at the end of its axis, pointing along it. @param {number} direction */
function flatCone(direction) {
  const n = 24;
  const rim = circle([0, 0, 0], 1, n).slice(1);
  const faces = rim.flatMap((_, i) => [0, 1 + i, 1 + ((i + 1) % n), 1 + i, n + 1, 1 + ((i + 1) % n)]);
  return { vertices: [0, 0, 0, ...rim.flatMap(([y, z]) => [direction, y, z]), direction, 0, 0], faces };
}

/** The attitude that turns the x axis into a direction: a half turn about the middle between both. @param {number[]} direction */
function turningXTo(direction) {
  const middle = add(direction, [1, 0, 0]);
  return norm(middle) > 1e-6 ? [0, ...unit(middle)] : [0, 0, 0, 1];
}
