// Orders to the chosen entity, or to its block: any message that its plugins take, typed into a form.
/** @import { OrderField, OrderKind } from './types' */
/** @import { Player } from './player.js' */

import { byId, element, say } from './formatting.js';
import { simplified } from './geometry.js';
import { Live } from './live.js';

/** Receivers of one command: of more, several are sent. */
const MAX_RECEIVERS = 1000;
const REMOVE = 'remove';
const SPAWN = 'spawn';
/** @type {OrderField} */
const PLACE = { name: 'position', kind: 'number', parts: ['x', 'y', 'z'], units: ['m', 'm', 'm'], is_list: false, doc: 'Where it is born.', example: [] };

export class OrderForm {
  /** @param {Player} player */
  constructor(player) {
    this.player = player;
    this.form = byId('orders', HTMLFormElement);
    this.select = byId('order', HTMLSelectElement);
    this.receivers = byId('receivers', HTMLSelectElement);
    /** @type {OrderKind[]} */
    this.kinds = [];
    this.offered = '';
    this.select.addEventListener('change', () => this.fill());
    this.form.addEventListener('submit', (event) => {
      event.preventDefault();
      this.send();
    });
  }

  /** Offer what the chosen entity takes; what has been typed stays as long as that is the same. */
  show() {
    const { layer, chosen } = this.player;
    const entity = layer instanceof Live && layer.status?.entity;
    const isThere = Boolean(entity && entity.id === chosen && layer.slotOf(chosen) >= 0 && this.may(chosen));
    this.form.hidden = !isThere;
    if (!isThere) return;
    const key = JSON.stringify([entity.orders, this.maySpawn, this.block]);
    if (key === this.offered) return;
    this.offered = key;
    this.kinds = entity.orders;
    const options = this.kinds.map(({ message, topic, plugins }, i) => new Option(message ? `${message} to ${plugins.join(', ')}` : topic, String(i)));
    const isMessage = (/** @type {unknown} */ _, /** @type {number} */ i) => Boolean(this.kinds[i].message);
    const groups = { Messages: options.filter(isMessage), Parameters: options.filter((_, i) => !isMessage(_, i)) };
    this.select.replaceChildren(...Object.entries(groups).filter(([, some]) => some.length).map(([label, some]) => {
      const made = element('optgroup');
      made.label = label;
      made.append(...some);
      return made;
    }), new Option('Remove it', REMOVE), ...(this.maySpawn && this.block ? [new Option(`Add one to ${this.block}`, SPAWN)] : []));
    this.fill();
  }

  /** Whether orders may be given to an entity from this address. @param {number} id */
  may(id) {
    const { layer } = this.player;
    if (!(layer instanceof Live)) return false;
    const { steers, role } = layer.status;
    return steers || (role.kind === 'operate' && layer.shown.team[layer.slotOf(id)] === role.team);
  }

  /** @returns {OrderKind | undefined} */
  get kind() {
    return this.kinds[Number(this.select.value)];
  }

  /** Name of the block of the chosen entity. */
  get block() {
    const { layer, chosen, page } = this.player;
    return page.blocks[layer.shown.block[layer.slotOf(chosen)]]?.name;
  }

  /** Whether this address may add entities. */
  get maySpawn() {
    const { layer } = this.player;
    return layer instanceof Live && layer.status.steers;
  }

  get isSpawn() {
    return this.select.value === SPAWN;
  }

  /** The fields of the order that is selected. */
  fill() {
    const { kind, isSpawn } = this;
    const fields = isSpawn ? [PLACE] : kind ? kind.fields : [];
    this.receivers.hidden = isSpawn;
    say(this.form.querySelector('p'), isSpawn ? `It is born in two steps, with heading and speed of ${this.block}.` : kind ? kind.doc : 'It dies at the end of the next step.');
    this.form.querySelector('.fields').replaceChildren(...fields.map((field) => this.makeField(field)));
  }

