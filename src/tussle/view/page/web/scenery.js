// What stands still: sky, ground with its grid, axes, bases, boundaries, terrain.

import { add, between, minus, scaled, unit } from './geometry.js';
import { Reader } from './packing.js';
import { GROUND_CORNERS, GROUND_PAINT, LINE_CORNERS, LINE_PAINT, MODEL_CORNERS, MODEL_PAINT, SKY_CORNERS, SKY_PAINT, TERRAIN_CORNERS, TERRAIN_PAINT } from './shaders.js';
import { attribute, buffer, program, square, use } from './drawing.js';
import { Model } from './models.js';
import { Lines } from './trails.js';

export const AXES = [['E', [226, 106, 92]], ['N', [92, 176, 112]], ['U', [94, 150, 232]]];
const NOBODY = [150, 160, 172];
/** Least distance of grid lines [pixels] where the view looks at. */
const LEAST_CELL = 14;
const CIRCLE = 64;

export class Scenery {
  constructor(gl, data, teams, models, source) {
    this.gl = gl;
    this.source = source;
    this.data = data;
    this.low = data.low;
    this.high = data.high;
    this.anchor = scaled(add(data.low, data.high), 0.5);
    this.teamColour = (team) => (teams.find(({ id }) => id === team) || { colour: NOBODY }).colour;
    this.sky = program(gl, SKY_CORNERS, SKY_PAINT);
    this.ground = program(gl, GROUND_CORNERS, GROUND_PAINT);
    this.solid = program(gl, MODEL_CORNERS, MODEL_PAINT);
    this.line = program(gl, LINE_CORNERS, LINE_PAINT);
    this.square = square(gl);
    this.axes = new Lines(gl, 16);
    this.outlines = new Lines(gl, 256);
    this.layAxes();
    this.layRegions();
    this.layBases(models.sphere);
    this.terrain = null;
  }

  layAxes() {
    const { axes, data } = this;
    axes.begin([0, 0, 0]);
    AXES.forEach(([, colour], axis) => {
      const end = [0, 0, 0];
      end[axis] = data.originLength;
      if (data.originLength > 0) axes.segment([0, 0, 0], end, colour);
    });
    axes.hand();
  }

  layRegions() {
    const { gl, outlines, data } = this;
    outlines.begin(this.anchor);
    this.regions = data.regions.map(({ mesh, outline, team, isWall, name }) => {
      const colour = team === null ? NOBODY : this.teamColour(team);
      for (let i = 0; i + 6 <= outline.length; i += 6) outlines.segment(outline.slice(i, i + 3), outline.slice(i + 3, i + 6), colour);
      const model = new Model(gl, { vertices: mesh.vertices.map((v, i) => v - this.anchor[i % 3]), faces: mesh.faces }, 1);
      return { model, colour, name, opacity: isWall ? 0.4 : 0.07, top: topOf(mesh.vertices) };
    });
  }

  layBases(sphere) {
    const { outlines, data } = this;
    this.bases = data.bases.map(({ pos, radius, team, opacity }) => {
      const colour = this.teamColour(team);
      const at = (i) => [pos[0] + radius * Math.cos((2 * Math.PI * i) / CIRCLE), pos[1] + radius * Math.sin((2 * Math.PI * i) / CIRCLE), pos[2]];
      if (opacity > 0) for (let i = 0; i < CIRCLE; i++) outlines.segment(at(i), at(i + 1), colour);
      return { model: new Model(this.gl, sphere, 1), pos, radius, colour, opacity: 0.35 * opacity };
    });
    outlines.hand();
  }

  /** Bring in the heights, which are unpacked after the page is there. */
  async readTerrain() {
    const { terrain } = this.data;
    if (!terrain) return;
    const n = terrain.x.length * terrain.y.length;
    const steps = new Reader(await this.source.blob('terrain')).ints(n);
    for (let i = 1; i < n; i++) steps[i] += steps[i - 1];
    const heights = Float32Array.from(steps, (step) => terrain.low + terrain.step * step);
    this.terrain = new TerrainMesh(this.gl, terrain, heights, this.anchor);
  }

  /** Distance of the narrowest grid lines, and how clearly they are seen, 0 to 1. */
  cell(view) {
    const distance = Math.max(view.distance, Math.abs(view.eye[2] - this.data.ground));
    const wanted = Math.log10((LEAST_CELL * distance * view.perPixel) / this.data.gridStep);
    const power = Math.ceil(wanted);
    return { spacing: this.data.gridStep * 10 ** power, nearer: between((power - wanted) * 1.6, 0, 1) };
  }

  drawSky(colours) {
    const { gl } = this;
    gl.disable(gl.DEPTH_TEST);
    use(gl, this.sky, { above: colours.sky, below: colours.ground });
    gl.bindVertexArray(this.square);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.enable(gl.DEPTH_TEST);
  }

