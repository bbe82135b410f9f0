// The player: puts the parts of the page together and draws whenever something has changed.
/** @import { Drawn, GameEvent, PageData, Source, Status } from './types' */

import { byId, eventText, field, number, say } from './formatting.js';
import { minus, norm } from './geometry.js';
import { Recorded } from './recorded.js';
import { Live } from './live.js';
import { Camera, STEEPEST } from './camera.js';
import { Picture } from './picture.js';
import { isDrawnSlowly } from './renderer.js';
import { TRAIL_LENGTHS, TRAIL_OF_CHOSEN } from './trails.js';
import { EventLine } from './events.js';
import { LiveClock, RecordedClock } from './timeline.js';
import { Panels } from './panels.js';
import { MessagePanel } from './feed.js';
import { AlarmPanel } from './alarms.js';
import { Drive } from './drive.js';
import { OrderForm } from './orders.js';
import { QuantityPanel } from './quantities.js';
import { Steering } from './steering.js';
import { Viewpoint } from './viewpoint.js';
import { fillHelp, listen } from './keys.js';
import { actionsOf, listenToSettings } from './actions.js';

/** As far as it is looked back for the longest trails [s]. */
const LONGEST_LOOK = 1e8;
/** Frames per second below which 3D is slow. */
const MIN_RATE = 8;
/** Time over which drawn frames are counted [ms]. */
const RATE_SPAN = 4000;
/** Least time between two looks back for the trails [ms]. */
const LOOK_PERIOD = 2000;
/** With no more entities than this, labels and short trails are shown from the start. */
const FEW = { labels: 30, trails: 500 };

export class Player {
  /** @param {PageData} page @param {Source} source @param {(text: string) => void} sorry shows a text in place of the page */
  constructor(page, source, sorry) {
    this.page = page;
    this.source = source;
    this.sorry = sorry;
    this.canvas = byId('view', HTMLCanvasElement);
    /** It is drawn without a graphics card. */
    this.isSlow = isDrawnSlowly();
    document.body.dataset.drawn = this.isSlow ? 'slowly' : '';
    this.gl = this.canvas.getContext('webgl2', { antialias: !this.isSlow, alpha: false, powerPreference: 'high-performance' });
    if (!this.gl && !byId('plain', HTMLCanvasElement).getContext('2d', { alpha: false })) throw new Sorry('This page draws with WebGL 2 or on a 2D canvas, and this browser has neither.');
    if (!window.DecompressionStream) throw new Sorry('This page unpacks its data with DecompressionStream, which this browser is too old to have.');
    const size = Math.max(norm(minus(page.scenery.high, page.scenery.low)), 1);
    const reach = Number((page.reach || 0.05 * size).toPrecision(3));
    /** Teams that are hidden. @type {Set<number>} */
    this.hidden = new Set();
    this.chosen = 0;
    this.hovered = 0;
    this.isChanged = true;
    /** There is news that only the panels show. */
    this.isTold = false;
    this.isReady = false;
    this.isShown = false;
    this.isPicking = false;
    this.isLost = false;
    /** What takes a picked point. @type {((pos: number[]) => void) | null} */
    this.takePoint = null;
    /** What takes a line that is drawn. @type {((line: number[][]) => void) | null} */
    this.takeStroke = null;
    /** Places of this line so far. @type {number[][]} */
    this.stroke = [];
    this.lookedBack = 0;
    /** @type {number | undefined} */
    this.looking = undefined;
    this.drawnTime = NaN;
    this.nDrawn = 0;
    /** Shapes of a recording that are drawn. @type {ReturnType<Recorded['shapesShown']>} */
    this.shapes = null;
    /** @type {Drawn} */
    this.drawn = {
      scale: 0, trail: 0, text: 0, labels: false, names: true, wire: false, least: true, grid: true, regions: true, shapes: true, rings: false,
      cones: false, links: false, ringRadius: reach, coneRange: reach, coneAngle: 60, linkRange: reach,
    };
    this.isCalm = window.matchMedia('(prefers-reduced-motion: reduce)').matches;
    const failed = (/** @type {Error} */ error) => sorry(`The data of this page is missing or damaged: ${error.message}`);
    this.layer = source.isLive ? new Live(page, () => this.look()) : new Recorded(page, source, () => this.look(), failed);
    /** @type {number[]} */
    this.drawTimes = [];
    this.camera = new Camera(size);
    /** Of 3D and of the plain map, each from when it is first shown. @type {Picture[]} */
    this.pictures = [];
    this.camera.isPlain = !this.gl;
    byId('plain').hidden = Boolean(this.gl);
    this.picture = this.pictures[Number(!this.gl)] = new Picture(this, !this.gl);
    this.isMeasured = !this.gl;
    this.viewpoint = new Viewpoint(this);
  }

