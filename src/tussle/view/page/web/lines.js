// Lines: trails of entities, outlines and axes.
/** @import { Colour, Vector, View } from './types' */

import { minus } from './geometry.js';
import { Instances, Renderer } from './renderer.js';

/** Of a point of a line: place, age from 0 to 1, colour, and whether a line goes on from it to the next. */
const POINT_BYTES = 20;

/** Points of lines; each goes on to the next one, if it says so. */
export class Lines extends Instances {
  /** @param {Renderer} renderer */
  constructor(renderer) {
    super(renderer, POINT_BYTES);
    const { gl } = renderer;
    /** @type {Vector} */
    this.anchor = [0, 0, 0];
    this.array = renderer.array(() => {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
      renderer.attribute(0, 3, gl.FLOAT, POINT_BYTES, 0, 1);
      renderer.attribute(1, 1, gl.FLOAT, POINT_BYTES, 12, 1);
      renderer.attribute(2, 4, gl.UNSIGNED_BYTE, POINT_BYTES, 16, 1);
      renderer.attribute(3, 3, gl.FLOAT, POINT_BYTES, POINT_BYTES, 1);
      renderer.attribute(4, 1, gl.FLOAT, POINT_BYTES, POINT_BYTES + 12, 1);
    });
  }

  /** Start anew, with places relative to an anchor. @param {Vector} anchor */
  begin(anchor) {
    this.anchor = anchor;
    this.n = 0;
  }

  /** @param {Vector} place @param {number} age @param {Colour} colour @param {boolean} goesOn */
  add(place, age, colour, goesOn) {
    const at = (POINT_BYTES / 4) * this.append(16, colour, goesOn ? 255 : 0);
    for (let k = 0; k < 3; k++) this.floats[at + k] = place[k] - this.anchor[k];
    this.floats[at + 3] = age;
  }

  /** @param {Vector} a @param {Vector} b @param {Colour} colour */
  segment(a, b, colour) {
    this.add(a, 0, colour, true);
    this.add(b, 0, colour, false);
  }

  /** @param {View} view @param {number} width pixels of the screen @param {number} opacity */
  draw(view, width, opacity) {
    if (this.n < 2) return;
    const { gl } = this.renderer;
    this.renderer.use('line', {
      clip: view.clip, offset: minus(this.anchor, view.anchor), viewport: [view.width, view.height], width: width * view.ratio, near: view.near, opacity,
    });
    gl.bindVertexArray(this.array);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, this.n - 1);
  }
}

/** Points of a circle, the first again at the end. @param {number[]} centre @param {number} radius @param {number} sides */
export function circle([x, y, z], radius, sides) {
  return Array.from({ length: sides + 1 }, (_, i) => [x + radius * Math.cos((2 * Math.PI * i) / sides), y + radius * Math.sin((2 * Math.PI * i) / sides), z]);
}
