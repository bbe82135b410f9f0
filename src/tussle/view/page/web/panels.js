// The cards on the page: title, teams, scores, the chosen entity, what is known of the run.
/** @import { Colour, Mode, PageData, Status, Team } from './types' */

import { amount, byId, cleared, duration, element, fillList, length, number, rgb, say, styled } from './formatting.js';
import { geodeticOf, sidesOf } from './geodesy.js';
import { between, forward, minus, norm } from './geometry.js';
import { NO_TEAM } from './layer.js';
import { Live } from './live.js';
import { Recorded } from './recorded.js';
import { steps } from './series.js';
/** @import { Series } from './series.js' */

/** Settings in which two runs differ that are shown at once. */
const MAX_DIFFERING = 4;

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
    for (const { name, title, teams } of page.runs || []) {
      const first = this.teams.find(({ team }) => teams.includes(team.id));
      first?.row.before(element('h3', 'run', `${name}: ${title}`));
    }
    /** What the card of scores shows. */
    this.scored = layer instanceof Live || page.teams.some(({ id }) => layer.series.has('score', id)) ? 'score' : 'captures';
    say(document.querySelector('#scores h2'), this.scored === 'score' ? 'Score' : 'Captures');
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
      const n = `${page.nEntities.map((each) => number(each)).join(' and ')} ${String(page.nEntities) === '1' ? 'entity' : 'entities'}`;
      say(byId('subtitle'), [seed && `seed ${seed}`, n, duration(layer.end - layer.start)].filter(Boolean).join(' · '));
    }
    const differing = page.differing?.map(([path, a, b]) => `${path} ${a} and ${b}`) || [];
    const more = differing.length > MAX_DIFFERING ? ` and ${differing.length - MAX_DIFFERING} more, see About` : '';
    const settings = differing.length ? ` · settings of A and B: ${differing.slice(0, MAX_DIFFERING).join(', ')}${more}` : '';
    byId('lead').hidden = !page.lead;
    say(byId('lead'), (page.lead || '') + settings);
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
  showStatus({ step, reached, rate, seed, isPaused, isOver, isSeeking, error, notes, metrics, steers, role }, drawRate) {
    const state = isSeeking ? 'seeking' : isOver ? 'over' : isPaused ? 'paused' : `${Number(reached.toPrecision(2))}× real time`;
    const parts = [`seed ${seed}`, `step ${number(step)}`, state, ...(rate && !isPaused ? [`${Number(drawRate.toPrecision(2))} frames/s`, `${rate} states/s sent`] : []), !steers && { direct: 'another browser steers', operate: `${role.name && `${role.name}, `}you operate team ${role.team}`, watch: 'you watch' }[role.kind]];
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

  /** Show entities left and born and the score of each team, with the curves up to a time. @param {number} t */
  showTeams(t) {
    const { layer: { series }, scored } = this;
    const left = this.teams.map(({ team }) => series.of('left', team.id));
    this.teams.forEach(({ team, count, most, curve }, i) => {
      say(count, number(left[i].at(t) || 0));
      say(most, ` / ${number(series.of('born', team.id).at(t) || 0)}`);
      this.drawCurve(curve, left[i], [0, left[i].range([0, 1])[1]], t, team);
    });
    const scores = this.scores.map(({ team }) => series.of(scored, team.id));
    const range = scores.reduce((sum, each) => each.range(sum), [0, 1e-9]);
    if (!(this.layer instanceof Live)) fillList(byId('metrics'), this.resultsAt(t));
    byId('scores').hidden = !scores.some(({ t: times }) => times.length) && !byId('metrics').children.length;
    this.scores.forEach(({ row, team, value, curve }, i) => {
      // Teams that capture nobody need no row.
      row.hidden = !scores[i].t.length || (scored === 'captures' && !scores[i].v.some(Boolean));
      say(value, amount(scores[i].at(t)));
      this.drawCurve(curve, scores[i], range, t, team);
    });
  }

  /** Recorded results at a time, without scores. @param {number} t @returns {[string, string][]} */
  resultsAt(t) {
    const { layer: { results, series }, page } = this;
    /** Names, teams and ids of the worlds and teams that have results. @type {[string, number | null, number][]} */
    const owners = [...(page.runs || [{ name: '' }]).map(({ name }, i) => /** @type {[string, null, number]} */ ([name, null, i && page.idShift])),
      ...page.teams.map(({ id, name }) => /** @type {[string, number, number]} */ ([name || `team ${id}`, id, 0]))];
    const specifications = (page.alarms || []).map(({ text }) => text);
    return results.filter((name) => !name.endsWith('.score') && !specifications.includes(name)).map((name) => [
      name.replace('.', ' ').replaceAll('_', ' '),
      owners.filter(([, team, id]) => series.has(name, team, id)).map(([owner, team, id]) => `${owner} ${amount(series.of(name, team, id).at(t))}`.trim()).join(', '),
    ]);
  }

  /**
   * Draw a curve over the whole game, and in colour up to now.
   * @param {HTMLCanvasElement} canvas @param {Series} series @param {number[]} range @param {number} t @param {{ colour: Colour }} team
   */
  drawCurve(canvas, series, [lowest, highest], t, team) {
    const { start, end } = this.layer;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width) return;
    const pen = cleared(canvas);
    const x = (/** @type {number} */ time) => between((time - start) / (end - start || 1), 0, 1) * (width - 6) + 2;
    const y = (/** @type {number} */ value) => height - 2 - ((value - lowest) / (highest - lowest || 1)) * (height - 5);
    pen.globalAlpha = 0.45;
    pen.strokeStyle = styled('--muted');
    pen.stroke(steps(series, end, x, y));
    const value = y(series.at(t));
    if (Number.isNaN(value)) return;
    const path = steps(series, t, x, y);
    pen.globalAlpha = 1;
    pen.strokeStyle = pen.fillStyle = rgb(team.colour);
    pen.lineWidth = 1.6;
    pen.stroke(path);
    const knob = new Path2D();
    knob.arc(x(t), value, 2.4, 0, 2 * Math.PI);
    pen.fill(knob);
    path.lineTo(x(t), height - 1);
    path.lineTo(x(series.t[0]), height - 1);
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

  /** Show columns of plugins, and messages of a live game's entity. @param {number} id */
  showSections(id) {
    const box = byId('sections');
    const sections = this.layer.sectionsOf(id);
    const titles = sections.map(([title]) => title).join('\n');
    if (titles !== this.titles) box.replaceChildren(...sections.map(([title]) => element('section', '', '', element('h3', '', title), element('dl'))));
    this.titles = titles;
    sections.forEach(([, rows], i) => fillList(box.children[i].lastElementChild, rows));
  }

  /** @param {number} id @param {number} t @returns {[string, string][]} */
  factsOf(id, t) {
    const { layer, page } = this;
    const slot = layer.slotOf(id);
    const team = slot >= 0 ? layer.teams.get(layer.shown.team[slot]) || NO_TEAM : layer.teamOf(id);
    const { teamShift } = page.runs?.find(({ teams }) => teams.includes(team.id)) || { teamShift: 0 };
    const nCaptures = layer.events.filter((event) => event.kind === 'capture' && event.id === id && event.t <= t).length;
    return [
      ['Team', team.name || `team ${team.id - teamShift}`],
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
    const { layer: { shown }, page } = this;
    const isSecond = page.shift && shown.id[slot] > page.idShift;
    const place = minus(shown.placeIn(slot), isSecond ? page.shift : [0, 0, 0]);
    const [east, north, up] = place;
    const geodetic = page.scenery.origin && geodeticOf(page.scenery.origin, place);
    const nose = forward(shown.quat.subarray(4 * slot, 4 * slot + 4));
    const heading = ((Math.atan2(nose[1], nose[0]) * 180) / Math.PI + 360) % 360;
    const health = shown.health[slot];
    return [
      ['East', `${number(east, 1)} m`], ['North', `${number(north, 1)} m`], ['Up', `${number(up, 1)} m`],
      .../** @type {[string, string][]} */ (geodetic ? ['Latitude', 'Longitude'].map((name, i) => [name, sidesOf(geodetic)[i]]) : []),
      ['Speed', `${number(norm(this.layer.velocity(shown.id[slot])), 1)} m/s`], ['Heading', `${number(heading)}°`],
      ['Health', number(health, health < 10 ? 2 : 0).replace(/(\.\d*?)0+$/, '$1').replace(/\.$/, '')],
    ];
  }
}
