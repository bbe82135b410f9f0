// WebGL 2: programs, buffers, and tables of instances.
/** @import { Vector } from './types' */

import { PlainRenderer } from './plain.js';
import {
  GROUND_CORNERS, GROUND_PAINT, LINE_CORNERS, LINE_PAINT, MODEL_CORNERS, MODEL_PAINT, SKY_CORNERS, SKY_PAINT, TERRAIN_CORNERS, TERRAIN_PAINT,
  PART_CORNERS, PART_PAINT,
} from './shaders.js';

const PROGRAMS = {
  model: [MODEL_CORNERS, MODEL_PAINT], line: [LINE_CORNERS, LINE_PAINT], ground: [GROUND_CORNERS, GROUND_PAINT],
  terrain: [TERRAIN_CORNERS, TERRAIN_PAINT], part: [PART_CORNERS, PART_PAINT], sky: [SKY_CORNERS, SKY_PAINT],
};

/** Texels of a row of a table; programs know it too. */
const TABLE_WIDTH = 1024;

/** What draws WebGL without a graphics card calls itself so. */
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

/** Whether this browser draws without a graphics card, or without WebGL. */
export function isDrawnSlowly() {
  const gl = document.createElement('canvas').getContext('webgl2');
  const names = gl?.getExtension('WEBGL_debug_renderer_info');
  const isSlow = SOFTWARE.test(String(gl?.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER)));
  gl?.getExtension('WEBGL_lose_context')?.loseContext();
  return isSlow || !gl;
}

/** The picture of a JPEG file. @param {Uint8Array<ArrayBuffer>} file */
export const imageOf = (file) => createImageBitmap(new Blob([file], { type: 'image/jpeg' }));

/** The canvas with its programs. */
export class Renderer {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    this.canvas = /** @type {HTMLCanvasElement} */ (gl.canvas);
    this.programs = Object.fromEntries(Object.entries(PROGRAMS).map(([name, sources]) => [name, this.program(sources)]));
    this.square = this.array(() => {
      this.buffer(new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]));
      this.attribute(0, 2, gl.FLOAT, 0, 0);
    });
  }

  /** Begin a picture. */
  begin() {
    const { gl, canvas } = this;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.disable(gl.BLEND);
  }

  /** Draw what is seen through, or what is not. @param {boolean} isSeenThrough */
  seeThrough(isSeenThrough) {
    const { gl } = this;
    if (isSeenThrough) gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(!isSeenThrough);
  }

  /** Compile a program and find its uniforms. @param {string[]} sources */
  program(sources) {
    const { gl } = this;
    const made = gl.createProgram();
    [gl.VERTEX_SHADER, gl.FRAGMENT_SHADER].forEach((kind, i) => {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, sources[i]);
      gl.compileShader(shader);
      gl.attachShader(made, shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(gl.getShaderInfoLog(shader));
    });
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(made));
    /** @type {Record<string, WebGLUniformLocation>} */
    const places = {};
    gl.useProgram(made);
    for (let i = 0; i < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); i++) {
      const { name } = gl.getActiveUniform(made, i);
      places[name] = gl.getUniformLocation(made, name);
    }
    gl.uniform1i(places.mesh ?? null, 1);
    return { made, places };
  }

  /** Use a program with numbers, or lists of two, three or sixteen. @param {keyof typeof PROGRAMS} name @param {Record<string, number | ArrayLike<number>>} values */
  use(name, values) {
    const { gl } = this;
    const { made, places } = this.programs[name];
    gl.useProgram(made);
    for (const [key, value] of Object.entries(values)) {
      if (typeof value === 'number') gl.uniform1f(places[key], value);
      else if (value.length === 2) gl.uniform2fv(places[key], Array.from(value));
      else if (value.length === 3) gl.uniform3fv(places[key], Array.from(value));
      else gl.uniformMatrix4fv(places[key], false, Array.from(value));
    }
  }

  /** A vertex array whose buffers and attributes a function sets up. @param {() => void} fill */
  array(fill) {
    const array = this.gl.createVertexArray();
    this.gl.bindVertexArray(array);
    fill();
    this.gl.bindVertexArray(null);
    return array;
  }

  /** @param {Float32Array<ArrayBuffer> | Uint32Array<ArrayBuffer>} data @param {number} target */
  buffer(data, target = this.gl.ARRAY_BUFFER) {
    this.gl.bindBuffer(target, this.gl.createBuffer());
    this.gl.bufferData(target, data, this.gl.STATIC_DRAW);
  }

  /** Tell where an attribute lies in the bound buffer. @param {number} place @param {number} size @param {number} kind @param {number} stride @param {number} offset */
  attribute(place, size, kind, stride, offset) {
    this.gl.enableVertexAttribArray(place);
    this.gl.vertexAttribPointer(place, size, kind, false, stride, offset);
  }

  /** Corners with place and normal: see `shape` of models. @param {Float32Array<ArrayBuffer>} corners */
  corners(corners) {
    this.buffer(corners);
    this.attribute(0, 3, this.gl.FLOAT, 24, 0);
    this.attribute(1, 3, this.gl.FLOAT, 24, 12);
  }

  /** A texture of a JPEG file; white without one. @param {Uint8Array<ArrayBuffer> | null} file */
  async texture(file) {
    const { gl } = this;
    const image = file && (await imageOf(file));
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    if (image) gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, image);
    else gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array([255, 255, 255, 255]));
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    return texture;
  }

  drawSquare() {
    this.gl.bindVertexArray(this.square);
    this.gl.drawArrays(this.gl.TRIANGLE_STRIP, 0, 4);
  }
}

