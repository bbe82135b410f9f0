// WebGL 2: programs, buffers, and tables of instances.
/** @import { Vector } from './types' */

import {
  GROUND_CORNERS, GROUND_PAINT, LINE_CORNERS, LINE_PAINT, MODEL_CORNERS, MODEL_PAINT, SKY_CORNERS, SKY_PAINT, TERRAIN_CORNERS, TERRAIN_PAINT,
  PART_CORNERS, PART_PAINT,
} from './shaders.js';

const PROGRAMS = {
  model: [MODEL_CORNERS, MODEL_PAINT], line: [LINE_CORNERS, LINE_PAINT], ground: [GROUND_CORNERS, GROUND_PAINT],
  terrain: [TERRAIN_CORNERS, TERRAIN_PAINT], part: [PART_CORNERS, PART_PAINT], sky: [SKY_CORNERS, SKY_PAINT],
};

/** The canvas with its programs. */
export class Renderer {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    this.programs = Object.fromEntries(Object.entries(PROGRAMS).map(([name, sources]) => [name, this.program(sources)]));
    this.square = this.array(() => {
      this.buffer(new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]));
      this.attribute(0, 2, gl.FLOAT, 0, 0);
    });
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
    for (let i = 0; i < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); i++) {
      const { name } = gl.getActiveUniform(made, i);
      places[name] = gl.getUniformLocation(made, name);
    }
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
  attribute(place, size, kind, stride, offset, divisor = 0) {
    const { gl } = this;
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, kind, kind === gl.UNSIGNED_BYTE, stride, offset);
    gl.vertexAttribDivisor(place, divisor);
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
    const image = file && (await createImageBitmap(new Blob([file], { type: 'image/jpeg' })));
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

/** Rows of numbers that are filled anew for each picture. */
export class Instances {
  /** @param {Renderer} renderer @param {number} rowBytes */
  constructor(renderer, rowBytes) {
    this.renderer = renderer;
    this.rowBytes = rowBytes;
    this.buffer = renderer.gl.createBuffer();
    this.n = 0;
    this.resize(64);
  }

  /** @param {number} room */
  resize(room) {
    const old = this.bytes;
    this.room = room;
    this.bytes = new Uint8Array(this.rowBytes * room);
    this.floats = new Float32Array(this.bytes.buffer);
    if (old) this.bytes.set(old);
    this.isRoomNew = true;
  }

  /** Append a row of numbers and a colour with a fourth value, 0 to 255; its number. @param {number} colourByte where the colour is in the row @param {Vector} colour @param {number} fourth */
  append(colourByte, colour, fourth) {
    if (this.n >= this.room) this.resize(2 * this.room);
    const at = this.rowBytes * this.n + colourByte;
    for (let k = 0; k < 3; k++) this.bytes[at + k] = colour[k];
    this.bytes[at + 3] = fourth;
    return this.n++;
  }

  /** Hand the rows to the graphics card. */
  upload() {
    const { gl } = this.renderer;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    if (this.isRoomNew) gl.bufferData(gl.ARRAY_BUFFER, this.bytes.byteLength, gl.DYNAMIC_DRAW);
    this.isRoomNew = false;
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.bytes, 0, this.rowBytes * this.n);
  }
}
