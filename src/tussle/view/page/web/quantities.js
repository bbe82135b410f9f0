// The panel of quantities over time: each that is chosen has a plot, with a line for each team, entity and run.
/** @import { Player } from './player.js' */
/** @import { Series } from './series.js' */

import { amount, byId, cleared, element, field, rgb, say, styled } from './formatting.js';
import { Live } from './live.js';
import { OF_TEAMS, steps } from './series.js';

/** Colours of entities in one plot, told apart with every kind of colour vision. */
export const COLOURS = ['#4aa3df', '#e8743b', '#2fb38a', '#d9ae1f', '#b59ad6', '#e05a9c'];
/** Lines of one plot. */
const MAX_LINES = 12;
/** Titles of quantities of teams. @type {Record<string, string>} */
const TITLES = { left: 'entities left', born: 'entities born' };

/** @typedef {{ label: string, colour: string, isDashed: boolean, team: number | null, id: number, row: HTMLElement, value: HTMLElement }} Line */
/** @typedef {{ name: string, title: string, unit: string, lines: Line[], box: HTMLElement, canvas: HTMLCanvasElement, list: HTMLElement }} Plot */

export class QuantityPanel {
  /** @param {Player} player */
  constructor(player) {
    this.player = player;
    this.box = byId('quantities');
    this.select = byId('quantity', HTMLSelectElement);
    this.ids = field('ids');
    /** @type {Plot[]} */
    this.plots = [];
    this.offered = '';
    /** The chosen entity whose id stands in the field. */
    this.chosen = 0;
    /** Columns of recorded entities that are there, or on their way. @type {Set<string>} */
    this.asked = new Set();
    this.select.addEventListener('change', () => {
      const [group, name] = this.select.value.split('\n');
      this.select.value = '';
      this.add(group, name);
      this.select.blur();
    });
    this.ids.addEventListener('change', () => {
      const [first] = this.entities();
      if (first) player.choose(first, false);
    });
  }

  toggle() {
    this.box.hidden = !this.box.hidden;
    if (!this.box.hidden && !byId('feed').hidden) this.player.feed.toggle();
    this.player.look();
  }

  /** Ids in the field, as the first of two runs counts them. */
  entities() {
    return [...new Set((this.ids.value.match(/\d+/g) || []).map(Number))];
  }

  /** Columns of the chosen entity, with their units. @returns {[string, string][]} */
  columns() {
    const { layer, page, chosen } = this.player;
    if (!(layer instanceof Live)) return page.quantities;
    return layer.status.entity?.id === chosen ? layer.status.entity.quantities : [];
  }

  /** Offer what there is. */
  offer() {
    const { layer, page, chosen } = this.player;
    const teams = OF_TEAMS.filter((name) => page.teams.some(({ id }) => layer.series.has(name, id)));
    /** @type {[string, string, string[][]][]} */
    const groups = [['team', 'Teams', teams.map((name) => [name, TITLES[name] || name])], ['result', 'Results', layer.results.map((name) => [name, name])],
      ['column', 'Columns of the entities', this.columns().map(([name]) => [name, name])]];
    const key = JSON.stringify(groups);
    if (key !== this.offered) {
      this.offered = key;
      this.select.replaceChildren(new Option('Add a quantity …', ''), ...groups.filter(([, , names]) => names.length).map(([group, label, names]) => {
        const made = element('optgroup');
        made.label = label;
        made.append(...names.map(([name, title]) => new Option(title, `${group}\n${name}`)));
        return made;
      }));
    }
    if (chosen !== this.chosen) {
      const [was, now] = [this.chosen, chosen].map((id) => (id ? String(this.player.layer.number(id)) : ''));
      if (this.ids.value === was && document.activeElement !== this.ids) this.ids.value = now;
      this.chosen = chosen;
    }
  }

  /** Add a quantity of all teams, of the world, or of the entities in the field. @param {string} group @param {string} name */
  add(group, name) {
    const { player } = this;
    const { layer, page } = player;
    const ids = group === 'column' ? this.entities() : [];
    if (group === 'column' && !ids.length) return player.say('Click an entity, or write its number in the field');
    const unit = this.columns().find(([each]) => each === name)?.[1] || '';
    const plot = this.plots.find((each) => each.name === name) || this.makePlot(name, TITLES[name] || name, unit);
    const teamsOfSecond = page.runs?.[1].teams || [];
    if (group !== 'column') {
      const ofWorld = { colour: styled('--ink'), team: /** @type {null} */ (null) };
      if (!page.teams.some(({ id }) => layer.series.has(name, id))) this.addLine(plot, { ...ofWorld, label: page.runs ? 'A' : name, isDashed: false, id: 0 });
      if (page.runs && layer.series.has(name, null, page.idShift)) this.addLine(plot, { ...ofWorld, label: 'B', isDashed: true, id: page.idShift });
      for (const { id, name: label, colour } of page.teams) {
        this.addLine(plot, { label: label || `team ${id}`, colour: rgb(colour), isDashed: teamsOfSecond.includes(id), team: id, id: 0 });
      }
    }
    for (const id of ids) {
      const colour = COLOURS[(new Set(plot.lines.map((line) => line.colour))).size % COLOURS.length];
      this.addLine(plot, { label: '', colour, isDashed: false, team: null, id });
      if (page.runs) this.addLine(plot, { label: '', colour, isDashed: true, team: null, id: id + page.idShift });
    }
    this.ask();
    player.look();
    return undefined;
  }

