// The player: puts the parts together and draws whenever something has changed.

import { element, eventText, length, number, say } from './formatting.js';
import { add, between, forward, halfTurn, minus, norm, scaled } from './geometry.js';
import { SOURCES } from './sources.js';
import { Recorded } from './layer.js';
import { Live } from './live.js';
import { Camera, FIRST_PITCH, FIRST_YAW, pixelOf, placeBehind, STEEPEST } from './camera.js';
import { styled } from './drawing.js';
import { Entities } from './models.js';
import { TRAIL_LENGTHS, TRAIL_OF_CHOSEN, Trails } from './trails.js';
import { AXES, Scenery } from './scenery.js';
import { Reach } from './reach.js';
import { Drawn } from './drawn.js';
import { EventLine } from './events.js';
import { FLASH, Overlay } from './overlay.js';
import { LiveClock, RecordedClock } from './timeline.js';
import { Panels } from './panels.js';
import { Steering } from './steering.js';
import { fillHelp, listen } from './keys.js';
import { actionsOf, listenToSettings } from './actions.js';

/** Least size of a model [pixels], where none may be too small to see. */
const LEAST_SIZE = 18;
/** Longer than any game [s]. */
const WHOLE_GAME = 1e9;
/** Least time between two looks back for the trails [ms]. */
const LOOK_PERIOD = 2000;
/** With no more entities than this, labels and short trails are shown from the start. */
const FEW = { labels: 30, trails: 500 };

class Player {
  constructor(page, source) {
    this.page = page;
    this.source = source;
    this.canvas = document.getElementById('view');
    this.gl = this.canvas.getContext('webgl2', { antialias: true, alpha: false, powerPreference: 'high-performance' });
    if (!this.gl) throw new Sorry('This page draws with WebGL 2, which this browser does not have or has turned off.');
    if (!window.DecompressionStream) throw new Sorry('This page unpacks its data with DecompressionStream, which this browser is too old to have.');
    this.size = Math.max(norm(minus(page.scenery.high, page.scenery.low)), 1);
    this.camera = new Camera(this.size);
    this.hidden = new Set();
    this.chosen = 0;
    this.hovered = 0;
    this.isChanged = true;
    this.isReady = false;
    this.isShown = false;
    this.isPicking = false;
    this.lookedBack = 0;
    const reach = Number((page.reach || 0.05 * this.size).toPrecision(3));
    this.drawn = {
      scale: 0, trail: 0, text: 0, labels: false, wire: false, least: true, grid: true, regions: true, shapes: true, rings: false,
      cones: false, links: false, ringRadius: reach, coneRange: reach, coneAngle: Math.round(page.angle) || 60, linkRange: reach,
    };
    this.isCalm = window.matchMedia('(prefers-reduced-motion: reduce)').matches;
    const failed = (error) => sorry(`The data of this page is missing or damaged: ${error.message}`);
    this.layer = source.isLive ? new Live(page, () => this.look()) : new Recorded(page, source, () => this.look(), failed);
  }

