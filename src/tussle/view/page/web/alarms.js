// The card of specifications: how far the game is from breaking each, and since when there is an alarm.
/** @import { Player } from './player.js' */
/** @import { GameEvent, SpecificationState } from './types' */

import { amount, byId, element, parseColour, say, styled } from './formatting.js';
import { Live } from './live.js';

const STATES = { holds: 'holds', open: 'not decided yet', near: 'near', failed: 'failed', unknown: 'not known' };

export class AlarmPanel {
  /** @param {Player} player */
  constructor(player) {
    this.player = player;
    this.box = byId('alarms');
    /** The specifications that are shown. @type {SpecificationState[]} */
    this.shown = [];
    /** Alarms that were told. @type {Set<string>} */
    this.told = new Set();
  }

  show() {
    const { layer } = this.player;
    if (!(layer instanceof Live)) return;
    this.shown = layer.status.alarms;
    this.box.hidden = !this.shown.length;
    while (this.box.children.length < this.shown.length) this.add(this.box.children.length);
    this.shown.forEach((each, i) => {
      this.showRow(this.box.children[i], each, layer);
      this.tell(each);
    });
  }

  /** @param {number} i */
  add(i) {
    const row = element('button', 'spec', '', element('b'), element('strong'), element('span'), element('canvas'), element('small'));
    row.addEventListener('click', () => this.go(this.shown[i]));
    this.box.append(row);
  }

  /** To the moment of the alarm; without one, to where it was nearest to failure. @param {SpecificationState} spec */
  go(spec) {
    const { player } = this;
    if (spec.since !== null) player.jump(alarmOf(spec));
    else if (spec.reached !== null) player.clock.seek(spec.reached);
  }

  /** Say a new alarm, once. @param {SpecificationState} spec */
  tell(spec) {
    const key = `${spec.text}\n${spec.state}\n${spec.since}`;
    if (spec.since !== null && !this.told.has(key)) this.player.tell(alarmOf(spec));
    this.told.add(key);
  }

  /** @param {Element} row @param {SpecificationState} spec @param {Live} layer */
  showRow(row, { text, unit, state, now, ended, least, reached, since, note }, layer) {
    const { clock, panels } = this.player;
    const [stateText, value, title, canvas, more] = row.children;
    const time = (/** @type {number} */ t) => `${t.toFixed(clock.decimals)} s`;
    const measure = (/** @type {number | null} */ v) => `${amount(v ?? NaN)} ${unit}`.trim();
    if (row.className !== `spec is-${state}`) row.className = `spec is-${state}`;
    row.setAttribute('title', note || text);
    say(stateText, since === null ? STATES[state] : `${STATES[state]} since ${time(since)}`);
    say(value, now === null ? '' : `now ${measure(now)}`);
    say(title, text);
    say(more, note || (least !== null ? `least ${measure(least)} at ${time(reached)}` : ended !== null ? `${measure(ended)} if it ended now` : ''));
    const series = layer.series.of(text);
    canvas.toggleAttribute('hidden', !series.t.length);
    const colour = parseColour(styled(state === 'failed' ? '--failed' : state === 'near' ? '--note' : '--accent'));
    panels.drawCurve(/** @type {HTMLCanvasElement} */ (canvas), series, series.range([0, 0]), clock.t, { colour });
  }
}

/** The event with which an alarm began. @param {SpecificationState} spec @returns {GameEvent} */
const alarmOf = ({ text, state, since }) => ({ t: since, kind: state === 'failed' ? 'failure' : 'alarm', id: 0, other: 0, text });
