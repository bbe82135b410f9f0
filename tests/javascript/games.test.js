// Reading and playing games: chunks, recordings, live games, events.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Chunk, Moment } from '../../src/tussle/view/page/web/chunk.js';
import { Layer } from '../../src/tussle/view/page/web/layer.js';
import { lastNotAfter, lastWhere } from '../../src/tussle/view/page/web/ordered.js';
import { SeriesBook, steps } from '../../src/tussle/view/page/web/series.js';
import { Live } from '../../src/tussle/view/page/web/live.js';
import { Recorded } from '../../src/tussle/view/page/web/recorded.js';
import { chunkBytes, pageData, sourceOf } from './games.js';

const TRACKS = [{ id: 7, begin: 0, x: [0, 2, 4] }, { id: 9, begin: 1, x: [100, 100] }];
const nothing = () => {};

/** A recording of two chunks whose second one begins with the last frame of the first. @param {(error: Error) => void} failed */
async function recorded(failed = assert.ifError) {
  const text = JSON.stringify([[0, 'birth', 7, 0, 'drone'], [1, 'capture', 7, 9, ''], [1, 'death', 9, 7, ''], [2, 'death', 5, 0, 'fuel']]);
  const blobs = {
    times: new Uint8Array(new Float64Array([0, 1, 2, 3]).buffer), events: new TextEncoder().encode(text),
    curves: new TextEncoder().encode(JSON.stringify([{ name: 'left', team: 1, id: 0, from: 0, t: [0, 2], v: [2, 1] }])),
    'chunk-0': chunkBytes(0, [0, 1, 2], [TRACKS[0], { id: 9, begin: 0, x: [100, 100] }]), 'chunk-1': chunkBytes(2, [2, 3], [{ id: 7, begin: 0, x: [4, 400] }]),
  };
  const page = pageData({ nFrames: 4, nStates: 7, chunks: [[0, 2], [2, 3]] });
  const layer = new Recorded(page, sourceOf(blobs), nothing, failed);
  await layer.read();
  return layer;
}

/** Show a time of a recording, when what it needs is there. @param {Recorded} layer @param {number} t */
async function shown(layer, t) {
  layer.show(t);
  await new Promise((done) => setTimeout(done));
  assert.ok(layer.show(t));
  return layer.shown;
}

test('a chunk holds tracks, of which each frame shows those that are there', () => {
  const chunk = new Chunk(chunkBytes(5, [0, 1, 2], TRACKS), pageData());
  assert.deepEqual([chunk.first, chunk.nFrames, chunk.nStates], [5, 3, 5]);
  assert.deepEqual([...chunk.sample(0).ids()], [7]);
  assert.deepEqual([...chunk.sample(1).ids()], [7, 9]);
  assert.deepEqual(chunk.sample(1).placeOf(7), [11, 20, 30]);
  assert.equal(chunk.sample(0).placeOf(9), null);
  const moment = new Moment(1).fill(chunk, 1, 0.5);
  assert.deepEqual([moment.n, moment.frame, moment.placeOf(7), moment.slotOf(3)], [2, 6, [11.5, 20, 30], -1]);
  assert.deepEqual([...moment.quat.subarray(0, 4), moment.health[0]], [1, 0, 0, 0, 2]);
});

test('a recording is read chunk by chunk and shown between frames', async () => {
  const layer = await recorded();
  assert.equal(layer.show(0.5), false, 'its chunk is not there yet');
  assert.deepEqual((await shown(layer, 0.5)).placeOf(7), [10.5, 20, 30]);
  assert.equal((await shown(layer, 2.5)).frame, 2);
  assert.deepEqual([layer.frameAt(1 - 1e-9), layer.frameAt(0.9), layer.chunkOf(2)], [1, 0, 1]);
});

