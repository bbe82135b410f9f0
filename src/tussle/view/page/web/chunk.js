// Frames that follow one another, as chunks.py packs them: states track after track, frame after frame.
/** @import { PageData, Sample } from './types' */

import { Reader } from './packing.js';

/** Bytes before the times of the frames. */
const HEAD_BYTES = 52;

export class Chunk {
  /** @param {Uint8Array} bytes @param {Pick<PageData, 'attitudeUnit' | 'healthSteps'>} units steps of attitudes and health */
  constructor(bytes, { attitudeUnit, healthSteps }) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.low = [0, 1, 2].map((i) => view.getFloat64(8 * i, true));
    this.step = view.getFloat64(24, true);
    const fullHealth = view.getFloat64(32, true);
    this.first = view.getUint32(40, true);
    this.nFrames = view.getUint32(44, true);
    this.nTracks = view.getUint32(48, true);
    const reader = new Reader(bytes, HEAD_BYTES);
    this.times = reader.reals(this.nFrames);
    this.id = reader.ints(this.nTracks);
    this.team = reader.ints(this.nTracks);
    this.block = reader.ints(this.nTracks);
    this.begin = reader.ints(this.nTracks);
    this.end = reader.ints(this.nTracks);
    const counts = this.begin.map((begin, i) => this.end[i] - begin + 1);
    this.row = new Int32Array(this.nTracks);
    for (let i = 1; i < this.nTracks; i++) this.row[i] = this.row[i - 1] + counts[i - 1];
    this.x = reader.column(counts);
    this.y = reader.column(counts);
    this.z = reader.column(counts);
    const [largest, ...others] = [0, 1, 2, 3].map(() => reader.column(counts));
    this.quat = attitudes(largest, others, attitudeUnit);
    this.health = Float32Array.from(reader.column(counts), (steps) => (steps / healthSteps) * fullHealth);
    this.nStates = this.x.length;
    /** @type {Map<number, number[]> | null} */
    this.tracksOf = null;
  }

  /** Id -> its tracks. @returns {Map<number, number[]>} */
  get tracks() {
    if (!this.tracksOf) {
      this.tracksOf = new Map();
      this.id.forEach((id, k) => this.tracksOf.set(id, [...(this.tracksOf.get(id) || []), k]));
    }
    return this.tracksOf;
  }

  /** One of its frames. @param {number} frame counted from its first @returns {Sample} */
  sample(frame) {
    const isThere = (/** @type {number} */ k) => this.begin[k] <= frame && this.end[k] >= frame;
    return {
      t: this.times[frame],
      ids: () => this.id.filter((_, k) => isThere(k)),
      placeOf: (id) => {
        const k = this.tracks.get(id)?.find(isThere);
        return k === undefined ? null : this.place(this.row[k] + frame - this.begin[k]);
      },
    };
  }

  /** @param {number} row @param {number} after row of the next frame @param {number} share of the way to it */
  place(row, after = row, share = 0) {
    const { low, step } = this;
    return [this.x, this.y, this.z].map((c, axis) => low[axis] + step * (c[row] + share * (c[after] - c[row])));
  }
}

/**
 * Quaternions from the number of the largest component and steps of the three others, each up to sqrt(1/2).
 * @param {Int32Array} largest @param {Int32Array[]} others @param {number} unitSteps
 */
function attitudes(largest, others, unitSteps) {
  const out = new Float32Array(4 * largest.length);
  const step = Math.SQRT1_2 / unitSteps;
  for (let row = 0; row < largest.length; row++) {
    let rest = 1;
    for (let k = 0; k < 3; k++) {
      const value = others[k][row] * step;
      out[4 * row + ((largest[row] + k + 1) & 3)] = value;
      rest -= value * value;
    }
    out[4 * row + largest[row]] = Math.sqrt(Math.max(0, rest));
  }
  return out;
}

/** Entities at one time, in rows that are called slots. */
export class Moment {
  constructor(room = 16) {
    this.n = 0;
    this.t = NaN;
    this.frame = -1;
    this.reserve(room);
  }

  /** @param {number} room */
  reserve(room) {
    this.room = room;
    this.id = new Int32Array(room);
    this.team = new Int32Array(room);
    this.block = new Int32Array(room);
    this.x = new Float64Array(room);
    this.y = new Float64Array(room);
    this.z = new Float64Array(room);
    this.quat = new Float32Array(4 * room);
    this.health = new Float32Array(room);
  }

  /** Take over a frame of a chunk, counted from its first, and a share of the way to the next. @param {Chunk} chunk @param {number} frame */
  fill(chunk, frame, share = 0) {
    if (this.room < chunk.nTracks) this.reserve(chunk.nTracks);
    const { low: [east, north, up], step, x, y, z } = chunk;
    let n = 0;
    for (let k = 0; k < chunk.nTracks; k++) {
      if (chunk.begin[k] > frame || chunk.end[k] < frame) continue;
      const row = chunk.row[k] + frame - chunk.begin[k];
      const after = frame < chunk.end[k] ? row + 1 : row;
      this.id[n] = chunk.id[k];
      this.team[n] = chunk.team[k];
      this.block[n] = chunk.block[k];
      this.x[n] = east + step * (x[row] + share * (x[after] - x[row]));
      this.y[n] = north + step * (y[row] + share * (y[after] - y[row]));
      this.z[n] = up + step * (z[row] + share * (z[after] - z[row]));
      this.health[n] = chunk.health[row];
      blend(this.quat, 4 * n, chunk.quat, 4 * row, chunk.quat, 4 * after, share);
      n++;
    }
    this.n = n;
    this.t = chunk.times[frame];
    this.frame = chunk.first + frame;
    this.slots = null;
    return this;
  }

  /** Row of an id; -1 where it is not there. @param {number} id */
  slotOf(id) {
    if (!this.slots) {
      this.slots = new Map();
      for (let i = 0; i < this.n; i++) this.slots.set(this.id[i], i);
    }
    return this.slots.get(id) ?? -1;
  }

  ids() {
    return this.id.subarray(0, this.n);
  }

  /** @param {number} slot */
  placeIn(slot) {
    return [this.x[slot], this.y[slot], this.z[slot]];
  }

  /** @param {number} id */
  placeOf(id) {
    const slot = this.slotOf(id);
    return slot < 0 ? null : this.placeIn(slot);
  }
}

/**
 * An attitude between two, of one of which the opposite sign may be meant.
 * @param {Float32Array} out @param {number} at @param {Float32Array} from @param {number} a @param {Float32Array} to @param {number} b
 * @param {number} share of the way
 */
export function blend(out, at, from, a, to, b, share) {
  const same = from[a] * to[b] + from[a + 1] * to[b + 1] + from[a + 2] * to[b + 2] + from[a + 3] * to[b + 3];
  const far = same < 0 ? -share : share;
  let sum = 0;
  for (let k = 0; k < 4; k++) {
    out[at + k] = (1 - share) * from[a + k] + far * to[b + k];
    sum += out[at + k] * out[at + k];
  }
  const size = 1 / Math.sqrt(sum || 1);
  for (let k = 0; k < 4; k++) out[at + k] *= size;
}
