// The camera: it looks at a point from a distance. `goal` is the view that was asked for; `now`, the one that is drawn, approaches it.
/** @import { Mode, Vector, View } from './types' */

import { add, between, cross, halfTurn, minus, norm, perspective, scaled } from './geometry.js';

const FIELD_OF_VIEW = (45 * Math.PI) / 180;
/** Time constant with which the drawn view approaches its goal [s]; the overview, which moves by itself, is calmer. */
const HASTE = { free: 0.07, follow: 0.07, behind: 0.09, overview: 0.35 };
export const STEEPEST = Math.PI / 2;
/** Nearest that an overview comes [m]. */
const MIN_DISTANCE = 6;
/** Where the eye is at first, seen from what it looks at: south, a little west, and above. */
export const FIRST_YAW = (-115 * Math.PI) / 180;
export const FIRST_PITCH = 0.5;

/** Of mode `overview` it keeps all in view; `follow` keeps to an entity, `behind` turns with it as well; `free` stays where it is put. */
export class Camera {
  /** @param {number} size of the scene [m] */
  constructor(size) {
    this.size = size;
    /** @type {Mode} */
    this.mode = 'overview';
    this.base = [0, 0, 0];
    this.heading = 0;
    /** It looks straight down, as on a map: north, or where it follows to, is up. */
    this.isPlain = false;
    this.goal = { at: [0, 0, 0], yaw: FIRST_YAW, pitch: FIRST_PITCH, zoom: Math.log(size) };
    this.now = structuredClone(this.goal);
    /** @type {{ goal: Camera['goal'], mode: Mode, base: number[], heading: number, chosen: number }[]} */
    this.past = [];
  }

  /** The point that is looked at. */
  get target() {
    return add(this.base, this.now.at);
  }

  get isFollowing() {
    return this.mode === 'follow' || this.mode === 'behind';
  }

  get distance() {
    return Math.exp(this.now.zoom);
  }

  /** Change the mode without a jump. @param {Mode} mode @param {number[]} base place of the entity that is followed @param {number} heading of it */
  enter(mode, base = [0, 0, 0], heading = 0) {
    this.mode = mode;
    const fixed = this.isFollowing ? base : [0, 0, 0];
    const turn = mode === 'behind' ? heading : 0;
    for (const state of [this.goal, this.now]) {
      state.at = minus(add(state.at, this.base), fixed);
      state.yaw = halfTurn(state.yaw + this.heading - turn);
    }
    // The shorter way round.
    this.now.yaw = this.goal.yaw + halfTurn(this.now.yaw - this.goal.yaw);
    this.base = fixed;
    this.heading = turn;
    if (this.isFollowing) this.goal.at = [0, 0, 0];
    if (mode === 'behind') {
      this.now.yaw = Math.PI + halfTurn(this.now.yaw - Math.PI);
      this.goal.yaw = Math.PI;
      this.goal.pitch = between(this.goal.pitch, 0.1, 0.45);
    }
  }

  /** Look from a place at another at once, freely; what is null stays. @param {number[] | null} from @param {number[] | null} at */
  look(from, at) {
    const target = at || this.target;
    const eye = from || add(target, scaled(this.axes().away, this.distance));
    const gap = minus(eye, target);
    this.enter('free');
    this.goal = { at: target, yaw: Math.atan2(gap[1], gap[0]), pitch: Math.asin(gap[2] / (norm(gap) || 1)), zoom: Math.log(norm(gap) || 1) };
    this.now = structuredClone(this.goal);
  }

  /** Keep to an entity that has moved on. @param {number[]} place @param {number} heading */
  track(place, heading) {
    if (this.isFollowing) this.base = place;
    if (this.mode === 'behind') this.heading += halfTurn(heading - this.heading);
  }

