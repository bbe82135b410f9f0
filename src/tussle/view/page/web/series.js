// Quantities over time: each keeps its value until its next change. They come from the server, or with the page, as lists of changes.
/** @import { Change } from './types' */

import { lastNotAfter } from './ordered.js';

/** Quantities of each team. */
export const OF_TEAMS = ['left', 'born', 'score', 'captures'];

/** A quantity: values that hold from times on; NaN where it is not known. */
export class Series {
  constructor() {
    /** @type {number[]} */
    this.t = [];
    /** @type {number[]} */
    this.v = [];
  }

  /** The value at a time; NaN before the first. @param {number} t */
  at(t) {
    return this.v[lastNotAfter(this.t, t)] ?? NaN;
  }

  /** The least and the largest value, and of a range. @param {number[]} others @returns {[number, number]} */
  range([low, high] = [Infinity, -Infinity]) {
    for (const value of this.v) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
    return [low, high];
  }
}

/** All quantities that a page knows. */
export class SeriesBook {
  constructor() {
    /** @type {Map<string, Series>} */
    this.known = new Map();
  }

  /** Take changes; those that are known from the first of them on are wrong. @param {Change[]} changes */
  take(changes) {
    for (const { name, team, id, from, t, v } of changes) {
      const series = this.of(name, team, id);
      series.t.length = series.v.length = from;
      t.forEach((time, i) => {
        series.t.push(time);
        series.v.push(v[i] ?? NaN);
      });
    }
  }

  /** A quantity, empty where it is not known yet. @param {string} name @param {number | null} team @param {number} id */
  of(name, team = null, id = 0) {
    const key = `${name}\n${team}\n${id}`;
    let found = this.known.get(key);
    if (!found) this.known.set(key, found = new Series());
    return found;
  }

  /** Whether a quantity has values. @param {string} name @param {number | null} team @param {number} id */
  has(name, team = null, id = 0) {
    return this.of(name, team, id).t.length > 0;
  }

  /** Forget all that does not fulfil a condition. @param {(name: string, id: number) => boolean} isKept */
  keep(isKept) {
    for (const key of this.known.keys()) {
      const [name, , id] = key.split('\n');
      if (!isKept(name, Number(id))) this.known.delete(key);
    }
  }
}

/** Width within which changes are drawn as one vertical line [pixels]. */
const NARROW = 0.5;

/**
 * Path of a quantity up to a time, as steps: level from change to change. It is broken where the quantity is not known.
 * @param {Series} series @param {number} until time of its end @param {(t: number) => number} x pixel of a time @param {(value: number) => number} y pixel of a value
 */
export function steps({ t, v }, until, x, y) {
  const path = new Path2D();
  let isOpen = false;
  const last = lastNotAfter(t, until);
  for (let k = 0; k <= last; k++) {
    const left = x(t[k]);
    let [level, right] = [y(v[k]), x(k < last ? t[k + 1] : until)];
    if (Number.isNaN(level)) {
      isOpen = false;
      continue;
    }
    if (isOpen) path.lineTo(left, level);
    else path.moveTo(left, level);
    let [low, high] = [level, level];
    while (right - left < NARROW && k < last && !Number.isNaN(v[k + 1])) {
      k++;
      [level, right] = [y(v[k]), x(k < last ? t[k + 1] : until)];
      [low, high] = [Math.min(low, level), Math.max(high, level)];
    }
    if (low < high) [low, high, level].forEach((each) => path.lineTo(left, each));
    path.lineTo(right, level);
    isOpen = true;
  }
  return path;
}
