// The player: puts the parts together and draws whenever something has changed.

/** Least size of a model [pixels], where none may be too small to see. */
const LEAST_SIZE = 18;
/** With no more entities than this, labels and short trails are shown from the start. */
const FEW = { labels: 30, trails: 500 };

class Player {
  constructor(page) {
    this.page = page;
    this.canvas = document.getElementById('view');
    this.gl = this.canvas.getContext('webgl2', { antialias: true, alpha: false, powerPreference: 'high-performance' });
    if (!this.gl) throw new Sorry('This page draws with WebGL 2, which this browser does not have or has turned off.');
    if (!window.DecompressionStream) throw new Sorry('This page unpacks its data with DecompressionStream, which this browser is too old to have.');
    const [low, high] = [page.scenery.low, page.scenery.high];
    this.size = Math.max(norm(minus(high, low)), 1);
    this.camera = new Camera(this.size);
    this.hidden = new Set();
    this.chosen = 0;
    this.hovered = 0;
    this.isChanged = true;
    this.isReady = false;
    this.isShown = false;
    this.drawn = { scale: 0, trail: 0, text: 0, labels: false, wire: false, least: true, grid: true, regions: true };
    this.isCalm = window.matchMedia('(prefers-reduced-motion: reduce)').matches;
    this.layers = page.layers.map((data) => new Layer(data, () => this.look(), (error) => sorry(`The data of this page is damaged: ${error.message}`)));
  }

  /** The recording whose time and entities the panels show. */
  get layer() {
    return this.layers[0];
  }

