// Entities: one mesh for each model, drawn at many places at once.

import { add, cross, dot, minus, unit } from './geometry.js';
import { MODEL_CORNERS, MODEL_PAINT } from './shaders.js';
import { attribute, buffer, program, use } from './drawing.js';

/** Angle between faces below which an edge looks round. */
const ROUND = Math.cos((40 * Math.PI) / 180);
/** Angle above which an edge is drawn in the wireframe. */
const SHARP = Math.cos((8 * Math.PI) / 180);
/** Of an instance: place, attitude, colour and lengths along its axes. */
const INSTANCE_BYTES = 44;

/** A mesh with normals, round or sharp by the angle of its edges, and with its edges. */
function prepared({ vertices, faces }) {
  const key = (corner) => vertices.slice(3 * corner, 3 * corner + 3).join();
  const place = (corner) => vertices.slice(3 * corner, 3 * corner + 3);
  const around = new Map();
  const edges = new Map();
  const normals = [];
  for (let f = 0; f < faces.length; f += 3) {
    const corners = [faces[f], faces[f + 1], faces[f + 2]];
    const [a, b, c] = corners.map(place);
    const normal = cross(minus(b, a), minus(c, a));
    normals.push(normal);
    corners.forEach((corner, k) => {
      const here = key(corner);
      const there = key(corners[(k + 1) % 3]);
      if (!around.has(here)) around.set(here, []);
      around.get(here).push(normal);
      const name = here < there ? `${here} ${there}` : `${there} ${here}`;
      if (!edges.has(name)) edges.set(name, { ends: [place(corner), place(corners[(k + 1) % 3])], normals: [] });
      edges.get(name).normals.push(unit(normal));
    });
  }
  const out = [];
  faces.forEach((corner, i) => {
    const own = unit(normals[Math.floor(i / 3)]);
    let sum = [0, 0, 0];
    for (const other of around.get(key(corner))) if (dot(unit(other), own) > ROUND) sum = add(sum, other);
    out.push(...place(corner), ...unit(sum));
  });
  const lines = [];
  for (const { ends, normals: sides } of edges.values()) {
    const isSharp = sides.length !== 2 || dot(sides[0], sides[1]) < SHARP;
    if (isSharp) for (const end of ends) lines.push(...end, 0, 0, 1);
  }
  return { corners: new Float32Array(out), lines: new Float32Array(lines) };
}

/** One mesh and the instances of it that are to be drawn. */
export class Model {
  constructor(gl, mesh, room) {
    this.gl = gl;
    this.n = 0;
    this.instances = gl.createBuffer();
    this.resize(Math.max(1, room));
    const { corners, lines } = prepared(mesh);
    this.solid = this.shape(corners);
    this.wire = this.shape(lines);
  }

  resize(room) {
    const old = this.colours;
    this.room = room;
    this.bytes = new ArrayBuffer(INSTANCE_BYTES * room);
    this.floats = new Float32Array(this.bytes);
    this.colours = new Uint8Array(this.bytes);
    if (old) this.colours.set(old);
    this.isRoomNew = true;
  }

  shape(corners) {
    const { gl } = this;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    buffer(gl, corners);
    attribute(gl, 0, 3, gl.FLOAT, 24, 0);
    attribute(gl, 1, 3, gl.FLOAT, 24, 12);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    attribute(gl, 2, 3, gl.FLOAT, INSTANCE_BYTES, 0, 1);
    attribute(gl, 3, 4, gl.FLOAT, INSTANCE_BYTES, 12, 1);
    attribute(gl, 4, 4, gl.UNSIGNED_BYTE, INSTANCE_BYTES, 28, 1);
    attribute(gl, 5, 3, gl.FLOAT, INSTANCE_BYTES, 32, 1);
    gl.bindVertexArray(null);
    return { array, n: corners.length / 6 };
  }

  /** `size` is one length [m] or three. */
  add(x, y, z, quat, at, colour, size, mark) {
    if (this.n >= this.room) this.resize(2 * this.room);
    const f = (INSTANCE_BYTES / 4) * this.n;
    const b = INSTANCE_BYTES * this.n + 28;
    this.floats[f] = x;
    this.floats[f + 1] = y;
    this.floats[f + 2] = z;
    for (let k = 0; k < 4; k++) this.floats[f + 3 + k] = quat[at + k];
    this.colours[b] = colour[0];
    this.colours[b + 1] = colour[1];
    this.colours[b + 2] = colour[2];
    this.colours[b + 3] = mark;
    for (let k = 0; k < 3; k++) this.floats[f + 8 + k] = size.length ? size[k] : size;
    this.n++;
  }

  /** Hand the instances to the graphics card. */
  hand() {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    if (this.isRoomNew) gl.bufferData(gl.ARRAY_BUFFER, this.bytes.byteLength, gl.DYNAMIC_DRAW);
    this.isRoomNew = false;
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.colours, 0, INSTANCE_BYTES * this.n);
  }

  draw(isWire) {
    const { gl } = this;
    const { array, n } = isWire ? this.wire : this.solid;
    gl.bindVertexArray(array);
    gl.drawArraysInstanced(isWire ? gl.LINES : gl.TRIANGLES, 0, n, this.n);
    gl.bindVertexArray(null);
  }
}

/** All entities of a game. */
export class Entities {
  constructor(gl, layer, { blocks, models }) {
    this.gl = gl;
    this.layer = layer;
    this.program = program(gl, MODEL_CORNERS, MODEL_PAINT);
    this.models = {};
    for (const name of new Set(blocks.map((block) => block.model))) this.models[name] = new Model(gl, models[name], 64);
    this.modelOf = blocks.map((block) => this.models[block.model]);
    this.sizeOf = blocks.map((block) => block.scale);
  }

  /** Place all who are shown. */
  place(anchor, hidden, marked) {
    const { layer } = this;
    const { shown } = layer;
    for (const model of Object.values(this.models)) model.n = 0;
    for (let i = 0; i < shown.n; i++) {
      if (hidden.has(shown.team[i])) continue;
      const block = shown.block[i];
      const mark = shown.id[i] === marked ? 255 : 0;
      const [x, y, z] = [shown.x[i] - anchor[0], shown.y[i] - anchor[1], shown.z[i] - anchor[2]];
      this.modelOf[block].add(x, y, z, shown.quat, 4 * i, layer.colourOf(i), this.sizeOf[block], mark);
    }
    for (const model of Object.values(this.models)) model.hand();
  }

  draw(view, { scale, least, isWire, bright }) {
    use(this.gl, this.program, { clip: view.clip, scale, least: least * view.perPixel, opacity: 1, flatness: isWire ? 1 : 0, bright });
    for (const model of Object.values(this.models)) if (model.n) model.draw(isWire);
  }
}
