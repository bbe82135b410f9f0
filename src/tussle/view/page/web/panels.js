// The cards on the page: title, teams, scores, who is chosen, what is known of the run.

import { element, length, number, rgb, say } from './formatting.js';
import { between, forward, norm } from './geometry.js';
import { attitudes } from './chunk.js';
import { lastWhere, NO_TEAM } from './layer.js';
import { append } from './live.js';

const CURVE_POINTS = 240;

export class Panels {
  constructor(page, layer, hidden, changed) {
    this.page = page;
    this.layer = layer;
    this.hidden = hidden;
    this.changed = changed;
    this.makeHead();
    this.teams = page.teams.map((team, i) => this.makeTeam(team, i));
    this.scores = page.teams.map((team) => this.makeScore(team));
    this.makeInfo();
  }

  makeHead() {
    const { page, layer } = this;
    document.querySelector('#head h1').textContent = page.title;
    if (!layer.status) {
      const seed = (page.facts.find(([name]) => name === 'Seed') || [])[1];
      const n = `${number(page.nEntities)} ${page.nEntities === 1 ? 'entity' : 'entities'}`;
      const seconds = `${number(layer.end - layer.start, 1).replace(/\.0$/, '')} s`;
      say(document.getElementById('subtitle'), [seed && `seed ${seed}`, n, seconds].filter(Boolean).join(' · '));
    }
    const lead = document.getElementById('lead');
    lead.hidden = !page.lead;
    say(lead, page.lead || '');
    this.showNotes(page.notes);
    if (!page.isComplete) this.notice('This run was cut short: what there is of it is shown', true);
  }

  /** How many notes there are, and the notes where that is clicked. */
  showNotes(notes) {
    const key = notes.join('\n');
    if (key === this.notes) return;
    this.notes = key;
    document.querySelector('#info .notes').replaceChildren(...notes.map((note) => element('li', '', note)));
    this.notice(notes.length ? `${notes.length} ${notes.length === 1 ? 'note' : 'notes'}` : '', false);
  }

  notice(text, isWarning) {
    const notice = document.getElementById('notice');
    notice.hidden = !text;
    notice.classList.toggle('plain', !isWarning);
    notice.dataset.do = 'info';
    say(notice, text);
  }

  /** What a live game says of itself. */
  showStatus(status) {
    const { step, reached, rate, seed, isPaused, isOver, isSeeking, error, notes, metrics, steers } = status;
    const state = isSeeking ? 'seeking' : isOver ? 'over' : isPaused ? 'paused' : `${Number(reached.toPrecision(2))}× real time`;
    const parts = [`seed ${seed}`, `step ${number(step)}`, state, rate && !isPaused && `${rate} frames/s`, !steers && 'another browser steers'];
    say(document.getElementById('subtitle'), parts.filter(Boolean).join(' · '));
    this.showNotes([...(error ? [error] : []), ...this.page.notes, ...notes.filter((note) => !this.page.notes.includes(note))]);
    if (error) this.notice(error, true);
    const rows = metrics.flatMap(([name, value]) => [element('dt', '', name), element('dd', '', value)]);
    document.getElementById('metrics').replaceChildren(...rows);
  }

  makeTeam(team, i) {
    const button = element('button', 'team');
    button.type = 'button';
    button.title = 'Show or hide';
    button.setAttribute('aria-pressed', 'true');
    const swatch = element('i');
    swatch.style.setProperty('--team', rgb(team.colour));
    const [count, most, right] = [element('b'), element('small'), element('span')];
    right.append(count, most);
    const curve = document.createElement('canvas');
    button.append(swatch, element('span', '', team.name || `team ${team.id}`), right, curve);
    button.addEventListener('click', () => this.toggle(team.id, button));
    document.getElementById('teams').append(button);
    return { team, count, most, curve, i };
  }

  makeScore(team) {
    const line = element('div', 'score');
    const swatch = element('i');
    swatch.style.setProperty('--team', rgb(team.colour));
    const [value, curve] = [element('b'), document.createElement('canvas')];
    line.append(swatch, element('span', '', team.name || `team ${team.id}`), value, curve);
    document.getElementById('scores').append(line);
    return { team, value, curve, line };
  }

