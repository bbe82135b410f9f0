// How things are said: numbers, times, who somebody is, what happened.

import { END_TEXTS, EVENT_TEXTS } from './event_texts.js';

/** A number with so many decimals, with thin spaces between thousands. */
export function number(value, digits = 0) {
  const [whole, rest] = Math.abs(value).toFixed(digits).split('.');
  const grouped = whole.replace(/\B(?=(\d{3})+$)/g, '\u202f');
  return (value < 0 && Number(value.toFixed(digits)) !== 0 ? '−' : '') + grouped + (rest ? '.' + rest : '');
}

/** A length [m] in the unit that suits it. */
export function length(metres) {
  if (metres >= 1000) return `${number(metres / 1000, metres % 1000 ? 1 : 0)} km`;
  if (metres >= 1) return `${number(metres, metres % 1 ? 1 : 0)} m`;
  return metres >= 0.01 ? `${number(metres * 100, 0)} cm` : `${number(metres * 1000, metres < 0.00095 ? 2 : 1)} mm`;
}

/** A speed of playing, such as 0.5×. */
export function times(speed) {
  return speed === Infinity ? 'max' : `${speed}×`;
}

/** Decimals that tell the times of two frames apart. */
export function decimalsOf(step) {
  return Math.min(4, Math.max(1, Math.ceil(-Math.log10(step) - 1e-6)));
}

/** The sentence for an event; `who` names an entity by its id. */
export function eventText(event, who) {
  const { kind, id, other, text } = event;
  const parts = { id: id ? who(id) : '', other: other ? who(other) : '', text: kind === 'end' ? END_TEXTS[text] || text : text };
  const isKnown = (template) => [...template.matchAll(/\{(\w+)\}/g)].every(([, name]) => parts[name]);
  const template = (EVENT_TEXTS[kind] || []).find(isKnown);
  if (!template) return [kind, ...Object.values(parts)].filter(Boolean).join(' ');
  return template.replace(/\{(\w+)\}/g, (_, name) => parts[name]);
}

/** A new element with a class and a text. Whatever is said goes through here or `textContent`: a name is never read as HTML. */
export function element(tag, className = '', text = '') {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text) made.textContent = text;
  return made;
}

/** Set a text where it has changed: writing one, even the same, makes the browser lay out the page anew. */
export function say(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/** "rgb(r, g, b)" of three numbers. */
export function rgb(colour, opacity = 1) {
  return `rgba(${colour[0]}, ${colour[1]}, ${colour[2]}, ${opacity})`;
}