  drawTerrain(view, colours, isGridShown) {
    if (!this.terrain) return;
    const { spacing, nearer } = this.cell(view);
    this.terrain.draw(view, spacing, isGridShown ? nearer : 0, colours.lightness);
  }

  /** What is seen through: the depth of nothing that is behind it is lost. */
  drawGround(view, colours, camera) {
    if (this.terrain) return;
    const { gl } = this;
    const { spacing, nearer } = this.cell(view);
    const reach = 6 * Math.max(view.distance, Math.abs(view.eye[2] - this.data.ground));
    const centre = [camera.target[0] - view.anchor[0], camera.target[1] - view.anchor[1]];
    const period = 100 * spacing;
    const shift = [0, 1].map((axis) => view.anchor[axis] - period * Math.floor(view.anchor[axis] / period));
    const middle = [...centre, this.data.ground - view.anchor[2]];
    use(gl, this.ground, { clip: view.clip, middle, reach, centre, shift, spacing, nearer, colour: colours.grid });
    gl.bindVertexArray(this.square);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  drawAxes(view) {
    this.axes.draw(this.line, view, 2 * view.ratio, 0.9);
  }

  drawRegions(view) {
    for (const { model, colour, opacity } of this.regions) this.drawOne(view, model, this.anchor, 1, colour, opacity);
    for (const { model, pos, radius, colour, opacity } of this.bases) this.drawOne(view, model, pos, 2 * radius, colour, opacity);
    this.outlines.draw(this.line, view, 1.3 * view.ratio, 0.7);
  }

  drawOne(view, model, place, size, colour, opacity) {
    if (opacity <= 0) return;
    model.n = 0;
    model.add(...minus(place, view.anchor), [1, 0, 0, 0], 0, colour, size, 0);
    model.hand();
    use(this.gl, this.solid, { clip: view.clip, scale: 1, least: 0, opacity, flatness: 0.5, bright: 1 });
    model.draw(false);
  }
}

/** The highest place of a mesh, which bears its name. */
function topOf(vertices) {
  let best = 0;
  for (let i = 3; i < vertices.length; i += 3) if (vertices[i + 2] > vertices[best + 2]) best = i;
  return vertices.slice(best, best + 3);
}

/** Ground of changing height. */
class TerrainMesh {
  constructor(gl, { x, y, low, step }, heights, anchor) {
    this.gl = gl;
    this.anchor = anchor;
    this.heights = [low, low + 65535 * step];
    const corners = new Float32Array(6 * heights.length);
    const at = (row, column) => heights[between(row, 0, y.length - 1) * x.length + between(column, 0, x.length - 1)];
    for (let row = 0; row < y.length; row++) {
      for (let column = 0; column < x.length; column++) {
        const [west, east] = [Math.max(0, column - 1), Math.min(x.length - 1, column + 1)];
        const [south, north] = [Math.max(0, row - 1), Math.min(y.length - 1, row + 1)];
        const slopeEast = (at(row, east) - at(row, west)) / (x[east] - x[west] || 1);
        const slopeNorth = (at(north, column) - at(south, column)) / (y[north] - y[south] || 1);
        const place = minus([x[column], y[row], at(row, column)], [anchor[0], anchor[1], 0]);
        corners.set([...place, ...unit([-slopeEast, -slopeNorth, 1])], 6 * (row * x.length + column));
      }
    }
    const faces = new Uint32Array(6 * (x.length - 1) * (y.length - 1));
    let n = 0;
    for (let row = 0; row + 1 < y.length; row++) {
      for (let column = 0; column + 1 < x.length; column++) {
        const corner = row * x.length + column;
        faces.set([corner, corner + 1, corner + x.length + 1, corner, corner + x.length + 1, corner + x.length], n);
        n += 6;
      }
    }
    this.n = n;
    this.program = program(gl, TERRAIN_CORNERS, TERRAIN_PAINT);
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    buffer(gl, corners);
    attribute(gl, 0, 3, gl.FLOAT, 24, 0);
    attribute(gl, 1, 3, gl.FLOAT, 24, 12);
    buffer(gl, faces, gl.ELEMENT_ARRAY_BUFFER);
    gl.bindVertexArray(null);
  }

  draw(view, spacing, nearer, lightness) {
    const { gl } = this;
    const [low, high] = this.heights;
    const offset = [this.anchor[0] - view.anchor[0], this.anchor[1] - view.anchor[1], -view.anchor[2]];
    const period = 100 * spacing;
    const shift = [0, 1].map((axis) => this.anchor[axis] - period * Math.floor(this.anchor[axis] / period));
    const contour = 10 ** Math.ceil(Math.log10(Math.max(high - low, 1e-3) / 20));
    use(gl, this.program, { clip: view.clip, offset, heights: [low, high], contour, spacing, nearer, shift, lightness });
    gl.bindVertexArray(this.array);
    gl.drawElements(gl.TRIANGLES, this.n, gl.UNSIGNED_INT, 0);
    gl.bindVertexArray(null);
  }
}
