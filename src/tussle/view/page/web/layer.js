// A game: who is there, where, and what has happened. Its subclasses are a recording, and a game that is played (live.js).

import { between, minus, scaled } from './geometry.js';
import { Reader } from './packing.js';
import { Chunk, Moment } from './chunk.js';

/** States of a recording that are kept unpacked, at some 45 bytes each; the chunks that were used last stay. */
const MOST_STATES = 4e6;
export const NO_TEAM = { id: 0, name: '', colour: [150, 160, 172] };

export class Layer {
  /** `changed` is called when there is something new to be shown. */
  constructor(page, changed) {
    this.page = page;
    this.changed = changed;
    this.teams = new Map(page.teams.map((team) => [team.id, team]));
    this.blockOf = new Map();
    this.colours = new Map();
    this.events = [];
    this.shown = new Moment(16);
    [this.start, this.end] = [0, 0];
    /** Entities of each team at some times, for the curves. */
    this.curves = { t: [], n: page.teams.map(() => []) };
  }

  /** What happened, without the deaths that a capture or a collision tells of. `rows` are [t, kind, id, other, text]. */
  setEvents(rows) {
    const all = rows.map(([t, kind, id, other, text]) => ({ t, kind, id, other, text }));
    const isTold = new Set();
    for (const { t, kind, id, other, text } of all) {
      if (kind === 'capture') isTold.add(`${t} ${other}`);
      if (kind === 'collision') isTold.add(`${t} ${id}`).add(`${t} ${other}`);
      const block = kind === 'birth' ? this.page.blocks.findIndex(({ name }) => name === text) : -1;
      if (block >= 0) this.blockOf.set(id, block);
    }
    this.events = all.filter(({ t, kind, id }) => kind !== 'death' || !isTold.has(`${t} ${id}`));
    // Who is there from the beginning needs no mark.
    this.marked = this.events.filter(({ t, kind }) => kind !== 'birth' || t > this.start);
  }

  /** Learn the names of those who are in a chunk. */
  meet(chunk) {
    for (let k = 0; k < chunk.nTracks; k++) this.blockOf.set(chunk.id[k], chunk.block[k]);
  }

  who(id) {
    const block = this.page.blocks[this.blockOf.get(id)];
    const number = this.page.idShift && id > this.page.idShift ? id - this.page.idShift : id;
    return block ? `${block.name} ${number}` : `${number}`;
  }

  teamOf(id) {
    const block = this.page.blocks[this.blockOf.get(id)];
    return (block && this.teams.get(block.team)) || NO_TEAM;
  }

  /** Colour of a block's entities in a team: the block's own where it is of that team. */
  colour(block, team) {
    const key = 65536 * block + team;
    let found = this.colours.get(key);
    if (!found) {
      const own = this.page.blocks[block];
      found = own.team === team ? own.colour : (this.teams.get(team) || NO_TEAM).colour;
      this.colours.set(key, found);
    }
    return found;
  }

  colourOf(slot) {
    return this.colour(this.shown.block[slot], this.shown.team[slot]);
  }

  /** Entities of each team who are shown. */
  counts() {
    const found = new Map(this.page.teams.map(({ id }) => [id, 0]));
    for (let i = 0; i < this.shown.n; i++) found.set(this.shown.team[i], (found.get(this.shown.team[i]) || 0) + 1);
    return this.page.teams.map(({ id }) => found.get(id));
  }

  slotOf(id) {
    return this.shown.slotOf(id);
  }

  placeIn(slot) {
    return [this.shown.x[slot], this.shown.y[slot], this.shown.z[slot]];
  }
}

/** A recorded run, of which chunks are unpacked when they are first needed. */
export class Recorded extends Layer {
  /** `failed` is called with an error when a chunk cannot be read. */
  constructor(page, source, changed, failed) {
    super(page, changed);
    this.source = source;
    this.failed = failed;
    this.chunks = new Map();
    this.reading = new Set();
    this.curves = page.curves;
  }

  async read() {
    this.times = new Reader(await this.source.blob('times')).reals(this.page.nFrames);
    [this.start, this.end] = [this.times[0], this.times[this.times.length - 1]];
    // A slider gives back times whose last digits differ from those it was given.
    this.slack = 1e-6 * ((this.end - this.start) / Math.max(1, this.times.length - 1));
    const columns = JSON.parse(new TextDecoder().decode(await this.source.blob('events')));
    this.setEvents(columns.t.map((t, i) => [t, columns.kind[i], columns.id[i], columns.other[i], columns.text[i]]));
  }

  get mostAtOnce() {
    return this.page.mostAtOnce;
  }

  /** Number of the last frame that is not after a time, within a millionth of a frame. */
  frameAt(t) {
    return Math.max(0, lastWhere(this.times.length, (i) => this.times[i] <= t + this.slack));
  }

  /** Number of the chunk that goes on from a frame. */
  chunkOf(frame) {
    const { chunks } = this.page;
    return Math.max(0, lastWhere(chunks.length, (i) => chunks[i][0] <= frame));
  }

