// What can be done, by name: keys, buttons and settings come here.
/** @import { Block, Drawn } from './types' */
/** @import { Player } from './player.js' */

import { byId, element, field, length, say } from './formatting.js';
import { TRAIL_LENGTHS } from './trails.js';

/** @param {Player} player @returns {Record<string, () => void>} */
export function actionsOf(player) {
  const { camera, clock, drawn, viewpoint } = player;
  const dialog = (/** @type {string} */ name) => () => byId(name, HTMLDialogElement).showModal();
  const change = (/** @type {() => void} */ act) => () => {
    act();
    showSettings(player);
    player.look();
  };
  const flip = (/** @type {'grid' | 'links'} */ name) => change(() => { drawn[name] = !drawn[name]; });
  const shift = (/** @type {'scale' | 'text'} */ name, /** @type {number} */ step) => change(() => {
    const { min, max } = field(RANGES[name]);
    drawn[name] = Math.max(Number(min), Math.min(Number(max), drawn[name] + step));
  });
  const trail = (/** @type {(length: number) => number} */ next) => change(() => {
    drawn.trail = next(drawn.trail);
    player.lookBack();
    player.say(`Trails: ${trailText(drawn.trail)}`);
  });
  /** Change the view so that `undo` brings it back. */
  const view = (/** @type {() => void} */ act) => () => {
    viewpoint.remember();
    act();
  };
  const zoom = (/** @type {number} */ factor) => change(() => {
    viewpoint.leaveOverview();
    camera.zoom(factor);
  });
  const event = (/** @type {boolean} */ isBack) => () => {
    const found = player.events.next(clock.t, isBack);
    if (found) player.jump(found);
  };
  return {
    play: change(() => { if (clock.isPlaying) clock.pause(); else clock.play(); }),
    forth: change(() => clock.step(1)),
    back: change(() => clock.step(-1)),
    begin: change(() => clock.seek(-Infinity)),
    end: change(() => clock.seek(Infinity)),
    faster: change(() => clock.change(1)),
    slower: change(() => clock.change(-1)),
    hurry: change(() => clock.hurry()),
    nextEvent: event(false),
    lastEvent: event(true),

    overview: view(() => viewpoint.overview(false)),
    top: view(() => viewpoint.overview(true)),
    reset: view(() => viewpoint.reset()),
    follow: view(() => viewpoint.enter('follow')),
    behind: view(() => viewpoint.enter('behind')),
    free: () => viewpoint.enter('free'),
    mode: view(() => viewpoint.nextMode()),
    nextEntity: view(() => viewpoint.followNext(1)),
    lastEntity: view(() => viewpoint.followNext(-1)),
    nearer: zoom(0.8),
    farther: zoom(1.25),
    undo: change(() => {
      const chosen = camera.undo();
      if (chosen !== null) player.choose(chosen, false);
    }),
    drive: change(() => player.drive.toggle()),
    unchoose: change(() => {
      if (player.isPicking) return player.pick(false);
      if (byId('settings').hidden) player.choose(0);
      byId('settings').hidden = true;
      return undefined;
    }),

    larger: shift('scale', 1),
    smaller: shift('scale', -1),
    usualSize: change(() => { drawn.scale = 0; }),
    trails: trail((i) => (i + 1) % TRAIL_LENGTHS.length),
    shorterTrails: trail((i) => Math.max(0, i - 1)),
    labels: change(() => showLabels(drawn, !drawn.labels)),
    largerText: shift('text', 1),
    smallerText: shift('text', -1),
    wire: change(() => { drawn.wire = true; }),
    solid: change(() => { drawn.wire = false; }),
    plain: () => player.drawPlain(!player.picture.isPlain).then(() => showSettings(player)),
    grid: flip('grid'),
    links: flip('links'),
    theme: () => player.picture.nextTheme(),
    save: () => player.picture.save(),

    pick: () => player.pick(!player.isPicking),
    customKey: () => player.order('key', { key: ';' }),
    anew: () => player.order('reset', { seed: Number(field('seed').value) }),

    quantities: () => player.quantities.toggle(),
    feed: () => player.feed.toggle(),
    help: dialog('help'),
    info: dialog('info'),
    // Escape may have closed it while a key is down on its button.
    close: () => /** @type {HTMLDialogElement | null} */ (document.querySelector('dialog[open]'))?.close(),
    settings: () => { byId('settings').hidden = !byId('settings').hidden; },
  };
}

