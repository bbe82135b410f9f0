// Models: one mesh drawn at many places at once.
/** @import { Colour, Mesh, PageData, Vector, View } from './types' */

import { add, cross, dot, minus, norm, scaled, unit } from './geometry.js';
import { PlainRenderer, silhouette } from './plain.js';
import { Instances, Renderer, Table, wordsFor } from './renderer.js';
import { Layer } from './layer.js';

/** Angle between faces below which an edge looks round. */
const ROUND = Math.cos((40 * Math.PI) / 180);
/** Angle above which an edge is drawn in the wireframe. */
const SHARP = Math.cos((8 * Math.PI) / 180);
/** Of an instance: place and colour, attitude, lengths along its axes. */
const INSTANCE_BYTES = 48;
/** Cells along each axis in which the corners of a coarse mesh are put together. */
const CELLS = 3;
/** Where all meshes together have more corners, entities that are shown smaller than so many pixels have coarse ones. */
const MAX_CORNERS = 3e5;
const SMALL = 24;
/** Quaternion of a body that is level and heads east. */
export const LEVEL = [1, 0, 0, 0];

/** Corners with normals, round or sharp by the angle of their edges, and the ends of sharp edges: eight numbers each. @param {Mesh} mesh */
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
    return [...here, 0, ...unit(alike.reduce(add, [0, 0, 0])), 0];
  }));
  const sharp = [...edges.values()].filter(({ normals: [a, b, ...more] }) => !b || more.length || dot(a, b) < SHARP);
  return { corners: new Float32Array(corners), lines: new Float32Array(sharp.flatMap(({ ends }) => ends.flatMap((end) => [...end, 0, 0, 0, 1, 0]))) };
}

/** A mesh of few faces: all corners in a cell become the one of them that is farthest from the middle. @param {Mesh} mesh @returns {Mesh} */
export function coarse({ vertices, faces }) {
  const n = vertices.length / 3;
  const [low, high] = [Math.min, Math.max].map((least) => [0, 1, 2].map((k) => {
    let found = vertices[k];
    for (let i = 1; i < n; i++) found = least(found, vertices[3 * i + k]);
    return found;
  }));
  const place = (/** @type {number} */ i) => vertices.slice(3 * i, 3 * i + 3);
  const far = (/** @type {number} */ i) => norm(minus(scaled(place(i), 2), add(low, high)));
  /** Cell of each corner, and the corner that stands for a cell. @type {number[]} */
  const cells = [];
  /** @type {number[]} */
  const best = [];
  for (let i = 0; i < n; i++) {
    cells[i] = place(i).reduce((cell, c, k) => CELLS * cell + Math.min(CELLS - 1, Math.floor((CELLS * (c - low[k])) / (high[k] - low[k] || 1))), 0);
    if (best[cells[i]] === undefined || far(i) > far(best[cells[i]])) best[cells[i]] = i;
  }
  /** Both sides of what is thin become one. @type {Map<string, number[]>} */
  const kept = new Map();
  for (let f = 0; f < faces.length; f += 3) {
    const face = [0, 1, 2].map((k) => best[cells[faces[f + k]]]);
    if (new Set(face).size === 3) kept.set(`${[...face].sort()}`, face);
  }
  return { vertices, faces: [...kept.values()].flat() };
}

/** One mesh and the instances of it that are drawn. */
export class Model extends Instances {
  /** @param {Renderer | PlainRenderer} renderer @param {Mesh} mesh */
  constructor(renderer, mesh) {
    super(renderer, INSTANCE_BYTES);
    this.mesh = mesh;
    /** What it covers on a plain map, level and heading east. @type {Path2D | null} */
    this.levelShape = null;
    if (renderer instanceof PlainRenderer) {
      this.levelShape = silhouette(mesh, LEVEL);
      /** Distance of its farthest corner from its origin. */
      this.reach = mesh.vertices.reduce((most, _, i, all) => (i % 3 ? most : Math.max(most, norm(all.slice(i, i + 3)))), 0);
      return;
    }
    const { corners, lines } = prepared(mesh);
    this.solid = this.shape(renderer, corners);
    this.wire = this.shape(renderer, lines);
  }