  async start() {
    const { gl, page, layer, source } = this;
    this.scenery = new Scenery(gl, page.scenery, page.teams, page.models, source);
    await this.scenery.readTerrain();
    this.shapes = new Drawn(gl, page.models.sphere);
    await (source.isLive ? this.join() : layer.read());
    this.entities = new Entities(gl, layer, page);
    this.trails = new Trails(gl, layer);
    this.reach = new Reach(gl);
    this.overlay = new Overlay(document.getElementById('over'));
    this.clock = source.isLive ? new LiveClock(layer, source) : new RecordedClock(layer, page);
    this.events = new EventLine(layer, this.clock, (event) => this.jump(event));
    this.panels = new Panels(page, layer, this.hidden, () => this.look());
    this.steering = new Steering(this.canvas, this);
    this.drawn.labels = layer.mostAtOnce <= FEW.labels;
    this.drawn.trail = page.hasTrails || layer.mostAtOnce <= FEW.trails ? TRAIL_LENGTHS.indexOf(page.hasTrails ? 10 : 5) : 0;
    this.listen();
    this.setTheme(page.scenery.background ? 'mission' : window.matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark');
    this.lay();
    this.open();
    // For the curves, and for the trails.
    this.order('history', { seconds: WHOLE_GAME });
    this.lookBack();
    this.isReady = true;
    if (window.matchMedia('(hover: hover)').matches) this.say('h shows the keys');
    this.last = performance.now();
    requestAnimationFrame((now) => this.tick(now));
  }

  /** Watch a live game: done when there is something to be shown. */
  join() {
    const { layer, source } = this;
    document.getElementById('game').hidden = false;
    document.getElementById('seed').value = String(this.page.seed);
    document.getElementById('loop').parentElement.hidden = true;
    return new Promise((done) => {
      const isThere = () => layer.status && !Number.isNaN(layer.shown.t) && done();
      source.connect({
        status: (status) => {
          layer.takeStatus(status);
          if (this.isReady) this.hear(status);
          isThere();
        },
        frame: (header, bytes) => {
          const isJump = header.epoch !== layer.epoch && layer.epoch >= 0;
          const before = layer.shown.t;
          layer.takeFrame(header, bytes);
          // Of a game that is faster than frames are sent, most of a trail is not seen.
          const isSparse = layer.shown.t - before > 0.1 * TRAIL_LENGTHS[this.drawn.trail] && performance.now() - this.lookedBack > LOOK_PERIOD;
          if (isJump || isSparse) this.lookBack();
          isThere();
        },
        past: (header, bytes) => layer.takePast(header, bytes),
        drawn: (header, bytes) => {
          this.shapes.take(header, bytes);
          this.look();
        },
        lost: () => {
          this.isLost = true;
          if (this.isReady) this.panels.notice('The game is no longer served: this is what was seen last', true);
          else sorry('The game is not served: the address may be an old one, or too many browsers watch.');
        },
      });
    });
  }

  /** What a live game says of itself. */
  hear(status) {
    if (!this.isLost) this.panels.showStatus(status);
    if (status.refusal) this.say(status.refusal);
    this.look();
  }

  /** Order something of a live game; nothing of a recording. */
  order(command, fields = {}) {
    if (this.source.isLive) this.source.send(command, fields);
  }

  /** Ask a live game for what was seen before, where trails are to be drawn. */
  lookBack() {
    this.lookedBack = performance.now();
    const seconds = TRAIL_LENGTHS[this.drawn.trail] || TRAIL_OF_CHOSEN;
    this.order('history', { seconds: Math.min(seconds, 0.1 * WHOLE_GAME) });
  }

  /** See the game at first as its mission says. */
  open() {
    const { opening } = this.page;
    if (!opening) return;
    if (opening.position || opening.target) this.camera.look(opening.position, opening.target);
    this.opening = opening.follow || opening.mode !== 'free' ? opening : null;
  }

  /** Follow whom the mission says, when it is there. */
  followFirst() {
    const { opening } = this;
    if (!opening || (opening.follow && this.layer.slotOf(opening.follow) < 0)) return;
    this.opening = null;
    if (opening.follow) this.choose(opening.follow);
    if (opening.mode !== 'free') this.enter(opening.mode);
  }

  listen() {
    listen(actionsOf(this));
    fillHelp(document.querySelector('#help .columns'), this.source.isLive);
    listenToSettings(this);
    const { slider } = this.clock;
    slider.addEventListener('input', () => {
      this.clock.seek(Number(slider.value));
      this.look();
    });
    slider.addEventListener('change', () => slider.blur());
    const sizes = new ResizeObserver(() => this.lay());
    for (const node of [document.body, document.getElementById('head')]) sizes.observe(node);
    this.canvas.addEventListener('webglcontextlost', (event) => {
      event.preventDefault();
      sorry('The graphics card has dropped this page. Loading it again brings it back.');
    });
  }

  /** Fit everything to the window. */
  lay() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    this.canvas.width = Math.max(1, Math.round(width * ratio));
    this.canvas.height = Math.max(1, Math.round(height * ratio));
    this.ratio = ratio;
    const style = document.documentElement.style;
    style.setProperty('--bar', `${document.getElementById('bar').offsetHeight}px`);
    style.setProperty('--head', `${document.getElementById('head').offsetHeight}px`);
    this.events.draw();
    this.look();
  }

  look() {
    this.isChanged = true;
  }

  // -- time ---------------------------------------------------------------------------------------------------------------------

