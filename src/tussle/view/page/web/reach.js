// How far entities reach: rings, cones, and links between those in reach of each other.

import { minus } from './geometry.js';
import { MODEL_CORNERS, MODEL_PAINT } from './shaders.js';
import { program, use } from './drawing.js';
import { Model } from './models.js';
import { Lines } from './trails.js';

/** Lines between entities; of more, the shortest are drawn. */
const MOST_LINKS = 5000;
/** Pairs in reach that are looked at. */
const MOST_PAIRS = 400000;
const SIDES = 40;

export class Reach {
  constructor(gl) {
    this.gl = gl;
    this.lines = new Lines(gl, 4096);
    this.program = program(gl, MODEL_CORNERS, MODEL_PAINT);
    this.cone = null;
  }

  draw(view, line, layer, isHidden, drawn) {
    const { lines } = this;
    lines.begin(view.anchor);
    if (drawn.rings) this.layRings(layer, isHidden, drawn.ringRadius);
    if (drawn.links) this.layLinks(layer, isHidden, drawn.linkRange);
    lines.hand();
    lines.draw(line, view, 1.2 * view.ratio, 0.75);
    if (drawn.cones) this.drawCones(view, layer, isHidden, drawn);
  }

  layRings(layer, isHidden, radius) {
    const { shown } = layer;
    for (let slot = 0; slot < shown.n; slot++) {
      if (isHidden(slot)) continue;
      for (let i = 0; i <= SIDES; i++) {
        const angle = (2 * Math.PI * i) / SIDES;
        const [x, y] = [shown.x[slot] + radius * Math.cos(angle), shown.y[slot] + radius * Math.sin(angle)];
        this.lines.add(x, y, shown.z[slot], 0, layer.colourOf(slot), i < SIDES);
      }
    }
  }

  layLinks({ shown }, isHidden, reach) {
    for (const [a, b] of pairsWithin(shown, isHidden, reach)) {
      this.lines.segment([shown.x[a], shown.y[a], shown.z[a]], [shown.x[b], shown.y[b], shown.z[b]], [90, 160, 190]);
    }
  }

  drawCones(view, layer, isHidden, { coneAngle, coneRange }) {
    if (!this.cone || this.angle !== coneAngle) {
      this.angle = coneAngle;
      this.cone = new Model(this.gl, coneMesh((coneAngle * Math.PI) / 180), 64);
    }
    const { shown } = layer;
    this.cone.n = 0;
    for (let i = 0; i < shown.n; i++) {
      const [x, y, z] = minus(layer.placeIn(i), view.anchor);
      if (!isHidden(i)) this.cone.add(x, y, z, shown.quat, 4 * i, layer.colourOf(i), coneRange, 0);
    }
    this.cone.hand();
    use(this.gl, this.program, { clip: view.clip, scale: 1, least: 0, opacity: 0.13, flatness: 0.6, bright: 1 });
    this.cone.draw(false);
  }
}

/** Pairs of slots that are no farther apart than a reach [m], at most MOST_LINKS. */
function pairsWithin(shown, isHidden, reach) {
  const cells = new Map();
  const cellOf = (i, dx = 0, dy = 0, dz = 0) =>
    `${Math.floor(shown.x[i] / reach) + dx} ${Math.floor(shown.y[i] / reach) + dy} ${Math.floor(shown.z[i] / reach) + dz}`;
  const found = [];
  for (let i = 0; i < shown.n && reach > 0 && found.length < MOST_PAIRS; i++) {
    if (isHidden(i)) continue;
    for (let k = 0; k < 27; k++) {
      for (const j of cells.get(cellOf(i, (k % 3) - 1, (Math.floor(k / 3) % 3) - 1, Math.floor(k / 9) - 1)) || []) {
        const gap = Math.hypot(shown.x[i] - shown.x[j], shown.y[i] - shown.y[j], shown.z[i] - shown.z[j]);
        if (gap <= reach) found.push([j, i, gap]);
      }
    }
    const own = cellOf(i);
    if (!cells.has(own)) cells.set(own, []);
    cells.get(own).push(i);
  }
  return found.length > MOST_LINKS ? found.sort((a, b) => a[2] - b[2]).slice(0, MOST_LINKS) : found;
}

/** What lies within 1 m of the origin and half an angle [rad] off the x axis: its skin, with the round end. */
function coneMesh(angle) {
  const half = 0.5 * Math.min(angle, 2 * Math.PI);
  const rings = Math.max(2, Math.ceil(half / 0.2) + 1) - 1;
  const vertices = [0, 0, 0];
  for (let r = 0; r < rings; r++) {
    const tilt = half * (1 - r / rings);
    for (let i = 0; i < SIDES; i++) {
      const turn = (2 * Math.PI * i) / SIDES;
      vertices.push(Math.cos(tilt), Math.sin(tilt) * Math.cos(turn), Math.sin(tilt) * Math.sin(turn));
    }
  }
  vertices.push(1, 0, 0);
  const faces = [];
  const at = (r, i) => 1 + r * SIDES + (i % SIDES);
  const tip = 1 + rings * SIDES;
  for (let i = 0; i < SIDES; i++) {
    faces.push(0, at(0, i + 1), at(0, i), at(rings - 1, i), at(rings - 1, i + 1), tip);
    for (let r = 0; r + 1 < rings; r++) faces.push(at(r, i), at(r, i + 1), at(r + 1, i + 1), at(r, i), at(r + 1, i + 1), at(r + 1, i));
  }
  return { vertices, faces };
}
