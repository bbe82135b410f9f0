// The cards on the page: title, teams, scores, the chosen entity, what is known of the run.
/** @import { Curves, Mode, PageData, Status, Team } from './types' */

import { byId, cleared, element, fillList, length, number, rgb, say, styled } from './formatting.js';
import { between, forward, norm } from './geometry.js';
import { lastNotAfter, NO_TEAM } from './layer.js';
import { append, Live } from './live.js';
import { Recorded } from './recorded.js';

const CURVE_POINTS = 240;

export class Panels {
  /** @param {PageData} page @param {Live | Recorded} layer @param {Set<number>} hidden teams @param {() => void} changed */
  constructor(page, layer, hidden, changed) {
    this.page = page;
    this.layer = layer;
    this.hidden = hidden;
    this.changed = changed;
    this.notes = '';
    this.titles = '';
    this.fillHead();
    this.teams = page.teams.map((team) => this.makeTeam(team));
    this.scores = page.teams.map((team) => this.makeRow(element('div', 'score'), 'scores', team, element('b')));
    this.scored = layer instanceof Live ? layer.scores : this.captures();
    this.fillInfo();
  }

  /** State of a live game; null of a recording. */
  get status() {
    return this.layer instanceof Live ? this.layer.status : null;
  }

  fillHead() {
    const { page, layer } = this;
    say(document.querySelector('#head h1'), page.title);
    if (!this.status) {
      const seed = page.facts.find(([name]) => name === 'Seed')?.[1];
      const n = `${number(page.nEntities)} ${page.nEntities === 1 ? 'entity' : 'entities'}`;
      const seconds = `${number(layer.end - layer.start, 1).replace(/\.0$/, '')} s`;
      say(byId('subtitle'), [seed && `seed ${seed}`, n, seconds].filter(Boolean).join(' · '));
    }
    byId('lead').hidden = !page.lead;
    say(byId('lead'), page.lead);
    say(document.querySelector('#scores h2'), this.status ? 'Score' : 'Captures');
    this.showNotes(page.notes);
    if (!page.isComplete) this.notice('This run was cut short: what there is of it is shown', true);
  }

  /** Show the notes and how many they are. @param {string[]} notes */
  showNotes(notes) {
    const key = notes.join('\n');
    if (key === this.notes) return;
    this.notes = key;
    document.querySelector('#info .notes').replaceChildren(...notes.map((note) => element('li', '', note)));
    this.notice(notes.length ? `${notes.length} ${notes.length === 1 ? 'note' : 'notes'}` : '', false);
  }

  /** @param {string} text @param {boolean} isWarning */
  notice(text, isWarning) {
    const notice = byId('notice');
    notice.hidden = !text;
    notice.classList.toggle('plain', !isWarning);
    say(notice, text);
  }

  /**
   * Show the state of a live game.
   * @param {Status} status
   * @param {number} drawRate Frames that this browser draws per second.
   */
  showStatus({ step, reached, rate, seed, isPaused, isOver, isSeeking, error, notes, metrics, steers }, drawRate) {
    const state = isSeeking ? 'seeking' : isOver ? 'over' : isPaused ? 'paused' : `${Number(reached.toPrecision(2))}× real time`;
    const parts = [`seed ${seed}`, `step ${number(step)}`, state, ...(rate && !isPaused ? [`${Number(drawRate.toPrecision(2))} frames/s`, `${rate} states/s sent`] : []), !steers && 'another browser steers'];
    say(byId('subtitle'), parts.filter(Boolean).join(' · '));
    this.showNotes([...new Set([...(error ? [error] : []), ...this.page.notes, ...notes])]);
    if (error) this.notice(error, true);
    fillList(byId('metrics'), metrics);
    // It begins anew with another seed.
    const facts = /** @type {[string, string][]} */ (this.page.facts.map(([name, value]) => [name, name === 'Seed' ? `${seed}` : value]));
    fillList(document.querySelector('#info dl'), facts);
  }

