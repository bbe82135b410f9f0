// How far entities reach: rings, cones, and links between those in reach of each other.
/** @import { Drawn, View } from './types' */

import { minus } from './geometry.js';
import { Layer } from './layer.js';
import { circle, Lines } from './lines.js';
import { Model } from './models.js';
import { Renderer } from './renderer.js';

/** Lines between entities; of more, the shortest are drawn. */
const MOST_LINKS = 5000;
/** Pairs in reach that are looked at. */
const MOST_PAIRS = 400000;
const SIDES = 40;

export class Reach {
  /** @param {Renderer} renderer @param {Layer} layer */
  constructor(renderer, layer) {
    this.renderer = renderer;
    this.layer = layer;
    this.lines = new Lines(renderer);
    this.angle = 0;
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
    for (const [a, b] of drawn.links ? pairsWithin(slots.map((slot) => shown.placeIn(slot)), drawn.linkRange) : []) lines.segment(a, b, [90, 160, 190]);
    lines.upload();
    lines.draw(view, 1.2, 0.75);
    if (drawn.cones) this.drawCones(view, slots, drawn);
  }

  /** @param {View} view @param {number[]} slots @param {Drawn} drawn */
  drawCones(view, slots, { coneAngle, coneRange }) {
    if (this.angle !== coneAngle) this.cone = new Model(this.renderer, coneMesh((coneAngle * Math.PI) / 180));
    this.angle = coneAngle;
    this.cone.n = 0;
    for (const slot of slots) {
      const [x, y, z] = minus(this.layer.placeIn(slot), view.anchor);
      this.cone.add(x, y, z, this.layer.shown.quat, 4 * slot, this.layer.colourOf(slot), coneRange);
    }
    this.cone.upload();
    this.cone.draw(view, { opacity: 0.13, flatness: 0.6 });
  }
}

/** Pairs of places that are no farther apart than a reach [m], at most MOST_LINKS. @param {number[][]} places @param {number} reach */
export function pairsWithin(places, reach) {
  /** @type {Map<string, number[][]>} */
  const cells = new Map();
  /** @type {[number[], number[], number][]} */
  const found = [];
  for (const here of places) {
    if (!(reach > 0) || found.length >= MOST_PAIRS) break;
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
  return found.length > MOST_LINKS ? found.sort((a, b) => a[2] - b[2]).slice(0, MOST_LINKS) : found;
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
