// A game: its entities, where they are, and its events. The two subclasses are a recording (recorded.js) and a live game (live.js).
/** @import { EventRow, GameEvent, PageData, Sample, Vector } from './types' */

import { minus, norm, scaled } from './geometry.js';
import { Moment } from './chunk.js';
import { SeriesBook } from './series.js';

export const NO_TEAM = { id: 0, name: '', colour: [150, 160, 172] };
/** Moments so long before and after what is shown are compared for a velocity [s]; the first that differ count. */
const VELOCITY_SPANS = [0.25, 1, 10, 60];

export class Layer {
  /** @param {PageData} page @param {() => void} changed called when there is something new to be shown */
  constructor(page, changed) {
    this.page = page;
    this.changed = changed;
    this.teams = new Map(page.teams.map((team) => [team.id, team]));
    /** Id -> its block. @type {Map<number, number>} */
    this.blockOf = new Map();
    /** @type {Map<number, number[]>} */
    this.colours = new Map();
    /** @type {GameEvent[]} */
    this.events = [];
    /** @type {GameEvent[]} */
    this.marked = [];
    this.shown = new Moment();
    this.start = 0;
    this.end = 0;
    /** Names of the results of metrics, interactions and networks. @type {string[]} */
    this.results = [];
    /** Quantities over time. */
    this.series = new SeriesBook();
    /** A move above this is a jump [m]. */
    this.leap = 0.25 * norm(minus(page.scenery.high, page.scenery.low));
  }

  /** Whether what is shown stays as it is until something new comes. */
  get isSettled() {
    return true;
  }

  /** Time at which the time line ends: of a game that is played, when its mission ends it. */
  get horizon() {
    return this.end;
  }

  /** Take events, without the deaths that a capture or a collision tells of. @param {EventRow[]} rows */
  setEvents(rows) {
    const all = rows.map(([t, kind, id, other, text]) => ({ t, kind, id, other, text }));
    const isTold = new Set();
    for (const { t, kind, id, other, text } of all) {
      if (kind === 'capture') isTold.add(`${t} ${other}`);
      if (kind === 'collision') isTold.add(`${t} ${id}`).add(`${t} ${other}`);
      const block = kind === 'birth' ? this.page.blocks.findIndex(({ name }) => name === text) : -1;
      if (block >= 0) this.blockOf.set(id, block);
    }
    this.events = all.filter(({ t, kind, id }) => kind !== 'death' || !isTold.has(`${t} ${id}`));
    // Who is there from the beginning needs no mark.
    this.marked = this.events.filter(({ t, kind }) => kind !== 'birth' || t > this.start);
  }

  /** Learn the blocks of the entities in a chunk. @param {{ id: Int32Array, block: Int32Array }} chunk */
  meet(chunk) {
    chunk.id.forEach((id, k) => this.blockOf.set(id, chunk.block[k]));
  }

  /** Number of an entity in its own run. @param {number} id */
  number(id) {
    return this.page.idShift && id > this.page.idShift ? id - this.page.idShift : id;
  }

  /** Name of an entity. @param {number} id */
  who(id) {
    const block = this.page.blocks[this.blockOf.get(id)];
    return block ? `${block.name} ${this.number(id)}` : `${this.number(id)}`;
  }

  /** @param {number} id */
  teamOf(id) {
    return this.teams.get(this.page.blocks[this.blockOf.get(id)]?.team) || NO_TEAM;
  }

  /** Colour of a block's entities in a team: the block's own where it is of that team. @param {number} block @param {number} team */
  colour(block, team) {
    const key = 65536 * block + team;
    let found = this.colours.get(key);
    if (!found) {
      const own = this.page.blocks[block];
      found = own.team === team ? own.colour : (this.teams.get(team) || NO_TEAM).colour;
      this.colours.set(key, found);
    }
    return found;
  }

  /** @param {number} slot */
  colourOf(slot) {
    return this.colour(this.shown.block[slot], this.shown.team[slot]);
  }

  /** @param {number} id */
  slotOf(id) {
    return this.shown.slotOf(id);
  }

  /** @param {number} slot */
  placeIn(slot) {
    return this.shown.placeIn(slot);
  }

  /** The last frame that is not after a time; null where it is not here. @param {number} _t @returns {Sample | null} */
  sampleAt(_t) {
    return null;
  }

  /** Frames of some seconds before what is shown, newest first, so that they are few. @param {number} _seconds @param {number} _most @returns {Sample[]} */
  samples(_seconds, _most) {
    return [];
  }

  /** Velocity of an entity over the frames around [m/s]. @param {number} id */
  velocity(id) {
    for (const span of VELOCITY_SPANS) {
      const [from, to] = [this.sampleAt(this.shown.t - span), this.sampleAt(this.shown.t + span)];
      const [a, b] = [from?.placeOf(id), to?.placeOf(id)];
      if (a && b && from.t < to.t) return norm(minus(b, a)) > this.leap ? [0, 0, 0] : scaled(minus(b, a), 1 / (to.t - from.t));
    }
    return [0, 0, 0];
  }

  /**
   * Trails of the last seconds: calls `lay` with the places of each entity, newest first, of one that has gone as well, and their times.
   * @param {number} seconds @param {number} most points of each trail @param {Iterable<number> | null} only ids; null for all
   * @param {(id: number, places: Vector[], times: number[]) => void} lay
   */
  trails(seconds, most, only, lay) {
    const samples = [this.shown, ...this.samples(seconds, most)];
    for (const id of only || new Set([...samples[samples.length - 1].ids(), ...this.shown.ids()])) {
      /** @type {Vector[]} */
      const places = [];
      const times = [];
      for (const sample of samples) {
        const place = sample.placeOf(id);
        const last = places[places.length - 1];
        if (last && (!place || norm(minus(place, last)) > this.leap)) break;
        if (place) times.push(sample.t);
        if (place) places.push(place);
      }
      if (places.length > 1) lay(id, places, times);
    }
  }
}
