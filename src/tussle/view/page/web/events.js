// Events: marks on the time line, what they say, and the last ones in a corner.

import { element, eventText } from './formatting.js';
import { between } from './geometry.js';
import { lastNotAfter } from './layer.js';

/** Colours that are told apart with every kind of colour vision; the shapes tell them apart as well. */
export const KINDS = { capture: '#e8743b', collision: '#d9ae1f', birth: '#2fb38a', death: '#b59ad6', end: '#93a1b0', difference: '#e05a9c' };
/** Captures, collisions and the end stand above a line, births and deaths below it. */
const IS_ABOVE = { capture: true, collision: true, end: true, difference: true };

export class EventLine {
  constructor(layer, clock, jump) {
    this.layer = layer;
    this.clock = clock;
    this.jump = jump;
    this.canvas = document.getElementById('events');
    this.tip = document.getElementById('tip');
    this.ticker = document.getElementById('ticker');
    this.canvas.addEventListener('pointermove', (event) => this.point(event));
    this.canvas.addEventListener('pointerleave', () => { this.tip.hidden = true; });
    this.canvas.addEventListener('click', (event) => this.click(event));
    this.shownInTicker = null;
  }

  get marked() {
    return this.layer.marked;
  }

  /** Draw the marks where there are others than before. */
  update() {
    const { start, end } = this.layer;
    const key = `${start} ${end}`;
    if (this.drawnFor === this.marked && this.drawnSpan === key) return;
    [this.drawnFor, this.drawnSpan] = [this.marked, key];
    this.draw();
  }

  who(id) {
    return this.layer.who(id);
  }

  /** Pixel of a time, from the left of the canvas; the ends are where the slider's knob can be. */
  x(t) {
    const { start, end } = this.layer;
    const width = this.canvas.clientWidth - 15;
    return 7.5 + (end > start ? ((t - start) / (end - start)) * width : 0);
  }

  /** Draw all marks: as many as fall on two pixels are one mark, the higher the more they are. */
  draw() {
    const { canvas } = this;
    const ratio = window.devicePixelRatio || 1;
    canvas.width = Math.round(canvas.clientWidth * ratio);
    canvas.height = Math.round(canvas.clientHeight * ratio);
    const pen = canvas.getContext('2d');
    pen.scale(ratio, ratio);
    const bins = new Map();
    for (const { t, kind } of this.marked) {
      const key = `${Math.round(this.x(t) / 2)} ${kind}`;
      bins.set(key, (bins.get(key) || 0) + 1);
    }
    for (const [key, count] of bins) {
      const [bin, kind] = key.split(' ');
      const size = Math.min(13, 5 + 2.5 * Math.log2(count));
      this.mark(pen, 2 * Number(bin), kind, size);
    }
  }

  mark(pen, x, kind, size) {
    pen.fillStyle = KINDS[kind] || KINDS.end;
    pen.beginPath();
    if (kind === 'collision') {
      pen.moveTo(x, 18 - size - 5);
      pen.lineTo(x + 4.5, 18 - size / 2 - 2.5);
      pen.lineTo(x, 18);
      pen.lineTo(x - 4.5, 18 - size / 2 - 2.5);
    } else if (kind === 'birth') {
      pen.moveTo(x, 20);
      pen.lineTo(x + 3.6, 20 + size / 2 + 4);
      pen.lineTo(x - 3.6, 20 + size / 2 + 4);
    } else if (kind === 'death') {
      pen.moveTo(x - 3.6, 20);
      pen.lineTo(x + 3.6, 20);
      pen.lineTo(x, 20 + size / 2 + 4);
    } else if (kind === 'end' || kind === 'difference') {
      pen.rect(x - 1, 4, 2, 22);
    } else {
      pen.arc(x, 18 - size, 3.2, 0, 2 * Math.PI);
      pen.rect(x - 0.8, 18 - size, 1.6, size);
    }
    pen.fill();
  }

  /** What is marked near a pixel, the nearest first. */
  near(event) {
    const x = event.clientX - this.canvas.getBoundingClientRect().left;
    const isAbove = event.clientY - this.canvas.getBoundingClientRect().top < 19;
    const found = this.marked.map((happened) => ({ happened, gap: Math.abs(this.x(happened.t) - x) })).filter(({ gap }) => gap <= 6);
    const order = ({ happened, gap }) => gap + (Boolean(IS_ABOVE[happened.kind]) === isAbove ? 0 : 3);
    return found.sort((a, b) => order(a) - order(b)).map(({ happened }) => happened);
  }

  point(event) {
    const found = this.near(event);
    this.tip.hidden = !found.length;
    if (!found.length) return;
    const lines = found.slice(0, 5).map((happened) => this.line('div', happened));
    if (found.length > 5) lines.push(element('div', 'small', `and ${found.length - 5} more`));
    this.tip.replaceChildren(...lines);
    const x = event.clientX - this.canvas.getBoundingClientRect().left;
    const { clientWidth } = this.canvas;
    this.tip.style.left = `${between(x - this.tip.offsetWidth / 2, 0, Math.max(0, clientWidth - this.tip.offsetWidth))}px`;
  }

  click(event) {
    const [nearest] = this.near(event);
    if (nearest) this.jump(nearest);
  }

  line(tag, happened) {
    const line = element(tag);
    const shape = element('i', `is-${happened.kind}`);
    shape.style.setProperty('--kind', KINDS[happened.kind] || KINDS.end);
    line.append(shape, element('time', '', `${happened.t.toFixed(this.clock.decimals)} s`), element('span', '', eventText(happened, (id) => this.who(id))));
    return line;
  }

  /** The last few things that have happened, in the corner. */
  tell(t) {
    const last = lastNotAfter(this.marked, t);
    const latest = this.marked.slice(Math.max(0, last - 3), last + 1);
    const newest = latest[latest.length - 1] || null;
    if (newest === this.shownInTicker) return;
    this.shownInTicker = newest;
    this.ticker.replaceChildren(...latest.map((happened) => {
      const item = element('li');
      const button = this.line('button', happened);
      button.type = 'button';
      button.addEventListener('click', () => this.jump(happened));
      item.append(button);
      return item;
    }));
  }

  /** The first thing after a time, or the last one before it; undefined where there is none. */
  next(t, isBack) {
    if (!isBack) return this.marked.find((happened) => happened.t > t + 1e-6);
    return this.marked.findLast((happened) => happened.t < t - 1e-6);
  }
}