  /** Remember the view, so that `undo` comes back to it. @param {number} chosen */
  remember(chosen) {
    this.past.push({ goal: structuredClone(this.goal), mode: this.mode, base: this.base, heading: this.heading, chosen });
    if (this.past.length > 50) this.past.shift();
  }

  /** Return to the view before the last change; returns who was chosen then, or null where there is none. */
  undo() {
    const last = this.past.pop();
    if (!last) return null;
    const { target } = this;
    const yaw = this.now.yaw + this.heading;
    Object.assign(this, { goal: last.goal, mode: last.mode, base: last.base, heading: last.heading });
    this.now.at = minus(target, this.base);
    this.now.yaw = this.goal.yaw + halfTurn(yaw - this.heading - this.goal.yaw);
    return last.chosen;
  }

  /** @param {number} yaw @param {number} pitch */
  turn(yaw, pitch) {
    this.goal.yaw += yaw;
    this.goal.pitch = between(this.goal.pitch + pitch, -STEEPEST, STEEPEST);
  }

  /** Move what is looked at by pixels of a view. @param {number} right @param {number} up @param {number} height of the view [pixels] */
  pan(right, up, height) {
    const perPixel = (2 * Math.tan(FIELD_OF_VIEW / 2) * Math.exp(this.goal.zoom)) / height;
    const axes = this.axes();
    this.goal.at = add(this.goal.at, add(scaled(axes.right, right * perPixel), scaled(axes.up, up * perPixel)));
  }

  /** Come nearer by a factor, towards a place that keeps its pixel. @param {number} factor @param {number[] | null} place null is what is looked at */
  zoom(factor, place = null) {
    const before = this.goal.zoom;
    this.goal.zoom = between(before + Math.log(factor), Math.log(0.3), Math.log(this.size * 40));
    if (!place) return;
    const share = 1 - Math.exp(this.goal.zoom - before);
    this.goal.at = add(this.goal.at, scaled(minus(place, add(this.base, this.goal.at)), share));
  }

  /** Approach the goal; true while it is not reached. @param {number} seconds @param {boolean} isCalm at once */
  step(seconds, isCalm) {
    const { now, goal } = this;
    const shareIn = (/** @type {number} */ haste) => (isCalm ? 1 : 1 - Math.exp(-seconds / haste));
    // An overview that has to become wider does so at once, lest entities leave it.
    const isWidening = this.mode === 'overview' && goal.zoom > now.zoom;
    const [share, turned] = [shareIn(isWidening ? HASTE.free : HASTE[this.mode]), shareIn(HASTE.free)];
    const gap = minus(goal.at, now.at);
    const isFar = norm(gap) > 2e-4 * this.distance || Math.abs(goal.yaw - now.yaw) + Math.abs(goal.pitch - now.pitch) > 2e-4 ||
      Math.abs(goal.zoom - now.zoom) > 2e-4;
    now.at = isFar ? add(now.at, scaled(gap, share)) : goal.at;
    now.zoom = isFar ? now.zoom + share * (goal.zoom - now.zoom) : goal.zoom;
    now.yaw = isFar ? now.yaw + turned * (goal.yaw - now.yaw) : goal.yaw;
    now.pitch = isFar ? now.pitch + turned * (goal.pitch - now.pitch) : goal.pitch;
    return isFar;
  }

  /** Right, up, and away from what is looked at, also straight from above. */
  axes(state = this.now) {
    const yaw = this.isPlain && this.mode !== 'behind' ? -Math.PI / 2 : state.yaw + this.heading;
    if (this.isPlain) return { right: [-Math.sin(yaw), Math.cos(yaw), 0], up: [-Math.cos(yaw), -Math.sin(yaw), 0], away: [0, 0, 1] };
    const [level, height] = [Math.cos(state.pitch), Math.sin(state.pitch)];
    const away = [level * Math.cos(yaw), level * Math.sin(yaw), height];
    const right = [-Math.sin(yaw), Math.cos(yaw), 0];
    return { right, up: cross(away, right), away };
  }