/** Show or hide the names of entities and of the mission's areas; at first, those of many entities are hidden. @param {Drawn} drawn @param {boolean} are */
function showLabels(drawn, are) {
  drawn.labels = drawn.names = are;
}

/** @param {number} i */
function trailText(i) {
  const seconds = TRAIL_LENGTHS[i];
  return seconds === 0 ? 'none' : seconds === Infinity ? 'all' : `${seconds} s`;
}

const CHECKS = /** @type {const} */ (['labels', 'wire', 'least', 'grid', 'regions', 'shapes', 'rings', 'cones', 'links']);
/** Setting -> id of its slider. */
const RANGES = /** @type {const} */ ({ trail: 'trail', scale: 'size', text: 'text' });
/** Lengths [m] and an angle [degrees]. */
const NUMBERS = /** @type {const} */ (['ringRadius', 'coneRange', 'coneAngle', 'linkRange']);

/** @param {Player} player */
export function listenToSettings(player) {
  const { drawn } = player;
  const listen = (/** @type {string} */ id, /** @type {string} */ kind, /** @type {(input: HTMLInputElement) => void} */ take) => {
    field(id).addEventListener(kind, () => {
      take(field(id));
      showSettings(player);
      player.look();
    });
  };
  for (const name of CHECKS) listen(name, 'change', ({ checked }) => { drawn[name] = checked; });
  listen('labels', 'change', ({ checked }) => showLabels(drawn, checked));
  for (const name of NUMBERS) listen(name, 'change', (input) => { if (input.value !== '' && input.checkValidity()) drawn[name] = Number(input.value); });
  for (const [name, id] of /** @type {['trail' | 'scale' | 'text', string][]} */ (Object.entries(RANGES))) {
    listen(id, 'input', ({ value }) => {
      drawn[name] = Number(value);
      if (name === 'trail') player.lookBack();
    });
  }
  fillViews(player.page.blocks);
  field('plain-map').addEventListener('change', ({ target }) => player.drawPlain(/** @type {HTMLInputElement} */ (target).checked).then(() => showSettings(player)));
  listen('loop', 'change', ({ checked }) => { player.clock.isLooping = checked; });
  showSettings(player);
}

/** List what plugins see; cones are set by hand only where none says so. @param {Block[]} blocks */
function fillViews(blocks) {
  const lines = blocks.flatMap(({ name, views }) => views.map(({ plugin, azimuth, elevation, range }) => {
    const angles = [azimuth, elevation].filter((angle) => angle !== null).map((angle) => `${Number(angle.toPrecision(4))}°`).join(' × ');
    return `${name}, ${plugin}: ${angles}${range === null ? '' : `, ${length(range)}`}`;
  }));
  byId('views').hidden = !lines.length;
  byId('views').replaceChildren(...lines.map((line) => element('li', '', line)));
  if (!lines.length) return;
  say(byId('cones-say'), 'Fields of view');
  for (const node of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll('#settings .by-hand'))) node.hidden = true;
}

/** Bring the settings up to what keys have changed. @param {{ drawn: Drawn, picture: { isPlain: boolean } }} player */
function showSettings({ drawn, picture }) {
  field('plain-map').checked = picture.isPlain;
  for (const name of CHECKS) field(name).checked = drawn[name];
  for (const name of NUMBERS) field(name).value = String(drawn[name]);
  field('trail').value = String(drawn.trail);
  field('size').value = String(drawn.scale);
  field('text').value = String(drawn.text);
  say(byId('trail-says'), trailText(drawn.trail));
  say(byId('size-says'), `${Number((1.5 ** drawn.scale).toPrecision(2))}×`);
  say(byId('text-says'), `${Math.round(100 * 1.15 ** drawn.text)} %`);
}
