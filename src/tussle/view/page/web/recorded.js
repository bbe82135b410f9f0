// A recorded run, whose chunks are unpacked when they are first needed.
/** @import { Change, EventRow, PageData, Sample, Section, ShapesHeader, Source, SpecificationState } from './types' */

import { between } from './geometry.js';
import { Reader, readMessage } from './packing.js';
import { Chunk } from './chunk.js';
import { ColumnChunk } from './columns.js';
import { Layer } from './layer.js';
import { lastNotAfter, lastWhere } from './ordered.js';
import { OF_TEAMS } from './series.js';

/** States that are kept unpacked, at some 45 bytes each; the chunks that were used last stay. */
const MAX_STATES = 4e6;

/** Groups of frames whose shapes, and chunks whose columns, are kept. */
const MAX_SHAPES = 4;

export class Recorded extends Layer {
  /** @param {PageData} page @param {Source} source @param {() => void} changed @param {(error: Error) => void} failed a chunk cannot be read */
  constructor(page, source, changed, failed) {
    super(page, changed);
    this.source = source;
    this.failed = failed;
    /** @type {Map<number, Chunk>} */
    this.chunks = new Map();
    this.reading = new Set();
    /** Shapes of plugins: groups of frames, each from a frame on. @type {Map<number, { frame: number, header: ShapesHeader, bytes: Uint8Array }[]>} */
    this.shapes = new Map();
    /** Columns of plugins by chunk. @type {Map<number, ColumnChunk>} */
    this.columns = new Map();
    this.times = new Float64Array(0);
    this.slack = 0;
  }

  async read() {
    this.times = new Reader(await this.source.blob('times')).reals(this.page.nFrames);
    this.start = this.times[0];
    this.end = this.times[this.times.length - 1];
    // A slider gives back times whose last digits differ from those it was given.
    this.slack = 1e-6 * ((this.end - this.start) / Math.max(1, this.times.length - 1));
    /** @type {EventRow[]} */
    const rows = JSON.parse(new TextDecoder().decode(await this.source.blob('events')));
    this.setEvents(rows);
    /** @type {Change[]} */
    const changes = JSON.parse(new TextDecoder().decode(await this.source.blob('curves')));
    this.series.take(changes);
    this.results = [...new Set(changes.map(({ name }) => name))].filter((name) => !OF_TEAMS.includes(name));
  }

  get mostAtOnce() {
    return this.page.mostAtOnce;
  }

  /** Number of the last frame that is not after a time, within a millionth of a frame. @param {number} t */
  frameAt(t) {
    return Math.max(0, lastNotAfter(this.times, t, this.slack));
  }

  /** Number of the chunk that goes on from a frame. @param {number} frame */
  chunkOf(frame) {
    const { chunks } = this.page;
    return Math.max(0, lastWhere(chunks.length, (i) => chunks[i][0] <= frame));
  }

  /** A chunk; null where it has to be read first, which begins now. @param {number} number */
  chunk(number) {
    const chunk = this.chunks.get(number);
    if (chunk) {
      this.chunks.delete(number);
      this.chunks.set(number, chunk);
      return chunk;
    }
    if (number < this.page.chunks.length) this.unpack(number).catch(this.failed);
    return null;
  }

  /** @param {number} number */
  async unpack(number) {
    if (this.reading.has(number)) return;
    this.reading.add(number);
    const chunk = new Chunk(await this.source.blob(`chunk-${number}`), this.page);
    this.meet(chunk);
    this.chunks.set(number, chunk);
    this.reading.delete(number);
    let nStates = 0;
    for (const each of this.chunks.values()) nStates += each.nStates;
    for (const [oldest, each] of this.chunks) {
      if (nStates <= MAX_STATES || this.chunks.size <= 2) break;
      nStates -= each.nStates;
      this.chunks.delete(oldest);
    }
    this.changed();
  }

  /** The oldest frame that can be kept unpacked together with a frame. @param {number} frame */
  oldestBeside(frame) {
    const { chunks, nStates } = this.page;
    const most = Math.max(1, Math.floor((0.6 * MAX_STATES * chunks.length) / Math.max(1, nStates)));
    return chunks[Math.max(0, this.chunkOf(frame) - most + 1)][0];
  }

