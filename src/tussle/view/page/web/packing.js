// Numbers as packing.py writes them.

import { length } from './formatting.js';

/** Reads numbers one block after another. */
export class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;
  }

  /** n whole numbers: planes of bytes, zigzag. */
  ints(n) {
    const { bytes } = this;
    const nPlanes = bytes[this.at++];
    const out = new Int32Array(n);
    for (let plane = 0; plane < nPlanes; plane++) {
      const shift = 8 * plane;
      const from = this.at + plane * n;
      for (let i = 0; i < n; i++) out[i] |= bytes[from + i] << shift;
    }
    for (let i = 0; i < n; i++) out[i] = (out[i] >>> 1) ^ -(out[i] & 1);
    this.at += nPlanes * n;
    return out;
  }

  /** Series of whole numbers, of which each begins with its first one and goes on with differences, or differences of these. */
  column(counts) {
    const order = this.bytes[this.at++];
    let n = 0;
    for (const count of counts) n += count;
    const heads = this.ints(counts.length);
    const steps = this.ints(n - counts.length);
    const out = new Int32Array(n);
    let row = 0;
    let next = 0;
    for (let series = 0; series < counts.length; series++) {
      let value = heads[series];
      let slope = 0;
      out[row++] = value;
      for (let k = 1; k < counts[series]; k++) {
        slope = order === 2 ? slope + steps[next] : steps[next];
        next++;
        value += slope;
        out[row++] = value;
      }
    }
    return out;
  }

  /** n real numbers: eight planes of bytes. */
  reals(n) {
    const raw = new Uint8Array(8 * n);
    for (let plane = 0; plane < 8; plane++) {
      for (let i = 0; i < n; i++) raw[8 * i + plane] = this.bytes[this.at + plane * n + i];
    }
    this.at += 8 * n;
    const view = new DataView(raw.buffer);
    return Float64Array.from({ length: n }, (_, i) => view.getFloat64(8 * i, true));
  }
}
