// The picture: all that is drawn in the window behind the panels.
/** @import { View } from './types' */
/** @import { Player } from './player.js' */

import { byId, element, length, parseColour, say, styled } from './formatting.js';
import { add, between, minus, norm, scaled } from './geometry.js';
import { geodeticOf, sidesOf } from './geodesy.js';
import { pixelOf, placeBehind } from './camera.js';
import { PlainRenderer } from './plain.js';
import { Renderer } from './renderer.js';
import { Entities } from './models.js';
import { Trails, TRAIL_LENGTHS } from './trails.js';
import { Scenery } from './scenery.js';
import { Shapes } from './shapes.js';
import { Reach } from './reach.js';
import { FLASH, Overlay } from './overlay.js';

/** Least size of a model [pixels], where none may be too small to see. */
const MIN_SIZE = 18;
/** Distance from the anchor above which another is taken [m]: 32 bits tell places 4 mm apart there. */
const MAX_DISTANCE = 5e4;

export class Picture {
  /** @param {Player} player @param {boolean} isPlain a map, seen from above, that needs no WebGL */
  constructor(player, isPlain) {
    const { page, layer, gl } = player;
    this.player = player;
    const renderer = isPlain ? new PlainRenderer(byId('plain', HTMLCanvasElement), page.models.sphere) : new Renderer(gl);
    this.renderer = renderer;
    this.canvas = renderer.canvas;
    this.scenery = new Scenery(renderer, page);
    this.shapes = new Shapes(renderer, page.models.sphere);
    this.entities = new Entities(renderer, layer, page);
    this.trails = new Trails(renderer, layer);
    this.reach = new Reach(renderer, layer);
    this.overlay = new Overlay(byId('over', HTMLCanvasElement));
    this.ratio = 1;
    this.isHalf = false;
    /** @type {View | null} */
    this.view = null;
    /** Pixel of the window that the pointer is at. @type {number[] | null} */
    this.pointer = null;
    this.setTheme(player.picture ? player.picture.theme : page.scenery.background ? 'mission' : window.matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark');
  }

  /** Fit it to the window. @param {boolean} isHalf half as many pixels each way, where they are slow */
  resize(isHalf = this.isHalf) {
    const { canvas } = this;
    this.isHalf = isHalf;
    this.ratio = Math.min(window.devicePixelRatio || 1, 2) * (isHalf ? 0.5 : 1);
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * this.ratio));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * this.ratio));
  }

  /** @param {string} theme */
  setTheme(theme) {
    const { background } = this.player.page.scenery;
    const own = theme === 'mission' ? background : null;
    const isLight = own ? 0.3 * own[0] + 0.59 * own[1] + 0.11 * own[2] > 140 : theme === 'light';
    this.theme = theme;
    document.body.dataset.theme = isLight ? 'light' : 'dark';
    const [sky, ground, grid] = ['--sky', '--ground', '--grid'].map((name) => parseColour(styled(name)));
    const share = (/** @type {number[]} */ colour) => scaled(colour, 1 / 255);
    this.colours = { sky: share(own || sky), ground: share(own || ground), grid: share(grid) };
    // Dark colours are to be seen on a dark ground, and a bright ground is not to blind on it.
    this.look = isLight ? { lightness: 1.15, bright: 1, trail: 0.7 } : { lightness: 0.75, bright: 1.25, trail: 0.9 };
    this.player.look();
  }

  nextTheme() {
    const themes = ['dark', 'light', ...(this.player.page.scenery.background ? ['mission'] : [])];
    this.setTheme(themes[(themes.indexOf(this.theme) + 1) % themes.length]);
  }

  get isPlain() {
    return this.renderer instanceof PlainRenderer;
  }

  // -- where things are -----------------------------------------------------------------------------------------------------------

  /** The entity that is drawn at a pixel of the window, or nearest to it; 0 for none. @param {number} x @param {number} y */
  whoIsAt(x, y) {
    const { layer } = this.player;
    let [best, found] = [Infinity, 0];
    for (const slot of this.view ? this.slots() : []) {
      const pixel = pixelOf(this.view, layer.placeIn(slot));
      if (!pixel) continue;
      const gap = Math.hypot(pixel[0] / this.ratio - x, pixel[1] / this.ratio - y);
      if (gap < best && gap < Math.max(12, 0.5 * this.pixelsOf(slot, pixel[2]))) [best, found] = [gap, layer.shown.id[slot]];
    }
    return found;
  }

  /** Slots of the entities that are not hidden. */
  slots() {
    return Array.from({ length: this.player.layer.shown.n }, (_, i) => i).filter((slot) => !this.player.isHidden(slot));
  }

  get scale() {
    return this.player.page.scale * 1.5 ** this.player.drawn.scale;
  }

  /** Length of an entity [m]. @param {number} slot */
  sizeOf(slot) {
    return this.scale * Math.max(...this.player.page.blocks[this.player.layer.shown.block[slot]].lengths);
  }

  /** Length of an entity so far before the eye [pixels of the window]. @param {number} slot @param {number} depth */
  pixelsOf(slot, depth) {
    return this.sizeOf(slot) / (depth * this.view.perPixel * this.ratio);
  }

  /** The place behind a pixel of the window. @param {number} x @param {number} y */
  placeAt(x, y) {
    return placeBehind(this.view, this.player.camera, x * this.ratio, y * this.ratio);
  }

  /** The place of the ground at a pixel of the window; null where there is none. @param {number} x @param {number} y */
  groundAt(x, y) {
    const { eye } = this.view;
    if (this.isPlain) return [...this.placeAt(x, y).slice(0, 2), this.scenery.data.ground];
    const way = minus(this.placeAt(x, y), eye);
    const share = (this.scenery.data.ground - eye[2]) / way[2];
    return share > 0 && share < Infinity ? add(eye, scaled(way, share)) : null;
  }

  /** The pointer has moved to a pixel of the window, or away from it. @param {number[] | null} pixel */
  pointAt(pixel) {
    this.pointer = pixel;
    this.showPointer();
  }

  /** Say where on Earth the ground at the pointer is. */
  showPointer() {
    const { origin } = this.scenery.data;
    const place = origin && this.pointer && this.view && this.groundAt(this.pointer[0], this.pointer[1]);
    const geodetic = place && geodeticOf(origin, place);
    say(byId('pointer'), geodetic ? sidesOf(geodetic).join(', ') : '');
  }

  // -- drawing --------------------------------------------------------------------------------------------------------------------

  draw() {
    const { camera, drawn, hidden, chosen } = this.player;
    const { canvas, renderer, scenery } = this;
    const isFar = norm(minus(camera.target, scenery.anchor)) > MAX_DISTANCE;
    const anchor = isFar ? camera.target.map((c) => 1e4 * Math.round(c / 1e4)) : scenery.anchor;
    const view = camera.view(canvas.width, canvas.height, this.ratio, anchor);
    this.view = view;
    renderer.begin();
    scenery.drawSky(this.colours);
    scenery.drawTerrain(view, this.look, drawn.grid);
    if (drawn.shapes) this.shapes.place(anchor);
    if (this.isPlain) this.drawThrough(view);
    this.entities.place(view, this.scale, hidden, chosen);
    this.entities.draw(view, { scale: this.scale, least: drawn.least ? MIN_SIZE : 0, bright: this.look.bright }, drawn.wire);
    if (drawn.shapes) this.shapes.draw(view, false);
    if (!this.isPlain) this.drawThrough(view);
    this.drawOver(view);
  }

  /** Draw what is seen through. @param {View} view */
  drawThrough(view) {
    const { drawn, hidden, chosen, camera } = this.player;
    this.renderer.seeThrough(true);
    if (drawn.grid) this.scenery.drawGround(view, this.colours, camera.target);
    this.trails.place(view.anchor, TRAIL_LENGTHS[drawn.trail], hidden, chosen);
    this.trails.draw(view, 1.4, this.look.trail);
    if (drawn.rings || drawn.cones || drawn.links) this.reach.draw(view, this.slots(), drawn);
    if (drawn.shapes) this.shapes.draw(view, true);
    if (drawn.regions) this.scenery.drawRegions(view);
    this.renderer.seeThrough(false);
  }

  /** Draw texts, rings and flashes. @param {View} view */
  drawOver(view) {
    const { overlay, scenery } = this;
    const { layer, drawn, clock, chosen, hovered } = this.player;
    const size = 12 * 1.15 ** drawn.text;
    overlay.begin(view, this.isHalf ? 2 : 1);
    overlay.flashes(view, layer, clock.t, between(FLASH * clock.speed, 0.2, 20));
    const slot = chosen ? layer.slotOf(chosen) : -1;
    const pixel = slot >= 0 ? pixelOf(view, layer.placeIn(slot)) : null;
    if (pixel) overlay.ring(pixel[0], pixel[1], Math.max(15, 0.9 * this.pixelsOf(slot, pixel[2])), overlay.ink, 1.6, 0.9);
    const first = [chosen, hovered].map((id) => (id ? layer.slotOf(id) : -1)).filter((each) => each >= 0);
    overlay.labels(view, layer, first, drawn.labels ? this.slots() : [], size, (each, depth) => this.pixelsOf(each, depth));
    for (const [text, ...place] of drawn.shapes ? this.shapes.header.texts : []) overlay.writeAt(view, place, text, overlay.ink, size, { must: true, gap: 0 });
    for (const { name, colour, top } of drawn.names && drawn.regions ? [...scenery.bases, ...scenery.regions] : []) overlay.writeAt(view, top, name, overlay.soft(colour), 12);
    for (const { name, colour, end } of drawn.grid ? scenery.ends : []) overlay.writeAt(view, end, name, overlay.soft(colour), 11, { gap: 3 });
    for (const [text, place] of this.player.page.signs || []) overlay.writeAt(view, place, text, overlay.ink, 16, { must: true, gap: 0 });
    const { spacing, nearer } = scenery.cell(view);
    const where = scenery.data.hasGround ? '' : ', no ground';
    this.showPointer();
    say(byId('scale'), drawn.grid ? `grid ${length(nearer > 0.4 ? spacing : 10 * spacing)}${where}` : '');
  }

  /** Hand the picture, without the panels, to the reader as a PNG file. */
  save() {
    const { canvas, player: { page, clock } } = this;
    this.resize(false);
    const picture = element('canvas');
    [picture.width, picture.height] = [canvas.width, canvas.height];
    const pen = picture.getContext('2d');
    // The canvas keeps what is drawn only until the browser has shown it.
    this.draw();
    pen.drawImage(canvas, 0, 0);
    pen.drawImage(this.overlay.canvas, 0, 0);
    picture.toBlob((blob) => {
      const link = element('a');
      link.href = URL.createObjectURL(blob);
      link.download = `${page.title.replace(/[^\p{L}\p{N}]+/gu, '-').slice(0, 60)}-${clock.t.toFixed(clock.decimals)}s.png`;
      link.click();
      URL.revokeObjectURL(link.href);
    });
  }
}
