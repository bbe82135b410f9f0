// A live game: its newest frame, and those before, for the trails.
/** @import { Change, EventRow, PageData, Sample, Section, Status } from './types' */

import { Chunk, Moment } from './chunk.js';
import { Approach, fillBetween } from './interpolation.js';
import { Layer } from './layer.js';
import { lastWhere } from './ordered.js';

/** States of past frames that are kept; of more, every other frame goes. */
const MAX_PAST = 1e6;

export class Live extends Layer {
  /** @param {PageData} page @param {() => void} changed */
  constructor(page, changed) {
    super(page, changed);
    /** @type {Status | null} */
    this.status = null;
    /** @type {EventRow[]} */
    this.rows = [];
    this.epoch = -1;
    /** @type {Moment[]} */
    this.past = [];
    /** The newest state; `shown` approaches it. */
    this.newest = this.shown;
    this.approach = new Approach();
    this.between = new Moment();
  }

  get mostAtOnce() {
    return this.newest.n;
  }

  get isSettled() {
    return this.shown === this.newest;
  }

  /** When the mission ends the game, as long as it is not over before. */
  get horizon() {
    return this.status?.isOver ? this.end : Math.max(this.end, this.page.endTime ?? this.end);
  }

  /** State of each specification. */
  alarmsAt() {
    return this.status.alarms;
  }

  /** Take the newest frame. @param {{ epoch: number }} header @param {Uint8Array} bytes */
  takeFrame({ epoch }, bytes) {
    const chunk = new Chunk(bytes, this.page);
    const isJump = epoch !== this.epoch || Boolean(this.status?.isPaused);
    if (epoch !== this.epoch) this.past = [];
    this.epoch = epoch;
    this.meet(chunk);
    const newest = new Moment(chunk.nTracks).fill(chunk, 0);
    this.newest = newest;
    this.end = Math.max(this.end, newest.t);
    if (!(this.past[this.past.length - 1]?.t >= newest.t)) this.keep([...this.past, newest]);
    this.approach.take(newest.t, performance.now() / 1000, isJump);
    this.show();
    this.changed();
  }

  /** Take changes of quantities. @param {{ results: string[], changes: Change[] }} message */
  takeCurves({ results, changes }) {
    this.results = results;
    this.series.take(changes);
    this.changed();
  }

  /** Take what was seen before. @param {{ epoch: number }} header @param {Uint8Array} bytes */
  takePast({ epoch }, bytes) {
    if (epoch !== this.epoch) return;
    const chunk = new Chunk(bytes, this.page);
    this.meet(chunk);
    const moments = Array.from(chunk.times, (_, i) => new Moment(chunk.nTracks).fill(chunk, i));
    const known = new Set(this.past.map(({ t }) => t));
    this.keep([...this.past, ...moments.filter(({ t }) => !known.has(t))].sort((a, b) => a.t - b.t));
    this.changed();
  }

  /** @param {Moment[]} past */
  keep(past) {
    const nStates = past.reduce((sum, each) => sum + each.n, 0);
    this.past = nStates > MAX_PAST ? past.filter((_, i) => i % 2 || i > past.length - 20) : past;
  }

  /** @param {Status} status */
  takeStatus(status) {
    this.status = status;
    this.start = status.span[0];
    this.end = Math.max(status.span[1], this.newest.t || 0);
    const { from, rows } = status.events;
    if (rows.length || from < this.rows.length) {
      this.rows = [...this.rows.slice(0, from), ...rows];
      this.setEvents(this.rows);
      this.changed();
    }
  }

  /** Columns of an entity's plugins, and its messages. @param {number} id @returns {Section[]} */
  sectionsOf(id) {
    const entity = this.status?.entity;
    return entity?.id === id ? entity.sections.slice(1) : [];
  }

  /** Move what is shown on towards the newest state. @param {number} seconds */
  advance(seconds) {
    if (this.approach.advance(seconds)) this.changed();
  }

  /** Set `shown` to where the approach is, between states on the straight way; false while there is no state. */
  show() {
    const { newest, past, approach: { t } } = this;
    const i = lastWhere(past.length, (k) => past[k].t <= t);
    const after = past[i + 1];
    this.shown = t === newest.t || i < 0 || !after ? newest : past[i].t === t ? past[i] : fillBetween(this.between, past[i], after, t, this.leap);
    return !Number.isNaN(newest.t);
  }

  lookAhead() {}

  /** @param {number} t */
  sampleAt(t) {
    return this.past[lastWhere(this.past.length, (i) => this.past[i].t <= t + 1e-9)] || null;
  }

  /** @param {number} seconds @param {number} most @returns {Sample[]} */
  samples(seconds, most) {
    const { t: now } = this.shown;
    const past = this.past.filter(({ t }) => t >= now - seconds && t < now);
    const stride = Math.max(1, Math.ceil(past.length / most));
    return past.filter((_, i) => (past.length - i) % stride === 0).reverse();
  }
}
