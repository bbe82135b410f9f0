// Mouse, pen and fingers on the picture.
/** @import { Player } from './player.js' */

import { between } from './geometry.js';

/** Pixels that a click may wander. */
const STILL = 5;

export class Steering {
  /** @param {HTMLCanvasElement} canvas @param {Player} player */
  constructor(canvas, player) {
    this.canvas = canvas;
    this.player = player;
    /** Fingers and buttons that are down, and where. @type {Map<number, { x: number, y: number }>} */
    this.down = new Map();
    this.wheeled = 0;
    this.isClick = false;
    this.isMoving = false;
    canvas.addEventListener('pointerdown', (event) => this.press(event));
    canvas.addEventListener('pointermove', (event) => this.move(event));
    canvas.addEventListener('pointerup', (event) => this.release(event));
    canvas.addEventListener('pointercancel', (event) => this.release(event));
    canvas.addEventListener('pointerleave', () => {
      player.hover(0);
      player.picture.pointAt(null);
    });
    canvas.addEventListener('wheel', (event) => this.wheel(event), { passive: false });
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('dblclick', (event) => event.preventDefault());
  }

  /** @param {PointerEvent} event */
  press(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.down.set(event.pointerId, { x: event.clientX, y: event.clientY });
    this.isClick = this.down.size === 1 && event.button === 0;
    if (this.down.size > 1) return;
    if (this.player.isStroke) this.player.drawTo(event.clientX, event.clientY);
    this.start = { x: event.clientX, y: event.clientY };
    this.isPan = event.button !== 0 || event.shiftKey || event.ctrlKey;
  }

  /** @param {PointerEvent} event */
  move(event) {
    const { player } = this;
    player.picture.pointAt([event.clientX, event.clientY]);
    const was = this.down.get(event.pointerId);
    if (!was) return player.hover(player.picture.whoIsAt(event.clientX, event.clientY));
    const now = { x: event.clientX, y: event.clientY };
    if (player.isStroke && this.down.size === 1) return player.drawTo(now.x, now.y);
    if (this.isClick && Math.hypot(now.x - this.start.x, now.y - this.start.y) < STILL) return undefined;
    if (this.isClick || !this.isMoving) {
      player.viewpoint.remember();
      this.isMoving = true;
      this.isClick = false;
      this.canvas.classList.add('is-dragged');
    }
    if (this.down.size >= 2) this.pinch(event.pointerId, was, now);
    else if (this.isPan || player.picture.isPlain) this.pan(now.x - was.x, now.y - was.y);
    else player.camera.turn(-0.006 * (now.x - was.x), 0.006 * (now.y - was.y));
    this.down.set(event.pointerId, now);
    return player.look();
  }

  /** @param {number} x @param {number} y */
  pan(x, y) {
    this.player.viewpoint.leaveOverview();
    this.player.camera.pan(-x, y, this.canvas.clientHeight);
  }

  /** Two fingers: their middle moves the view, their distance brings it nearer. @param {number} id @param {{ x: number, y: number }} was @param {{ x: number, y: number }} now */
  pinch(id, was, now) {
    const [, other] = [...this.down].find(([key]) => key !== id);
    const gap = (/** @type {{ x: number, y: number }} */ at) => Math.max(20, Math.hypot(at.x - other.x, at.y - other.y));
    this.pan((now.x - was.x) / 2, (now.y - was.y) / 2);
    this.player.camera.zoom(gap(was) / gap(now));
  }

  /** @param {PointerEvent} event */
  release(event) {
    this.down.delete(event.pointerId);
    if (this.down.size) return;
    this.canvas.classList.remove('is-dragged');
    if (this.player.isStroke) this.player.endStroke();
    else if (this.isClick && event.type === 'pointerup') this.player.click(event.clientX, event.clientY);
    this.isClick = false;
    this.isMoving = false;
  }

  /** @param {WheelEvent} event */
  wheel(event) {
    event.preventDefault();
    const { player } = this;
    if (event.timeStamp - this.wheeled > 600) player.viewpoint.remember();
    this.wheeled = event.timeStamp;
    player.viewpoint.leaveOverview();
    const lines = event.deltaMode === 1 ? 30 : 1;
    const place = player.camera.mode === 'free' ? player.picture.placeAt(event.clientX, event.clientY) : null;
    player.camera.zoom(Math.exp(between(event.deltaY * lines, -240, 240) * 0.0016), place);
    player.look();
  }
}
