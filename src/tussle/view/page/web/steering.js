// Mouse, pen and fingers on the picture.

import { between } from './geometry.js';

/** Pixels that a click may wander. */
const STILL = 5;

export class Steering {
  /** `player` has a camera, knows who stands at a pixel, and is told what was chosen. */
  constructor(canvas, player) {
    this.canvas = canvas;
    this.player = player;
    this.down = new Map();
    this.wheeled = 0;
    canvas.addEventListener('pointerdown', (event) => this.press(event));
    canvas.addEventListener('pointermove', (event) => this.move(event));
    for (const name of ['pointerup', 'pointercancel']) canvas.addEventListener(name, (event) => this.release(event));
    canvas.addEventListener('pointerleave', () => player.hover(0));
    canvas.addEventListener('wheel', (event) => this.wheel(event), { passive: false });
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('dblclick', (event) => event.preventDefault());
  }

  press(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.down.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (this.down.size > 1) {
      this.isClick = false;
      return;
    }
    this.start = { x: event.clientX, y: event.clientY };
    this.isClick = event.button === 0;
    this.isPan = event.button !== 0 || event.shiftKey || event.ctrlKey;
  }

  move(event) {
    const was = this.down.get(event.pointerId);
    if (!was) {
      this.player.hover(this.player.whoIsAt(event.clientX, event.clientY));
      return;
    }
    const { camera } = this.player;
    const now = { x: event.clientX, y: event.clientY };
    if (this.isClick && Math.hypot(now.x - this.start.x, now.y - this.start.y) < STILL) return;
    if (this.isClick || !this.isMoving) {
      camera.remember(this.player.chosen);
      this.isMoving = true;
      this.isClick = false;
      this.canvas.classList.add('is-dragged');
    }
    if (this.down.size >= 2) this.pinch(event.pointerId, was, now);
    else if (this.isPan) this.pan(now.x - was.x, now.y - was.y);
    else camera.turn(-0.006 * (now.x - was.x), 0.006 * (now.y - was.y));
    this.down.set(event.pointerId, now);
    this.player.look();
  }

  pan(x, y) {
    this.player.leaveOverview();
    this.player.camera.pan(-x, y, this.canvas.clientHeight);
  }

  /** Two fingers: their middle moves the view, their distance brings it nearer. */
  pinch(id, was, now) {
    const [other] = [...this.down].filter(([key]) => key !== id).map(([, at]) => at);
    const gap = (at) => Math.max(20, Math.hypot(at.x - other.x, at.y - other.y));
    this.pan((now.x - was.x) / 2, (now.y - was.y) / 2);
    this.player.camera.zoom(gap(was) / gap(now));
  }

  release(event) {
    this.down.delete(event.pointerId);
    if (this.down.size) return;
    this.canvas.classList.remove('is-dragged');
    if (this.isClick && event.type === 'pointerup') this.player.click(event.clientX, event.clientY);
    this.isClick = false;
    this.isMoving = false;
  }

  wheel(event) {
    event.preventDefault();
    const { player } = this;
    if (event.timeStamp - this.wheeled > 600) player.camera.remember(player.chosen);
    this.wheeled = event.timeStamp;
    player.leaveOverview();
    const lines = event.deltaMode === 1 ? 30 : 1;
    const isFree = player.camera.mode === 'free';
    player.camera.zoom(Math.exp(between(event.deltaY * lines, -240, 240) * 0.0016), isFree ? player.placeAt(event.clientX, event.clientY) : null);
    player.look();
  }
}
