// Columns of plugins that were recorded with a run, as recorded.py writes them.
/** @import { Column, Section } from './types' */

import { Reader } from './packing.js';

/** Columns in the frames of a chunk. */
export class ColumnChunk {
  /** @param {Uint8Array} bytes @param {number} first its first frame @param {number} nFrames @param {Column[]} columns */
  constructor(bytes, first, nFrames, columns) {
    const reader = new Reader(bytes);
    this.first = first;
    this.counts = reader.ints(nFrames);
    const n = this.counts.reduce((sum, count) => sum + count, 0);
    this.ids = reader.ints(n);
    this.columns = columns;
    /** Column -> its components, NaN where an entity does not have it. */
    this.values = columns.map(({ fields }) => Array.from({ length: fields.length || 1 }, () => reader.reals(n)));
  }

  /** Components of each column of an entity; NaN where it does not have it. @param {number} frame @param {number} id */
  valuesOf(frame, id) {
    const begin = this.counts.subarray(0, frame - this.first).reduce((sum, count) => sum + count, 0);
    const row = this.ids.subarray(begin, begin + this.counts[frame - this.first]).indexOf(id);
    return this.values.map((parts) => parts.map((values) => (row < 0 ? NaN : values[begin + row])));
  }

  /** Plugins of an entity with their columns. @param {number} frame @param {number} id @returns {Section[]} */
  sections(frame, id) {
    /** @type {Map<string, [string, string, string][]>} */
    const found = new Map();
    this.valuesOf(frame, id).forEach((values, i) => {
      if (values.every(Number.isNaN)) return;
      const { name, kind, units, doc } = this.columns[i];
      const at = name.lastIndexOf('.');
      const unit = new Set(units).size > 1 ? units.join(' ') : units[0];
      const text = `${values.map((value) => written(value, kind)).join('  ')} ${unit}`.trim();
      found.set(name.slice(0, at), [...(found.get(name.slice(0, at)) || []), [name.slice(at + 1), text, doc]]);
    });
    return [...found];
  }
}

/** A value of a column. @param {number} value @param {string} kind */
function written(value, kind) {
  if (kind === 'bool') return value ? 'yes' : 'no';
  return (kind === 'int' ? value : Number(value.toPrecision(4))).toLocaleString('en-US', { maximumSignificantDigits: 17 });
}
