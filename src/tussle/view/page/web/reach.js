// How far entities reach: rings, cones, and links between those in reach of each other.
/** @import { Drawn, FieldOfView, View } from './types' */

import { add, between, minus, rotated, turned } from './geometry.js';
import { Layer } from './layer.js';
import { circle, Lines } from './lines.js';
import { LEVEL, Model } from './models.js';
import { PlainRenderer } from './plain.js';
import { Renderer } from './renderer.js';

/** Lines between entities; of more, the shortest are drawn. */
const MAX_LINKS = 5000;
/** Pairs in reach that are looked at. */
const MAX_PAIRS = 400000;
const SIDES = 40;

export class Reach {
  /** @param {Renderer | PlainRenderer} renderer @param {Layer} layer */
  constructor(renderer, layer) {
    this.renderer = renderer;
    this.layer = layer;
    this.lines = new Lines(renderer);
    this.links = new Lines(renderer);
    /** Angles -> their model. @type {Map<string, Model>} */
    this.cones = new Map();
  }

  /** @param {View} view @param {number[]} slots @param {Drawn} drawn */
  draw(view, slots, drawn) {
    const { lines, layer } = this;
    const { shown } = layer;
    lines.begin(view.anchor);
    for (const slot of drawn.rings ? slots : []) {
      const colour = layer.colourOf(slot);
      circle(shown.placeIn(slot), drawn.ringRadius, SIDES).forEach((place, i) => lines.add(place, 0, colour, i < SIDES));
    }
    lines.upload();
    lines.draw(view, 1.2, 0.75);
    const links = drawn.links ? pairsWithin(slots.map((slot) => shown.placeIn(slot)), drawn.linkRange) : [];
    this.links.begin(view.anchor);
    for (const [a, b] of links) this.links.segment(a, b, [90, 160, 190]);
    this.links.upload();
    this.links.draw(view, 1, linkOpacity(links.length));
    if (drawn.cones) this.drawCones(view, slots, drawn);
  }

  /** Draw what plugins see, or cones by the settings where no plugin says so. @param {View} view @param {number[]} slots @param {Drawn} drawn */
  drawCones(view, slots, { coneAngle, coneRange }) {
    const { shown } = this.layer;
    const { blocks } = this.layer.page;
    /** @type {FieldOfView[]} */
    const byHand = [{ plugin: '', azimuth: coneAngle, elevation: null, range: coneRange, pos: [0, 0, 0], quat: LEVEL }];
    const isByHand = !blocks.some(({ views }) => views.length);
    for (const model of this.cones.values()) model.n = 0;
    for (const slot of slots) {
      const own = shown.quat.subarray(4 * slot, 4 * slot + 4);
      for (const { azimuth, elevation, range, pos, quat } of isByHand ? byHand : blocks[shown.block[slot]].views) {
        const [x, y, z] = add(minus(this.layer.placeIn(slot), view.anchor), rotated(own, pos));
        this.cone(azimuth, elevation).add(x, y, z, turned(own, quat), 0, this.layer.colourOf(slot), range ?? coneRange);
      }
    }
    for (const model of this.cones.values()) {
      model.upload();
      model.draw(view, { opacity: coneOpacity(slots.length), flatness: 0.6 });
    }
  }

  /** The model for angles [degrees]. @param {number} azimuth @param {number | null} elevation */
  cone(azimuth, elevation) {
    const key = `${azimuth} ${elevation}`;
    let found = this.cones.get(key);
    if (!found) {
      const [wide, tall] = [azimuth, elevation].map((angle) => (angle === null ? null : (angle * Math.PI) / 180));
      found = new Model(this.renderer, tall === null ? coneMesh(wide) : sectorMesh(wide, tall));
      this.cones.set(key, found);
    }
    return found;
  }
}

/** Opacity of so many links: what lies behind is seen through many as well as through few. @param {number} n */
export const linkOpacity = (n) => between(4 / Math.sqrt(n || 1), 0.1, 0.45);

