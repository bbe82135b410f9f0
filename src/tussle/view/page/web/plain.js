// The plain map: what renderer.js draws in 3D, drawn straight from above with the 2D canvas that every browser has.
/** @import { Mesh, Terrain, View } from './types' */
/** @import { Lines } from './lines.js' */
/** @import { Model } from './models.js' */

import { rgb } from './formatting.js';
import { cross, dot, forward, minus, rotated, scaled, unit } from './geometry.js';

/** Shown smaller than this, a model is a mark that points where it heads [pixels of the screen]. */
const MAX_MARK = 26;
/** Corners of a mark of length 1 that heads east. */
const MARK_CORNERS = [[0.5, 0], [-0.45, 0.38], [-0.25, 0], [-0.45, -0.38]];
/** Models of a kind of which each is drawn as it is turned; of more, each as it were level. */
const MAX_TURNED = 200;
/** Steps in which lines fade with their age. */
const FADES = 6;
/** Where light comes from, as on a printed map. */
const SUNLIGHT = unit([-1, 1, 1.4]);
/** Colours of low, middle and high ground. */
const GROUND_COLOURS = [[59, 84, 74], [115, 110, 84], [184, 178, 171]];

export class PlainRenderer {
  /** @param {HTMLCanvasElement} canvas @param {Mesh} ball the mesh of spheres */
  constructor(canvas, ball) {
    this.canvas = canvas;
    this.pen = canvas.getContext('2d', { alpha: false });
    this.ball = ball;
    /** It has none. @type {WebGL2RenderingContext} */
    this.gl = null;
  }

  /** Begin a picture. */
  begin() {}

  /** Draw what is seen through, or what is not: here what comes later is above. @param {boolean} _isSeenThrough */
  seeThrough(_isSeenThrough) {}

  /** Fill the canvas. @param {number[]} colour shares */
  fill(colour) {
    const { pen, canvas } = this;
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.globalAlpha = 1;
    pen.setLineDash([]);
    pen.fillStyle = rgb(scaled(colour, 255));
    pen.fillRect(0, 0, canvas.width, canvas.height);
  }

  /** Draw in metres from the anchor of a view, or from another place. @param {View} view */
  inMetres(view, place = view.anchor) {
    const [a, b, c, d, e, f] = affine(view);
    const [x, y] = minus(place, view.anchor);
    this.pen.setTransform(a, b, c, d, a * x + c * y + e, b * x + d * y + f);
  }

  /** Lines, with the fading of trails. @param {Lines} lines @param {View} view @param {number} width pixels of the screen @param {number} opacity */
  drawLines({ n, words, bytes, floats, anchor }, view, width, opacity) {
    const { pen } = this;
    /** Colour and fade -> the path of the points that have both. @type {Map<number, Path2D>} */
    const paths = new Map();
    let [last, path] = [-1, /** @type {Path2D} */ (null)];
    for (let i = 0; i + 1 < n; i++) {
      const paint = bytes[16 * i + 15];
      if (!(paint & 1)) continue;
      const key = (words[4 * i + 3] & 0xffffff) + 0x1000000 * Math.floor((FADES * (paint >> 1)) / 128);
      const found = paths.get(key);
      if (!found) paths.set(key, path = new Path2D());
      if (found !== path || last !== i) (path = paths.get(key)).moveTo(floats[4 * i], floats[4 * i + 1]);
      path.lineTo(floats[4 * i + 4], floats[4 * i + 5]);
      last = i + 1;
    }
    this.inMetres(view, anchor);
    pen.lineWidth = width * view.ratio * view.perPixel * view.distance;
    for (const [key, each] of paths) {
      const age = Math.floor(key / 0x1000000) / FADES;
      pen.globalAlpha = opacity * (1 - age) * (1 - 0.5 * age);
      pen.strokeStyle = rgb([key & 255, (key >> 8) & 255, (key >> 16) & 255]);
      pen.stroke(each);
    }
    pen.globalAlpha = 1;
  }

