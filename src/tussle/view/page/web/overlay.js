// What is drawn over the picture: labels, a ring around who is chosen, flashes where something happens.

/** @import { Colour, View } from './types' */

import { parseColour, rgb, styled } from './formatting.js';
import { Layer } from './layer.js';
import { lastWhere } from './ordered.js';
import { pixelOf } from './camera.js';
import { KINDS } from './events.js';

const MAX_LABELS = 150;
const MAX_FLASHES = 200;
/** Seconds, as the watcher feels them, that a flash lasts. */
export const FLASH = 0.9;

export class Overlay {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext('2d');
    this.ratio = 1;
    /** Boxes of the texts that are there. @type {number[][]} */
    this.taken = [];
    /** These texts. @type {string[]} */
    this.texts = [];
    this.ink = '';
    this.paper = '';
  }

  /** Empty it. @param {View} view @param {number} fineness its pixels in one of the view */
  begin({ width, height, ratio }, fineness) {
    const { canvas } = this;
    const size = [fineness * width, fineness * height];
    if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
    this.pen.setTransform(fineness, 0, 0, fineness, 0, 0);
    this.pen.clearRect(0, 0, width, height);
    this.ratio = ratio;
    this.taken = [];
    this.texts = [];
    this.ink = styled('--ink');
    this.paper = styled('--ground');
    this.family = getComputedStyle(document.body).fontFamily;
  }

  /**
   * Write a text some pixels beside a pixel, unless something stands there already; `must` writes it in any case.
   * @param {number} x @param {number} y @param {string} text @param {string} colour @param {number} size
   */
  write(x, y, text, colour, size, { must = false, gap = 9 } = {}) {
    const { pen, ratio } = this;
    pen.font = `600 ${size * ratio}px ${this.family}`;
    const left = x + gap * ratio;
    const [top, right, bottom] = [y - size * ratio, left + pen.measureText(text).width, y + 3 * ratio];
    const isFree = this.taken.every(([a, b, c, d]) => left > c || right < a || top > d || bottom < b);
    if (!isFree && !must) return false;
    this.taken.push([left, top, right, bottom]);
    this.texts.push(text);
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

  /** Write a text beside a place of the world. @param {View} view @param {ArrayLike<number>} place @param {string} text @param {string} colour @param {number} size */
  writeAt(view, place, text, colour, size, options = {}) {
    const pixel = pixelOf(view, place);
    if (pixel) this.write(pixel[0], pixel[1], text, colour, size, options);
  }

  /** @param {number} x @param {number} y @param {number} radius @param {string} colour @param {number} width */
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

  /**
   * Names of entities: those of `first`, and those nearest to the eye.
   * @param {View} view @param {Layer} layer @param {number[]} first slots @param {number[]} slots
   * @param {number} size @param {(slot: number, depth: number) => number} pixelsOf length of an entity
   */
  labels(view, layer, first, slots, size, pixelsOf) {
    const { shown } = layer;
    const inView = slots.map((slot) => ({ slot, pixel: pixelOf(view, shown.placeIn(slot)) }))
      .filter(({ pixel }) => pixel && pixel[0] > 0 && pixel[1] > 0 && pixel[0] < view.width && pixel[1] < view.height)
      .sort((a, b) => a.pixel[2] - b.pixel[2]).slice(0, 2 * MAX_LABELS).map(({ slot }) => slot);
    let n = 0;
    for (const slot of new Set([...first, ...inView])) {
      const pixel = pixelOf(view, shown.placeIn(slot));
      if (!pixel || n >= MAX_LABELS) continue;
      const must = first.includes(slot);
      const colour = must ? this.ink : this.soft(layer.colourOf(slot));
      const gap = Math.max(9, 0.55 * pixelsOf(slot, pixel[2]));
      if (this.write(pixel[0], pixel[1] + 4 * this.ratio, layer.who(shown.id[slot]), colour, size, { must, gap })) n++;
    }
  }

  /** A team's colour, so near to that of text that it can be read. @param {Colour} colour */
  soft(colour) {
    return rgb(parseColour(this.ink).map((c, i) => Math.round(0.45 * colour[i] + 0.55 * c)));
  }

  /**
   * Rings that widen where somebody was captured, died or collided, up to some seconds of the game ago.
   * @param {View} view @param {Layer} layer @param {number} t @param {number} seconds
   */
  flashes(view, layer, t, seconds) {
    const { events } = layer;
    const last = lastWhere(events.length, (i) => events[i].t <= t + 1e-9);
    for (let i = last; i >= 0 && events[i].t > t - seconds && last - i < MAX_FLASHES; i--) {
      const { kind, id, other, t: when } = events[i];
      if (kind === 'birth' || kind === 'end' || !id) continue;
      const place = layer.sampleAt(when)?.placeOf(kind === 'capture' ? other : id);
      const pixel = place && pixelOf(view, place);
      if (!pixel) continue;
      const age = (t - when) / seconds;
      this.ring(pixel[0], pixel[1], 5 + 26 * Math.sqrt(age), KINDS[kind] || this.ink, 2.5, 1 - age);
    }
  }
}