  async start() {
    const { gl, page } = this;
    await Promise.all(this.layers.map((layer) => layer.read()));
    const { layer } = this;
    this.scenery = new Scenery(gl, page.scenery, layer.data.teams, page.models);
    await this.scenery.readTerrain();
    this.entities = this.layers.map((each) => new Entities(gl, each, page.models));
    this.trails = this.layers.map((each) => new Trails(gl, each));
    this.overlay = new Overlay(document.getElementById('over'));
    this.clock = new Clock(layer);
    this.happenings = new Happenings(layer, (happening) => this.jump(happening));
    this.panels = new Panels(page, layer, this.hidden, () => this.look());
    this.steering = new Steering(this.canvas, this);
    this.drawn.labels = layer.mostAtOnce <= FEW.labels;
    this.drawn.trail = layer.mostAtOnce <= FEW.trails ? TRAIL_LENGTHS.indexOf(5) : 0;
    this.listen();
    this.setTheme(page.scenery.background ? 'mission' : window.matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark');
    this.lay();
    this.isReady = true;
    if (window.matchMedia('(hover: hover)').matches) this.say('h shows the keys');
    this.last = performance.now();
    requestAnimationFrame((now) => this.tick(now));
  }

  listen() {
    listen(actionsOf(this));
    fillHelp(document.querySelector('#help .columns'));
    listenToSettings(this);
    const { slider } = this.clock;
    slider.addEventListener('input', () => {
      this.clock.seek(Number(slider.value));
      this.look();
    });
    slider.addEventListener('change', () => slider.blur());
    new ResizeObserver(() => this.lay()).observe(document.body);
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
    this.happenings.draw();
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
      this.look();
    }
    this.isShown = this.layers.every((layer) => layer.show(this.clock.t));
    if (this.isShown) {
      this.follow();
      const isMoving = this.camera.step(seconds, this.isCalm);
      if (this.isChanged || isMoving) {
        this.isChanged = isMoving;
        this.draw();
      }
      if (this.clock.isPlaying) for (const layer of this.layers) layer.piece(layer.pieceOf(layer.shown.frame) + 1);
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

  fitAll() {
    const each = (see) => {
      for (const { shown, team } of this.layers) {
        for (let i = 0; i < shown.n; i++) {
          if (!this.hidden.has(team[shown.track[i]])) see(shown.x[i], shown.y[i], shown.z[i]);
        }
      }
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
      const track = layer.shown.track[i];
      if (this.hidden.has(layer.team[track])) continue;
      const pixel = pixelOf(view, layer.placeIn(i));
      if (!pixel) continue;
      const radius = Math.max(12, 0.5 * this.pixelsOf(track, pixel[2]));
      const gap = Math.hypot(pixel[0] / ratio - x, pixel[1] / ratio - y);
      if (gap < radius && gap < best) [best, found] = [gap, layer.id[track]];
    }
    return found;
  }

  /** Length of who is drawn, so far before the eye [pixels of the window]. */
  pixelsOf(track, depth) {
    return this.scaleOf(track) / (depth * this.view.perPixel * this.ratio);
  }

  scaleOf(track) {
    return this.scale * this.layer.data.blocks[this.layer.block[track]].scale;
  }

  get scale() {
    return 1.5 ** this.drawn.scale;
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
  click(id) {
    if (id && id === this.chosen && !['follow', 'behind'].includes(this.camera.mode)) this.enter('follow');
    else if (id || !['follow', 'behind'].includes(this.camera.mode)) this.choose(id);
  }

  choose(id) {
    if (this.chosen === id) return;
    const isFollowing = ['follow', 'behind'].includes(this.camera.mode);
    this.chosen = id;
    if (isFollowing) this.enter(id ? this.camera.mode : 'free');
    this.look();
  }

  /** Let the camera be of a mode. Following begins near whom it follows. */
  enter(mode) {
    const { camera, layer } = this;
    const isFollowing = mode === 'follow' || mode === 'behind';
    if (isFollowing && !this.chosen) this.chosen = this.neighbour(1);
    const slot = layer.slotOf(this.chosen);
    if (isFollowing && slot < 0) return;
    const wasFollowing = camera.mode === 'follow' || camera.mode === 'behind';
    if (isFollowing) camera.enter(mode, layer.placeIn(slot), this.headingOf(slot));
    else camera.enter(mode, [0, 0, 0], 0);
    if (isFollowing && !wasFollowing) {
      const near = Math.max(14 * this.scaleOf(layer.shown.track[slot]), 0.004 * this.size);
      camera.wish.zoom = Math.min(camera.wish.zoom, Math.log(near));
      camera.wish.pitch = between(camera.wish.pitch, 0.12, 0.6);
    }
    // Behind it, its own turns are what is to be seen.
    if (mode === 'behind') camera.wish.zoom = Math.min(camera.wish.zoom, Math.log(25 * this.scaleOf(layer.shown.track[slot])));
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
    const { shown, id, team } = this.layer;
    const ids = Array.from({ length: shown.n }, (_, i) => shown.track[i]).filter((k) => !this.hidden.has(team[k])).map((k) => id[k]);
    ids.sort((a, b) => a - b);
    if (!ids.length) return 0;
    if (direction > 0) return ids.find((each) => each > this.chosen) ?? ids[0];
    return ids.findLast((each) => each < this.chosen) ?? ids[ids.length - 1];
  }

  jump(happening) {
    this.clock.seek(happening.t);
    this.say(`${happening.t.toFixed(this.clock.decimals)} s: ${told(happening, (id) => this.layer.who(id))}`);
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
    this.entities.forEach((entities) => {
      entities.place(this.anchor, this.hidden, this.chosen);
      entities.draw(view, { scale: this.scale, least: drawn.least ? LEAST_SIZE * this.ratio : 0, isWire: drawn.wire, bright: this.colours.bright });
    });
    this.drawThrough(view);
    this.drawOver(view);
    this.panels.showTeams(clock.t);
    this.panels.showChosen(this.chosen, camera.mode, clock.t);
    this.happenings.tell(clock.t);
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
    this.trails.forEach((trails, i) => {
      trails.place(this.anchor, TRAIL_LENGTHS[drawn.trail], this.hidden, this.chosen, this.entities[i].colourOf);
      trails.lines.draw(scenery.line, view, 1.4 * this.ratio, this.colours.trail);
    });
    if (drawn.regions) scenery.drawRegions(view);
    gl.depthMask(true);
  }

  drawOver(view) {
    const { overlay, layer, drawn, scenery, clock } = this;
    const size = 12 * 1.15 ** drawn.text;
    overlay.begin(view, this.ratio);
    overlay.flashes(view, layer, clock.t, Math.max(FLASH * clock.speed, 0.2));
    const slot = this.chosen ? layer.slotOf(this.chosen) : -1;
    const pixel = slot >= 0 ? pixelOf(view, layer.placeIn(slot)) : null;
    if (pixel) overlay.ring(pixel[0], pixel[1], Math.max(15, 0.9 * this.pixelsOf(layer.shown.track[slot], pixel[2])), overlay.ink, 1.6, 0.9);
    overlay.labels(view, layer, this.hidden, {
      size, isOn: drawn.labels, first: [this.chosen, this.hovered], pixelsOf: (track, depth) => this.pixelsOf(track, depth),
    });
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
    get nFrames() { return player.layer.data.nFrames; },
    get isPlaying() { return player.clock.isPlaying; },
    get speed() { return player.clock.speed; },
    get chosen() { return player.chosen; },
    get mode() { return player.camera.mode; },
    get camera() {
      const { target, distance, now, heading } = player.camera;
      return { target, distance, yaw: now.yaw + heading, pitch: now.pitch };
    },
    get drawn() { return { ...player.drawn, theme: player.theme, hidden: [...player.hidden] }; },
    get ids() { return Array.from(player.layer.shown.track.subarray(0, player.layer.shown.n), (k) => player.layer.id[k]); },
    get happenings() { return structuredClone(player.happenings.marked); },
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
    const player = new Player(JSON.parse(document.getElementById('document').textContent));
    publish(player);
    await player.start();
    sorry('');
  } catch (error) {
    sorry(error instanceof Sorry ? error.message : `This page cannot be shown: ${error.message}`);
    if (!(error instanceof Sorry)) throw error;
  }
}

main();