  /** @param {Renderer} renderer @param {Float32Array} corners place and normal of each, eight numbers */
  shape(renderer, corners) {
    const words = new Uint32Array(wordsFor(corners.length));
    new Float32Array(words.buffer).set(corners);
    const table = new Table(renderer);
    table.upload(words);
    return { table, n: corners.length / 8 };
  }

  /**
   * @param {number} x @param {number} y @param {number} z relative to the anchor
   * @param {ArrayLike<number>} quat list that has the attitude from number `at` on @param {number} at
   * @param {Colour} colour @param {number | Vector} size one length [m] or three @param {number} mark 255 for the chosen entity
   */
  add(x, y, z, quat, at, colour, size, mark = 0) {
    const f = (INSTANCE_BYTES / 4) * this.append(colour, mark);
    this.floats[f] = x;
    this.floats[f + 1] = y;
    this.floats[f + 2] = z;
    for (let k = 0; k < 4; k++) this.floats[f + 4 + k] = quat[at + k];
    for (let k = 0; k < 3; k++) this.floats[f + 8 + k] = typeof size === 'number' ? size : size[k];
  }

  /** @param {View} view @param {Record<string, number>} look values of the program beside the view; `least` is in pixels */
  draw(view, { scale = 1, least = 0, opacity = 1, flatness = 0, bright = 1 }, isWire = false) {
    if (!this.n) return;
    if (this.renderer instanceof PlainRenderer) {
      this.renderer.drawModel(this, view, { scale, least, opacity });
      return;
    }
    const { gl } = this.renderer;
    const { table, n } = isWire ? this.wire : this.solid;
    this.renderer.use('model', { corners: n, clip: view.clip, scale, least: least * view.ratio * view.perPixel, opacity, flatness: isWire ? 1 : flatness, bright });
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, table.texture);
    gl.activeTexture(gl.TEXTURE0);
    this.drawVertices(isWire ? gl.LINES : gl.TRIANGLES, n * this.n);
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
  /** @param {Renderer | PlainRenderer} renderer @param {Layer} layer @param {PageData} page */
  constructor(renderer, layer, { blocks, models }) {
    this.layer = layer;
    const found = new Map(blocks.map(({ model }) => [model, [models[model], coarse(models[model])].map((mesh) => new Model(renderer, mesh))]));
    this.models = [...found.values()].flat();
    /** Of each block, the models for what is near and what is far. */
    this.modelsOf = blocks.map(({ model }) => found.get(model));
    this.sizeOf = blocks.map(({ lengths }) => lengths);
  }

  /** Place all that are shown. @param {View} view @param {number} scale @param {Set<number>} hidden teams @param {number} chosen */
  place(view, scale, hidden, chosen) {
    const { shown } = this.layer;
    const { anchor, eye, away } = view;
    for (const model of this.models) model.n = 0;
    let nCorners = 0;
    for (let i = 0; i < shown.n; i++) nCorners += this.modelsOf[shown.block[i]][0].solid?.n ?? 0;
    /** Distance from the eye at which they are small. */
    const farFrom = this.sizeOf.map((lengths) => (nCorners > MAX_CORNERS ? (scale * Math.max(...lengths)) / (SMALL * view.ratio * view.perPixel) : Infinity));
    for (let i = 0; i < shown.n; i++) {
      if (hidden.has(shown.team[i])) continue;
      const block = shown.block[i];
      const isChosen = shown.id[i] === chosen;
      const isFar = (eye[0] - shown.x[i]) * away[0] + (eye[1] - shown.y[i]) * away[1] + (eye[2] - shown.z[i]) * away[2] > farFrom[block];
      const model = this.modelsOf[block][Number(isFar && !isChosen)];
      const [x, y, z] = [shown.x[i] - anchor[0], shown.y[i] - anchor[1], shown.z[i] - anchor[2]];
      model.add(x, y, z, shown.quat, 4 * i, this.layer.colourOf(i), this.sizeOf[block], isChosen ? 255 : 0);
    }
    for (const model of this.models) model.upload();
  }

  /** @param {View} view @param {Record<string, number>} look @param {boolean} isWire */
  draw(view, look, isWire) {
    for (const model of this.models) model.draw(view, look, isWire);
  }
}