  toggle(team, button) {
    if (this.hidden.has(team)) this.hidden.delete(team);
    else this.hidden.add(team);
    button.classList.toggle('is-hidden', this.hidden.has(team));
    button.setAttribute('aria-pressed', String(!this.hidden.has(team)));
    this.changed();
  }

  makeInfo() {
    const { page } = this;
    const box = document.getElementById('info');
    say(box.querySelector('h2'), page.title);
    const degrees = (page.angleError * 180) / Math.PI;
    const accuracy = page.positionError && `positions within ${length(page.positionError)}, attitudes within ${degrees.toFixed(2)}° of the recording; between its frames, on the straight way`;
    const facts = [...page.facts, ...(accuracy ? [['Accuracy', accuracy]] : [])];
    box.querySelector('dl').append(...facts.flatMap(([name, value]) => [element('dt', '', name), element('dd', '', value)]));
    const whole = page.source === 'embedded' ? ' This page is whole by itself: it needs no network.' : '';
    say(box.querySelector('.small'), `Made by ${page.generator}.${whole}`);
  }

  /** How many are left of each team, and what each has scored, with the curves up to now. */
  showTeams(t) {
    const { layer } = this;
    const muted = getComputedStyle(document.body).getPropertyValue('--muted').trim();
    const counts = layer.counts();
    for (const { team, count, most, curve, i } of this.teams) {
      const highest = Math.max(1, counts[i], ...layer.curves.n[i]);
      say(count, number(counts[i]));
      say(most, ` / ${number(highest)}`);
      if (curve.clientWidth) this.drawCurve(curve, layer.curves.t, layer.curves.n[i], [0, highest], t, rgb(team.colour), muted);
    }
    const [title, { t: at, n }] = this.scored();
    const box = document.getElementById('scores');
    box.hidden = !at.length;
    if (box.hidden) return;
    say(box.querySelector('h2'), title);
    const now = lastWhere(at.length, (i) => at[i] <= t + 1e-9);
    const all = n.flat();
    const range = [Math.min(0, ...all), Math.max(1e-9, ...all)];
    this.scores.forEach(({ team, value, curve, line }, i) => {
      line.hidden = !n[i].some(Boolean);
      const score = now < 0 ? 0 : n[i][now];
      say(value, number(score, Number.isInteger(score) ? 0 : 2));
      if (curve.clientWidth) this.drawCurve(curve, at, n[i], range, t, rgb(team.colour), muted);
    });
  }

  /** What is plotted beside the numbers: scores of a live game; of a recording, which has only the last ones, captures. */
  scored() {
    const { layer, page } = this;
    if (layer.status) return ['Score', layer.scores];
    if (!this.captures) {
      this.captures = { t: [], n: page.teams.map(() => []) };
      const sums = page.teams.map(() => 0);
      for (const { t, kind, id } of layer.events) {
        const i = kind === 'capture' ? page.teams.findIndex((team) => team.id === layer.teamOf(id).id) : -1;
        if (i < 0) continue;
        if (!this.captures.t.length) append(this.captures, layer.start, sums);
        append(this.captures, t, sums);
        sums[i]++;
        append(this.captures, t, sums);
      }
    }
    return ['Captures', this.captures];
  }