  async start() {
    const { page, layer, source, drawn } = this;
    await this.picture.scenery.read(source);
    if (layer instanceof Live) await this.join(layer);
    else await layer.read();
    this.clock = layer instanceof Live ? new LiveClock(layer, source) : new RecordedClock(layer, page);
    this.events = new EventLine(layer, this.clock, (event) => this.jump(event));
    this.panels = new Panels(page, layer, this.hidden, () => this.look());
    this.orders = new OrderForm(this);
    this.drive = new Drive(this);
    this.feed = new MessagePanel(this);
    this.alarms = new AlarmPanel(this);
    this.quantities = new QuantityPanel(this);
    this.steering = new Steering(this.canvas, this);
    drawn.labels = layer.mostAtOnce <= FEW.labels;
    drawn.trail = page.hasTrails || layer.mostAtOnce <= FEW.trails ? TRAIL_LENGTHS.indexOf(page.hasTrails ? 10 : 5) : 0;
    this.listen();
    this.resize();
    this.viewpoint.open();
    this.lookBack();
    this.isReady = true;
    const slow = this.gl ? 'Drawn without a graphics card: coarser while it moves; 2 draws a plain map' : 'A plain map: this browser has no WebGL, which 3D needs';
    const hints = [this.isSlow && slow, window.matchMedia('(hover: hover)').matches && 'h shows the keys'];
    this.say(hints.filter(Boolean).join(' · '));
    this.last = performance.now();
    requestAnimationFrame((now) => this.tick(now));
  }

  /** Watch a live game; resolved when there is something to be shown. @param {Live} layer @returns {Promise<void>} */
  join(layer) {
    byId('game').hidden = false;
    field('seed').value = String(this.page.seed);
    field('loop').parentElement.hidden = true;
    return new Promise((done) => {
      const resolve = () => { if (layer.status && layer.show()) done(); };
      this.source.connect({
        status: (status) => {
          layer.takeStatus(status);
          if (this.isReady) this.takeStatus(status);
          resolve();
        },
        frame: (header, bytes) => {
          const isJump = header.epoch !== layer.epoch && layer.epoch >= 0;
          const before = layer.newest.t;
          layer.takeFrame(header, bytes);
          // Of a game that is faster than frames are sent, most of a trail is not seen.
          const isSparse = layer.newest.t - before > 0.1 * TRAIL_LENGTHS[this.drawn.trail];
          if (isJump) this.lookBack();
          else if (isSparse) this.lookBackSoon();
          resolve();
        },
        curves: (message) => layer.takeCurves(message),
        past: (header, bytes) => layer.takePast(header, bytes),
        drawn: (header, bytes) => {
          this.picture.shapes.take(header, bytes);
          this.look();
        },
        lost: () => {
          this.isLost = true;
          if (this.isReady) this.panels.notice('The game is no longer served: this is what was seen last', true);
          else this.sorry('The game is not served: the address may be an old one, or too many browsers watch.');
        },
      });
    });
  }

  /** @param {Status} status */
  takeStatus(status) {
    if (!this.isLost) this.panels.showStatus(status, this.drawRate);
    if (status.isDriveRefused) this.drive.release();
    if (status.refusal) this.say(status.refusal);
    this.isTold = true;
  }

  /** Send a command to a live game; a recording takes none. @param {string} command */
  order(command, fields = {}) {
    this.source.send?.(command, fields);
  }

  /** Ask a live game for what was seen before, where trails are to be drawn. */
  lookBack() {
    this.lookedBack = performance.now();
    const seconds = TRAIL_LENGTHS[this.drawn.trail] || TRAIL_OF_CHOSEN;
    this.order('history', { seconds: Math.min(seconds, LONGEST_LOOK) });
  }

  /** Look back once `LOOK_PERIOD` is over. */
  lookBackSoon() {
    this.looking ??= setTimeout(() => {
      this.looking = undefined;
      this.lookBack();
    }, LOOK_PERIOD - (performance.now() - this.lookedBack));
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
    const sizes = new ResizeObserver(() => this.resize());
    for (const node of [document.body, byId('head'), byId('bar')]) sizes.observe(node);
    this.canvas.addEventListener('webglcontextlost', (event) => {
      event.preventDefault();
      this.gl = null;
      this.drawPlain(true);
      this.say('A plain map: the graphics card has dropped this page. Loading it again brings 3D back');
    });
  }