  /**
   * A row with the colour and the name of a team, a value and a curve.
   * @template {HTMLElement} T @param {T} row @param {string} box @param {Team} team @param {HTMLElement} value
   */
  makeRow(row, box, team, value) {
    const swatch = element('i');
    swatch.style.setProperty('--team', rgb(team.colour));
    const curve = element('canvas');
    row.append(swatch, element('span', '', team.name || `team ${team.id}`), value, curve);
    byId(box).append(row);
    return { row, team, value, curve };
  }

  /** @param {Team} team */
  makeTeam(team) {
    const [count, most, button] = [element('b'), element('small'), element('button', 'team')];
    button.title = 'Show or hide';
    button.setAttribute('aria-pressed', 'true');
    button.addEventListener('click', () => {
      const isShown = this.hidden.delete(team.id) || !this.hidden.add(team.id);
      button.classList.toggle('is-hidden', !isShown);
      button.setAttribute('aria-pressed', String(isShown));
      this.changed();
    });
    return { ...this.makeRow(button, 'teams', team, element('span', '', '', count, most)), count, most };
  }

  fillInfo() {
    const { page } = this;
    const box = byId('info');
    const degrees = (page.angleError * 180) / Math.PI;
    const accuracy = `positions within ${length(page.positionError)}, attitudes within ${degrees.toFixed(2)}° of the recording; between its frames, on the straight way`;
    const whole = page.source === 'embedded' ? ' This page is whole by itself: it needs no network.' : '';
    say(box.querySelector('h2'), page.title);
    fillList(box.querySelector('dl'), page.positionError ? [...page.facts, ['Accuracy', accuracy]] : page.facts);
    say(box.querySelector('.small'), `Made by ${page.generator}.${whole}`);
  }

  /** Show entities and score of each team, with the curves up to a time. @param {number} t */
  showTeams(t) {
    const { layer, scored } = this;
    const counts = layer.counts();
    this.teams.forEach(({ team, count, most, curve }, i) => {
      const highest = Math.max(1, counts[i], ...layer.curves.n[i]);
      say(count, number(counts[i]));
      say(most, ` / ${number(highest)}`);
      this.drawCurve(curve, layer.curves, i, [0, highest], t, team);
    });
    byId('scores').hidden = !scored.t.length;
    const now = lastNotAfter(scored.t, t);
    const all = scored.n.flat();
    this.scores.forEach(({ row, team, value, curve }, i) => {
      row.hidden = !scored.n[i].some(Boolean);
      const score = scored.n[i][now] ?? 0;
      say(value, number(score, Number.isInteger(score) ? 0 : 2));
      this.drawCurve(curve, scored, i, [Math.min(0, ...all), Math.max(1e-9, ...all)], t, team);
    });
  }

  /** Captures of each team over time: of a recording, which has only the last scores. */
  captures() {
    const { layer, page } = this;
    const found = layer.emptyCurves();
    const sums = page.teams.map(() => 0);
    for (const { t, kind, id } of layer.events) {
      const i = kind === 'capture' ? page.teams.findIndex((team) => team.id === layer.teamOf(id).id) : -1;
      if (i < 0) continue;
      if (!found.t.length) append(found, layer.start, sums);
      append(found, t, sums);
      sums[i]++;
      append(found, t, sums);
    }
    return found;
  }