  /** All instances of a model, by what covers the ground below them. @param {Model} model @param {View} view @param {Record<string, number>} look */
  drawModel(model, view, { scale = 1, least = 0, opacity = 1 }) {
    const { pen, canvas } = this;
    const { n, floats, bytes, mesh } = model;
    const place = affine(view);
    const perMetre = 1 / (view.perPixel * view.distance);
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.globalAlpha = opacity;
    let colour = -1;
    for (let i = 0; i < n; i++) {
      const at = 12 * i;
      const [x, y, longest] = [floats[at], floats[at + 1], Math.max(floats[at + 8], floats[at + 9], floats[at + 10])];
      const [px, py] = [place[0] * x + place[2] * y + place[4], place[1] * x + place[3] * y + place[5]];
      const grown = Math.max(scale, (least * view.ratio) / (longest * perMetre || 1));
      const size = grown * longest * perMetre;
      const reach = size * model.reach;
      if (px < -reach || py < -reach || px > canvas.width + reach || py > canvas.height + reach) continue;
      if (colour !== (colour = model.words[at + 3] & 0xffffff)) pen.fillStyle = rgb(bytes.subarray(4 * at + 12, 4 * at + 15));
      const quat = floats.subarray(at + 4, at + 8);
      const lengths = [floats[at + 8] * grown, floats[at + 9] * grown, floats[at + 10] * grown];
      if (mesh === this.ball) {
        pen.beginPath();
        pen.arc(px, py, 0.5 * size, 0, 2 * Math.PI);
        pen.fill();
      } else if (size < MAX_MARK * view.ratio && (least > 0 || n > MAX_TURNED)) {
        this.mark(px, py, size, quat, place);
      } else {
        const isLevel = n > MAX_TURNED || Math.hypot(quat[1], quat[2]) < 1e-3;
        const [cos, sin] = isLevel ? headingOf(quat) : [1, 0];
        const [right, up] = isLevel ? lengths : [1, 1];
        const shape = isLevel ? model.levelShape : silhouette(mesh, quat, lengths);
        const [a, b, c, d] = place;
        pen.setTransform(right * (a * cos + c * sin), right * (b * cos + d * sin), up * (c * cos - a * sin), up * (d * cos - b * sin), px, py);
        pen.fill(shape);
        pen.setTransform(1, 0, 0, 1, 0, 0);
      }
    }
    pen.globalAlpha = 1;
  }

  /** A mark at a pixel that points where a body heads. @param {number} x @param {number} y @param {number} size @param {ArrayLike<number>} quat @param {number[]} place */
  mark(x, y, size, quat, [a, b, c, d]) {
    const { pen } = this;
    const [cos, sin] = headingOf(quat);
    const [east, north] = [size / Math.hypot(a, b), size / Math.hypot(c, d)];
    pen.beginPath();
    for (const [ahead, left] of MARK_CORNERS) {
      const [along, across] = [east * (ahead * cos - left * sin), north * (ahead * sin + left * cos)];
      pen.lineTo(x + a * along + c * across, y + b * along + d * across);
    }
    pen.fill();
  }

  /** Lines of the ground, the tenth ones clearer. @param {View} view @param {number} spacing @param {number} nearer how clear the narrowest are, 0 to 1 @param {number[]} colour shares */
  drawGrid(view, spacing, nearer, colour) {
    const { pen, canvas } = this;
    const inverse = new DOMMatrix(affine(view)).inverse();
    const corners = [[0, 0], [canvas.width, 0], [0, canvas.height], [canvas.width, canvas.height]].map(([x, y]) => inverse.transformPoint({ x, y }));
    this.inMetres(view);
    pen.strokeStyle = rgb(scaled(colour, 255));
    pen.lineWidth = view.ratio * view.perPixel * view.distance;
    for (const [step, opacity] of [[spacing, 0.16 * nearer], [10 * spacing, 0.3]]) {
      const path = new Path2D();
      const [[west, east], [south, north]] = [corners.map(({ x }) => x), corners.map(({ y }) => y)].map((all) => [Math.min(...all), Math.max(...all)]);
      for (const x of multiples(west, east, step, view.anchor[0])) path.addPath(lineOf(x, south, x, north));
      for (const y of multiples(south, north, step, view.anchor[1])) path.addPath(lineOf(west, y, east, y));
      pen.globalAlpha = opacity;
      pen.stroke(path);
    }
    pen.globalAlpha = 1;
  }
}