test('a recording whose data cannot be read says so', async () => {
  const errors = [];
  const layer = await recorded((error) => errors.push(error));
  layer.source.blob = async () => { throw new Error('gone'); };
  layer.show(0);
  await new Promise((done) => setTimeout(done));
  assert.equal(errors[0].message, 'gone');
});

test('a specification is as the last moment says, and an alarm stays', async () => {
  const alarms = [
    { id: 0, text: 'far', unit: 'm', near: 0.5, failed: 1, t: [0, 0.5, 1], least: [3, 0.5, -1], note: '' },
    { id: 0, text: 'broken', unit: '', near: /** @type {null} */ (null), failed: /** @type {null} */ (null), t: [], least: [], note: 'no number' },
  ];
  const changes = [{ name: 'far', team: /** @type {null} */ (null), id: 0, from: 0, t: [0, 0.5, 1, 1.5], v: [3, 0.5, -1, 2] }];
  const layer = new Recorded(pageData({ nFrames: 1, alarms }), sourceOf({}), () => {}, assert.fail);
  layer.series.take(changes);
  const at = (/** @type {number} */ t) => layer.alarmsAt(t)[0];
  assert.deepEqual([at(0).state, at(0).since, at(0).now, at(0).least], ['holds', null, 3, 3]);
  assert.deepEqual([at(0.7).state, at(0.7).since, at(0.7).reached], ['near', 0.5, 0.5]);
  assert.deepEqual([at(1.6).state, at(1.6).since, at(1.6).now, at(1.6).least], ['failed', 1, 2, -1]);
  assert.deepEqual([at(-1).state, at(-1).now, at(-1).least], ['open', null, null]);
  assert.deepEqual([layer.alarmsAt(1)[1].state, layer.alarmsAt(1)[1].note], ['unknown', 'no number']);
});

test('shapes are read in groups of frames, and last until the next ones', async () => {
  const layer = await recorded();
  assert.equal((await shown(layer, 1)) && layer.shapesShown(), null);
  const message = (frame, width) => {
    const header = new TextEncoder().encode(JSON.stringify({ width }).padEnd(16));
    return [...new Uint8Array(Uint32Array.of(frame, 24, 16).buffer), ...header, 1, 2, 3, 4];
  };
  layer.page.shapeFrames = 64;
  layer.source.blob = async () => Uint8Array.from([...message(0, 5), ...message(2, 6)]);
  assert.equal(layer.shapesShown(), undefined, 'they are not there yet');
  await new Promise((done) => setTimeout(done));
  assert.deepEqual([layer.shapesShown().header.width, [...layer.shapesShown().bytes]], [5, [1, 2, 3, 4]]);
  layer.shown.frame = 3;
  assert.equal(layer.shapesShown().header.width, 6);
});

test('velocity is that of the frames around, and none over a jump', async () => {
  const layer = await recorded();
  await shown(layer, 1);
  assert.deepEqual(layer.velocity(7), [1, 0, 0]);
  await shown(layer, 3);
  assert.deepEqual(layer.velocity(7), [0, 0, 0]);
});

test('trails lead back, of the dead too, and end at a jump', async () => {
  const layer = await recorded();
  await shown(layer, 0);
  await shown(layer, 3);
  /** Times of all trails, by id. @param {number[] | null} only */
  const times = (only = null) => {
    const found = [];
    layer.trails(10, 100, only, (id, _, when) => found.push([id, when]));
    return found;
  };
  assert.deepEqual(times(), [[9, [1, 0]]], 'the last place of 7 is a jump away from all others');
  await shown(layer, 2);
  assert.deepEqual(times(), [[7, [2, 1, 0]], [9, [1, 0]]]);
  assert.deepEqual(times([9]), [[9, [1, 0]]]);
});