/** Opacity of so many cones. @param {number} n */
export const coneOpacity = (n) => between(0.25 / Math.sqrt(n || 1), 0.012, 0.13);

/** Pairs of places that are no farther apart than a reach [m], at most MAX_LINKS. @param {number[][]} places @param {number} reach */
export function pairsWithin(places, reach) {
  /** @type {Map<string, number[][]>} */
  const cells = new Map();
  /** @type {[number[], number[], number][]} */
  const found = [];
  for (const here of places) {
    if (!(reach > 0) || found.length >= MAX_PAIRS) break;
    const [x, y, z] = here.map((c) => Math.floor(c / reach));
    for (let k = 0; k < 27; k++) {
      for (const other of cells.get(`${x + (k % 3) - 1} ${y + (Math.floor(k / 3) % 3) - 1} ${z + Math.floor(k / 9) - 1}`) || []) {
        const gap = Math.hypot(...minus(here, other));
        if (gap <= reach) found.push([other, here, gap]);
      }
    }
    const own = `${x} ${y} ${z}`;
    if (!cells.has(own)) cells.set(own, []);
    cells.get(own).push(here);
  }
  return found.length > MAX_LINKS ? found.sort((a, b) => a[2] - b[2]).slice(0, MAX_LINKS) : found;
}

/** What lies within 1 m of the origin and half an angle off the x axis: its skin, with the round end. @param {number} angle radians */
function coneMesh(angle) {
  const half = 0.5 * Math.min(angle, 2 * Math.PI);
  const rings = Math.max(1, Math.ceil(half / 0.2));
  const vertices = [0, 0, 0];
  for (let r = 0; r < rings; r++) {
    const tilt = half * (1 - r / rings);
    for (const [y, z] of circle([0, 0, 0], Math.sin(tilt), SIDES).slice(1)) vertices.push(Math.cos(tilt), y, z);
  }
  vertices.push(1, 0, 0);
  const faces = [];
  const at = (/** @type {number} */ r, /** @type {number} */ i) => 1 + r * SIDES + (i % SIDES);
  const tip = 1 + rings * SIDES;
  for (let i = 0; i < SIDES; i++) {
    faces.push(0, at(0, i + 1), at(0, i), at(rings - 1, i), at(rings - 1, i + 1), tip);
    for (let r = 0; r + 1 < rings; r++) faces.push(at(r, i), at(r, i + 1), at(r + 1, i + 1), at(r, i), at(r + 1, i + 1), at(r + 1, i));
  }
  return { vertices, faces };
}

/** What lies within 1 m of the origin and half the angles to the sides and up and down: its skin. @param {number} wide radians @param {number} tall radians */
export function sectorMesh(wide, tall) {
  const [across, up] = [Math.min(wide / 2, Math.PI), Math.min(tall / 2, Math.PI / 2)];
  const nAcross = Math.max(1, Math.ceil(across / 0.1));
  const nUp = Math.max(1, Math.ceil(up / 0.1));
  const vertices = [0, 0, 0];
  for (let j = 0; j <= nUp; j++) {
    const rise = up * ((2 * j) / nUp - 1);
    for (let i = 0; i <= nAcross; i++) {
      const turn = across * ((2 * i) / nAcross - 1);
      vertices.push(Math.cos(rise) * Math.cos(turn), Math.cos(rise) * Math.sin(turn), Math.sin(rise));
    }
  }
  const at = (/** @type {number} */ i, /** @type {number} */ j) => 1 + j * (nAcross + 1) + i;
  const faces = [];
  for (let j = 0; j < nUp; j++) {
    for (let i = 0; i < nAcross; i++) faces.push(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1));
    if (across < Math.PI) faces.push(0, at(0, j), at(0, j + 1), 0, at(nAcross, j + 1), at(nAcross, j));
  }
  for (let i = 0; up < Math.PI / 2 && i < nAcross; i++) faces.push(0, at(i + 1, 0), at(i, 0), 0, at(i, nUp), at(i + 1, nUp));
  return { vertices, faces };
}