  /**
   * Draw a curve over the whole game, and in colour up to now.
   * @param {HTMLCanvasElement} canvas @param {Curves} curves @param {number} i which of them @param {number[]} range @param {number} t @param {Team} team
   */
  drawCurve(canvas, { t: at, n }, i, [lowest, highest], t, team) {
    const { start, end } = this.layer;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width) return;
    const pen = cleared(canvas);
    const x = (/** @type {number} */ time) => between((time - start) / (end - start || 1), 0, 1) * (width - 6) + 2;
    const y = (/** @type {number} */ value) => height - 2 - ((value - lowest) / (highest - lowest || 1)) * (height - 5);
    const stride = Math.max(1, Math.floor(at.length / CURVE_POINTS));
    const traced = (/** @type {number} */ last) => {
      const path = new Path2D();
      for (let k = 0; k < last; k += stride) path.lineTo(x(at[k]), y(n[i][k]));
      if (last >= 0) path.lineTo(x(at[last]), y(n[i][last]));
      return path;
    };
    pen.globalAlpha = 0.45;
    pen.strokeStyle = styled('--muted');
    pen.stroke(traced(at.length - 1));
    const now = lastNotAfter(at, t);
    if (now < 0) return;
    const path = traced(now);
    const value = y(n[i][now]);
    path.lineTo(x(t), value);
    pen.globalAlpha = 1;
    pen.strokeStyle = pen.fillStyle = rgb(team.colour);
    pen.lineWidth = 1.6;
    pen.stroke(path);
    const knob = new Path2D();
    knob.arc(x(t), value, 2.4, 0, 2 * Math.PI);
    pen.fill(knob);
    path.lineTo(x(t), height - 1);
    path.lineTo(x(at[0]), height - 1);
    pen.globalAlpha = 0.25;
    pen.fill(path);
  }

  /** Show what is known of the chosen entity; 0 for none. @param {number} id @param {Mode} mode @param {number} t */
  showChosen(id, mode, t) {
    const box = byId('chosen');
    box.hidden = !id;
    if (!id) return;
    say(box.querySelector('h2'), this.layer.who(id));
    fillList(box.querySelector('dl'), this.factsOf(id, t));
    this.showSections(id);
    for (const button of /** @type {NodeListOf<HTMLElement>} */ (box.querySelectorAll('.modes button'))) {
      button.classList.toggle('is-on', button.dataset.do === mode);
    }
  }

  /** Show columns of plugins and messages of a live game's entity. @param {number} id */
  showSections(id) {
    const box = byId('sections');
    const entity = this.status?.entity;
    const sections = entity?.id === id ? entity.sections.slice(1) : [];
    const titles = sections.map(([title]) => title).join('\n');
    if (titles !== this.titles) box.replaceChildren(...sections.map(([title]) => element('section', '', '', element('h3', '', title), element('dl'))));
    this.titles = titles;
    sections.forEach(([, rows], i) => fillList(box.children[i].lastElementChild, rows));
  }

  /** @param {number} id @param {number} t @returns {[string, string][]} */
  factsOf(id, t) {
    const { layer } = this;
    const slot = layer.slotOf(id);
    const team = slot >= 0 ? layer.teams.get(layer.shown.team[slot]) || NO_TEAM : layer.teamOf(id);
    const nCaptures = layer.events.filter((event) => event.kind === 'capture' && event.id === id && event.t <= t).length;
    return [
      ['Team', team.name || `team ${team.id}`],
      ...(slot >= 0 ? this.stateOf(slot) : [this.absence(id, t)]),
      .../** @type {[string, string][]} */ (nCaptures ? [['Captures', `${nCaptures}`]] : []),
    ];
  }

  /** Since or until when an entity is not there. @param {number} id @param {number} t @returns {[string, string]} */
  absence(id, t) {
    const { events } = this.layer;
    const born = events.find((event) => event.kind === 'birth' && event.id === id)?.t;
    const gone = events.find(({ kind, id: one, other }) =>
      (['death', 'collision'].includes(kind) && one === id) || (['capture', 'collision'].includes(kind) && other === id))?.t;
    if (born > t) return ['Comes at', `${born.toFixed(1)} s`];
    return gone <= t ? ['Gone since', `${gone.toFixed(1)} s`] : ['Gone', 'not there at this time'];
  }

  /** @param {number} slot @returns {[string, string][]} */
  stateOf(slot) {
    const { shown } = this.layer;
    const [east, north, up] = shown.placeIn(slot);
    const nose = forward(shown.quat.subarray(4 * slot, 4 * slot + 4));
    const heading = ((Math.atan2(nose[1], nose[0]) * 180) / Math.PI + 360) % 360;
    const health = shown.health[slot];
    return [
      ['East', `${number(east, 1)} m`], ['North', `${number(north, 1)} m`], ['Up', `${number(up, 1)} m`],
      ['Speed', `${number(norm(this.layer.velocity(shown.id[slot])), 1)} m/s`], ['Heading', `${number(heading)}°`],
      ['Health', number(health, health < 10 ? 2 : 0).replace(/(\.\d*?)0+$/, '$1').replace(/\.$/, '')],
    ];
  }
}