  tick(now) {
    // A tab that was in the background does not make up for it.
    const seconds = Math.min((now - this.last) / 1000, 1);
    this.last = now;
    // Time waits for what has to be unpacked.
    if (this.clock.isPlaying && this.isShown) {
      this.clock.advance(seconds);
      if (!this.source.isLive) this.look();
    }
    this.isShown = this.layer.show(this.clock.t);
    if (this.isShown) {
      this.followFirst();
      this.follow();
      const isMoving = this.camera.step(seconds, this.isCalm);
      if (this.isChanged || isMoving) {
        this.isChanged = isMoving;
        this.draw();
      }
      if (this.clock.isPlaying) this.layer.lookAhead();
    }
    requestAnimationFrame((next) => this.tick(next));
  }

  /** Let the camera keep to what it keeps to. */
  follow() {
    const { camera, layer, chosen } = this;
    if (camera.mode === 'overview') {
      this.fitAll();
    } else if (camera.mode !== 'free') {
      const slot = layer.slotOf(chosen);
      if (slot >= 0) camera.track(layer.placeIn(slot), this.headingOf(slot));
    }
  }

  headingOf(slot) {
    const { quat } = this.layer.shown;
    const nose = forward(quat.subarray(4 * slot, 4 * slot + 4));
    return Math.hypot(nose[0], nose[1]) > 0.05 ? Math.atan2(nose[1], nose[0]) : this.camera.heading;
  }

  isHidden(slot) {
    return this.hidden.has(this.layer.shown.team[slot]);
  }

  fitAll() {
    const { shown } = this.layer;
    const each = (see) => {
      for (let i = 0; i < shown.n; i++) if (!this.isHidden(i)) see(shown.x[i], shown.y[i], shown.z[i]);
    };
    const { width, height } = this.canvas;
    this.camera.fit(each, width / height, this.room());
  }

  /** Shares of the view that panels cover. */
  room() {
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    const bar = document.getElementById('bar').offsetHeight + 24;
    const isNarrow = width <= 720;
    // Panels stand in the upper right corner only: half their width is enough.
    const side = isNarrow ? 0.06 : Math.min(0.15, 145 / width);
    return { left: isNarrow ? 0.06 : 0.05, right: side, top: isNarrow ? Math.min(0.25, 130 / height) : 0.1, bottom: Math.min(0.4, bar / height) };
  }

  // -- choosing -------------------------------------------------------------------------------------------------------------------

  /** Who is drawn at a pixel of the window, or nearest to it; 0 for nobody. */
  whoIsAt(x, y) {
    const { layer, view, ratio } = this;
    if (!view) return 0;
    let [best, found] = [Infinity, 0];
    for (let i = 0; i < layer.shown.n; i++) {
      if (this.isHidden(i)) continue;
      const pixel = pixelOf(view, layer.placeIn(i));
      if (!pixel) continue;
      const radius = Math.max(12, 0.5 * this.pixelsOf(i, pixel[2]));
      const gap = Math.hypot(pixel[0] / ratio - x, pixel[1] / ratio - y);
      if (gap < radius && gap < best) [best, found] = [gap, layer.shown.id[i]];
    }
    return found;
  }

  /** Length of who is drawn, so far before the eye [pixels of the window]. */
  pixelsOf(slot, depth) {
    return this.scaleOf(slot) / (depth * this.view.perPixel * this.ratio);
  }

  scaleOf(slot) {
    return this.scale * this.page.blocks[this.layer.shown.block[slot]].scale;
  }

  get scale() {
    return this.page.scale * 1.5 ** this.drawn.scale;
  }

  placeAt(x, y) {
    return placeBehind(this.view, this.camera, x * this.ratio, y * this.ratio);
  }

  hover(id) {
    if (id === this.hovered) return;
    this.hovered = id;
    this.canvas.classList.toggle('is-over', id > 0);
    this.look();
  }

  /** A click chooses; one on who is chosen already follows it; one on nothing lets go, unless the camera follows. */
  click(x, y) {
    if (this.isPicking) return this.pickAt(x, y);
    const id = this.whoIsAt(x, y);
    if (id && id === this.chosen && !['follow', 'behind'].includes(this.camera.mode)) this.enter('follow');
    else if (id || !['follow', 'behind'].includes(this.camera.mode)) this.choose(id);
  }

  /** Begin, or end, to wait for a click on the ground. */
  pick(isPicking) {
    if (!this.source.isLive) return;
    this.isPicking = isPicking;
    this.canvas.classList.toggle('is-picking', isPicking);
    this.say(isPicking ? 'Click on the ground: plugins are told of it in the next step' : 'No point is picked');
  }

