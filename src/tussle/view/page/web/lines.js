// Lines: trails of entities, outlines and axes.
/** @import { Colour, Vector, View } from './types' */

import { minus } from './geometry.js';
import { PlainRenderer } from './plain.js';
import { Instances, Renderer } from './renderer.js';

/** Of a point of a line: place, colour, and in a byte its age from 0 to 127 and whether a line goes on from it to the next. */
const POINT_BYTES = 16;

/** Points of lines; each goes on to the next one, if it says so. */
export class Lines extends Instances {
  /** @param {Renderer | PlainRenderer} renderer */
  constructor(renderer) {
    super(renderer, POINT_BYTES);
    /** @type {Vector} */
    this.anchor = [0, 0, 0];
  }

  /** Start anew, with places relative to an anchor. @param {Vector} anchor */
  begin(anchor) {
    this.anchor = anchor;
    this.n = 0;
  }

  /** @param {Vector} place @param {number} age from 0 to 1 @param {Colour} colour @param {boolean} goesOn */
  add(place, age, colour, goesOn) {
    const at = (POINT_BYTES / 4) * this.append(colour, 2 * Math.round(127 * age) + Number(goesOn));
    for (let k = 0; k < 3; k++) this.floats[at + k] = place[k] - this.anchor[k];
  }

  /** @param {Vector} a @param {Vector} b @param {Colour} colour */
  segment(a, b, colour) {
    this.add(a, 0, colour, true);
    this.add(b, 0, colour, false);
  }

  /** @param {View} view @param {number} width pixels of the screen @param {number} opacity */
  draw(view, width, opacity) {
    if (this.n < 2) return;
    if (this.renderer instanceof PlainRenderer) {
      this.renderer.drawLines(this, view, width, opacity);
      return;
    }
    this.renderer.use('line', {
      clip: view.clip, offset: minus(this.anchor, view.anchor), viewport: [view.width, view.height], width: width * view.ratio, near: view.near, opacity,
    });
    this.drawVertices(this.renderer.gl.TRIANGLES, 6 * (this.n - 1));
  }
}

/** Points of a circle, the first again at the end. @param {number[]} centre @param {number} radius @param {number} sides */
export function circle([x, y, z], radius, sides) {
  return Array.from({ length: sides + 1 }, (_, i) => [x + radius * Math.cos((2 * Math.PI * i) / sides), y + radius * Math.sin((2 * Math.PI * i) / sides), z]);
}
