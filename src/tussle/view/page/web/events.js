// Events: marks on the time line, what they say, and the last ones in a corner.
/** @import { GameEvent } from './types' */

import { byId, cleared, element, eventText } from './formatting.js';
import { between } from './geometry.js';
import { Layer } from './layer.js';
import { lastWhere } from './ordered.js';
import { Clock } from './timeline.js';

/** Colours that are told apart with every kind of colour vision; the shapes tell them apart as well. @type {Record<string, string>} */
export const KINDS = { capture: '#e8743b', collision: '#d9ae1f', flag: '#4aa3df', birth: '#2fb38a', death: '#b59ad6', alarm: '#f0c04a', failure: '#e5534b', mark: '#8f7cf7', end: '#93a1b0', difference: '#e05a9c' };
/** What is marked below a line, all others above it. */
const BELOW = ['birth', 'death', 'mark'];
/** Pixels within which a mark is pointed at, and half the knob of the slider. */
const [NEAR, KNOB] = [6, 7.5];

export class EventLine {
  /** @param {Layer} layer @param {Clock} clock @param {(event: GameEvent) => void} jump */
  constructor(layer, clock, jump) {
    this.layer = layer;
    this.clock = clock;
    this.jump = jump;
    this.canvas = byId('events', HTMLCanvasElement);
    this.tip = byId('tip');
    /** The last event in the ticker. @type {GameEvent | undefined} */
    this.newest = undefined;
    this.canvas.addEventListener('pointermove', (event) => this.showTip(event));
    this.canvas.addEventListener('pointerleave', () => { this.tip.hidden = true; });
    this.canvas.addEventListener('click', (event) => {
      const [nearest] = this.near(event);
      if (nearest) this.jump(nearest);
    });
  }

  /** Bring marks and ticker up to a time. @param {number} t */
  update(t) {
    const { marked, start, horizon } = this.layer;
    const isNew = this.drawnFor?.marked !== marked || this.drawnFor.start !== start || this.drawnFor.horizon !== horizon;
    if (isNew) this.draw();
    this.showTicker(t);
  }

  /** Pixel of a time, from the left of the canvas; the ends are where the slider's knob can be. @param {number} t */
  x(t) {
    const { start, horizon } = this.layer;
    return KNOB + (horizon > start ? ((t - start) / (horizon - start)) * (this.canvas.clientWidth - 2 * KNOB) : 0);
  }

  /** Time at a pixel of the window, within the game. @param {number} clientX */
  timeAt(clientX) {
    const { start, horizon } = this.layer;
    const { left, width } = this.canvas.getBoundingClientRect();
    return start + between((clientX - left - KNOB) / (width - 2 * KNOB), 0, 1) * (horizon - start);
  }

  /** Draw all marks: as many as fall on two pixels are one mark, the higher the more they are. */
  draw() {
    const { marked, start, horizon } = this.layer;
    this.drawnFor = { marked, start, horizon };
    const pen = cleared(this.canvas);
    const bins = new Map();
    for (const { t, kind } of marked) {
      const key = `${Math.round(this.x(t) / 2)} ${kind}`;
      bins.set(key, (bins.get(key) || 0) + 1);
    }
    const isMark = (/** @type {string} */ key) => Number(key.endsWith('mark'));
    for (const [key, count] of [...bins].sort(([a], [b]) => isMark(a) - isMark(b))) {
      const [bin, kind] = key.split(' ');
      pen.fillStyle = KINDS[kind] || KINDS.end;
      pen.fill(markOf(kind, 2 * Number(bin), Math.min(13, 5 + 2.5 * Math.log2(count))));
    }
  }

  /** Events marked near the mouse, the nearest first. @param {MouseEvent} event @returns {GameEvent[]} */
  near({ clientX, clientY }) {
    const { left, top } = this.canvas.getBoundingClientRect();
    const isBelow = clientY - top >= 19;
    const gap = (/** @type {GameEvent} */ { t }) => Math.abs(this.x(t) - (clientX - left));
    const order = (/** @type {GameEvent} */ event) => gap(event) + (BELOW.includes(event.kind) === isBelow ? 0 : NEAR / 2);
    return this.layer.marked.filter((event) => gap(event) <= NEAR).sort((a, b) => order(a) - order(b));
  }

  /** @param {MouseEvent} event */
  showTip(event) {
    const found = this.near(event);
    this.tip.hidden = !found.length;
    if (!found.length) return;
    const lines = found.slice(0, 5).map((each) => this.line('div', each));
    if (found.length > 5) lines.push(element('div', 'small', `and ${found.length - 5} more`));
    this.tip.replaceChildren(...lines);
    const left = event.clientX - this.canvas.getBoundingClientRect().left - this.tip.offsetWidth / 2;
    this.tip.style.left = `${between(left, 0, Math.max(0, this.canvas.clientWidth - this.tip.offsetWidth))}px`;
  }

  /** An element with mark, time and text of an event. @param {'div' | 'button'} tag @param {GameEvent} event */
  line(tag, event) {
    const shape = element('i', `is-${event.kind}`);
    shape.style.setProperty('--kind', KINDS[event.kind] || KINDS.end);
    const when = element('time', '', `${event.t.toFixed(this.clock.decimals)} s`);
    return element(tag, '', '', shape, when, element('span', '', eventText(event, (id) => this.layer.who(id))));
  }

  /** Show the last events before a time, in the corner. @param {number} t */
  showTicker(t) {
    const { marked } = this.layer;
    const last = lastWhere(marked.length, (i) => marked[i].t <= t + 1e-9);
    if (marked[last] === this.newest) return;
    this.newest = marked[last];
    byId('ticker').replaceChildren(...marked.slice(Math.max(0, last - 3), last + 1).map((event) => {
      const button = this.line('button', event);
      button.addEventListener('click', () => this.jump(event));
      return element('li', '', '', button);
    }));
  }

  /** The first event after a time, or the last one before it; undefined where there is none. @param {number} t @param {boolean} isBack */
  next(t, isBack) {
    const { marked } = this.layer;
    return isBack ? marked.findLast((event) => event.t < t - 1e-6) : marked.find((event) => event.t > t + 1e-6);
  }
}

/** Outline of a mark on the time line. @param {string} kind @param {number} x @param {number} size */
function markOf(kind, x, size) {
  const [top, bottom] = [13 - size, 24 + size / 2];
  if (kind === 'collision') return new Path2D(`M${x} ${top}L${x + 4.5} ${(top + 18) / 2}L${x} 18L${x - 4.5} ${(top + 18) / 2}Z`);
  if (kind === 'flag') return new Path2D(`M${x - 0.8} 18V${top - 3}L${x + 7} ${top}L${x + 0.8} ${top + 3}V18Z`);
  if (kind === 'birth') return new Path2D(`M${x} 20L${x + 3.6} ${bottom}L${x - 3.6} ${bottom}Z`);
  if (kind === 'death') return new Path2D(`M${x - 3.6} 20L${x + 3.6} 20L${x} ${bottom}Z`);
  if (kind === 'mark') return new Path2D(`M${x} 19L${x + 4.5} 23.5L${x} 28L${x - 4.5} 23.5Z`);
  const path = new Path2D();
  if (kind === 'alarm' || kind === 'failure') return new Path2D(`M${x - 4} 4H${x + 4}L${x + 1.2} 24H${x - 1.2}Z`);
  if (kind === 'end' || kind === 'difference') {
    path.rect(x - 1, 4, 2, 22);
  } else {
    path.arc(x, 18 - size, 3.2, 0, 2 * Math.PI);
    path.rect(x - 0.8, 18 - size, 1.6, size);
  }
  return path;
}
