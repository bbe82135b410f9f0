// The shapes that plugins draw, as drawing.py sends them.

import { add, minus, norm, unit } from './geometry.js';
import { MODEL_CORNERS, MODEL_PAINT } from './shaders.js';
import { program, use } from './drawing.js';
import { Model } from './models.js';
import { Lines } from './trails.js';

/** Least size of a point [pixels]. */
const LEAST_POINT = 4;
const LEVEL = [1, 0, 0, 0];
const BOX = {
  vertices: [-0.5, -0.5, -0.5, 0.5, -0.5, -0.5, 0.5, 0.5, -0.5, -0.5, 0.5, -0.5, -0.5, -0.5, 0.5, 0.5, -0.5, 0.5, 0.5, 0.5, 0.5, -0.5, 0.5, 0.5],
  faces: [0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7],
};

export class Drawn {
  constructor(gl, ball) {
    this.gl = gl;
    this.program = program(gl, MODEL_CORNERS, MODEL_PAINT);
    this.lines = new Lines(gl, 256);
    this.meshes = { points: ball, sphere: ball, box: BOX, cone: flatCone(), head: flatCone(-1) };
    this.header = { parts: [], texts: [], width: 2 };
    this.groups = new Map();
    this.own = [];
  }

  take(header, bytes) {
    this.header = header;
    this.data = new Float32Array(bytes.buffer, bytes.byteOffset, bytes.byteLength / 4);
    this.own = header.parts.filter(({ kind }) => kind === 'mesh').map((part) => this.ownMesh(part));
  }

  /** A mesh that a plugin has made. */
  ownMesh({ at, nVertices, nFaces }) {
    const numbers = Array.from(this.data.subarray(at, at + 11 + 3 * (nVertices + nFaces)));
    const mesh = { vertices: numbers.slice(11, 11 + 3 * nVertices), faces: numbers.slice(11 + 3 * nVertices) };
    return { model: new Model(this.gl, mesh, 1), numbers };
  }

  /** The instances of a mesh that are as opaque as each other. */
  group(kind, opacity) {
    const key = `${kind} ${opacity.toFixed(2)}`;
    if (!this.groups.has(key)) this.groups.set(key, { kind, opacity, model: new Model(this.gl, this.meshes[kind], 16) });
    return this.groups.get(key).model;
  }

  /** Lay all out. */
  place(anchor) {
    for (const { model } of this.groups.values()) model.n = 0;
    this.lines.begin(anchor);
    for (const { kind, n, at } of this.header.parts) {
      const size = { points: 7, lines: 9, arrows: 9, sphere: 14, box: 14, cone: 14 }[kind];
      for (let i = 0; size && i < n; i++) this.add(kind, this.data.subarray(at + i * size, at + (i + 1) * size), anchor);
    }
    for (const { model, numbers } of this.own) {
      model.n = 0;
      model.add(...minus(numbers, anchor), numbers, 3, numbers.slice(7, 10), 1, 0);
      model.hand();
    }
    this.lines.hand();
    for (const { model } of this.groups.values()) model.hand();
  }

  add(kind, row, anchor) {
    const [x, y, z] = minus(row, anchor);
    if (kind === 'points') {
      this.group(kind, 1).add(x, y, z, LEVEL, 0, row.subarray(4), row[3], 0);
    } else if (kind === 'lines' || kind === 'arrows') {
      const [from, to, colour] = [row.subarray(0, 3), row.subarray(3, 6), row.subarray(6)];
      this.lines.segment(from, to, colour);
      const way = minus(to, from);
      const head = norm(way) / 5;
      if (kind === 'arrows' && head > 0) this.group('head', 1).add(...minus(to, anchor), turningXTo(unit(way)), 0, colour, [head, head / 3, head / 3], 0);
    } else {
      this.group(kind, row[13]).add(x, y, z, row, 3, row.subarray(10, 13), row.subarray(7, 10), 0);
    }
  }

  draw(view, line, isSeenThrough) {
    for (const { kind, opacity, model } of this.groups.values()) {
      if (model.n && opacity < 1 === isSeenThrough) this.drawOne(view, model, opacity, kind === 'points' ? LEAST_POINT * view.ratio : 0);
    }
    for (const { model, numbers } of this.own) if (numbers[10] < 1 === isSeenThrough) this.drawOne(view, model, numbers[10], 0);
    if (isSeenThrough) this.lines.draw(line, view, this.header.width * view.ratio, 1);
  }

  drawOne(view, model, opacity, least) {
    use(this.gl, this.program, { clip: view.clip, scale: 1, least: least * view.perPixel, opacity, flatness: least ? 0.7 : 0.25, bright: 1 });
    model.draw(false);
  }
}

/** A cone 1 m long along x and 1 m in radius: with its tip at the origin, or (-1) at the end of its axis, pointing along it. */
function flatCone(direction = 1) {
  const n = 24;
  const vertices = [0, 0, 0];
  for (let i = 0; i < n; i++) vertices.push(direction, Math.cos((2 * Math.PI * i) / n), Math.sin((2 * Math.PI * i) / n));
  vertices.push(direction, 0, 0);
  const faces = [];
  for (let i = 0; i < n; i++) faces.push(0, 1 + i, 1 + ((i + 1) % n), 1 + i, n + 1, 1 + ((i + 1) % n));
  return { vertices, faces };
}

/** The attitude that turns the x axis into a direction: a half turn about the middle between both. */
function turningXTo(direction) {
  const middle = add(direction, [1, 0, 0]);
  return norm(middle) > 1e-6 ? [0, ...unit(middle)] : [0, 0, 0, 1];
}