  /** Tell the plugins of the ground at a pixel of the window. */
  pickAt(x, y) {
    this.pick(false);
    const { eye } = this.view;
    const way = minus(placeBehind(this.view, this.camera, x * this.ratio, y * this.ratio), eye);
    const share = (this.page.scenery.ground - eye[2]) / way[2];
    if (!(share > 0) || share === Infinity) return this.say('There is no ground there');
    const pos = add(eye, scaled(way, share));
    this.order('point', { pos });
    return this.say(`Plugins are told of ${pos.map((c) => number(c, 1)).join(', ')} m`);
  }

  choose(id, mayMove = true) {
    if (this.chosen === id) return;
    const isFollowing = mayMove && ['follow', 'behind'].includes(this.camera.mode);
    this.chosen = id;
    this.order('choose', { id });
    if (isFollowing) this.enter(id ? this.camera.mode : 'free');
    this.look();
  }

  /** Let the camera be of a mode. Following begins near whom it follows. */
  enter(mode) {
    const { camera, layer } = this;
    const isFollowing = mode === 'follow' || mode === 'behind';
    if (isFollowing && !this.chosen) this.choose(this.neighbour(1), false);
    const slot = layer.slotOf(this.chosen);
    if (isFollowing && slot < 0) return;
    const wasFollowing = camera.mode === 'follow' || camera.mode === 'behind';
    if (isFollowing) camera.enter(mode, layer.placeIn(slot), this.headingOf(slot));
    else camera.enter(mode, [0, 0, 0], 0);
    if (isFollowing && !wasFollowing) {
      const near = Math.max(14 * this.scaleOf(slot), 0.004 * this.size);
      camera.wish.zoom = Math.min(camera.wish.zoom, Math.log(near));
      camera.wish.pitch = between(camera.wish.pitch, 0.12, 0.6);
    }
    // Behind it, its own turns are what is to be seen.
    if (mode === 'behind') camera.wish.zoom = Math.min(camera.wish.zoom, Math.log(25 * this.scaleOf(slot)));
    this.look();
  }

  /** Keep all in view, as seen from above or from the side. */
  overview(isTop) {
    const { wish } = this.camera;
    this.enter('overview');
    if (isTop) {
      // North is up.
      wish.yaw = wish.yaw + halfTurn(-Math.PI / 2 - wish.yaw);
      wish.pitch = STEEPEST;
    } else if (wish.pitch > STEEPEST - 0.01) {
      this.lookFromTheSide();
    }
  }

  lookFromTheSide() {
    const { wish } = this.camera;
    wish.yaw = wish.yaw + halfTurn(FIRST_YAW - wish.yaw);
    wish.pitch = FIRST_PITCH;
  }

  /** The view of the beginning. */
  reset() {
    this.choose(0);
    this.enter('overview');
    this.lookFromTheSide();
  }

  /** Follow, then behind, then free. */
  nextMode() {
    const next = { follow: 'behind', behind: 'free' }[this.camera.mode] || 'follow';
    this.enter(next);
    this.say({ follow: `Following ${this.layer.who(this.chosen)}`, behind: `Behind ${this.layer.who(this.chosen)}`, free: 'Free' }[this.camera.mode]);
  }

  nextTheme() {
    const themes = ['dark', 'light', ...(this.page.scenery.background ? ['mission'] : [])];
    this.setTheme(themes[(themes.indexOf(this.theme) + 1) % themes.length]);
  }

  /** What the user moves by hand is no overview any more. */
  leaveOverview() {
    if (this.camera.mode === 'overview') this.enter('free');
  }

  /** The next one who is there by its id, or the one before; 0 where nobody is. */
  neighbour(direction) {
    const { shown } = this.layer;
    const ids = Array.from({ length: shown.n }, (_, i) => i).filter((i) => !this.isHidden(i)).map((i) => shown.id[i]);
    ids.sort((a, b) => a - b);
    if (!ids.length) return 0;
    if (direction > 0) return ids.find((each) => each > this.chosen) ?? ids[0];
    return ids.findLast((each) => each < this.chosen) ?? ids[ids.length - 1];
  }

  jump(event) {
    this.clock.seek(event.t);
    this.say(`${event.t.toFixed(this.clock.decimals)} s: ${eventText(event, (id) => this.layer.who(id))}`);
    this.look();
  }

  // -- drawing --------------------------------------------------------------------------------------------------------------------

