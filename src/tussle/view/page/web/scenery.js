// What stands still: sky, ground with its grid, axes, bases, boundaries, terrain.
/** @import { PageData, Source, Terrain, Vector, View } from './types' */

import { add, between, minus, scaled, unit } from './geometry.js';
import { Reader } from './packing.js';
import { circle, Lines } from './lines.js';
import { Model } from './models.js';
import { PlainRenderer, PlainTerrain } from './plain.js';
import { imageOf, Renderer } from './renderer.js';

/** @type {[string, number[]][]} */
export const AXES = [['E', [226, 106, 92]], ['N', [92, 176, 112]], ['U', [94, 150, 232]]];
const NOBODY = [150, 160, 172];
/** Least distance of grid lines [pixels] where the view looks at. */
const MIN_CELL = 14;
const CIRCLE = 64;

export class Scenery {
  /** @param {Renderer | PlainRenderer} renderer @param {PageData} page */
  constructor(renderer, { scenery, teams, models }) {
    this.renderer = renderer;
    this.data = scenery;
    this.anchor = scaled(add(scenery.low, scenery.high), 0.5);
    this.axes = new Lines(renderer);
    /** Where an axis ends, its name and colour. @type {{ name: string, colour: number[], end: number[] }[]} */
    this.ends = [];
    this.outlines = new Lines(renderer);
    /** @param {number | null} team */
    const colourOf = (team) => teams.find(({ id }) => id === team)?.colour || NOBODY;
    this.layAxes(scenery.originLength);
    this.outlines.begin(this.anchor);
    this.regions = scenery.regions.map(({ mesh: { vertices, faces }, outline, team, isWall, name, nParts }) => {
      const colour = colourOf(team);
      for (let i = 0; i + 6 <= outline.length; i += 6) this.outlines.segment(outline.slice(i, i + 3), outline.slice(i + 3, i + 6), colour);
      const model = new Model(renderer, { vertices: vertices.map((v, i) => v - this.anchor[i % 3]), faces });
      return { model, colour, name, opacity: nParts && renderer instanceof Renderer ? 0 : isWall ? 0.4 : 0.07, top: topOf(vertices) };
    });
    const ball = new Model(renderer, models.sphere);
    this.bases = scenery.bases.filter(({ opacity }) => opacity > 0).map(({ pos, radius, team, opacity }) => {
      const colour = colourOf(team);
      circle(pos, radius, CIRCLE).forEach((place, i) => this.outlines.add(place, 0, colour, i < CIRCLE));
      const name = `base of ${teams.find(({ id }) => id === team)?.name || `team ${team}`}`;
      return { model: ball, pos, radius, colour, name, top: add(pos, [0, 0, radius]), opacity: 0.35 * opacity };
    });
    this.outlines.upload();
    /** @type {TerrainMesh | PlainTerrain | null} */
    this.terrain = null;
    /** @type {MeshPart[]} */
    this.parts = [];
  }

  /** @param {number} length */
  layAxes(length) {
    this.axes.begin([0, 0, 0]);
    for (const [axis, [name, colour]] of length > 0 ? AXES.entries() : []) {
      const end = [0, 1, 2].map((k) => (k === axis ? length : 0));
      this.axes.segment([0, 0, 0], end, colour);
      this.ends.push({ name, colour, end });
    }
    this.axes.upload();
  }

  /** Bring in heights, images and coloured parts, which are unpacked after the page is there. @param {Source} source */
  async read(source) {
    await this.readTerrain(source);
    if (this.renderer instanceof PlainRenderer) return;
    const nParts = this.data.regions.reduce((sum, region) => sum + region.nParts, 0);
    for (let i = 0; i < nParts; i++) {
      const bytes = await source.blob(`part-${i}`);
      const [nCorners, nFaces, hasImage] = new Uint32Array(bytes.slice(0, 12).buffer);
      const corners = new Float32Array(bytes.slice(12, 12 + 32 * nCorners).buffer);
      const faces = new Uint32Array(bytes.slice(12 + 32 * nCorners, 12 + 32 * nCorners + 12 * nFaces).buffer);
      const image = await this.renderer.texture(hasImage ? await source.blob(`image-${i}`) : null);
      this.parts.push(new MeshPart(this.renderer, corners, faces, image, this.anchor));
    }
  }