/** Numbers that programs find by the number of a vertex: without a graphics card, an instance takes far longer to draw than its vertices. */
export class Table {
  /** @param {Renderer} renderer */
  constructor(renderer) {
    this.gl = renderer.gl;
    this.texture = this.gl.createTexture();
    this.nRows = 0;
  }

  /** @param {Uint32Array<ArrayBuffer>} words four a texel, full rows of texels @param {number} n texels that count */
  upload(words, n = words.length / 4) {
    const { gl } = this;
    const nRows = words.length / (4 * TABLE_WIDTH);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    if (nRows !== this.nRows) {
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32UI, TABLE_WIDTH, nRows, 0, gl.RGBA_INTEGER, gl.UNSIGNED_INT, words);
      for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    } else if (n > 0) {
      const size = [Math.min(n, TABLE_WIDTH), Math.ceil(n / TABLE_WIDTH)];
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, size[0], size[1], gl.RGBA_INTEGER, gl.UNSIGNED_INT, words);
    }
    this.nRows = nRows;
  }
}

/** Words of full rows of a table that have room for so many. @param {number} n */
export const wordsFor = (n) => 4 * TABLE_WIDTH * Math.max(1, Math.ceil(n / (4 * TABLE_WIDTH)));

/** Rows of numbers that are filled anew for each picture. */
export class Instances {
  /** @param {Renderer | PlainRenderer} renderer @param {number} rowBytes a multiple of 16 */
  constructor(renderer, rowBytes) {
    this.renderer = renderer;
    this.rowBytes = rowBytes;
    this.table = renderer instanceof PlainRenderer ? null : new Table(renderer);
    this.n = 0;
    this.resize(64);
  }

  /** @param {number} room */
  resize(room) {
    const old = this.bytes;
    this.words = new Uint32Array(wordsFor((room * this.rowBytes) / 4));
    this.bytes = new Uint8Array(this.words.buffer);
    this.floats = new Float32Array(this.words.buffer);
    this.room = Math.floor(this.bytes.length / this.rowBytes);
    if (old) this.bytes.set(old);
  }

  /** Append a row of a place, a colour with a fourth value, 0 to 255, and more; its number. @param {Vector} colour @param {number} fourth */
  append(colour, fourth) {
    if (this.n >= this.room) this.resize(2 * this.room);
    const at = this.rowBytes * this.n + 12;
    for (let k = 0; k < 3; k++) this.bytes[at + k] = colour[k];
    this.bytes[at + 3] = fourth;
    return this.n++;
  }

  /** Hand the rows to the graphics card. */
  upload() {
    this.table?.upload(this.words, (this.n * this.rowBytes) / 16);
  }

  /** Draw so many vertices. @param {number} kind @param {number} n */
  drawVertices(kind, n) {
    const { gl } = this.renderer;
    gl.bindTexture(gl.TEXTURE_2D, this.table.texture);
    gl.bindVertexArray(null);
    gl.drawArrays(kind, 0, n);
  }
}