  /** A curve over the whole game, and in colour up to now. */
  drawCurve(canvas, at, values, [lowest, highest], t, colour, muted) {
    const { start, end } = this.layer;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (canvas.width !== Math.round(width * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const pen = canvas.getContext('2d');
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const x = (time) => between((time - start) / (end - start || 1), 0, 1) * (width - 6) + 2;
    const y = (value) => height - 2 - ((value - lowest) / (highest - lowest || 1)) * (height - 5);
    const now = lastWhere(at.length, (i) => at[i] <= t + 1e-9);
    const stride = Math.max(1, Math.floor(at.length / CURVE_POINTS));
    const trace = (last) => {
      pen.beginPath();
      for (let k = 0; k < last; k += stride) pen.lineTo(x(at[k]), y(values[k]));
      if (last >= 0) pen.lineTo(x(at[last]), y(values[last]));
    };
    pen.globalAlpha = 0.45;
    pen.strokeStyle = muted;
    trace(at.length - 1);
    pen.stroke();
    if (now >= 0) {
      trace(now);
      pen.lineTo(x(t), y(values[now]));
      pen.globalAlpha = 1;
      pen.strokeStyle = colour;
      pen.lineWidth = 1.6;
      pen.stroke();
      pen.lineTo(x(t), height - 1);
      pen.lineTo(x(at[0]), height - 1);
      pen.globalAlpha = 0.25;
      pen.fillStyle = colour;
      pen.fill();
      pen.globalAlpha = 1;
      pen.lineWidth = 1;
      pen.beginPath();
      pen.arc(x(t), y(values[now]), 2.4, 0, 2 * Math.PI);
      pen.fill();
    }
    pen.globalAlpha = 1;
  }

  /** What is known of who is chosen. */
  showChosen(id, mode, t) {
    const box = document.getElementById('chosen');
    box.hidden = !id;
    if (!id) return;
    const { layer } = this;
    say(box.querySelector('h2'), layer.who(id));
    const facts = this.factsOf(id, t);
    const list = box.querySelector('dl');
    if (list.children.length !== 2 * facts.length) {
      list.replaceChildren(...facts.flatMap(([name]) => [element('dt', '', name), element('dd')]));
    }
    facts.forEach(([name, value], i) => {
      say(list.children[2 * i], name);
      say(list.children[2 * i + 1], value);
    });
    this.showSections(id);
    for (const button of box.querySelectorAll('.modes button')) {
      button.classList.toggle('is-on', button.dataset.do === mode);
    }
  }

  /** What a live game tells of its plugins' columns and messages. */
  showSections(id) {
    const box = document.getElementById('sections');
    const { entity } = this.layer.status || {};
    const sections = entity && entity.id === id ? entity.sections.slice(1) : [];
    const key = sections.map(([title, rows]) => [title, ...rows.map(([name]) => name)].join('\n')).join('\n\n');
    if (key !== this.sectionsFor) {
      this.sectionsFor = key;
      box.replaceChildren(...sections.map(([title, rows]) => {
        const [part, list] = [element('section'), element('dl')];
        list.append(...rows.flatMap(([name]) => [element('dt', '', name), element('dd')]));
        part.append(element('h3', '', title), list);
        return part;
      }));
    }
    const cells = box.querySelectorAll('dd');
    sections.flatMap(([, rows]) => rows).forEach(([, value], i) => say(cells[i], value));
  }

  factsOf(id, t) {
    const { layer } = this;
    const slot = layer.slotOf(id);
    const team = slot >= 0 ? layer.teams.get(layer.shown.team[slot]) || NO_TEAM : layer.teamOf(id);
    const facts = [['Team', team.name ? `${team.id} ${team.name}` : `${team.id}`]];
    const when = (condition) => (layer.events.find(condition) || {}).t;
    if (slot >= 0) {
      facts.push(...this.stateOf(slot));
    } else {
      const born = when((event) => event.kind === 'birth' && event.id === id);
      const gone = when(({ kind, id: one, other }) => (kind === 'capture' ? other === id : ['death', 'collision'].includes(kind) && (one === id || (kind === 'collision' && other === id))));
      if (born > t) facts.push(['Comes at', `${born.toFixed(1)} s`]);
      else facts.push(gone <= t ? ['Gone since', `${gone.toFixed(1)} s`] : ['Gone', 'not there at this time']);
    }
    const captures = layer.events.filter((event) => event.kind === 'capture' && event.id === id && event.t <= t).length;
    if (captures) facts.push(['Captures', `${captures}`]);
    return facts;
  }

  stateOf(slot) {
    const { layer } = this;
    const [east, north, up] = layer.placeIn(slot);
    const velocity = layer.velocity(slot);
    const [noseEast, noseNorth] = forward(layer.shown.quat.subarray(4 * slot, 4 * slot + 4));
    const heading = ((Math.atan2(noseNorth, noseEast) * 180) / Math.PI + 360) % 360;
    const health = layer.shown.health[slot];
    return [
      ['East', `${number(east, 1)} m`], ['North', `${number(north, 1)} m`], ['Up', `${number(up, 1)} m`],
      ['Speed', `${number(norm(velocity), 1)} m/s`], ['Heading', `${number(heading % 360)}°`],
      ['Health', number(health, health < 10 ? 2 : 0).replace(/(\.\d*?)0+$/, '$1').replace(/\.$/, '')],
    ];
  }
}
