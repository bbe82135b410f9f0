// What keys and buttons do. The help page is this list.

import { element } from './formatting.js';

/** Groups of [keys, what they do, names of the actions]; the keys are those of SCRIMMAGE where it has them. @type {[string, [string[], string, ...string[]][]][]} */
const KEYS = [
  ['Time', [
    [[' ', 'b'], 'play, pause', 'play'],
    [['.', ','], 'one frame forward, one frame back', 'forth', 'back'],
    [[']', '['], 'faster, slower', 'faster', 'slower'],
    [['m'], 'as fast as possible, and back', 'hurry'],
    [['PageDown', 'PageUp'], 'next event, previous event', 'nextEvent', 'lastEvent'],
    [['Home', 'End'], 'to the beginning, to the end', 'begin', 'end'],
  ]],
  ['Camera', [
    [['o'], 'all entities in view', 'overview'],
    [['v'], 'view from above', 'top'],
    [['a'], 'camera: follow, behind, free', 'mode'],
    [['ArrowRight', 'ArrowLeft'], 'follow the next or previous entity', 'nextEntity', 'lastEntity'],
    [['z', 'Z'], 'nearer, farther', 'nearer', 'farther'],
    [['r'], 'initial view', 'reset'],
    [['u'], 'previous view', 'undo'],
    [['Escape'], 'deselect the entity', 'unchoose'],
  ]],
  ['Picture', [
    [['+', '-'], 'larger, smaller models', 'larger', 'smaller'],
    [['0'], 'models in their true size', 'usualSize'],
    [['t', 'T'], 'trails: longer, shorter', 'trails', 'shorterTrails'],
    [['l'], 'labels', 'labels'],
    [['n', 'N'], 'larger, smaller labels', 'largerText', 'smallerText'],
    [['w', 's'], 'wireframe, solid', 'wire', 'solid'],
    [['2'], 'plain map, 3D', 'plain'],
    [['g'], 'grid and axes', 'grid'],
    [['x'], 'links between entities in range', 'links'],
    [['k'], 'dark, light', 'theme'],
    [['c'], 'save the picture', 'save'],
  ]],
  ['Live game', [
    [['p'], 'pick a point on the ground and send it to the plugins', 'pick'],
    [[';'], 'send a key to the plugins', 'customKey'],
    [['f'], 'messages that plugins publish', 'feed'],
    [['j'], 'drive the chosen entity with W A S D, E Q or a gamepad; Esc gives it back', 'drive'],
  ]],
  ['Page', [
    [['q'], 'quantities over time', 'quantities'],
    [['h', '?'], 'keys', 'help'],
    [['i'], 'about this run', 'info'],
    [['d'], 'settings', 'settings'],
  ]],
];
/** @type {Record<string, string>} */
const NAMES = { ' ': 'space', Backspace: 'Backspace', PageDown: 'PgDn', PageUp: 'PgUp', ArrowRight: '→', ArrowLeft: '←', Escape: 'Esc', '-': '−' };

/** Key -> name of its action. @returns {Map<string, string>} */
function bindings() {
  const found = new Map();
  for (const [, entries] of KEYS) {
    for (const [keys, , ...actions] of entries) keys.forEach((key, i) => found.set(key, actions[Math.min(i, actions.length - 1)]));
  }
  // Keys that lie beside those above, or are another way to write them.
  return found.set('Backspace', 'back').set('=', 'larger').set('_', 'smaller').set('A', 'reset').set('H', 'help');
}

/** @param {Element} box @param {boolean} isLive */
export function fillHelp(box, isLive) {
  box.replaceChildren(...KEYS.filter(([title]) => isLive || title !== 'Live game').map(([title, entries]) => {
    const lines = entries.map(([keys, what]) => {
      const names = keys.map((key) => element('kbd', '', NAMES[key] || key));
      return element('div', 'key', '', element('span', '', '', ...names), element('span', '', what));
    });
    return element('section', '', '', element('h3', '', title), ...lines);
  }));
}

/** Whether an element takes a key itself. @param {EventTarget | null} target @param {string} key */
export function takesKey(target, key) {
  if (!(target instanceof HTMLElement)) return false;
  if (target instanceof HTMLSelectElement || (target instanceof HTMLInputElement && ['number', 'text'].includes(target.type))) return true;
  if (target instanceof HTMLInputElement && target.type === 'range') return target.id !== 'time' && key.startsWith('Arrow');
  return Boolean(target.closest('button, input[type="checkbox"]')) && (key === ' ' || key === 'Enter');
}

/** Listen to keys and to buttons with `data-do`. @param {Record<string, () => void>} actions */
export function listen(actions) {
  const keys = bindings();
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector('dialog[open]') || takesKey(event.target, event.key)) return;
    const action = keys.get(event.key);
    if (!action) return;
    event.preventDefault();
    actions[action]();
  });
  document.addEventListener('click', (event) => {
    const button = event.target instanceof Element ? /** @type {HTMLElement | null} */ (event.target.closest('[data-do]')) : null;
    if (!button) return;
    actions[button.dataset.do]();
    // A key goes to the page again, not to the button that was clicked last.
    if (event.detail > 0) button.blur();
  });
}
