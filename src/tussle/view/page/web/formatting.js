// Numbers, times, names and events as text, and the elements that show them.
/** @import { Colour, GameEvent } from './types' */

import { END_TEXTS, EVENT_TEXTS } from './event_texts.js';

/** A number with so many decimals, with commas between thousands, as in reports. @param {number} value */
export function number(value, digits = 0) {
  const [whole, rest] = Math.abs(value).toFixed(digits).split('.');
  const grouped = whole.replace(/\B(?=(\d{3})+$)/g, ',');
  return (value < 0 && Number(value.toFixed(digits)) !== 0 ? '−' : '') + grouped + (rest ? '.' + rest : '');
}

/** A number with its four most significant digits; nothing of one that is not known. @param {number} value */
export function amount(value) {
  if (!Number.isFinite(value)) return '–';
  if (Number.isInteger(value)) return number(value);
  if (Math.abs(value) < 1e-3 || Math.abs(value) >= 1e7) return value.toExponential(3).replace('-', '−').replace(/\.?0+e/, 'e');
  const digits = Math.max(0, 3 - Math.floor(Math.log10(Math.abs(value))));
  return number(value, digits).replace(/(\.\d*?)0+$/, '$1').replace(/\.$/, '');
}

/** A length in the unit that suits it. @param {number} metres */
export function length(metres) {
  if (metres >= 1000) return `${number(metres / 1000, metres % 1000 ? 1 : 0)} km`;
  if (metres >= 1) return `${number(metres, metres % 1 ? 1 : 0)} m`;
  return metres >= 0.01 ? `${number(metres * 100, 0)} cm` : `${number(metres * 1000, metres < 0.00095 ? 2 : 1)} mm`;
}

/** A speed of playing, such as 0.5×. @param {number} speed */
export function times(speed) {
  return speed === Infinity ? 'max' : `${speed}×`;
}

/** Decimals that tell the times of two frames apart. @param {number} step seconds */
export function decimalsOf(step) {
  return Math.min(9, Math.max(1, Math.ceil(-Math.log10(step) - 1e-6)));
}

/** The length of a recording, to a tenth of a second where it has any. @param {number} seconds */
export function duration(seconds) {
  return `${seconds < 0.1 ? amount(seconds) : number(seconds, 1).replace(/\.0$/, '')} s`;
}

/** An event as a sentence. @param {GameEvent} event @param {(id: number) => string} who */
export function eventText(event, who) {
  const { kind, id, other, text } = event;
  /** @type {Record<string, string>} */
  const parts = { id: id ? who(id) : '', other: other ? who(other) : '', text: kind === 'end' ? END_TEXTS[text] || text : text };
  /** @param {string} template */
  const isKnown = (template) => [...template.matchAll(/\{(\w+)\}/g)].every(([, name]) => parts[name]);
  const template = (EVENT_TEXTS[kind] || []).find(isKnown);
  if (!template) return [kind, ...Object.values(parts)].filter(Boolean).join(' ');
  return template.replace(/\{(\w+)\}/g, (_, name) => parts[name]);
}

/** "rgb(r, g, b)" of three numbers. @param {Colour} colour */
export function rgb(colour) {
  return `rgb(${colour[0]}, ${colour[1]}, ${colour[2]})`;
}

/** The element of an id. @template {HTMLElement} [T=HTMLElement] @param {string} id @param {{ new (): T }} [_kind] @returns {T} */
export function byId(id, _kind) {
  return /** @type {T} */ (document.getElementById(id));
}

/** The input field of an id. @param {string} id */
export const field = (id) => byId(id, HTMLInputElement);

/**
 * A new element with a class and a text. All text is written here or with `textContent`: a name is never read as HTML.
 * @template {keyof HTMLElementTagNameMap} K @param {K} tag @param {...Node} children
 */
export function element(tag, className = '', text = '', ...children) {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text) made.textContent = text;
  made.append(...children);
  return made;
}

/** Set a text where it has changed: writing one, even the same, makes the browser lay out the page anew. @param {Element} node */
export function say(node, text = '') {
  if (node.textContent !== text) node.textContent = text;
}

/** Fill a list with names and values; a third text says what a name is. @param {Element} list @param {[string, string, string?][]} rows */
export function fillList(list, rows) {
  if (list.children.length !== 2 * rows.length) list.replaceChildren(...rows.flatMap(() => [element('dt'), element('dd')]));
  rows.forEach(([name, text, about = ''], i) => {
    const [title, value] = [list.children[2 * i], list.children[2 * i + 1]];
    say(title, name);
    say(value, text);
    if (title.getAttribute('title') !== about) title.setAttribute('title', about);
  });
}

/** A value of the page's style. @param {string} name */
export function styled(name) {
  return getComputedStyle(document.body).getPropertyValue(name).trim();
}

/** Red, green and blue, 0 to 255, of a colour such as #6cb8e6. @param {string} text */
export function parseColour(text) {
  return [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16));
}

/** Match the pixels of a canvas to its size on the screen, empty it, and return its pen. @param {HTMLCanvasElement} canvas */
export function cleared(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((size) => Math.round(size * ratio));
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  const pen = canvas.getContext('2d');
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, canvas.clientWidth, canvas.clientHeight);
  return pen;
}