  /** @param {OrderField} field */
  makeField(field) {
    const { name, kind, parts, units, is_list: isList, doc } = field;
    const box = element('fieldset');
    box.title = doc;
    box.dataset.field = name;
    const legend = element('legend', '', [name, new Set(units).size === 1 && units[0] && units[0] !== '1' ? `[${units[0]}]` : ''].join(' '));
    box.append(legend);
    const isPlace = parts.slice(0, 3).join() === 'x,y,z';
    if (isList) {
      const area = element('textarea');
      area.rows = 3;
      area.placeholder = parts.length ? `${parts.join(' ')}, one a line` : 'one a line';
      area.setAttribute('aria-label', name);
      box.append(area);
    } else {
      for (const [i, part] of (parts.length ? parts : [name]).entries()) {
        const input = element('input');
        input.type = kind === 'flag' ? 'checkbox' : kind === 'text' ? 'text' : 'number';
        input.step = kind === 'number' ? 'any' : '1';
        input.placeholder = parts.length ? part : kind === 'entity' ? 'id' : '';
        input.setAttribute('aria-label', parts.length ? `${name} ${part}` : name);
        if (units[i] && units[i] !== '1') input.title = `${part} [${units[i]}]`;
        box.append(input);
      }
    }
    if (isPlace) {
      const button = element('button', '', isList ? 'Add a point on the ground' : 'Point on the ground');
      button.type = 'button';
      button.addEventListener('click', () => this.player.pick(true, (pos) => this.takePlace(box, pos, field)));
      box.append(button);
      if (isList) {
        const stroke = element('button', '', 'Draw a line');
        stroke.type = 'button';
        stroke.addEventListener('click', () => this.player.pickStroke((line) => {
          for (const pos of simplified(line, this.player.camera.distance / 100)) this.takePlace(box, pos, field);
        }));
        box.append(stroke);
      }
    }
    return box;
  }

  /** A picked point at the height of the chosen entity, since most orders are for what flies. @param {HTMLElement} box @param {number[]} pos @param {OrderField} field */
  takePlace(box, [x, y], { parts, is_list: isList, example }) {
    const { layer, chosen } = this.player;
    const slot = layer.slotOf(chosen);
    const z = slot < 0 ? 0 : layer.placeIn(slot)[2];
    const numbers = [x, y, z].map((value) => String(Number(value.toFixed(1))));
    if (isList) {
      const area = box.querySelector('textarea');
      const rest = parts.slice(3).map((_, i) => example[i + 3] ?? 0);
      area.value = [...area.value.split('\n').filter((line) => line.trim()), [...numbers, ...rest].join(' ')].join('\n');
    } else {
      box.querySelectorAll('input').forEach((input, i) => { input.value = numbers[i] ?? input.value; });
    }
  }

  /** Ids of those whom it is for. */
  ids() {
    const { layer, chosen, page } = this.player;
    const block = layer.shown.block[layer.slotOf(chosen)];
    if (this.receivers.value === 'one' || !page.blocks[block]) return [chosen];
    return [...layer.shown.ids()].filter((id) => layer.shown.block[layer.slotOf(id)] === block);
  }

  /** What is typed into a field; undefined where nothing is. @param {OrderField} field @returns {unknown} */
  typed({ name, kind, parts, is_list: isList }) {
    const box = /** @type {HTMLElement} */ ([...this.form.querySelectorAll('fieldset')].find((each) => each.dataset.field === name));
    const numbers = (/** @type {string} */ line) => line.trim().split(/[\s,;]+/).map(Number);
    if (isList) {
      const items = box.querySelector('textarea').value.split('\n').filter((line) => line.trim()).map(numbers);
      if (items.flat().some(Number.isNaN)) throw new Error(`${name}: numbers, one item a line`);
      return parts.length ? items : items.flat();
    }
    const inputs = [...box.querySelectorAll('input')];
    if (kind === 'flag') return parts.length ? inputs.map(({ checked }) => checked) : inputs[0].checked;
    if (inputs.every(({ value }) => value === '')) return undefined;
    if (kind === 'text') return inputs[0].value;
    if (inputs.some((input) => input.value === '' || !input.checkValidity())) throw new Error(`${name}: ${parts.join(', ') || 'a number'}`);
    const values = inputs.map(({ value }) => Number(value));
    return parts.length ? values : values[0];
  }

  send() {
    const { player, kind } = this;
    const ids = this.ids();
    try {
      if (this.isSpawn) {
        const pos = this.typed(PLACE);
        if (!pos) throw new Error('position: x, y, z');
        player.order(SPAWN, { block: this.block, pos });
        player.say(`One more of ${this.block}: in two steps`);
        return;
      }
      const typed = kind ? kind.fields.map((field) => [field.name, this.typed(field)]).filter(([, value]) => value !== undefined) : [];
      const values = Object.fromEntries(typed);
      if (kind && !kind.network && values.value === undefined) throw new Error('value: a number');
      for (let i = 0; i < ids.length; i += MAX_RECEIVERS) {
        const some = ids.slice(i, i + MAX_RECEIVERS);
        if (kind && !kind.network) player.order('set', { entities: some, path: kind.topic, value: values.value });
        else if (kind) player.order('order', { receivers: some, network: kind.network, topic: kind.topic, values });
        else player.order(REMOVE, { entities: some });
      }
      const whom = ids.length === 1 ? player.layer.who(ids[0]) : `${ids.length} entities`;
      player.say(`${kind ? kind.message || kind.topic : 'Removal'} for ${whom}: in the next step`);
    } catch (error) {
      player.say(error.message);
    }
  }
}
