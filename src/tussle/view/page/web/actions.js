// What can be done, by name: keys, buttons and settings come here.

import { say } from './formatting.js';
import { TRAIL_LENGTHS, Trails } from './trails.js';

export function actionsOf(player) {
  const { camera, clock, drawn } = player;
  const remember = () => camera.remember(player.chosen);
  const dialog = (name) => () => document.getElementById(name).showModal();
  const change = (act) => () => {
    act();
    showSettings(player);
    player.look();
  };
  const follow = (direction) => () => {
    const id = player.neighbour(direction);
    if (!id) return;
    const isFollowing = camera.mode === 'follow' || camera.mode === 'behind';
    remember();
    player.choose(id);
    if (!isFollowing) player.enter('follow');
  };
  const event = (isBack) => () => {
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

    overview: () => { remember(); player.overview(false); },
    top: () => { remember(); player.overview(true); },
    reset: () => { remember(); player.reset(); },
    follow: () => { remember(); player.enter('follow'); },
    behind: () => { remember(); player.enter('behind'); },
    free: () => player.enter('free'),
    mode: () => { remember(); player.nextMode(); },
    nextEntity: follow(1),
    lastEntity: follow(-1),
    nearer: change(() => { player.leaveOverview(); camera.zoom(0.8); }),
    farther: change(() => { player.leaveOverview(); camera.zoom(1.25); }),
    undo: change(() => {
      const chosen = camera.undo();
      if (chosen !== null) player.choose(chosen, false);
    }),
    unchoose: change(() => {
      const settings = document.getElementById('settings');
      if (player.isPicking) return player.pick(false);
      if (settings.hidden) player.choose(0);
      settings.hidden = true;
    }),

    larger: change(() => { drawn.scale = Math.min(12, drawn.scale + 1); }),
    smaller: change(() => { drawn.scale = Math.max(-6, drawn.scale - 1); }),
    usualSize: change(() => { drawn.scale = 0; }),
    trails: change(() => { drawn.trail = (drawn.trail + 1) % TRAIL_LENGTHS.length; player.lookBack(); player.say(`Trails: ${trailWords(drawn.trail)}`); }),
    shorterTrails: change(() => { drawn.trail = Math.max(0, drawn.trail - 1); player.say(`Trails: ${trailWords(drawn.trail)}`); }),
    labels: change(() => { drawn.labels = !drawn.labels; }),
    smallerText: change(() => { drawn.text = Math.max(-3, drawn.text - 1); }),
    largerText: change(() => { drawn.text = Math.min(6, drawn.text + 1); }),
    wire: change(() => { drawn.wire = true; }),
    solid: change(() => { drawn.wire = false; }),
    grid: change(() => { drawn.grid = !drawn.grid; }),
    links: change(() => { drawn.links = !drawn.links; }),
    theme: () => player.nextTheme(),
    save: () => player.savePicture(),

    pick: () => player.pick(!player.isPicking),
    customKey: () => player.order('key', { key: ';' }),
    anew: () => player.order('reset', { seed: Number(document.getElementById('seed').value) }),

    help: dialog('help'),
    info: dialog('info'),
    close: () => document.querySelector('dialog[open]').close(),
    settings: () => { document.getElementById('settings').hidden = !document.getElementById('settings').hidden; },
  };
}

function trailWords(i) {
  const seconds = TRAIL_LENGTHS[i];
  if (seconds === 0) return 'none';
  return seconds === Infinity ? 'all' : `${seconds} s`;
}

const CHECKS = ['labels', 'wire', 'least', 'grid', 'regions', 'shapes', 'rings', 'cones', 'links'];
const RANGES = { trail: 'trail', size: 'scale', text: 'text' };
/** Numbers of the settings: lengths [m] and an angle [degrees]. */
const NUMBERS = ['ringRadius', 'coneRange', 'coneAngle', 'linkRange'];

export function listenToSettings(player) {
  for (const name of CHECKS) {
    document.getElementById(name).addEventListener('change', (event) => {
      player.drawn[name] = event.target.checked;
      player.look();
    });
  }
  for (const [id, name] of Object.entries(RANGES)) {
    document.getElementById(id).addEventListener('input', (event) => {
      player.drawn[name] = Number(event.target.value);
      if (name === 'trail') player.lookBack();
      showSettings(player);
      player.look();
    });
  }
  for (const name of NUMBERS) {
    const field = document.getElementById(name);
    field.value = String(player.drawn[name]);
    field.addEventListener('change', () => {
      if (field.value !== '' && field.checkValidity()) player.drawn[name] = Number(field.value);
      else field.value = String(player.drawn[name]);
      player.look();
    });
  }
  document.getElementById('loop').addEventListener('change', (event) => { player.clock.isLooping = event.target.checked; });
  showSettings(player);
}

/** Bring the settings up to what keys have changed. */
function showSettings({ drawn }) {
  for (const name of CHECKS) document.getElementById(name).checked = drawn[name];
  for (const [id, name] of Object.entries(RANGES)) document.getElementById(id).value = String(drawn[name]);
  say(document.getElementById('trail-says'), trailWords(drawn.trail));
  say(document.getElementById('size-says'), `${Number((1.5 ** drawn.scale).toPrecision(2))}×`);
  say(document.getElementById('text-says'), `${Math.round(100 * 1.15 ** drawn.text)} %`);
}