  /** A chunk; null where it has to be read first, which begins now. */
  chunk(number) {
    const chunk = this.chunks.get(number);
    if (chunk) {
      this.chunks.delete(number);
      this.chunks.set(number, chunk);
      return chunk;
    }
    if (number >= 0 && number < this.page.chunks.length) this.unpack(number).catch(this.failed);
    return null;
  }

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
      if (nStates <= MOST_STATES || this.chunks.size <= 2) break;
      nStates -= each.nStates;
      this.chunks.delete(oldest);
    }
    this.changed();
  }

  /** The oldest frame that can be kept unpacked together with a frame. */
  oldestBeside(frame) {
    const { chunks, nStates } = this.page;
    const most = Math.max(1, Math.floor((0.6 * MOST_STATES * chunks.length) / Math.max(1, nStates)));
    return chunks[Math.max(0, this.chunkOf(frame) - most + 1)][0];
  }

  /** Set `shown` to a time, between frames on the straight way; false while it has to be read. */
  show(t) {
    const frame = this.frameAt(t);
    const chunk = this.chunk(this.chunkOf(frame));
    if (!chunk) return false;
    if (this.shown.t === t) return true;
    const next = frame + 1 < this.times.length ? this.times[frame + 1] : t;
    const share = next > this.times[frame] ? between((t - this.times[frame]) / (next - this.times[frame]), 0, 1) : 0;
    this.shown.fill(chunk, frame - chunk.first, share);
    Object.assign(this.shown, { t, frame, chunk });
    return true;
  }

  /** Read what comes next. */
  lookAhead() {
    this.chunk(this.chunkOf(this.shown.frame) + 1);
  }

  /** Where an entity was at a time; null where it was not there, or that is not unpacked. */
  placeAt(id, t) {
    const frame = this.frameAt(t);
    const chunk = this.chunks.get(this.chunkOf(frame));
    const track = chunk ? chunk.trackIn(id, frame - chunk.first) : -1;
    return track < 0 ? null : chunk.placeOf(chunk.row[track] + frame - chunk.first - chunk.begin[track]);
  }

  /** Velocity [m/s] of who is shown in a slot, over the frames around it within half a second. */
  velocity(slot) {
    const { frame, chunk, track } = this.shown;
    const { times } = this;
    const k = track[slot];
    const [begin, end] = [chunk.first + chunk.begin[k], chunk.first + chunk.end[k]];
    let [a, b] = [frame, Math.min(frame + 1, end)];
    while (a > begin && times[frame] - times[a - 1] <= 0.25) a--;
    while (b < end && times[b + 1] - times[frame] <= 0.25) b++;
    if (a === b) a = Math.max(begin, a - 1);
    if (a === b) return [0, 0, 0];
    const [from, to] = [a, b].map((each) => chunk.placeOf(chunk.row[k] + each - begin));
    return scaled(minus(to, from), 1 / (times[b] - times[a]));
  }

  /** Lay out trails of the last seconds: see `Trails`. */
  layTrails(lines, { seconds, most, isWanted, ageOf }) {
    const { shown, times } = this;
    const from = Math.max(this.frameAt(Math.max(this.start, times[shown.frame] - seconds)), this.oldestBeside(shown.frame));
    const stride = Math.max(1, Math.ceil((shown.frame - from) / most));
    for (let k = this.chunkOf(from); k <= this.chunkOf(shown.frame); k++) {
      const chunk = this.chunk(k);
      if (chunk) this.layChunk(lines, chunk, Math.floor(from / stride) * stride, stride, { isWanted, ageOf });
    }
  }

  /** Lay out what a chunk has of the trails, in frames that a stride divides and in the last one. */
  layChunk(lines, chunk, from, stride, { isWanted, ageOf }) {
    const { shown, times } = this;
    for (let k = 0; k < chunk.nTracks; k++) {
      const first = Math.max(from, chunk.first + chunk.begin[k]);
      const last = Math.min(shown.frame, chunk.first + chunk.end[k]);
      if (first > last || !isWanted(chunk.id[k], chunk.team[k])) continue;
      const colour = this.colour(chunk.block[k], chunk.team[k]);
      const isHead = chunk === shown.chunk && last === shown.frame;
      for (let frame = first; frame <= last; frame = nextFrame(frame, stride, last)) {
        const row = chunk.row[k] + frame - chunk.first - chunk.begin[k];
        lines.add(...chunk.placeOf(row), ageOf(times[frame]), colour, frame < last || isHead);
      }
      const slot = isHead ? shown.slotOf(chunk.id[k]) : -1;
      if (isHead) lines.add(...this.placeIn(slot), 0, colour, false);
    }
  }
}

/** The frame after one that a stride divides; the last one always comes. */
function nextFrame(frame, stride, last) {
  const next = (Math.floor(frame / stride) + 1) * stride;
  return frame < last && next > last ? last : next;
}

/** The last of n numbers from 0 for which a condition holds that holds for all before it; -1 without one. */
export function lastWhere(n, holds) {
  let [low, high] = [-1, n];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (holds(middle)) low = middle;
    else high = middle;
  }
  return low;
}

/** Number of the last event that is not after a time; -1 without one. */
export function lastNotAfter(events, t) {
  return lastWhere(events.length, (i) => events[i].t <= t + 1e-9);
}