  /** Fit everything to the window. */
  resize() {
    const { style } = document.documentElement;
    this.picture.resize();
    style.setProperty('--bar', `${byId('bar').offsetHeight}px`);
    style.setProperty('--head', `${byId('head').offsetHeight}px`);
    this.events.draw();
    this.look();
  }

  /** Draw as a plain map, or in 3D. @param {boolean} isPlain */
  async drawPlain(isPlain) {
    if (!isPlain && !this.gl) return this.say('3D needs WebGL 2, which this browser does not have or has turned off');
    const before = this.picture;
    if (before.isPlain === isPlain) return undefined;
    let next = this.pictures[Number(isPlain)];
    if (!next) {
      next = this.pictures[Number(isPlain)] = new Picture(this, isPlain);
      await next.scenery.read(this.source);
    }
    next.shapes.take(before.shapes.header, new Uint8Array(before.shapes.data.buffer));
    if (next.theme !== before.theme) next.setTheme(before.theme);
    this.picture = next;
    this.camera.isPlain = isPlain;
    byId('plain').hidden = !isPlain;
    this.resize();
    return undefined;
  }

  /** Draw as a plain map where 3D is slow. The quickest of three pictures counts, and reading a pixel waits for it. */
  measure() {
    this.isMeasured = true;
    this.picture.resize(this.isSlow);
    const times = [0, 1, 2].map(() => {
      const begin = performance.now();
      this.picture.draw();
      this.gl.readPixels(0, 0, 1, 1, this.gl.RGBA, this.gl.UNSIGNED_BYTE, new Uint8Array(4));
      return performance.now() - begin;
    });
    const rate = 1000 / Math.min(...times);
    if (rate >= MIN_RATE) return;
    this.drawPlain(true);
    this.say(`A plain map: this browser draws 3D at ${rate.toPrecision(2)} frames/s (2 switches)`);
  }

  /** Draw with half the pixels each way, or with all again. @param {boolean} isHalf */
  refine(isHalf) {
    this.picture.resize(isHalf);
    this.look();
  }

  /** Draw again. */
  look() {
    this.isChanged = true;
  }

  /** @param {number} now [ms] */
  tick(now) {
    // A tab that was in the background does not make up for it.
    const seconds = Math.min((now - this.last) / 1000, 1);
    this.last = now;
    this.drive.update();
    // Time waits for what has to be unpacked.
    if (this.isShown) {
      if (this.clock.isPlaying && !this.source.isLive) this.look();
      this.clock.advance(seconds);
    }
    this.isShown = this.layer.show(this.clock.t);
    if (this.isShown) {
      this.viewpoint.update();
      const isMoving = this.camera.step(seconds, this.isCalm);
      if (!this.isMeasured) this.measure();
      const isHalf = this.isSlow && !this.picture.isPlain && (isMoving || this.clock.isPlaying);
      if (isHalf !== this.picture.isHalf) this.refine(isHalf);
      if (this.isChanged || isMoving) {
        this.isChanged = isMoving;
        this.draw();
      } else if (this.isTold) this.showPanels();
      if (this.clock.isPlaying) this.layer.lookAhead();
    }
    requestAnimationFrame((next) => this.tick(next));
  }

  /** Frames drawn per second, over the last seconds. */
  get drawRate() {
    const now = performance.now();
    this.drawTimes = this.drawTimes.filter((time) => now - time < RATE_SPAN);
    return this.drawTimes.length / (RATE_SPAN / 1000);
  }

  draw() {
    const { clock, layer } = this;
    this.nDrawn++;
    this.drawTimes.push(performance.now());
    const shapes = layer instanceof Recorded ? layer.shapesShown() : null;
    if (shapes && shapes !== this.shapes) {
      this.shapes = shapes;
      this.picture.shapes.take(shapes.header, shapes.bytes);
      if (shapes.header.notes.length) this.panels.showNotes([...new Set([...this.page.notes, ...shapes.header.notes])]);
    }
    this.picture.draw();
    this.showPanels();
    this.drawnTime = clock.t;
  }

  /** Show in the panels what is true now. */
  showPanels() {
    const { clock } = this;
    this.isTold = false;
    this.panels.showTeams(clock.t);
    this.panels.showChosen(this.chosen, this.camera.mode, clock.t);
    this.orders.show();
    this.drive.show();
    this.feed.show();
    this.alarms.show();
    this.quantities.show(clock.t);
    this.events.update(clock.t);
    clock.show(clock.t, clock.isPlaying, clock.speed);
    this.showButtons();
  }