  setTheme(theme) {
    const { background } = this.page.scenery;
    this.theme = theme;
    const isLight = theme === 'mission' ? 0.3 * background[0] + 0.59 * background[1] + 0.11 * background[2] > 140 : theme === 'light';
    document.body.dataset.theme = isLight ? 'light' : 'dark';
    const own = theme === 'mission' ? background.map((c) => c / 255) : null;
    this.colours = { sky: own || styled('--sky'), ground: own || styled('--ground'), grid: styled('--grid') };
    // Dark colours are to be seen on a dark ground, and a bright ground is not to blind on it.
    Object.assign(this.colours, isLight ? { lightness: 1.15, bright: 1, trail: 0.7 } : { lightness: 0.75, bright: 1.25, trail: 0.9 });
    this.look();
  }

  draw() {
    const { gl, camera, canvas, scenery, drawn, clock } = this;
    this.anchor = scenery.anchor;
    const far = minus(camera.target, this.anchor);
    // 32 bits tell places 4 mm apart at 50 km from the anchor.
    if (norm(far) > 5e4) this.anchor = camera.target.map((c) => 1e4 * Math.round(c / 1e4));
    this.view = { ...camera.view(canvas.width, canvas.height, this.anchor), ratio: this.ratio };
    const { view } = this;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.disable(gl.BLEND);
    scenery.drawSky(this.colours);
    scenery.drawTerrain(view, this.colours, drawn.grid);
    this.entities.place(this.anchor, this.hidden, this.chosen);
    this.entities.draw(view, { scale: this.scale, least: drawn.least ? LEAST_SIZE * this.ratio : 0, isWire: drawn.wire, bright: this.colours.bright });
    if (drawn.shapes) {
      this.shapes.place(this.anchor);
      this.shapes.draw(view, scenery.line, false);
    }
    this.drawThrough(view);
    this.drawOver(view);
    this.panels.showTeams(clock.t);
    this.panels.showChosen(this.chosen, camera.mode, clock.t);
    this.events.update();
    this.events.tell(clock.t);
    clock.show();
    this.showButtons();
    this.drawnTime = clock.t;
  }

  /** Hand what is drawn, without the panels, to the reader as a PNG file. */
  savePicture() {
    const { canvas } = this;
    const picture = document.createElement('canvas');
    [picture.width, picture.height] = [canvas.width, canvas.height];
    const pen = picture.getContext('2d');
    // The canvas keeps what is drawn only until the browser has shown it.
    this.draw();
    pen.drawImage(canvas, 0, 0);
    pen.drawImage(this.overlay.canvas, 0, 0);
    picture.toBlob((blob) => {
      const link = element('a');
      link.href = URL.createObjectURL(blob);
      link.download = `${this.page.title.replace(/[^\p{L}\p{N}]+/gu, '-').slice(0, 60)}-${this.clock.t.toFixed(this.clock.decimals)}s.png`;
      link.click();
      URL.revokeObjectURL(link.href);
    });
  }

  /** What is seen through. */
  drawThrough(view) {
    const { gl, scenery, drawn } = this;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    if (drawn.grid) {
      scenery.drawGround(view, this.colours, this.camera);
      scenery.drawAxes(view);
    }
    this.trails.place(this.anchor, TRAIL_LENGTHS[drawn.trail], this.hidden, this.chosen);
    this.trails.lines.draw(scenery.line, view, 1.4 * this.ratio, this.colours.trail);
    if (drawn.rings || drawn.cones || drawn.links) this.reach.draw(view, scenery.line, this.layer, (slot) => this.isHidden(slot), drawn);
    if (drawn.shapes) this.shapes.draw(view, scenery.line, true);
    if (drawn.regions) scenery.drawRegions(view);
    gl.depthMask(true);
  }

