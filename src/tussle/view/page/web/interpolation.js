// Between the states of a live game: what is drawn moves on evenly while states come in one after another.

import { norm, minus, between } from './geometry.js';
import { blend, Moment } from './chunk.js';

/** Longest time over which a state is approached [s]; states that come more seldom are reached early and stay. */
const LONGEST = 1.5;
/** Share of a new interval in the usual one. */
const FRESH = 0.3;

/** Where the drawing is between the states that have come, one usual interval behind the newest. */
export class Approach {
  constructor() {
    this.t = NaN;
    this.goal = NaN;
    this.left = 0;
    this.usual = 0;
    this.came = NaN;
  }

  /** A state has come. @param {number} t its time @param {number} now time of this computer [s] @param {boolean} isJump it is shown at once */
  take(t, now, isJump) {
    const interval = now - this.came;
    this.came = now;
    this.goal = t;
    if (!isJump && t > this.t && interval < LONGEST) {
      this.usual = this.usual ? this.usual + FRESH * (interval - this.usual) : interval;
      this.left = this.usual;
    } else {
      this.t = t;
    }
  }

  /** Move on; true where there is something new to be drawn. @param {number} seconds */
  advance(seconds) {
    if (this.t === this.goal) return false;
    const share = this.left > seconds ? seconds / this.left : 1;
    this.left -= seconds;
    this.t = share === 1 ? this.goal : this.t + share * (this.goal - this.t);
    return true;
  }
}

/**
 * Fill a moment with what lies between two others: who is in both moves from one to the other, who is only in the first stays.
 * @param {Moment} out @param {Moment} a @param {Moment} b @param {number} t between their times @param {number} leap moves above this are jumps [m]
 */
export function fillBetween(out, a, b, t, leap) {
  const share = between((t - a.t) / (b.t - a.t), 0, 1);
  if (out.room < a.n) out.reserve(a.n);
  for (let i = 0; i < a.n; i++) {
    const j = a.id[i] === b.id[i] ? i : b.slotOf(a.id[i]);
    const isJump = j < 0 || norm(minus(b.placeIn(j), a.placeIn(i))) > leap;
    const s = isJump ? 0 : share;
    out.id[i] = a.id[i];
    out.team[i] = a.team[i];
    out.block[i] = a.block[i];
    out.health[i] = a.health[i];
    out.x[i] = a.x[i] + (s && s * (b.x[j] - a.x[i]));
    out.y[i] = a.y[i] + (s && s * (b.y[j] - a.y[i]));
    out.z[i] = a.z[i] + (s && s * (b.z[j] - a.z[i]));
    blend(out.quat, 4 * i, a.quat, 4 * i, s ? b.quat : a.quat, s ? 4 * j : 4 * i, s);
  }
  out.n = a.n;
  out.t = t;
  out.frame = a.frame;
  out.slots = null;
  return out;
}
