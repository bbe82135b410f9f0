// The viewpoint: whom the camera follows, and how it keeps all in view.
/** @import { Mode, PageData } from './types' */
/** @import { Player } from './player.js' */

import { byId } from './formatting.js';
import { between, forward, halfTurn } from './geometry.js';
import { FIRST_PITCH, FIRST_YAW, STEEPEST } from './camera.js';

/** Between entities and panels [pixels]. */
const MARGIN = 22;

/** Share of the view that is free. @param {{ left: number, right: number, top: number, bottom: number }} room */
const freeShare = ({ left, right, top, bottom }) => Math.max(0, 1 - left - right) * Math.max(0, 1 - top - bottom);

export class Viewpoint {
  /** @param {Player} player */
  constructor(player) {
    this.player = player;
    this.camera = player.camera;
    this.layer = player.layer;
    /** How the mission wants it to be at first, until that is done. @type {PageData['opening']} */
    this.opening = null;
  }

  /** See the game at first as its mission says. */
  open() {
    const { opening } = this.player.page;
    if (!opening) return;
    if (opening.position || opening.target) this.camera.look(opening.position, opening.target);
    if (opening.follow || opening.mode !== 'free') this.opening = opening;
  }

  /** Follow whom the mission says, when it is there. */
  followFirst() {
    const { opening, layer, player } = this;
    if (!opening || (opening.follow && layer.slotOf(opening.follow) < 0)) return;
    this.opening = null;
    if (opening.follow) player.choose(opening.follow);
    if (opening.mode !== 'free') this.enter(opening.mode);
  }

  remember() {
    this.camera.remember(this.player.chosen);
  }

  /** Let the camera keep to what it keeps to. */
  update() {
    const { camera, layer, player } = this;
    this.followFirst();
    const slot = layer.slotOf(player.chosen);
    if (camera.mode === 'overview') this.fitAll();
    else if (camera.isFollowing && slot >= 0) camera.track(layer.placeIn(slot), this.headingOf(slot));
  }

  /** @param {number} slot */
  headingOf(slot) {
    const nose = forward(this.layer.shown.quat.subarray(4 * slot, 4 * slot + 4));
    return Math.hypot(nose[0], nose[1]) > 0.05 ? Math.atan2(nose[1], nose[0]) : this.camera.heading;
  }

  fitAll() {
    const { shown } = this.layer;
    const { canvas } = this.player;
    this.camera.fit((see) => {
      for (let i = 0; i < shown.n; i++) if (!this.player.isHidden(i)) see(shown.x[i], shown.y[i], shown.z[i]);
    }, canvas.clientWidth / canvas.clientHeight, this.room());
  }

  /** Shares of the view that panels cover, or are to be kept free beside them: below the panels at the top, or between them. */
  room() {
    const { clientWidth: width, clientHeight: height } = this.player.canvas;
    const [head, right, bar] = ['head', 'right', 'bar'].map((id) => byId(id).getBoundingClientRect());
    const beside = Math.max(0, width - right.left);
    const shares = (/** @type {number} */ top, /** @type {number} */ onRight) => ({
      left: Math.max(0.05, MARGIN / width), right: Math.max(0.05, (onRight + MARGIN) / width),
      top: (top + MARGIN) / height, bottom: (height - bar.top + MARGIN) / height,
    });
    const [best] = [shares(Math.max(head.bottom, right.bottom), 0), shares(head.bottom, beside)].sort((a, b) => freeShare(b) - freeShare(a));
    // Where panels cover nearly all, something is seen behind them.
    return freeShare(best) > 0.02 ? best : { ...best, top: Math.min(best.top, 0.3), bottom: Math.min(best.bottom, 0.4) };
  }

  /** Let the camera be of a mode. Following begins near whom it follows. @param {Mode} mode */
  enter(mode) {
    const { camera, layer, player } = this;
    if (mode === 'free' || mode === 'overview') {
      camera.enter(mode);
      player.look();
      return;
    }
    if (!player.chosen) player.choose(this.neighbour(1), false);
    const slot = layer.slotOf(player.chosen);
    if (slot < 0) return;
    const wasFollowing = camera.isFollowing;
    const size = player.picture.sizeOf(slot);
    camera.enter(mode, layer.placeIn(slot), this.headingOf(slot));
    if (!wasFollowing) {
      camera.goal.zoom = Math.min(camera.goal.zoom, Math.log(Math.max(14 * size, 0.004 * camera.size)));
      camera.goal.pitch = between(camera.goal.pitch, 0.12, 0.6);
    }
    // Behind it, its own turns are what is to be seen.
    if (mode === 'behind') camera.goal.zoom = Math.min(camera.goal.zoom, Math.log(25 * size));
    player.look();
  }

  /** Keep all in view, as seen from above or from the side. @param {boolean} isTop */
  overview(isTop) {
    const { goal } = this.camera;
    this.enter('overview');
    // From above, north is up.
    if (isTop) this.lookFrom(-Math.PI / 2, STEEPEST);
    else if (goal.pitch > STEEPEST - 0.01) this.lookFrom(FIRST_YAW, FIRST_PITCH);
  }

  /** @param {number} yaw @param {number} pitch */
  lookFrom(yaw, pitch) {
    const { goal } = this.camera;
    goal.yaw += halfTurn(yaw - goal.yaw);
    goal.pitch = pitch;
  }

  /** The view of the beginning. */
  reset() {
    this.player.choose(0);
    this.enter('overview');
    this.lookFrom(FIRST_YAW, FIRST_PITCH);
  }

  /** Follow, then behind, then free. */
  nextMode() {
    /** @type {Partial<Record<Mode, Mode>>} */
    const next = { follow: 'behind', behind: 'free' };
    this.enter(next[this.camera.mode] || 'follow');
    const who = this.layer.who(this.player.chosen);
    this.player.say({ follow: `Following ${who}`, behind: `Behind ${who}`, free: 'Free', overview: '' }[this.camera.mode]);
  }

  /** What the user moves by hand is no overview any more. */
  leaveOverview() {
    if (this.camera.mode === 'overview') this.enter('free');
  }

  /** Follow the next entity by its id, or the one before. @param {number} direction */
  followNext(direction) {
    const id = this.neighbour(direction);
    if (!id) return;
    const { isFollowing } = this.camera;
    this.player.choose(id);
    if (!isFollowing) this.enter('follow');
  }

  /** The next entity by its id, or the one before; 0 where nobody is. @param {number} direction */
  neighbour(direction) {
    const { shown } = this.layer;
    const { chosen } = this.player;
    const ids = [...shown.ids()].filter((_, slot) => !this.player.isHidden(slot)).sort((a, b) => a - b);
    const found = direction > 0 ? ids.find((id) => id > chosen) ?? ids[0] : ids.findLast((id) => id < chosen) ?? ids[ids.length - 1];
    return found || 0;
  }
}
