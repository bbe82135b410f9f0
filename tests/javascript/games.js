// Games without a browser: chunks as chunks.py packs them, and a page that shows them.
/** @import { PageData, Source } from '../../src/tussle/view/page/web/types' */

/** A number in zigzag, as four planes of one byte per number. @param {number[]} values */
function ints(values) {
  const zigzag = values.map((v) => ((v << 1) ^ (v >> 31)) >>> 0);
  return [4, ...[0, 8, 16, 24].flatMap((shift) => zigzag.map((v) => (v >>> shift) & 255))];
}

/** Series as their first numbers and their differences. @param {number[][]} series */
function column(series) {
  return [1, ...ints(series.map(([first]) => first)), ...ints(series.flatMap((s) => s.slice(1).map((v, i) => v - s[i])))];
}

/**
 * A chunk of entities that fly east, in steps of 0.5 m.
 * @param {number} first @param {number[]} times @param {{ id: number, begin: number, x: number[] }[]} tracks
 */
export function chunkBytes(first, times, tracks) {
  const head = new DataView(new ArrayBuffer(52 + 8 * times.length));
  [10, 20, 30, 0.5, 2].forEach((value, i) => head.setFloat64(8 * i, value, true));
  [first, times.length, tracks.length].forEach((value, i) => head.setUint32(40 + 4 * i, value, true));
  times.forEach((t, i) => head.setFloat64(52 + 8 * i, t, true));
  const flat = tracks.map(({ x }) => x.map(() => 0));
  const rows = [tracks.map(({ id }) => id), flat.map(() => 1), flat.map(() => 0), tracks.map(({ begin }) => begin), tracks.map(({ begin, x }) => begin + x.length - 1)];
  const health = tracks.map(({ x }) => x.map(() => 255));
  return Uint8Array.from([
    ...new Uint8Array(head.buffer), ...rows.flatMap(ints), ...column(tracks.map(({ x }) => x)), ...[1, 2, 3, 4, 5, 6].flatMap(() => column(flat)), ...column(health),
  ]);
}

/** A page of one team with one block. @param {Partial<PageData>} more @returns {PageData} */
export function pageData(more = {}) {
  return (({
    blocks: [{ name: 'drone', team: 1, colour: [1, 2, 3], model: 'sphere', lengths: [1, 1, 1] }], teams: [{ id: 1, name: 'drones', colour: [1, 2, 3] }],
    scenery: { low: [0, 0, 0], high: [400, 0, 0] }, attitudeUnit: 2047, healthSteps: 255, idShift: 0, ...more,
  }));
}

/** A source of data by name. @param {Record<string, Uint8Array>} blobs @returns {Source} */
export function sourceOf(blobs) {
  return { isLive: false, blob: async (name) => blobs[name] };
}
