// Driving the chosen entity: keys, or a gamepad, are the sticks of an operator.
/** @import { Player } from './player.js' */

import { byId, say } from './formatting.js';
import { between } from './geometry.js';
import { takesKey } from './keys.js';
import { Live } from './live.js';

/** Steps of a stick from its middle to its end. */
const STEPS = 127;
/** Time after which sticks are sent again that have not changed, since silence gives the entity back [ms]. */
const REPEAT = 1000;
/** Deflection of a gamepad below which it rests. */
const REST = 0.12;
/** Key -> axis and deflection. @type {Record<string, [number, number]>} */
const STICK_KEYS = {
  w: [0, 1], arrowup: [0, 1], s: [0, -1], arrowdown: [0, -1], a: [1, 1], arrowleft: [1, 1], d: [1, -1], arrowright: [1, -1],
  e: [2, 1], pageup: [2, 1], q: [2, -1], pagedown: [2, -1],
};
const HINTS = { ahead: 'W S', left: 'A D', up: 'E Q' };
/** Channels that are in the world frame: for these, ahead is away from who looks. */
const OF_WORLD = ['velocity_y', 'acceleration_y', 'position_y'];

export class Drive {
  /** @param {Player} player */
  constructor(player) {
    this.player = player;
    this.box = byId('drive');
    /** Id of the entity that is driven; 0 for none. */
    this.who = 0;
    /** Of the game when driving began: a jump in time ends it. */
    this.epoch = -1;
    /** Channels of the entity that is driven. @type {string[]} */
    this.channels = [];
    this.sent = '';
    this.sentAt = 0;
    /** @type {Set<string>} */
    this.held = new Set();
    // Before the keys of the page, which mean something else meanwhile.
    document.addEventListener('keydown', (event) => this.press(event), true);
    document.addEventListener('keyup', ({ key }) => this.held.delete(key.toLowerCase()), true);
    // At once: a page that is hidden draws no more frames.
    window.addEventListener('blur', () => {
      this.held.clear();
      this.update();
    });
    document.addEventListener('visibilitychange', () => this.update());
    setInterval(() => this.update(), REPEAT / 2);
  }

  /** What is known of the chosen entity, if this address may drive it. */
  get entity() {
    const { layer, chosen, orders } = this.player;
    const entity = layer instanceof Live && !layer.status.isOver ? layer.status.entity : null;
    return entity?.id === chosen && layer.slotOf(chosen) >= 0 && orders.may(chosen) && Object.keys(entity.axes).length ? entity : null;
  }

  /** Why nothing is driven. */
  get obstacle() {
    const { layer, chosen, orders } = this.player;
    if (!(layer instanceof Live)) return 'Only a live game has entities that are driven';
    if (layer.status.isOver) return 'The game is over: nobody is driven';
    if (!chosen || layer.slotOf(chosen) < 0) return 'Click the entity that you want to drive';
    if (!orders.may(chosen)) return `This address may not drive ${layer.who(chosen)}`;
    if (layer.status.entity?.id !== chosen) return `${layer.who(chosen)} is still being read: try again`;
    return `${layer.who(chosen)} has no channel that keys can drive`;
  }

  show() {
    const { entity, who } = this;
    this.box.hidden = !entity;
    if (!entity) return;
    const button = this.box.querySelector('button');
    say(button, who ? 'Give back' : 'Take over');
    button.setAttribute('aria-pressed', String(who > 0));
    button.classList.toggle('is-on', who > 0);
    const axes = Object.entries(entity.axes).filter(([, channels]) => channels.length);
    const hints = axes.map(([axis, channels]) => `${HINTS[/** @type {'ahead'} */ (axis)]}: ${channels.join(', ')}`);
    say(this.box.querySelector('p'), who ? `${hints.join('; ')}. Esc gives it back.` : entity.isDriven ? 'An operator drives it.' : 'Drive it by keys or gamepad (j)');
  }

  toggle() {
    const { entity, player } = this;
    if (this.who) this.release();
    else if (entity && player.layer instanceof Live) {
      this.who = player.chosen;
      this.epoch = player.layer.epoch;
      this.channels = Object.values(entity.axes).flat();
      this.sent = '';
      this.held.clear();
      player.say(`You drive ${player.layer.who(this.who)}`);
    } else player.say(this.obstacle);
    player.look();
  }

  /** Give the entity back to its autonomies. */
  release() {
    const { player, who } = this;
    if (!who) return;
    this.who = 0;
    player.order('drive', { entities: [who], sticks: null });
    player.say(`${player.layer.who(who)} is given back`);
    player.look();
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    const key = event.key.toLowerCase();
    if (!this.who || event.ctrlKey || event.metaKey || event.altKey || takesKey(event.target, event.key)) return;
    if (key !== 'escape' && !(key in STICK_KEYS)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (key === 'escape') this.release();
    else this.held.add(key);
  }

  /** Send the sticks where they have changed; called in each frame. */
  update() {
    if (!this.who) return;
    const { player, who } = this;
    const { layer } = player;
    // Not by the state of the entity, which may be older than the command.
    if (player.chosen !== who || player.isLost || !(layer instanceof Live) || layer.status.isOver || layer.epoch !== this.epoch || layer.slotOf(who) < 0) {
      this.release();
      return;
    }
    const sticks = this.sticks(this.channels).map((x) => Math.round(STEPS * between(x, -1, 1)) / STEPS + 0);
    const text = sticks.join();
    if (text === this.sent && performance.now() - this.sentAt < REPEAT) return;
    this.sent = text;
    this.sentAt = performance.now();
    player.order('drive', { entities: [who], sticks });
  }

  /** Deflections ahead, left and up. @param {string[]} channels */
  sticks(channels) {
    const sum = [0, 0, 0];
    if (document.hidden) return sum;
    for (const key of this.held) sum[STICK_KEYS[key][0]] += STICK_KEYS[key][1];
    for (const pad of navigator.getGamepads?.() ?? []) {
      [1, 0, 3].forEach((axis, i) => { if (Math.abs(pad?.axes[axis] ?? 0) > REST) sum[i] -= pad.axes[axis]; });
    }
    if (!channels.some((channel) => OF_WORLD.includes(channel))) return sum;
    const { camera } = this.player;
    const yaw = camera.now.yaw + camera.heading;
    const [ahead, left, up] = sum;
    return [-ahead * Math.sin(yaw) - left * Math.cos(yaw), ahead * Math.cos(yaw) - left * Math.sin(yaw), up];
  }
}