test('a capture tells of the death, and names come from births', async () => {
  const layer = await recorded();
  assert.deepEqual(layer.events.map(({ kind }) => kind), ['birth', 'capture', 'death']);
  assert.equal(layer.series.of('left', 1).at(2.5), 1);
  assert.deepEqual(layer.marked.map(({ t, kind }) => [t, kind]), [[1, 'capture'], [2, 'death']]);
  assert.deepEqual([layer.who(7), layer.who(5), layer.teamOf(7).id, layer.teamOf(5).id], ['drone 7', '5', 1, 0]);
  assert.equal(new Layer(pageData({ idShift: 10 }), nothing).who(13), '3');
});

test('colours are those of the block in its own team', () => {
  const layer = new Layer(pageData({ teams: [{ id: 1, name: '', colour: [1, 1, 1] }, { id: 2, name: '', colour: [2, 2, 2] }] }), nothing);
  assert.deepEqual([layer.colour(0, 1), layer.colour(0, 2)], [[1, 2, 3], [2, 2, 2]]);
});

test('a live game keeps its frames, and forgets them when it jumps', () => {
  const layer = new Live(pageData(), nothing);
  assert.equal(layer.show(), false);
  const frame = (t, epoch = 1) => layer.takeFrame({ epoch }, chunkBytes(t, [t], [{ id: 7, begin: 0, x: [2 * t] }]));
  frame(1);
  frame(2);
  layer.advance(1);
  assert.deepEqual([layer.show(), layer.end, layer.past.length], [true, 2, 2]);
  assert.deepEqual(layer.velocity(7), [1, 0, 0]);
  layer.takePast({ epoch: 1, seconds: 5 }, chunkBytes(0, [0, 1], [{ id: 7, begin: 0, x: [0, 2] }, { id: 4, begin: 0, x: [90] }]));
  assert.deepEqual(layer.past.map(({ t }) => t), [0, 1, 2]);
  assert.equal(layer.who(4), 'drone 4', 'it was gone before the first frame');
  assert.deepEqual(layer.samples(1.5, 10).map(({ t }) => t), [1]);
  frame(1, 2);
  assert.deepEqual([layer.past.length], [1]);
  layer.takePast({ epoch: 1, seconds: 5 }, new Uint8Array(0));
  assert.equal(layer.past.length, 1, 'what was asked for before the jump is not taken');
});

test('between two states of a live game entities are on the way, and arrive', () => {
  const layer = new Live(pageData({ endTime: 60 }), nothing);
  const clock = { now: 0 };
  const real = performance.now;
  /** Way east in steps, as the chunks have it. */
  const way = () => 2 * (layer.shown.placeOf(7)[0] - 10);
  const isNear = (a, b) => assert.ok(Math.abs(a - b) < 1e-2, `${a} is not ${b}`);
  performance.now = () => 1000 * clock.now;
  const frame = (t, now, x, more = []) => {
    clock.now = now;
    layer.takeFrame({ epoch: 1 }, chunkBytes(10 * t, [t], [{ id: 7, begin: 0, x: [x] }, ...more]));
  };
  try {
    frame(1, 5, 0);
    frame(1.1, 5.1, 2);
    assert.deepEqual([layer.shown.t, layer.isSettled], [1, false], 'a state is approached over the time to the one before');
    layer.advance(0.05);
    layer.show();
    isNear(layer.shown.t, 1.05);
    isNear(way(), 1);
    frame(1.2, 5.2, 6, [{ id: 8, begin: 0, x: [0] }]);
    isNear(way(), 1);
    assert.equal(layer.slotOf(8), -1, 'it is born at the end of the way');
    for (const seconds of [0.05, 0.04]) layer.advance(seconds);
    layer.show();
    assert.ok(layer.shown.t > 1.1 && way() > 2, 'the way leads through the states');
    layer.advance(0.5);
    layer.show();
    assert.deepEqual([layer.shown.t, layer.isSettled, layer.shown.n], [1.2, true, 2]);
    frame(1.3, 5.3, 1e6);
    layer.advance(0.05);
    layer.show();
    assert.ok(way() < 7, 'a jump has no way');
    layer.status = /** @type {any} */ ({ isPaused: true });
    frame(1.4, 5.4, 8);
    assert.deepEqual([layer.shown.t, layer.isSettled], [1.4, true], 'a step of a paused game is shown at once');
  } finally {
    performance.now = real;
  }
});

