// What is drawn over the picture: labels, a ring around who is chosen, flashes where something happens.

import { rgb } from './formatting.js';
import { lastNotAfter } from './layer.js';
import { pixelOf } from './camera.js';
import { KINDS } from './events.js';

const MOST_LABELS = 150;
/** Seconds, as the watcher feels them, that a flash lasts. */
export const FLASH = 0.9;

export class Overlay {
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext('2d');
  }

  begin(view, ratio) {
    const { canvas, pen } = this;
    if (canvas.width !== view.width || canvas.height !== view.height) {
      canvas.width = view.width;
      canvas.height = view.height;
    }
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, canvas.width, canvas.height);
    this.ratio = ratio;
    this.taken = [];
    this.style = getComputedStyle(document.body);
    this.ink = this.style.getPropertyValue('--ink').trim();
    this.paper = this.style.getPropertyValue('--ground').trim();
    this.family = this.style.fontFamily;
  }

  /** Write a text some pixels beside a pixel, unless something stands there already; `must` writes it in any case. */
  write(x, y, text, colour, size, { must = false, gap = 9 } = {}) {
    const { pen, ratio } = this;
    pen.font = `600 ${size * ratio}px ${this.family}`;
    const left = x + gap * ratio;
    const [top, right, bottom] = [y - size * ratio, left + pen.measureText(text).width, y + 3 * ratio];
    const isFree = this.taken.every(([a, b, c, d]) => left > c || right < a || top > d || bottom < b);
    if (!isFree && !must) return false;
    this.taken.push([left, top, right, bottom]);
    pen.lineWidth = 3 * ratio;
    pen.lineJoin = 'round';
    pen.strokeStyle = this.paper;
    pen.globalAlpha = 0.85;
    pen.strokeText(text, left, y);
    pen.globalAlpha = 1;
    pen.fillStyle = colour;
    pen.fillText(text, left, y);
    return true;
  }

  ring(x, y, radius, colour, width, opacity = 1) {
    const { pen, ratio } = this;
    pen.globalAlpha = opacity;
    pen.strokeStyle = colour;
    pen.lineWidth = width * ratio;
    pen.beginPath();
    pen.arc(x, y, radius * ratio, 0, 2 * Math.PI);
    pen.stroke();
    pen.globalAlpha = 1;
  }

  /** Names of those nearest to the eye; `first` are written before all others. */
  labels(view, layer, hidden, { size, isOn, first, pixelsOf }) {
    const { shown } = layer;
    const wanted = [];
    for (const id of first) {
      const slot = id ? layer.slotOf(id) : -1;
      if (slot >= 0) wanted.push([0, slot, true]);
    }
    if (isOn) wanted.push(...this.nearest(view, layer, hidden));
    let n = 0;
    const done = new Set();
    for (const [, slot, must] of wanted) {
      if (n >= MOST_LABELS) break;
      const pixel = pixelOf(view, layer.placeIn(slot));
      if (!pixel || done.has(slot)) continue;
      done.add(slot);
      const colour = must ? this.ink : this.soft(layer.colourOf(slot));
      const gap = Math.max(9, 0.55 * pixelsOf(slot, pixel[2]));
      if (this.write(pixel[0], pixel[1] + 4 * this.ratio, layer.who(shown.id[slot]), colour, size, { must, gap })) n++;
    }
  }

  /** Those in view by their distance, no more than twice what will be written. */
  nearest(view, layer, hidden) {
    const { shown } = layer;
    const found = [];
    for (let i = 0; i < shown.n; i++) {
      if (hidden.has(shown.team[i])) continue;
      const pixel = pixelOf(view, layer.placeIn(i));
      if (pixel && pixel[0] > 0 && pixel[1] > 0 && pixel[0] < view.width && pixel[1] < view.height) found.push([pixel[2], i, false]);
    }
    return found.sort((a, b) => a[0] - b[0]).slice(0, 2 * MOST_LABELS);
  }

  /** A team's colour, so near to that of text that it can be read. */
  soft(colour) {
    const ink = [1, 3, 5].map((i) => parseInt(this.ink.slice(i, i + 2), 16));
    return rgb(colour.map((c, i) => Math.round(0.45 * c + 0.55 * ink[i])));
  }

  /** Rings that widen where somebody was captured, died or met somebody, up to `seconds` of the game ago. */
  flashes(view, layer, t, seconds) {
    for (const event of this.recent(layer, t, seconds)) {
      const { kind, id, other } = event;
      if (kind === 'birth' || kind === 'end' || !id) continue;
      const place = layer.placeAt(kind === 'capture' ? other : id, event.t);
      const pixel = place && pixelOf(view, place);
      if (!pixel) continue;
      const age = (t - event.t) / seconds;
      this.ring(pixel[0], pixel[1], 5 + 26 * Math.sqrt(age), KINDS[kind] || this.ink, 2.5, 1 - age);
    }
  }

  recent(layer, t, seconds) {
    const found = [];
    for (let i = lastNotAfter(layer.events, t); i >= 0 && layer.events[i].t > t - seconds && found.length < 200; i--) {
      found.push(layer.events[i]);
    }
    return found;
  }
}