  /** @param {Source} source */
  async readTerrain(source) {
    const { terrain } = this.data;
    if (!terrain) return;
    const n = terrain.x.length * terrain.y.length;
    const steps = new Reader(await source.blob('terrain')).ints(n);
    for (let i = 1; i < n; i++) steps[i] += steps[i - 1];
    const heights = Float32Array.from(steps, (step) => terrain.low + terrain.step * step);
    const texture = terrain.hasTexture ? await source.blob('texture') : null;
    if (this.renderer instanceof PlainRenderer) {
      this.terrain = new PlainTerrain(this.renderer, terrain, heights);
      if (texture) this.terrain.image = await imageOf(texture);
      return;
    }
    this.terrain = new TerrainMesh(this.renderer, terrain, heights, this.anchor);
    if (texture) this.terrain.image = await this.renderer.texture(texture);
  }

  /** Distance of the narrowest grid lines, and how clearly they are seen, 0 to 1. @param {View} view */
  cell(view) {
    const distance = Math.max(view.distance, Math.abs(view.eye[2] - this.data.ground));
    const wanted = Math.log10((MIN_CELL * distance * view.perPixel) / this.data.gridStep);
    const power = Math.ceil(wanted);
    return { spacing: this.data.gridStep * 10 ** power, nearer: between((power - wanted) * 1.6, 0, 1) };
  }

  /** @param {{ sky: number[], ground: number[] }} colours */
  drawSky(colours) {
    if (this.renderer instanceof PlainRenderer) {
      this.renderer.fill(colours.ground);
      return;
    }
    const { gl } = this.renderer;
    gl.disable(gl.DEPTH_TEST);
    this.renderer.use('sky', { above: colours.sky, below: colours.ground });
    this.renderer.drawSquare();
    gl.enable(gl.DEPTH_TEST);
  }

  /** @param {View} view @param {{ lightness: number }} colours @param {boolean} isGridShown */
  drawTerrain(view, { lightness }, isGridShown) {
    const { spacing, nearer } = this.cell(view);
    this.terrain?.draw(view, spacing, isGridShown ? nearer : 0, lightness);
    for (const part of this.parts) part.draw(view);
  }

  /** The ground's grid, where there is no terrain, and the axes. @param {View} view @param {{ grid: number[] }} colours @param {Vector} target */
  drawGround(view, colours, target) {
    this.axes.draw(view, 2, 0.9);
    if (this.terrain) return;
    const { spacing, nearer } = this.cell(view);
    if (this.renderer instanceof PlainRenderer) {
      this.renderer.drawGrid(view, spacing, nearer, colours.grid);
      return;
    }
    const reach = 6 * Math.max(view.distance, Math.abs(view.eye[2] - this.data.ground));
    const centre = [target[0] - view.anchor[0], target[1] - view.anchor[1]];
    const middle = [...centre, this.data.ground - view.anchor[2]];
    this.renderer.use('ground', { clip: view.clip, middle, reach, centre, shift: gridShift(view.anchor, spacing), spacing, nearer, colour: colours.grid });
    this.renderer.drawSquare();
  }

  /** @param {View} view */
  drawRegions(view) {
    for (const { model, colour, opacity } of this.regions) if (opacity) model.drawAt(view, this.anchor, colour, 1, { opacity, flatness: 0.5 });
    for (const { model, pos, radius, colour, opacity } of this.bases) model.drawAt(view, pos, colour, 2 * radius, { opacity, flatness: 0.5 });
    this.outlines.draw(view, 1.3, 0.7);
  }
}

/** What is added to places relative to an anchor, so that grid lines lie where they belong. @param {Vector} anchor @param {number} spacing */
function gridShift(anchor, spacing) {
  const period = 100 * spacing;
  return [0, 1].map((axis) => anchor[axis] - period * Math.floor(anchor[axis] / period));
}

/** The highest place of a mesh, which bears its name. @param {number[]} vertices */
function topOf(vertices) {
  let best = 0;
  for (let i = 3; i < vertices.length; i += 3) if (vertices[i + 2] > vertices[best + 2]) best = i;
  return vertices.slice(best, best + 3);
}

