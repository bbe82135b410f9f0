// A game that is played while it is seen: its newest frame, and those before, for the trails.

import { minus, norm, scaled } from './geometry.js';
import { Chunk, Moment } from './chunk.js';
import { lastWhere, Layer } from './layer.js';

/** States of past frames that are kept; of more, every other frame goes. */
const MOST_PAST = 1e6;
/** A look back over more seconds than this is for the curves. */
const WHOLE = 5e8;
/** Moments of the curves; of more, every other one goes. */
const MOST_MOMENTS = 600;

export class Live extends Layer {
  constructor(page, changed) {
    super(page, changed);
    this.status = null;
    this.rows = [];
    this.epoch = -1;
    this.clear();
    this.scores = { t: [], n: page.teams.map(() => []) };
  }

  clear() {
    this.past = [];
    this.nPast = 0;
  }

  get mostAtOnce() {
    return this.shown.n;
  }

  /** Take the newest frame. */
  takeFrame({ epoch }, bytes) {
    const chunk = new Chunk(bytes, this.page);
    if (epoch !== this.epoch) this.clear();
    this.epoch = epoch;
    this.meet(chunk);
    this.shown = momentOf(chunk, 0);
    this.end = Math.max(this.end, this.shown.t);
    this.keep(this.shown);
    cut(this.curves, this.shown.t);
    append(this.curves, this.shown.t, this.counts());
    this.changed();
  }

  /** Take what was seen before. */
  takePast({ epoch, seconds }, bytes) {
    if (epoch !== this.epoch) return;
    const chunk = new Chunk(bytes, this.page);
    if (seconds > WHOLE) {
      this.fillCurves(chunk);
      return;
    }
    const known = new Set(this.past.map(({ t }) => t));
    for (let i = 0; i < chunk.nFrames; i++) if (!known.has(chunk.times[i])) this.past.push(momentOf(chunk, i));
    this.past.sort((a, b) => a.t - b.t);
    this.nPast = this.past.reduce((sum, each) => sum + each.n, 0);
    this.changed();
  }

  /** Count who was there before this page was. */
  fillCurves(chunk) {
    const { shown, curves } = this;
    const known = { t: [...curves.t], n: curves.n.map((values) => [...values]) };
    cut(curves, -Infinity);
    for (let i = 0; i < chunk.nFrames && !(chunk.times[i] >= known.t[0]); i++) {
      this.shown = momentOf(chunk, i);
      append(curves, chunk.times[i], this.counts());
    }
    known.t.forEach((t, i) => append(curves, t, known.n.map((values) => values[i])));
    this.shown = shown;
    this.changed();
  }

  keep(moment) {
    const { past } = this;
    if (past.length && moment.t <= past[past.length - 1].t) return;
    past.push(moment);
    this.nPast += moment.n;
    if (this.nPast > MOST_PAST) {
      this.past = past.filter((_, i) => i % 2 || i > past.length - 20);
      this.nPast = this.past.reduce((sum, each) => sum + each.n, 0);
    }
  }

  takeStatus(status) {
    this.status = status;
    [this.start, this.end] = [status.span[0], Math.max(status.span[1], this.shown.t || 0)];
    const { from, rows } = status.events;
    if (rows.length || from < this.rows.length) {
      this.rows = [...this.rows.slice(0, from), ...rows];
      this.setEvents(this.rows);
    }
    if (Object.keys(status.scores).length) {
      cut(this.scores, status.t);
      append(this.scores, status.t, this.page.teams.map(({ id }) => status.scores[id] ?? 0));
    }
    this.changed();
  }

  show() {
    return this.shown.n > 0 || !Number.isNaN(this.shown.t);
  }

  lookAhead() {}

  momentAt(t) {
    return this.past[lastWhere(this.past.length, (i) => this.past[i].t <= t + 1e-9)];
  }

  placeAt(id, t) {
    const moment = this.momentAt(t);
    const slot = moment ? moment.slotOf(id) : -1;
    return slot < 0 ? null : [moment.x[slot], moment.y[slot], moment.z[slot]];
  }

  velocity(slot) {
    const before = this.placeAt(this.shown.id[slot], this.shown.t - 0.25) || this.placeAt(this.shown.id[slot], this.shown.t - 1e-6);
    const moment = this.momentAt(this.shown.t - 0.25) || this.momentAt(this.shown.t - 1e-6);
    if (!before || moment.t >= this.shown.t) return [0, 0, 0];
    return scaled(minus(this.placeIn(slot), before), 1 / (this.shown.t - moment.t));
  }

  /** Lay out trails of the last seconds: see `Trails`. */
  layTrails(lines, { seconds, most, isWanted, ageOf }) {
    const { shown } = this;
    const leap = 0.25 * norm(minus(this.page.scenery.high, this.page.scenery.low));
    const past = this.past.filter(({ t }) => t >= shown.t - seconds && t < shown.t);
    const stride = Math.max(1, Math.ceil(past.length / most));
    const moments = past.filter((_, i) => (past.length - i) % stride === 0);
    for (let slot = 0; slot < shown.n; slot++) {
      if (!isWanted(shown.id[slot], shown.team[slot])) continue;
      const colour = this.colourOf(slot);
      let [x, y, z] = this.placeIn(slot);
      lines.add(x, y, z, 0, colour, moments.length > 0);
      for (let i = moments.length - 1; i >= 0; i--) {
        const moment = moments[i];
        const at = moment.id[slot] === shown.id[slot] && slot < moment.n ? slot : moment.slotOf(shown.id[slot]);
        const isFar = at < 0 || Math.hypot(moment.x[at] - x, moment.y[at] - y, moment.z[at] - z) > leap;
        if (isFar) {
          lines.end();
          break;
        }
        [x, y, z] = [moment.x[at], moment.y[at], moment.z[at]];
        lines.add(x, y, z, ageOf(moment.t), colour, i > 0);
      }
    }
  }
}

function momentOf(chunk, i) {
  const moment = new Moment(chunk.nTracks);
  moment.fill(chunk, i, 0);
  return Object.assign(moment, { t: chunk.times[i], frame: chunk.first + i });
}

/** Forget what a curve has of a time and later ones. */
function cut(curves, t) {
  const n = lastWhere(curves.t.length, (i) => curves.t[i] < t) + 1;
  for (const values of [curves.t, ...curves.n]) values.length = n;
}

export function append(curves, t, row) {
  curves.t.push(t);
  row.forEach((value, i) => curves.n[i].push(value));
  if (curves.t.length > MOST_MOMENTS) {
    for (const values of [curves.t, ...curves.n]) values.splice(0, values.length, ...values.filter((_, i) => i % 2 === 0));
  }
}
