// Lines: trails of entities, outlines and axes.

import { add, between, minus } from './geometry.js';
import { attribute, use } from './drawing.js';

/** Of a point of a line: place, age from 0 to 1, colour, and whether a line goes on from it to the next. */
const POINT_BYTES = 20;
/** Points of all trails together; with more, each has fewer. */
const MOST_POINTS = 120000;
/** Length of the trail that who is chosen has where nobody has one [s]. */
export const TRAIL_OF_CHOSEN = 10;
/** Lengths of trails [s] that can be chosen. */
export const TRAIL_LENGTHS = [0, 1, 2, 5, 10, 30, 120, Infinity];

/** Points of lines, which may be filled again and again. */
export class Lines {
  constructor(gl, room) {
    this.gl = gl;
    this.n = 0;
    this.anchor = [0, 0, 0];
    this.array = gl.createVertexArray();
    this.buffer = gl.createBuffer();
    this.resize(room);
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    attribute(gl, 0, 3, gl.FLOAT, POINT_BYTES, 0, 1);
    attribute(gl, 1, 1, gl.FLOAT, POINT_BYTES, 12, 1);
    attribute(gl, 2, 4, gl.UNSIGNED_BYTE, POINT_BYTES, 16, 1);
    attribute(gl, 3, 3, gl.FLOAT, POINT_BYTES, POINT_BYTES, 1);
    attribute(gl, 4, 1, gl.FLOAT, POINT_BYTES, POINT_BYTES + 12, 1);
    gl.bindVertexArray(null);
  }

  resize(room) {
    this.room = room;
    const old = this.colours;
    this.bytes = new ArrayBuffer(POINT_BYTES * room);
    this.floats = new Float32Array(this.bytes);
    this.colours = new Uint8Array(this.bytes);
    if (old) this.colours.set(old.subarray(0, POINT_BYTES * this.n));
    this.isRoomNew = true;
  }

  begin(anchor) {
    this.anchor = anchor;
    this.n = 0;
  }

  add(x, y, z, age, colour, goesOn) {
    if (this.n + 1 >= this.room) this.resize(2 * this.room);
    const f = (POINT_BYTES / 4) * this.n;
    const b = POINT_BYTES * this.n + 16;
    this.floats[f] = x - this.anchor[0];
    this.floats[f + 1] = y - this.anchor[1];
    this.floats[f + 2] = z - this.anchor[2];
    this.floats[f + 3] = age;
    this.colours[b] = colour[0];
    this.colours[b + 1] = colour[1];
    this.colours[b + 2] = colour[2];
    this.colours[b + 3] = goesOn ? 255 : 0;
    this.n++;
  }

  segment(a, b, colour) {
    this.add(...a, 0, colour, true);
    this.add(...b, 0, colour, false);
  }

  /** End the line of the last point. */
  end() {
    this.colours[POINT_BYTES * (this.n - 1) + 19] = 0;
  }

  hand() {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    if (this.isRoomNew) gl.bufferData(gl.ARRAY_BUFFER, this.bytes.byteLength, gl.DYNAMIC_DRAW);
    this.isRoomNew = false;
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.colours, 0, POINT_BYTES * this.n);
  }

  draw(made, view, width, opacity) {
    if (this.n < 2) return;
    const { gl } = this;
    const values = { clip: view.clip, offset: minus(this.anchor, view.anchor), viewport: [view.width, view.height], width, near: view.near, opacity };
    use(gl, made, values);
    gl.bindVertexArray(this.array);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, this.n - 1);
    gl.bindVertexArray(null);
  }
}

/** Where the entities of a game have come from. */
export class Trails {
  constructor(gl, layer) {
    this.layer = layer;
    this.lines = new Lines(gl, 4096);
  }

  /** Lay out the trails of the last seconds up to what is shown; `marked` has one in any case. */
  place(anchor, seconds, hidden, marked) {
    const { layer, lines } = this;
    lines.begin(anchor);
    const span = seconds > 0 ? seconds : TRAIL_OF_CHOSEN;
    const { t } = layer.shown;
    layer.layTrails(lines, {
      seconds: span,
      most: Math.max(4, Math.floor(MOST_POINTS / Math.max(1, seconds > 0 ? layer.shown.n : 1))),
      isWanted: (id, team) => !hidden.has(team) && (seconds > 0 || id === marked),
      ageOf: (when) => (span === Infinity ? 0.35 : between((t - when) / span, 0, 1)),
    });
    lines.hand();
  }
}
