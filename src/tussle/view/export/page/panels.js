// The cards on the page: title, teams, who is chosen, what is known of the run.

const CURVE_POINTS = 240;

class Panels {
  constructor(page, layer, hidden, changed) {
    this.page = page;
    this.layer = layer;
    this.hidden = hidden;
    this.changed = changed;
    this.teams = [];
    this.makeHead();
    this.makeTeams();
    this.makeInfo();
  }

  makeHead() {
    const { data } = this.layer;
    const seed = (data.facts.find(([name]) => name === 'Seed') || [])[1];
    document.querySelector('#head h1').textContent = this.page.title;
    const parts = [seed && `seed ${seed}`, `${number(data.nEntities)} ${data.nEntities === 1 ? 'entity' : 'entities'}`, `${number(this.layer.end - this.layer.start, 1).replace(/\.0$/, '')} s`];
    say(document.getElementById('subtitle'), parts.filter(Boolean).join(' · '));
    const notice = document.getElementById('notice');
    if (!data.isComplete || data.notes.length) {
      notice.hidden = false;
      say(notice, data.isComplete ? `${data.notes.length} ${data.notes.length === 1 ? 'note' : 'notes'}` : 'This run was cut short: what there is of it is shown');
      notice.classList.toggle('plain', data.isComplete);
      notice.dataset.do = 'info';
    }
  }

  makeTeams() {
    const box = document.getElementById('teams');
    this.layer.data.teams.forEach((team, i) => {
      const button = element('button', 'team');
      button.type = 'button';
      button.title = 'Show or hide';
      button.setAttribute('aria-pressed', 'true');
      const swatch = element('i');
      swatch.style.setProperty('--team', rgb(team.colour));
      const count = element('b');
      const most = element('small');
      const right = element('span');
      right.append(count, most);
      const curve = document.createElement('canvas');
      button.append(swatch, element('span', '', team.name || `team ${team.id}`), right, curve);
      button.addEventListener('click', () => this.toggle(team.id, button));
      box.append(button);
      this.teams.push({ team, count, most, curve, values: this.curveOf(i) });
    });
  }

  /** How many there are of a team over the time, as many numbers as the curve has pixels. */
  curveOf(i) {
    const { layer } = this;
    const { start, end } = layer;
    return Array.from({ length: CURVE_POINTS }, (_, k) => layer.counts[i][layer.frameAt(start + ((end - start) * k) / (CURVE_POINTS - 1))]);
  }

  toggle(team, button) {
    if (this.hidden.has(team)) this.hidden.delete(team);
    else this.hidden.add(team);
    button.classList.toggle('is-hidden', this.hidden.has(team));
    button.setAttribute('aria-pressed', String(!this.hidden.has(team)));
    this.changed();
  }

  makeInfo() {
    const { data } = this.layer;
    const box = document.getElementById('info');
    say(box.querySelector('h2'), this.page.title);
    const facts = box.querySelector('dl');
    const degrees = (data.angleError * 180) / Math.PI;
    const accuracy = `positions within ${length(data.positionError)}, attitudes within ${degrees.toFixed(2)}° of the recording; between its frames, on the straight way`;
    for (const [name, value] of [...data.facts, ['Accuracy', accuracy]]) facts.append(element('dt', '', name), element('dd', '', value));
    box.querySelector('.notes').append(...data.notes.map((note) => element('li', '', note)));
    say(box.querySelector('.small'), `Made by ${this.page.generator}. This page is whole by itself: it needs no network.`);
  }

  /** How many are left of each team, with the curve up to now. */
  showTeams(t) {
    const { layer } = this;
    const { frame } = layer.shown;
    const ink = getComputedStyle(document.body);
    const muted = ink.getPropertyValue('--muted').trim();
    this.teams.forEach(({ team, count, most, curve, values }, i) => {
      const highest = Math.max(1, ...values);
      say(count, number(layer.counts[i][frame]));
      say(most, ` / ${number(highest)}`);
      if (curve.clientWidth) this.drawCurve(curve, values, highest, (t - layer.start) / (layer.end - layer.start || 1), rgb(team.colour), muted);
    });
  }

  drawCurve(canvas, values, highest, share, colour, muted) {
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (canvas.width !== Math.round(width * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const pen = canvas.getContext('2d');
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const x = (k) => (k / (CURVE_POINTS - 1)) * (width - 2) + 1;
    const y = (value) => height - 2 - (value / highest) * (height - 4);
    const trace = (from, to) => {
      pen.beginPath();
      for (let k = from; k <= to; k++) pen.lineTo(x(k), y(values[k]));
    };
    const now = Math.round(share * (CURVE_POINTS - 1));
    pen.globalAlpha = 0.45;
    pen.strokeStyle = muted;
    trace(0, CURVE_POINTS - 1);
    pen.stroke();
    trace(0, now);
    pen.lineTo(x(now), height - 1);
    pen.lineTo(x(0), height - 1);
    pen.globalAlpha = 0.25;
    pen.fillStyle = colour;
    pen.fill();
    pen.globalAlpha = 1;
    pen.strokeStyle = colour;
    pen.lineWidth = 1.6;
    trace(0, now);
    pen.stroke();
    pen.lineWidth = 1;
    pen.beginPath();
    pen.arc(x(now), y(values[now]), 2.4, 0, 2 * Math.PI);
    pen.fillStyle = colour;
    pen.fill();
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
    for (const button of box.querySelectorAll('.modes button')) {
      button.classList.toggle('is-on', button.dataset.do === mode);
    }
  }

  factsOf(id, t) {
    const { layer } = this;
    const tracks = layer.tracksOf.get(id);
    const slot = layer.slotOf(id);
    const team = layer.data.teams[layer.teamIndex.get(layer.team[slot >= 0 ? layer.shown.track[slot] : tracks[0]])];
    const facts = [['Team', team.name ? `${team.id} ${team.name}` : `${team.id}`]];
    if (slot < 0) {
      const first = layer.times[layer.first[tracks[0]]];
      const last = layer.times[layer.last[tracks[tracks.length - 1]]];
      facts.push(t < first ? ['Comes at', `${first.toFixed(1)} s`] : ['Gone since', `${last.toFixed(1)} s`]);
    } else {
      facts.push(...this.stateOf(slot));
    }
    const captures = layer.happenings.filter((happening) => happening.kind === 'capture' && happening.id === id && happening.t <= t).length;
    if (captures) facts.push(['Captures', `${captures}`]);
    return facts;
  }

  stateOf(slot) {
    const { layer } = this;
    const [east, north, up] = layer.placeIn(slot);
    const velocity = layer.velocity(slot);
    const quat = layer.shown.quat.subarray(4 * slot, 4 * slot + 4);
    const [noseEast, noseNorth] = forward(quat);
    const heading = ((Math.atan2(noseNorth, noseEast) * 180) / Math.PI + 360) % 360;
    const { healthSteps, fullHealth } = layer.data;
    return [
      ['East', `${number(east, 1)} m`], ['North', `${number(north, 1)} m`], ['Up', `${number(up, 1)} m`],
      ['Speed', `${number(norm(velocity), 1)} m/s`], ['Heading', `${number(heading % 360)}°`],
      ['Health', number((layer.shown.health[slot] / healthSteps) * fullHealth, fullHealth < 10 ? 2 : 0).replace(/\.?0+$/, '') || '0'],
    ];
  }
}