  /**
   * All that is needed to draw. Places of the world are taken relative to an anchor near them, for 32 bits are few.
   * @param {number} width @param {number} height @param {number} ratio pixels of the canvas to one of the window @param {number[]} anchor @returns {View}
   */
  view(width, height, ratio, anchor) {
    const { right, up, away } = this.axes();
    const { distance } = this;
    const eye = add(this.target, scaled(away, distance));
    const near = Math.max(0.02 * distance, 0.02);
    const far = 4 * (distance + this.size) + 100;
    const clip = perspective(minus(eye, anchor), right, up, away, FIELD_OF_VIEW, width / height, near, far);
    if (this.isPlain) clip.set([0, 0, 0, distance].flatMap((w, i) => [clip[4 * i], clip[4 * i + 1], clip[4 * i + 2], w]));
    return { clip, eye, right, up, away, width, height, anchor, near, far, distance, ratio, perPixel: (2 * Math.tan(FIELD_OF_VIEW / 2)) / height };
  }

  /**
   * Ask for a view of places from the present direction.
   * @param {(see: (x: number, y: number, z: number) => void) => void} each calls a function with every place
   * @param {number} aspect @param {{ left: number, right: number, top: number, bottom: number }} room shares of the view that panels cover
   */
  fit(each, aspect, room) {
    const { right, up, away } = this.axes(this.goal);
    const axes = [right, up, away];
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    each((x, y, z) => {
      for (let k = 0; k < 3; k++) {
        const along = axes[k][0] * x + axes[k][1] * y + axes[k][2] * z;
        low[k] = Math.min(low[k], along);
        high[k] = Math.max(high[k], along);
      }
    });
    if (low[0] === Infinity) return;
    const middle = scaled(add(low, high), 0.5);
    const tangent = Math.tan(FIELD_OF_VIEW / 2);
    const wide = 1 / (tangent * aspect * (1 - room.left - room.right));
    const tall = 1 / (tangent * (1 - room.top - room.bottom));
    let distance = MIN_DISTANCE;
    each((x, y, z) => {
      const across = Math.abs(right[0] * x + right[1] * y + right[2] * z - middle[0]) * wide;
      const upward = Math.abs(up[0] * x + up[1] * y + up[2] * z - middle[1]) * tall;
      distance = Math.max(distance, Math.max(across, upward) + (this.isPlain ? 0 : away[0] * x + away[1] * y + away[2] * z - middle[2]));
    });
    const shift = [(room.right - room.left) * tangent * aspect * distance, (room.top - room.bottom) * tangent * distance, 0];
    const at = add(middle, shift);
    this.goal.at = add(scaled(right, at[0]), add(scaled(up, at[1]), scaled(away, at[2])));
    this.goal.zoom = Math.log(distance);
  }
}

/** Pixel of a place and how far before the eye it is; null behind the eye. @param {View} view @param {Vector} place */
export function pixelOf(view, place) {
  const { clip, anchor } = view;
  const [x, y, z] = minus(place, anchor);
  const w = clip[3] * x + clip[7] * y + clip[11] * z + clip[15];
  if (w <= view.near) return null;
  const across = (clip[0] * x + clip[4] * y + clip[8] * z + clip[12]) / w;
  const upward = (clip[1] * x + clip[5] * y + clip[9] * z + clip[13]) / w;
  return [(0.5 + 0.5 * across) * view.width, (0.5 - 0.5 * upward) * view.height, w];
}

/** The place behind a pixel, as far away as what is looked at. @param {View} view @param {Camera} camera @param {number} x @param {number} y */
export function placeBehind(view, camera, x, y) {
  const right = (x - 0.5 * view.width) * view.perPixel * view.distance;
  const up = (0.5 * view.height - y) * view.perPixel * view.distance;
  return add(camera.target, add(scaled(view.right, right), scaled(view.up, up)));
}