/** Ground of changing height. */
class TerrainMesh {
  /** @param {Renderer} renderer @param {Terrain} terrain @param {Float32Array} heights @param {Vector} anchor */
  constructor(renderer, { x, y, low, step }, heights, anchor) {
    const { gl } = renderer;
    this.renderer = renderer;
    this.anchor = anchor;
    this.heights = [low, low + 65535 * step];
    this.corner = [x[0] - anchor[0], y[0] - anchor[1]];
    this.extent = [x[x.length - 1] - x[0], y[y.length - 1] - y[0]];
    /** Image over it. @type {WebGLTexture | null} */
    this.image = null;
    const [nRows, nColumns] = [y.length, x.length];
    const corners = new Float32Array(6 * heights.length);
    const faces = new Uint32Array(6 * (nColumns - 1) * (nRows - 1));
    let n = 0;
    for (let row = 0; row < nRows; row++) {
      for (let column = 0; column < nColumns; column++) {
        const [west, east] = [Math.max(0, column - 1), Math.min(nColumns - 1, column + 1)];
        const [south, north] = [Math.max(0, row - 1), Math.min(nRows - 1, row + 1)];
        const here = row * nColumns + column;
        const slopeEast = (heights[row * nColumns + east] - heights[row * nColumns + west]) / (x[east] - x[west] || 1);
        const slopeNorth = (heights[north * nColumns + column] - heights[south * nColumns + column]) / (y[north] - y[south] || 1);
        corners.set([x[column] - anchor[0], y[row] - anchor[1], heights[here], ...unit([-slopeEast, -slopeNorth, 1])], 6 * here);
        if (row + 1 === nRows || column + 1 === nColumns) continue;
        faces.set([here, here + 1, here + nColumns + 1, here, here + nColumns + 1, here + nColumns], n);
        n += 6;
      }
    }
    this.n = n;
    this.array = renderer.array(() => {
      renderer.corners(corners);
      renderer.buffer(faces, gl.ELEMENT_ARRAY_BUFFER);
    });
  }

  /** @param {View} view @param {number} spacing @param {number} nearer @param {number} lightness */
  draw(view, spacing, nearer, lightness) {
    const { gl } = this.renderer;
    const [low, high] = this.heights;
    const [east, north] = minus(this.anchor, view.anchor);
    const contour = 10 ** Math.ceil(Math.log10(Math.max(high - low, 1e-3) / 20));
    this.renderer.use('terrain', {
      clip: view.clip, offset: [east, north, -view.anchor[2]], heights: this.heights, contour, spacing, nearer, shift: gridShift(this.anchor, spacing), lightness,
      corner: this.corner, extent: this.extent, textured: this.image ? 1 : 0,
    });
    gl.bindTexture(gl.TEXTURE_2D, this.image);
    gl.bindVertexArray(this.array);
    gl.drawElements(gl.TRIANGLES, this.n, gl.UNSIGNED_INT, 0);
  }
}

/** A part of a mesh in its own colours. */
class MeshPart {
  /** @param {Renderer} renderer @param {Float32Array<ArrayBuffer>} corners @param {Uint32Array<ArrayBuffer>} faces @param {WebGLTexture} image @param {Vector} anchor */
  constructor(renderer, corners, faces, image, anchor) {
    const { gl } = renderer;
    this.renderer = renderer;
    this.image = image;
    this.anchor = anchor;
    this.n = faces.length;
    this.array = renderer.array(() => {
      renderer.buffer(corners);
      renderer.attribute(0, 3, gl.FLOAT, 32, 0);
      renderer.attribute(1, 2, gl.FLOAT, 32, 12);
      renderer.attribute(2, 3, gl.FLOAT, 32, 20);
      renderer.buffer(faces, gl.ELEMENT_ARRAY_BUFFER);
    });
  }

  /** @param {View} view */
  draw(view) {
    const { gl } = this.renderer;
    this.renderer.use('part', { clip: view.clip, offset: minus(this.anchor, view.anchor) });
    gl.bindTexture(gl.TEXTURE_2D, this.image);
    gl.bindVertexArray(this.array);
    gl.drawElements(gl.TRIANGLES, this.n, gl.UNSIGNED_INT, 0);
  }
}