/** Ground of changing height, as a picture seen from above. */
export class PlainTerrain {
  /** @param {PlainRenderer} renderer @param {Terrain} terrain @param {Float32Array} heights */
  constructor(renderer, { x, y, low, step }, heights) {
    this.renderer = renderer;
    this.corner = [x[0], y[y.length - 1], 0];
    this.extent = [x[x.length - 1] - x[0], y[y.length - 1] - y[0]];
    const [nColumns, nRows] = [x.length, y.length];
    /** @type {HTMLCanvasElement | ImageBitmap} */
    this.image = Object.assign(document.createElement('canvas'), { width: nColumns, height: nRows });
    const pixels = new ImageData(nColumns, nRows);
    for (let row = 0; row < nRows; row++) {
      for (let column = 0; column < nColumns; column++) {
        const here = row * nColumns + column;
        const [west, east] = [column > 0 ? here - 1 : here, column + 1 < nColumns ? here + 1 : here];
        const [south, north] = [row > 0 ? here - nColumns : here, row + 1 < nRows ? here + nColumns : here];
        const slope = [(heights[west] - heights[east]) * ((nColumns - 1) / this.extent[0]) / (east - west || 1),
          (heights[south] - heights[north]) * ((nRows - 1) / this.extent[1]) / ((north - south) / nColumns || 1), 1];
        const share = Math.min(1.999, (2 * (heights[here] - low)) / (65535 * step || 1));
        const [from, to] = GROUND_COLOURS.slice(Math.floor(share));
        const light = 0.35 + 0.85 * Math.max(0, dot(unit(slope), SUNLIGHT));
        const at = 4 * ((nRows - 1 - row) * nColumns + column);
        for (let k = 0; k < 3; k++) pixels.data[at + k] = light * (from[k] + (share % 1) * (to[k] - from[k]));
        pixels.data[at + 3] = 255;
      }
    }
    this.image.getContext('2d').putImageData(pixels, 0, 0);
  }

  /** @param {View} view */
  draw(view) {
    const { renderer: { pen }, extent: [east, north], corner } = this;
    this.renderer.inMetres(view, corner);
    pen.scale(1, -1);
    pen.drawImage(this.image, 0, 0, east, north);
  }
}

/** Metres east and north of the anchor to pixels, as a canvas takes it: a view from above has no depth. @param {View} view */
export function affine({ clip, width, height }) {
  const [across, upward] = [(0.5 * width) / clip[15], (-0.5 * height) / clip[15]];
  return [across * clip[0], upward * clip[1], across * clip[4], upward * clip[5], 0.5 * width + across * clip[12], 0.5 * height + upward * clip[13]];
}

/** Cosine and sine of the heading of a body, also of one that points up. @param {ArrayLike<number>} quat */
export function headingOf(quat) {
  const [east, north] = forward(quat);
  const length = Math.hypot(east, north);
  return length > 1e-6 ? [east / length, north / length] : [1, 0];
}

/** The faces of a mesh that are seen from above, corner after corner. @param {Mesh} mesh @param {ArrayLike<number>} quat @param {number[]} lengths along its axes @returns {number[][][]} */
export function facesFromAbove({ vertices, faces }, quat, lengths) {
  const q = Array.from(quat);
  const corners = Array.from({ length: vertices.length / 3 }, (_, i) => rotated(q, [0, 1, 2].map((k) => vertices[3 * i + k] * lengths[k])));
  return Array.from({ length: faces.length / 3 }, (_, f) => [0, 1, 2].map((k) => corners[faces[3 * f + k]]))
    .filter(([a, b, c]) => cross(minus(b, a), minus(c, a))[2] > 0);
}

/** What a mesh covers, seen from above. @param {Mesh} mesh @param {ArrayLike<number>} quat */
export function silhouette(mesh, quat, lengths = [1, 1, 1]) {
  const path = new Path2D();
  for (const [a, b, c] of facesFromAbove(mesh, quat, lengths)) {
    path.moveTo(a[0], a[1]);
    path.lineTo(b[0], b[1]);
    path.lineTo(c[0], c[1]);
    path.closePath();
  }
  return path;
}

/** Multiples of a step within a span, both counted from an origin. @param {number} low @param {number} high @param {number} step @param {number} origin */
function multiples(low, high, step, origin) {
  const first = Math.ceil((low + origin) / step);
  return Array.from({ length: Math.max(0, Math.floor((high + origin) / step) - first + 1) }, (_, i) => (first + i) * step - origin);
}

/** @param {number} x @param {number} y @param {number} endX @param {number} endY */
function lineOf(x, y, endX, endY) {
  const path = new Path2D();
  path.moveTo(x, y);
  path.lineTo(endX, endY);
  return path;
}
