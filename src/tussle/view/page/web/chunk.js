// Frames that follow one another, as chunks.py packs them: states track after track, frame after frame.

import { Reader } from './packing.js';

/** Bytes before the times of the frames. */
const HEAD_BYTES = 52;

export class Chunk {
  /** `page` has the steps of attitudes and health. */
  constructor(bytes, page) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.low = [0, 1, 2].map((i) => view.getFloat64(8 * i, true));
    this.step = view.getFloat64(24, true);
    const fullHealth = view.getFloat64(32, true);
    [this.first, this.nFrames, this.nTracks] = [40, 44, 48].map((at) => view.getUint32(at, true));
    const reader = new Reader(bytes);
    reader.at = HEAD_BYTES;
    this.times = reader.reals(this.nFrames);
    for (const name of ['id', 'team', 'block', 'begin', 'end']) this[name] = reader.ints(this.nTracks);
    const counts = this.begin.map((begin, i) => this.end[i] - begin + 1);
    this.row = new Int32Array(this.nTracks);
    for (let i = 1; i < this.nTracks; i++) this.row[i] = this.row[i - 1] + counts[i - 1];
    [this.x, this.y, this.z] = [0, 1, 2].map(() => reader.column(counts));
    const [largest, ...others] = [0, 1, 2, 3].map(() => reader.column(counts));
    this.quat = attitudes(largest, others, page.attitudeUnit);
    this.health = Float32Array.from(reader.column(counts), (steps) => (steps / page.healthSteps) * fullHealth);
    this.nStates = this.x.length;
  }

  get last() {
    return this.first + this.nFrames - 1;
  }

  /** The track of an id in a frame, counted from the chunk's first; -1 where it is not there. */
  trackIn(id, frame) {
    if (!this.tracksOf) {
      this.tracksOf = new Map();
      this.id.forEach((each, k) => this.tracksOf.set(each, [...(this.tracksOf.get(each) || []), k]));
    }
    const found = (this.tracksOf.get(id) || []).find((k) => this.begin[k] <= frame && this.end[k] >= frame);
    return found === undefined ? -1 : found;
  }

  placeOf(row) {
    const { low, step } = this;
    return [low[0] + step * this.x[row], low[1] + step * this.y[row], low[2] + step * this.z[row]];
  }
}

/** Quaternions from which component is largest and steps of the three others, each up to sqrt(1/2). */
export function attitudes(largest, others, unitSteps) {
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

/** Entities at one moment, in rows: slots. */
export class Moment {
  constructor(room) {
    this.n = 0;
    this.t = NaN;
    this.frame = -1;
    this.reserve(room);
  }

  reserve(room) {
    this.room = room;
    for (const name of ['id', 'team', 'block', 'track']) this[name] = new Int32Array(room);
    for (const name of ['x', 'y', 'z']) this[name] = new Float64Array(room);
    this.quat = new Float32Array(4 * room);
    this.health = new Float32Array(room);
  }

  /** Take over a frame of a chunk, counted from its first, and a share of the way to the next. */
  fill(chunk, frame, share) {
    if (this.room < chunk.nTracks) this.reserve(chunk.nTracks);
    const { low, step } = chunk;
    let n = 0;
    for (let k = 0; k < chunk.nTracks; k++) {
      if (chunk.begin[k] > frame || chunk.end[k] < frame) continue;
      const row = chunk.row[k] + frame - chunk.begin[k];
      const after = frame < chunk.end[k] ? row + 1 : row;
      this.track[n] = k;
      this.id[n] = chunk.id[k];
      this.team[n] = chunk.team[k];
      this.block[n] = chunk.block[k];
      this.x[n] = low[0] + step * (chunk.x[row] + share * (chunk.x[after] - chunk.x[row]));
      this.y[n] = low[1] + step * (chunk.y[row] + share * (chunk.y[after] - chunk.y[row]));
      this.z[n] = low[2] + step * (chunk.z[row] + share * (chunk.z[after] - chunk.z[row]));
      this.health[n] = chunk.health[row];
      turned(this.quat, 4 * n, chunk.quat, 4 * row, 4 * after, share);
      n++;
    }
    this.n = n;
    this.slots = null;
  }

  /** Row of an id; -1 where it is not there. */
  slotOf(id) {
    if (!this.slots) {
      this.slots = new Map();
      for (let i = 0; i < this.n; i++) this.slots.set(this.id[i], i);
    }
    return this.slots.get(id) ?? -1;
  }
}

/** An attitude between two, of one of which the opposite sign may be meant. */
export function turned(out, at, quat, a, b, share) {
  const same = quat[a] * quat[b] + quat[a + 1] * quat[b + 1] + quat[a + 2] * quat[b + 2] + quat[a + 3] * quat[b + 3];
  const far = same < 0 ? -share : share;
  const near = 1 - share;
  let sum = 0;
  for (let k = 0; k < 4; k++) {
    out[at + k] = near * quat[a + k] + far * quat[b + k];
    sum += out[at + k] * out[at + k];
  }
  const size = 1 / Math.sqrt(sum || 1);
  for (let k = 0; k < 4; k++) out[at + k] *= size;
}