  drawOver(view) {
    const { overlay, layer, drawn, scenery, clock } = this;
    const size = 12 * 1.15 ** drawn.text;
    overlay.begin(view, this.ratio);
    overlay.flashes(view, layer, clock.t, between(FLASH * clock.speed, 0.2, 20));
    const slot = this.chosen ? layer.slotOf(this.chosen) : -1;
    const pixel = slot >= 0 ? pixelOf(view, layer.placeIn(slot)) : null;
    if (pixel) overlay.ring(pixel[0], pixel[1], Math.max(15, 0.9 * this.pixelsOf(slot, pixel[2])), overlay.ink, 1.6, 0.9);
    overlay.labels(view, layer, this.hidden, {
      size, isOn: drawn.labels, first: [this.chosen, this.hovered], pixelsOf: (each, depth) => this.pixelsOf(each, depth),
    });
    if (drawn.shapes) {
      for (const [text, ...place] of this.shapes.header.texts) {
        const at = pixelOf(view, place);
        if (at) overlay.write(at[0], at[1], text, overlay.ink, size, { must: true, gap: 0 });
      }
    }
    if (drawn.regions) {
      for (const { name, colour, top } of scenery.regions) {
        const at = pixelOf(view, top);
        if (at) overlay.write(at[0], at[1], name, overlay.soft(colour), 12);
      }
    }
    if (drawn.grid && scenery.data.originLength > 0) {
      AXES.forEach(([name, colour], axis) => {
        const end = [0, 0, 0];
        end[axis] = scenery.data.originLength;
        const at = pixelOf(view, end);
        if (at) overlay.write(at[0] - 6 * this.ratio, at[1], name, overlay.soft(colour), 11);
      });
    }
    const { spacing, nearer } = scenery.cell(view);
    say(document.getElementById('scale'), drawn.grid ? `grid ${length(nearer > 0.4 ? spacing : 10 * spacing)}` : '');
  }

  showButtons() {
    const { camera, drawn } = this;
    const isTop = camera.wish.pitch > STEEPEST - 0.01;
    const isOn = { overview: camera.mode === 'overview' && !isTop, top: isTop, trails: drawn.trail > 0, labels: drawn.labels };
    for (const [name, state] of Object.entries(isOn)) {
      const button = document.querySelector(`#tools [data-do="${name}"]`);
      button.classList.toggle('is-on', state);
      button.setAttribute('aria-pressed', String(state));
    }
  }

  /** Say something for a moment. */
  say(text) {
    const box = document.getElementById('said');
    say(box, text);
    box.classList.add('is-shown');
    clearTimeout(this.saying);
    this.saying = setTimeout(() => box.classList.remove('is-shown'), 2600);
  }
}

/** Something that the page cannot do without; its message is for the reader. */
class Sorry extends Error {}

function sorry(text) {
  const box = document.getElementById('sorry');
  box.textContent = text;
  box.hidden = !text;
}

/** What others may see of the player; nothing of it can be changed. */
function publish(player) {
  const state = {
    get isReady() { return player.isReady; },
    get t() { return player.clock.t; },
    get frame() { return player.clock.frame; },
    /** Whether the page shows what is true now, and nothing moves by itself. */
    get isDrawn() { return !player.isChanged && player.drawnTime === player.clock.t; },
    get nFrames() { return player.page.nFrames; },
    get isPlaying() { return player.clock.isPlaying; },
    get speed() { return player.clock.speed; },
    get chosen() { return player.chosen; },
    get mode() { return player.camera.mode; },
    get camera() {
      const { target, distance, now, heading } = player.camera;
      return { target, distance, yaw: now.yaw + heading, pitch: now.pitch };
    },
    get drawn() { return { ...player.drawn, theme: player.theme, hidden: [...player.hidden] }; },
    get ids() { return [...player.layer.shown.id.subarray(0, player.layer.shown.n)]; },
    get events() { return structuredClone(player.events.marked); },
    get status() { return structuredClone(player.layer.status || null); },
    get shapes() { return player.shapes.header.parts.map(({ kind, n }) => [kind, n]); },
    get trailPoints() { return player.trails.lines.n; },
    /** Place of an entity [m], and its attitude (w, x, y, z); null where it is not there. */
    stateOf(id) {
      const slot = player.layer.slotOf(id);
      return slot < 0 ? null : { pos: player.layer.placeIn(slot), quat: [...player.layer.shown.quat.subarray(4 * slot, 4 * slot + 4)] };
    },
    /** Pixel of an entity in the window; null where it is not in view. */
    pixelOf(id) {
      const slot = player.layer.slotOf(id);
      const pixel = slot < 0 ? null : pixelOf(player.view, player.layer.placeIn(slot));
      return pixel && [pixel[0] / player.ratio, pixel[1] / player.ratio];
    },
  };
  Object.defineProperty(window, 'player', { value: Object.freeze(state) });
}

async function main() {
  try {
    const page = JSON.parse(document.getElementById('document').textContent);
    const player = new Player(page, SOURCES[page.source](page));
    publish(player);
    await player.start();
    sorry('');
  } catch (error) {
    sorry(error instanceof Sorry ? error.message : `This page cannot be shown: ${error.message}`);
    if (!(error instanceof Sorry)) throw error;
  }
}

main();