test('the time line of a live game reaches to the end that its mission has', () => {
  const layer = new Live(pageData({ endTime: 60 }), nothing);
  const status = (t, isOver) => layer.takeStatus(/** @type {any} */ ({ t, span: [0, t], events: { from: 0, rows: [] }, scores: {}, isOver }));
  status(5, false);
  assert.deepEqual([layer.end, layer.horizon], [5, 60]);
  status(12, true);
  assert.deepEqual([layer.end, layer.horizon], [12, 12], 'it is over before');
  const endless = new Live(pageData({ endTime: null }), nothing);
  endless.takeStatus(/** @type {any} */ ({ t: 5, span: [0, 5], events: { from: 0, rows: [] }, scores: {}, isOver: false }));
  assert.equal(endless.horizon, 5);
});

test('events of a live game grow, and are cut where it takes another course', () => {
  const layer = new Live(pageData(), nothing);
  const status = (t, from, rows) => layer.takeStatus(({ t, span: [0, 9], events: { from, rows } }));
  status(1, 0, [[0.5, 'death', 3, 0, '']]);
  status(2, 1, [[1.5, 'death', 4, 0, '']]);
  assert.equal(layer.marked.length, 2);
  status(1, 1, []);
  assert.equal(layer.marked.length, 1);
});

test('a quantity keeps its value until the next change, and later changes replace those that are wrong', () => {
  const book = new SeriesBook();
  const change = { name: 'left', team: 1, id: 0 };
  book.take([{ ...change, from: 0, t: [0, 2, 5], v: [4, null, 3] }]);
  const left = book.of('left', 1);
  assert.deepEqual([-1, 0, 1.9, 2, 4, 5, 99].map((t) => left.at(t)), [NaN, 4, 4, NaN, NaN, 3, 3]);
  assert.deepEqual([left.range(), left.range([0, 9])], [[3, 4], [0, 9]]);
  book.take([{ ...change, from: 1, t: [1], v: [7] }]);
  assert.deepEqual([left.t, left.v], [[0, 1], [4, 7]]);
  assert.deepEqual([book.has('left', 2), book.of('left', 2).at(3)], [false, NaN]);
});

test('curves are steps, broken where a quantity is not known', () => {
  /** @type {[string, number, number][]} */
  const drawn = [];
  globalThis.Path2D = class {
    moveTo(x, y) { drawn.push(['move', x, y]); }
    lineTo(x, y) { drawn.push(['line', x, y]); }
  };
  const same = (value) => value;
  steps(({ t: [0, 2, 5, 6], v: [4, 1, NaN, 3] }), 7, same, same);
  assert.deepEqual(drawn, [['move', 0, 4], ['line', 2, 4], ['line', 2, 1], ['line', 5, 1], ['move', 6, 3], ['line', 7, 3]]);
  drawn.length = 0;
  const many = Array.from({ length: 1000 }, (_, i) => i);
  steps(({ t: [...many, 1000], v: [...many.map((i) => (i % 2 ? 9 : 5)), 7] }), 1001, (t) => t / 100, same);
  assert.ok(drawn.length < 120, 'as many as fall on half a pixel are one line');
  const levels = drawn.map(([, , level]) => level);
  assert.deepEqual([Math.min(...levels), Math.max(...levels), levels[levels.length - 1]], [5, 9, 7]);
});

test('a place in an ordered list is found', () => {
  assert.deepEqual([0, 1, 3, 9].map((n) => lastWhere(n, (i) => i < 3)), [-1, 0, 2, 2]);
  assert.deepEqual([-1, 0, 1.5, 5].map((t) => lastNotAfter([0, 1, 2], t)), [-1, 0, 1, 2]);
});
