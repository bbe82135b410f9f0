// The card of specifications: how far the game is from breaking each, and since when there is an alarm. Of a recording, the curves of all
// are above the time line.
/** @import { Player } from './player.js' */
/** @import { GameEvent, SpecificationState } from './types' */

import { amount, byId, cleared, element, parseColour, say, styled } from './formatting.js';
import { KINDS } from './events.js';
import { Live } from './live.js';
import { COLOURS } from './quantities.js';
import { steps } from './series.js';

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
    this.course = byId('course');
    const { layer, page, clock, events } = player;
    const known = (page.alarms || []).filter(({ text, id }) => layer.series.has(text, null, id));
    const texts = [...new Set(known.map(({ text }) => text))];
    /** What has a curve above the time line, with the number of its specification. */
    this.curves = known.map((each) => ({ ...each, number: texts.indexOf(each.text) }));
    this.course.hidden = !this.curves.length;
    /** Width and theme for which the curves were drawn. */
    this.drawnFor = '';
    this.course.addEventListener('click', ({ clientX }) => {
      clock.seek(events.timeAt(clientX));
      player.look();
    });
  }

  show() {
    const { layer, clock } = this.player;
    this.shown = layer.alarmsAt(clock.t);
    this.drawCurves();
    this.box.hidden = !this.shown.length;
    while (this.box.children.length < this.shown.length) this.add(this.box.children.length);
    this.shown.forEach((each, i) => {
      this.showRow(this.box.children[i], each);
      this.tell(each);
    });
  }

  /** Draw the curves of a recording, all about one line, below which a specification has failed; each specification has its own scale. */
  drawCurves() {
    const { layer, page, clock, events, picture } = this.player;
    const [canvas, cursor] = /** @type {[HTMLCanvasElement, HTMLElement]} */ ([...this.course.children]);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width) return;
    cursor.style.left = `${events.x(clock.t)}px`;
    const key = `${width} ${picture.theme}`;
    if (key === this.drawnFor) return;
    this.drawnFor = key;
    const pen = cleared(canvas);
    /** Least and greatest value of each specification, with 0. @type {[number, number][]} */
    const ranges = [];
    for (const { text, number, id } of this.curves) ranges[number] = layer.series.of(text, null, id).range(ranges[number] || [0, 0]);
    const scales = ranges.map(([low, high]) => Math.max(-low, high) || 1);
    const least = Math.min(...ranges.map(([low], i) => low / scales[i]), -0.05);
    const x = (/** @type {number} */ time) => events.x(time);
    const y = (/** @type {number} */ value) => 3 + (1 - value) / (1 - least) * (height - 6);
    pen.fillStyle = styled('--failed');
    pen.globalAlpha = 0.14;
    pen.fillRect(x(layer.start), y(0), x(layer.end) - x(layer.start), height - y(0));
    pen.globalAlpha = 1;
    pen.strokeStyle = styled('--muted');
    pen.strokeRect(x(layer.start), y(0), x(layer.end) - x(layer.start), 0);
    pen.strokeStyle = KINDS.mark;
    for (const { t } of layer.marked.filter(({ kind }) => kind === 'mark')) pen.strokeRect(x(t), 0, 0, height);
    pen.lineWidth = 1.6;
    for (const { text, number, id } of this.curves) {
      pen.strokeStyle = COLOURS[number % COLOURS.length];
      pen.setLineDash(id ? [5, 3] : []);
      pen.stroke(steps(layer.series.of(text, null, id), layer.end, x, (value) => y(value / scales[number])));
    }
    pen.font = `11px ${getComputedStyle(document.body).fontFamily}`;
    pen.fillStyle = styled('--muted');
    if (ranges.length === 1) pen.fillText(`${amount(scales[0])} ${this.curves[0].unit}`, x(layer.start) + 3, 12);
    pen.textAlign = 'right';
    pen.fillText(page.runs ? 'robustness: A —, B – –' : 'robustness', x(layer.end) - 3, 12);
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
    if (spec.since !== null) player.jump(this.alarmOf(spec));
    else if (spec.reached !== null) player.clock.seek(spec.reached);
  }

  /** Say a new alarm, once. @param {SpecificationState} spec */
  tell(spec) {
    const key = `${this.title(spec)}\n${spec.state}\n${spec.since}`;
    if (spec.since !== null && !this.told.has(key)) this.player.tell(this.alarmOf(spec));
    this.told.add(key);
  }

  /** The specification, of two runs with the name of its run. @param {SpecificationState} spec */
  title({ text, id }) {
    const { runs } = this.player.page;
    return runs ? `${runs[id ? 1 : 0].name}: ${text}` : text;
  }

  /** The event with which an alarm began. @param {SpecificationState} spec @returns {GameEvent} */
  alarmOf(spec) {
    return { t: spec.since, kind: spec.state === 'failed' ? 'failure' : 'alarm', id: 0, other: 0, text: this.title(spec) };
  }

  /** @param {Element} row @param {SpecificationState} spec */
  showRow(row, spec) {
    const { text, unit, state, now, ended, least, reached, since, note } = spec;
    const { clock, layer, panels } = this.player;
    const [stateText, value, title, canvas, more] = row.children;
    const time = (/** @type {number} */ t) => `${t.toFixed(clock.decimals)} s`;
    const measure = (/** @type {number | null} */ v) => `${amount(v ?? NaN)} ${unit}`.trim();
    if (row.className !== `spec is-${state}`) row.className = `spec is-${state}`;
    const { number } = this.curves.find((each) => each.text === text) || {};
    if (number !== undefined) row.querySelector('span').style.setProperty('--curve', COLOURS[number % COLOURS.length]);
    row.setAttribute('title', note || this.title(spec));
    say(stateText, since === null ? STATES[state] : `${STATES[state]} since ${time(since)}`);
    say(value, now === null ? '' : `now ${measure(now)}`);
    say(title, this.title(spec));
    say(more, note || (least !== null ? `least ${measure(least)} at ${time(reached)}` : ended !== null ? `${measure(ended)} if it ended now` : ''));
    const series = layer.series.of(text);
    canvas.toggleAttribute('hidden', !series.t.length || !(layer instanceof Live));
    const colour = parseColour(styled(state === 'failed' ? '--failed' : state === 'near' ? '--note' : '--accent'));
    panels.drawCurve(/** @type {HTMLCanvasElement} */ (canvas), series, series.range([0, 0]), clock.t, { colour });
  }
}
