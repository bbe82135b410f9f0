// Numbers as packing.py writes them.

/** Header and data of a block that `message` of packing.py has made. @param {Uint8Array} bytes @returns {[any, Uint8Array]} */
export function readMessage(bytes) {
  const length = new DataView(bytes.buffer, bytes.byteOffset).getUint32(0, true);
  return [JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length))), bytes.subarray(4 + length)];
}

/** Reads numbers one block after another. */
export class Reader {
  /** @param {Uint8Array} bytes @param {number} at first byte to read */
  constructor(bytes, at = 0) {
    this.bytes = bytes;
    this.at = at;
  }

  /** n whole numbers: planes of bytes, zigzag. @param {number} n */
  ints(n) {
    const { bytes } = this;
    const nPlanes = bytes[this.at++];
    const out = new Int32Array(n);
    for (let plane = 0; plane < nPlanes; plane++) {
      const from = this.at + plane * n;
      for (let i = 0; i < n; i++) out[i] |= bytes[from + i] << (8 * plane);
    }
    for (let i = 0; i < n; i++) out[i] = (out[i] >>> 1) ^ -(out[i] & 1);
    this.at += nPlanes * n;
    return out;
  }

  /** Series of whole numbers, each stored as its first number and differences, or differences of these. @param {Int32Array} counts */
  column(counts) {
    const order = this.bytes[this.at++];
    const n = counts.reduce((sum, count) => sum + count, 0);
    const heads = this.ints(counts.length);
    const steps = this.ints(n - counts.length);
    const out = new Int32Array(n);
    let [row, next] = [0, 0];
    for (let series = 0; series < counts.length; series++) {
      let [value, slope] = [heads[series], 0];
      out[row++] = value;
      for (let k = 1; k < counts[series]; k++) {
        slope = order === 2 ? slope + steps[next++] : steps[next++];
        out[row++] = value += slope;
      }
    }
    return out;
  }

  /** n real numbers. @param {number} n */
  reals(n) {
    const out = new Float64Array(this.bytes.slice(this.at, this.at + 8 * n).buffer);
    this.at += 8 * n;
    return out;
  }
}