  /** Set `shown` to a time, between frames on the straight way; false while it has to be read. @param {number} t */
  show(t) {
    const frame = this.frameAt(t);
    const chunk = this.chunk(this.chunkOf(frame));
    if (!chunk) return false;
    if (this.shown.t === t) return true;
    const next = frame + 1 < this.times.length ? this.times[frame + 1] : t;
    const share = next > this.times[frame] ? between((t - this.times[frame]) / (next - this.times[frame]), 0, 1) : 0;
    this.shown.fill(chunk, frame - chunk.first, share).t = t;
    return true;
  }

  /** Read what comes next. */
  lookAhead() {
    this.chunk(this.chunkOf(this.shown.frame) + 1);
  }

  /** Shapes of plugins in what is shown; null where there are none, or they have to be read first. */
  shapesShown() {
    const { page: { shapeFrames }, shown: { frame } } = this;
    if (!shapeFrames) return null;
    const number = Math.floor(frame / shapeFrames);
    const found = this.shapes.get(number);
    if (!found) this.readShapes(number).catch(this.failed);
    return found?.[lastWhere(found.length, (i) => found[i].frame <= frame)];
  }

  /** @param {number} number */
  async readShapes(number) {
    const name = `shapes-${number}`;
    if (this.reading.has(name)) return;
    this.reading.add(name);
    const bytes = await this.source.blob(name);
    const view = new DataView(bytes.buffer, bytes.byteOffset);
    const found = [];
    for (let at = 0; at < bytes.length; at += 8 + view.getUint32(at + 4, true)) {
      const [header, data] = readMessage(bytes.subarray(at + 8, at + 8 + view.getUint32(at + 4, true)));
      found.push({ frame: view.getUint32(at, true), header, bytes: data });
    }
    this.shapes.set(number, found);
    this.reading.delete(name);
    if (this.shapes.size > MAX_SHAPES) this.shapes.delete(this.shapes.keys().next().value);
    this.changed();
  }

  /** Columns of a chunk; null where there are none, or they have to be read first. @param {number} number */
  columnsOf(number) {
    if (!this.page.columns.length) return null;
    const found = this.columns.get(number);
    if (!found) this.readColumns(number).catch(this.failed);
    return found;
  }

  /** @param {number} number */
  async readColumns(number) {
    const name = `columns-${number}`;
    if (this.reading.has(name)) return;
    this.reading.add(name);
    const [first, last] = this.page.chunks[number];
    this.columns.set(number, new ColumnChunk(await this.source.blob(name), first, last - first + 1, this.page.columns));
    this.reading.delete(name);
    if (this.columns.size > MAX_SHAPES) this.columns.delete(this.columns.keys().next().value);
    this.changed();
  }

  /** Columns of an entity's plugins that were recorded. @param {number} id @returns {Section[]} */
  sectionsOf(id) {
    const { frame } = this.shown;
    return this.columnsOf(this.chunkOf(frame))?.sections(frame, id) || [];
  }

  /** State of each specification at a time. @param {number} t @returns {SpecificationState[]} */
  alarmsAt(t) {
    const now = t + this.slack;
    return this.page.alarms.map(({ text, unit, id, near, failed, t: times, least, note }) => {
      const last = lastNotAfter(times, now);
      const since = [failed, near].find((time) => time !== null && time <= now) ?? null;
      const state = note ? 'unknown' : since === null ? (last < 0 ? 'open' : 'holds') : since === failed ? 'failed' : 'near';
      const value = this.series.of(text, null, id).at(now);
      return { text, unit, id, state, now: Number.isNaN(value) ? null : value, ended: /** @type {null} */ (null), least: least[last] ?? null, reached: times[last] ?? null, since, note };
    });
  }

  /** @param {number} t */
  sampleAt(t) {
    const frame = this.frameAt(t);
    const chunk = this.chunks.get(this.chunkOf(frame));
    return chunk ? chunk.sample(frame - chunk.first) : null;
  }

  /** @param {number} seconds @param {number} most @returns {Sample[]} */
  samples(seconds, most) {
    const { frame, t } = this.shown;
    const oldest = Math.max(this.frameAt(Math.max(this.start, t - seconds)), this.oldestBeside(frame));
    const stride = Math.max(1, Math.ceil((frame - oldest) / most));
    const found = [];
    // Frames that the stride divides are the same ones in the next picture: trails do not flicker.
    for (let each = frame; each >= oldest; each = each % stride ? each - (each % stride) : each - stride) {
      const chunk = this.chunk(this.chunkOf(each));
      if (chunk && this.times[each] < t) found.push(chunk.sample(each - chunk.first));
    }
    return found;
  }
}