  /** @param {string} name @param {string} title @param {string} unit @returns {Plot} */
  makePlot(name, title, unit) {
    const [canvas, list, close] = [element('canvas'), element('ul'), element('button', 'plain', '✕')];
    close.title = 'Remove';
    close.type = 'button';
    const box = element('section', 'plot', '', element('div', 'row', '', element('h3', '', title + (unit ? ` [${shownUnit(unit)}]` : '')), close), canvas, list);
    const plot = { name, title, unit, lines: /** @type {Line[]} */ ([]), box, canvas, list };
    close.addEventListener('click', () => {
      box.remove();
      this.plots = this.plots.filter((each) => each !== plot);
      this.ask();
    });
    this.plots.push(plot);
    byId('plots').append(box);
    return plot;
  }

  /** @param {Plot} plot @param {Omit<Line, 'row' | 'value'>} line */
  addLine(plot, line) {
    if (plot.lines.length >= MAX_LINES || plot.lines.some(({ team, id }) => team === line.team && id === line.id)) return;
    const [swatch, value] = [element('i', line.isDashed ? 'is-dashed' : ''), element('b')];
    swatch.style.setProperty('--line-colour', line.colour);
    const row = element('li', '', '', swatch, element('span', '', line.label), value);
    plot.lines.push({ ...line, row, value });
    plot.list.append(row);
  }

  /** Ask for what the plots need. */
  ask() {
    const { player } = this;
    const wanted = this.plots.flatMap(({ name, lines }) => [...new Set(lines.map(({ id }) => id))].map((id) => /** @type {[string, number]} */ ([name, id])));
    if (player.layer instanceof Live) {
      player.order('want', { wanted });
      player.layer.series.keep((name, id) => OF_TEAMS.includes(name) || wanted.some(([each, who]) => each === name && who === id));
      return;
    }
    for (const [name, id] of wanted) {
      const blob = `column-${player.layer.number(id)}-${encodeURIComponent(name)}`;
      if (!id || id === player.page.idShift || this.asked.has(blob)) continue;
      this.asked.add(blob);
      player.source.blob(blob).then((bytes) => {
        player.layer.series.take(JSON.parse(new TextDecoder().decode(bytes)));
        player.look();
      }, (error) => player.say(error.message));
    }
  }

  /** Draw all plots up to a time. @param {number} t */
  show(t) {
    if (this.box.hidden) return;
    this.offer();
    for (const plot of this.plots) this.showPlot(plot, t);
  }

  /** @param {Plot} plot @param {number} t */
  showPlot({ name, unit, lines, canvas }, t) {
    const { layer } = this.player;
    const factor = inDegrees(unit) ? 180 / Math.PI : 1;
    const shown = lines.map((line) => ({ ...line, series: layer.series.of(name, line.team, line.id) }));
    for (const { row, value, series, label, id } of shown) {
      row.hidden = !series.t.length;
      say(row.children[1], label || layer.who(id));
      say(value, amount(factor * series.at(t)));
    }
    const counted = ['left', 'born', 'captures'].includes(name) ? [0, 1] : [Infinity, -Infinity];
    const range = shown.reduce((sum, { series }) => series.range(sum), counted);
    if (canvas.clientWidth) this.draw(canvas, shown, range[0] <= range[1] ? range : [0, 0], t, factor);
  }

  /**
   * Lines up to a time in colour, and what comes later pale.
   * @param {HTMLCanvasElement} canvas @param {(Line & { series: Series })[]} lines @param {number[]} range @param {number} t @param {number} factor of the values on the axis
   */
  draw(canvas, lines, [low, high], t, factor) {
    const { start, end } = this.player.layer;
    const pen = cleared(canvas);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    const [least, most] = low < high ? [low, high] : [low, low + 1];
    pen.font = `11px ${getComputedStyle(document.body).fontFamily}`;
    const labels = [most, least].map((value) => amount(factor * value));
    const left = 8 + Math.max(...labels.map((text) => pen.measureText(text).width));
    const x = (/** @type {number} */ time) => left + ((time - start) / (end - start || 1)) * (width - left - 4);
    const y = (/** @type {number} */ value) => height - 16 - ((value - least) / (most - least)) * (height - 24);
    pen.strokeStyle = styled('--line');
    for (const level of [8, height - 16]) pen.strokeRect(left, level, width - left, 0);
    pen.strokeStyle = styled('--muted');
    pen.strokeRect(x(t), 8, 0, height - 24);
    for (const { series, colour, isDashed } of lines) {
      pen.strokeStyle = colour;
      pen.setLineDash(isDashed ? [5, 3] : []);
      pen.globalAlpha = 0.35;
      pen.lineWidth = 1;
      pen.stroke(steps(series, end, x, y));
      pen.globalAlpha = 1;
      pen.lineWidth = 1.6;
      pen.stroke(steps(series, t, x, y));
    }
    pen.setLineDash([]);
    pen.fillStyle = styled('--muted');
    pen.textAlign = 'left';
    pen.fillText(`${amount(start)} s`, left, height - 3);
    pen.textAlign = 'right';
    pen.fillText(`${amount(end)} s`, width - 2, height - 3);
    pen.fillText(labels[0], left - 4, 12);
    pen.fillText(labels[1], left - 4, height - 13);
  }
}

/** Whether a unit is one of angles, which are shown in degrees. @param {string} unit */
const inDegrees = (unit) => /^rad\b/.test(unit);

/** @param {string} unit */
const shownUnit = (unit) => (inDegrees(unit) ? unit.replace('rad', '°') : unit);