  showButtons() {
    const { camera, drawn } = this;
    const isTop = camera.goal.pitch > STEEPEST - 0.01;
    const isOn = { overview: camera.mode === 'overview' && !isTop, top: isTop, trails: drawn.trail > 0, labels: drawn.labels };
    for (const [name, state] of Object.entries(isOn)) {
      const button = document.querySelector(`#tools [data-do="${name}"]`);
      button.classList.toggle('is-on', state);
      button.setAttribute('aria-pressed', String(state));
    }
  }

  /** Show a text for a moment. @param {string} text */
  say(text) {
    const box = byId('said');
    say(box, text);
    box.classList.add('is-shown');
    clearTimeout(this.saying);
    this.saying = setTimeout(() => box.classList.remove('is-shown'), 2600);
  }

  /** @param {number} slot */
  isHidden(slot) {
    return this.hidden.has(this.layer.shown.team[slot]);
  }

  /** @param {number} id */
  hover(id) {
    if (id === this.hovered) return;
    this.hovered = id;
    this.canvas.classList.toggle('is-over', id > 0);
    this.look();
  }

  /** A click chooses; one on the chosen entity follows it; one on nothing lets go, unless the camera follows. @param {number} x @param {number} y */
  click(x, y) {
    if (this.isPicking) return this.pickAt(x, y);
    const id = this.picture.whoIsAt(x, y);
    const { isFollowing } = this.camera;
    if (id && id === this.chosen && !isFollowing) this.viewpoint.enter('follow');
    else if (id || !isFollowing) this.choose(id);
    return undefined;
  }

  /** Choose an entity, or nobody (0). @param {number} id @param {boolean} mayMove the camera follows it, where it followed another */
  choose(id, mayMove = true) {
    if (this.chosen === id) return;
    const { mode, isFollowing } = this.camera;
    this.chosen = id;
    this.order('choose', { id });
    if (mayMove && isFollowing) this.viewpoint.enter(id ? mode : 'free');
    this.look();
  }

  /** Begin, or end, to wait for a click on the ground. @param {boolean} isPicking @param {((pos: number[]) => void) | null} take takes the point; by default plugins are told of it */
  pick(isPicking, take = null) {
    if (!this.source.isLive) return;
    this.isPicking = isPicking;
    this.takePoint = take;
    this.takeStroke = null;
    this.stroke = [];
    this.canvas.classList.toggle('is-picking', isPicking);
    this.say(isPicking ? `Click on the ground${take ? '' : ': plugins are told of it in the next step'}` : 'No point is picked');
  }

  /** Wait for a line that is drawn on the ground in one stroke. @param {(line: number[][]) => void} take takes its places */
  pickStroke(take) {
    if (!this.source.isLive) return;
    this.pick(true);
    this.takeStroke = take;
    this.say('Draw a line on the ground, with the button held');
  }

  get isStroke() {
    return Boolean(this.takeStroke);
  }

  /** The stroke goes on to a pixel of the window. @param {number} x @param {number} y */
  drawTo(x, y) {
    const pos = this.picture.groundAt(x, y);
    if (pos) this.stroke.push(pos);
  }

  endStroke() {
    const { takeStroke: take, stroke } = this;
    this.pick(false);
    if (stroke.length > 1) take(stroke);
    this.say(stroke.length > 1 ? 'The line is in the form' : 'No line is drawn');
  }

  /** Tell the plugins, or who waits for it, of the ground at a pixel of the window. @param {number} x @param {number} y */
  pickAt(x, y) {
    const take = this.takePoint;
    this.pick(false);
    const pos = this.picture.groundAt(x, y);
    const text = pos?.map((c) => number(c, 1)).join(', ');
    if (pos && take) take(pos);
    else if (pos) this.order('point', { pos });
    this.say(!pos ? 'There is no ground there' : take ? `${text} m` : `Plugins are told of ${text} m`);
  }

  /** @param {GameEvent} event */
  jump(event) {
    this.clock.seek(event.t);
    this.tell(event);
    this.look();
  }

  /** Say what happened, and when. @param {GameEvent} event */
  tell(event) {
    this.say(`${event.t.toFixed(this.clock.decimals)} s: ${eventText(event, (id) => this.layer.who(id))}`);
  }
}

/** Something that the page cannot do without; its message is for the reader. */
export class Sorry extends Error {}
