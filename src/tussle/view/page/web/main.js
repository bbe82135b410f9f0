// Starts the page, and shows what tests may see of it.

import { pixelOf } from './camera.js';
import { Player, Sorry } from './player.js';
import { SOURCES } from './sources.js';

/** Show a text in place of the page; "" shows the page. @param {string} text */
function sorry(text) {
  const box = document.getElementById('sorry');
  box.textContent = text;
  box.hidden = !text;
}

/** What others may see of the player; nothing of it can be changed. @param {Player} player */
function publish(player) {
  const { page, layer, camera } = player;
  const state = {
    get isReady() { return player.isReady; },
    get t() { return player.clock.t; },
    get frame() { return layer.shown.frame; },
    /** Whether the page shows what is true now, and nothing moves by itself. */
    get isDrawn() { return !player.isChanged && !player.isTold && layer.isSettled && player.drawnTime === player.clock.t && (player.clock.isPlaying || !player.picture.isHalf); },
    get nFrames() { return page.nFrames; },
    get isPlaying() { return player.clock.isPlaying; },
    get speed() { return player.clock.speed; },
    get chosen() { return player.chosen; },
    /** Frames that have been drawn. */
    get nDrawn() { return player.nDrawn; },
    get mode() { return camera.mode; },
    get isPlain() { return player.picture.isPlain; },
    get camera() {
      const { target, distance, now, heading } = camera;
      return { target, distance, yaw: now.yaw + heading, pitch: now.pitch };
    },
    get drawn() { return { ...player.drawn, theme: player.picture.theme, hidden: [...player.hidden] }; },
    get ids() { return [...layer.shown.ids()]; },
    get events() { return structuredClone(layer.marked); },
    get status() { return 'status' in layer ? structuredClone(layer.status) : null; },
    /** Changes of a quantity: time and value of each. @param {string} name @param {number | null} team @param {number} id */
    curve(name, team = null, id = 0) {
      const { t, v } = layer.series.of(name, team, id);
      return t.map((time, i) => [time, v[i]]);
    },
    /** Texts in the picture. */
    get texts() { return [...player.picture.overlay.texts]; },
    get shapes() { return player.picture.shapes.header.parts.map(({ kind, n }) => [kind, n]); },
    get trailPoints() { return player.picture.trails.n; },
    /** Place of an entity [m], and its attitude (w, x, y, z); null where it is not there. @param {number} id */
    stateOf(id) {
      const slot = layer.slotOf(id);
      return slot < 0 ? null : { pos: layer.placeIn(slot), quat: [...layer.shown.quat.subarray(4 * slot, 4 * slot + 4)] };
    },
    /** Pixel of an entity in the window; null where it is not in view. @param {number} id */
    pixelOf(id) {
      const place = layer.shown.placeOf(id);
      const pixel = place && pixelOf(player.picture.view, place);
      return pixel && [pixel[0] / player.picture.ratio, pixel[1] / player.picture.ratio];
    },
  };
  Object.defineProperty(window, 'player', { value: Object.freeze(state) });
}

async function main() {
  try {
    const page = JSON.parse(document.getElementById('document').textContent);
    const player = new Player(page, SOURCES[page.source](), sorry);
    publish(player);
    await player.start();
    sorry('');
  } catch (error) {
    sorry(error instanceof Sorry ? error.message : `This page cannot be shown: ${error.message}`);
    if (!(error instanceof Sorry)) throw error;
  }
}

main();
