// What is computed for the picture: views, models, links, texts.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Camera, pixelOf, placeBehind, STEEPEST } from '../../src/tussle/view/page/web/camera.js';
import { decimalsOf, duration, eventText, length, number, times } from '../../src/tussle/view/page/web/formatting.js';
import { forward, halfTurn, minus, norm, rotated, turned, unit } from '../../src/tussle/view/page/web/geometry.js';
import { geodeticOf, sidesOf } from '../../src/tussle/view/page/web/geodesy.js';
import { coarse, prepared } from '../../src/tussle/view/page/web/models.js';
import { affine, facesFromAbove, headingOf } from '../../src/tussle/view/page/web/plain.js';
import { Reader } from '../../src/tussle/view/page/web/packing.js';
import { linkOpacity, pairsWithin, sectorMesh } from '../../src/tussle/view/page/web/reach.js';

/** @param {ArrayLike<number>} a @param {ArrayLike<number>} b */
const isNear = (a, b, error = 1e-9) => assert.ok(Array.from(a).every((v, i) => Math.abs(v - b[i]) <= error), `${Array.from(a)} is not ${Array.from(b)}`);

/** A camera that has come to rest. @param {Camera} camera */
function rested(camera) {
  while (camera.step(1, true));
  return camera;
}

test('what the camera looks at is in the middle, and a pixel leads back to its place', () => {
  const camera = new Camera(100);
  camera.look([0, -50, 20], [1, 2, 3]);
  const view = camera.view(400, 300, 1, [0, 0, 0]);
  isNear(pixelOf(view, [1, 2, 3]), [200, 150, norm([1, 52, 17])], 1e-6);
  isNear(placeBehind(view, camera, 200, 150), [1, 2, 3]);
  assert.equal(pixelOf(view, [0, -100, 20]), null, 'it lies behind the eye');
  const [x, y] = pixelOf(view, [5, 2, 3]);
  isNear(pixelOf(view, placeBehind(view, camera, x, y)).slice(0, 2), [x, y], 1e-6);
});

test('a fitted view has all places inside the room that panels leave', () => {
  const camera = new Camera(100);
  const places = [[0, 0, 0], [80, 5, 3], [-30, 60, 10], [10, -90, 40]];
  camera.fit((see) => places.forEach(([x, y, z]) => see(x, y, z)), 4 / 3, { left: 0.1, right: 0.2, top: 0.1, bottom: 0.3 });
  const view = rested(camera).view(400, 300, 1, [0, 0, 0]);
  for (const place of places) {
    const [x, y] = pixelOf(view, place);
    assert.ok(x > 39 && x < 321 && y > 29 && y < 211, `${x}, ${y}`);
  }
});

test('following keeps the view and goes with the entity', () => {
  const camera = new Camera(100);
  camera.look([0, -50, 20], [1, 2, 3]);
  const before = camera.view(400, 300, 1, [0, 0, 0]).eye;
  camera.enter('follow', [10, 0, 0], 0);
  isNear(camera.view(400, 300, 1, [0, 0, 0]).eye, before, 1e-6);
  rested(camera);
  isNear(camera.target, [10, 0, 0]);
  camera.track([20, 0, 0], 1);
  isNear(camera.target, [20, 0, 0]);
  camera.enter('behind', [20, 0, 0], Math.PI / 2);
  isNear(rested(camera).axes().away.slice(0, 2), [0, -Math.cos(camera.now.pitch)], 1e-6);
});

test('undo returns to the view before, and to who was chosen', () => {
  const camera = rested(new Camera(100));
  const [yaw, distance] = [camera.now.yaw, camera.distance];
  camera.remember(5);
  camera.turn(1, 9);
  camera.zoom(0.5);
  rested(camera);
  assert.deepEqual([camera.now.pitch, Math.round(camera.distance)], [STEEPEST, 50]);
  assert.equal(camera.undo(), 5);
  rested(camera);
  isNear([camera.now.yaw, camera.distance], [yaw, distance], 1e-6);
  assert.equal(camera.undo(), null);
});

test('coming nearer to a place leaves it where it is', () => {
  const camera = rested(new Camera(100));
  const place = placeBehind(camera.view(400, 300, 1, [0, 0, 0]), camera, 300, 100);
  camera.enter('free');
  camera.zoom(0.5, place);
  isNear(pixelOf(rested(camera).view(400, 300, 1, [0, 0, 0]), place).slice(0, 2), [300, 100], 1e-6);
});

test('angles and directions', () => {
  isNear([halfTurn(7), halfTurn(-4)], [7 - 2 * Math.PI, 2 * Math.PI - 4]);
  isNear(forward([Math.SQRT1_2, 0, 0, Math.SQRT1_2]), [0, 1, 0]);
  assert.deepEqual([unit([0, 3, 4]), unit([0, 0, 0])], [[0, 0.6000000000000001, 0.8], [0, 0, 0]]);
});

test('a box has sharp edges and flat sides, a fine roof round ones', () => {
  const tent = (height) => ({ vertices: [-1, 0, 0, 0, 0, height, 1, 0, 0, 0, 2, height], faces: [0, 1, 3, 1, 2, 3] });
  const [steep, flat] = [prepared(tent(1)), prepared(tent(0.01))];
  assert.equal(steep.corners.length, 6 * 8);
  assert.equal(steep.lines.length / 16, 5, 'four sides and the ridge');
  assert.equal(flat.lines.length / 16, 4, 'the ridge is no edge');
  const normals = (corners, i) => corners.subarray(8 * i + 4, 8 * i + 7);
  isNear(normals(flat.corners, 1), normals(flat.corners, 3), 1e-6);
  assert.ok(norm(minus(normals(steep.corners, 1), normals(steep.corners, 3))) > 0.5);
});

test('a coarse mesh has few faces, and reaches as far', () => {
  const n = 24;
  const at = (/** @type {number} */ i, /** @type {number} */ j) => {
    const [up, round] = [(Math.PI * j) / n, (2 * Math.PI * i) / n];
    return [2 * Math.sin(up) * Math.cos(round), Math.sin(up) * Math.sin(round), 3 * Math.cos(up)];
  };
  const vertices = [];
  const faces = [];
  for (let j = 0; j <= n; j++) for (let i = 0; i < n; i++) vertices.push(...at(i, j));
  for (let j = 0; j < n; j++) for (let i = 0; i < n; i++) {
    const [a, b] = [n * j + i, n * j + ((i + 1) % n)];
    faces.push(a, a + n, b, b, a + n, b + n);
  }
  const few = coarse({ vertices, faces });
  assert.ok(few.faces.length < faces.length / 10, `${few.faces.length / 3} faces`);
  assert.deepEqual(coarse(few).faces.length, few.faces.length, 'what is coarse stays');
  const reach = (/** @type {number[]} */ corners) => [0, 1, 2].map((k) => Math.max(...corners.map((i) => vertices[3 * i + k])));
  isNear(reach(few.faces), reach(faces), 0.35);
});

test('a field of view ends at its angles, and is closed', () => {
  const degree = Math.PI / 180;
  for (const [wide, tall] of [[120, 40], [200, 90], [360, 60], [90, 180], [360, 180]]) {
    const { vertices, faces } = sectorMesh(wide * degree, tall * degree);
    const corners = Array.from({ length: vertices.length / 3 }, (_, i) => vertices.slice(3 * i, 3 * i + 3)).slice(1);
    const [turns, rises] = [corners.map(([x, y]) => Math.atan2(y, x)), corners.map(([, , z]) => Math.asin(Math.max(-1, Math.min(1, z))))];
    if (tall < 180) isNear([Math.max(...turns), Math.min(...turns)].map(Math.abs), [wide / 2, wide / 2].map((angle) => angle * degree), 1e-9);
    isNear([Math.max(...rises), Math.min(...rises)], [(tall / 2) * degree, (-tall / 2) * degree], 1e-6);
    assert.ok(corners.every((corner) => Math.abs(norm(corner) - 1) < 1e-9));
    // Each edge has a face on both sides: places are compared, as both ends of a full turn are one.
    const key = (i) => vertices.slice(3 * i, 3 * i + 3).map((c) => (Math.round(c * 1e6) / 1e6) + 0).join(' ');
    const seen = new Map();
    for (let f = 0; f < faces.length; f += 3) {
      for (let k = 0; k < 3; k++) {
        const [a, b] = [key(faces[f + k]), key(faces[f + ((k + 1) % 3)])];
        if (a !== b) seen.set(`${a} > ${b}`, (seen.get(`${a} > ${b}`) || 0) + 1);
      }
    }
    for (const [edge, n] of seen) assert.equal(seen.get(edge.split(' > ').reverse().join(' > ')), n, `${wide} x ${tall}: ${edge}`);
  }
});

test('attitudes are joined, and turn vectors', () => {
  const half = Math.SQRT1_2;
  const [left, down] = [[half, 0, 0, half], [half, 0, half, 0]];
  isNear(rotated(left, [1, 0, 0]), [0, 1, 0]);
  isNear(rotated(turned(left, down), [1, 0, 0]), rotated(left, rotated(down, [1, 0, 0])));
  isNear(forward(turned(left, down)), [0, 0, -1]);
});

test('of many links each is the more transparent', () => {
  assert.deepEqual([linkOpacity(0), linkOpacity(1)], [0.45, 0.45]);
  assert.ok(linkOpacity(400) < linkOpacity(100) && linkOpacity(1e5) >= 0.1);
});

test('links join those in reach, each pair once', () => {
  const places = Array.from({ length: 60 }, (_, i) => [(i * 37) % 50, (i * 17) % 40, (i * 7) % 11]);
  const slow = places.flatMap((a, i) => places.slice(0, i).filter((b) => norm(minus(a, b)) <= 9));
  assert.equal(pairsWithin(places, 9).length, slow.length);
  assert.ok(slow.length > 20);
  assert.deepEqual(pairsWithin(places, 0), []);
});

test('whole numbers and differences of differences are read', () => {
  const reader = new Reader(Uint8Array.from([1, 0, 1, 2, 3, 4, /* column */ 2, 1, 20, 1, 2, 2, 0]));
  assert.deepEqual([...reader.ints(5)], [0, -1, 1, -2, 2]);
  assert.deepEqual([...reader.column(Int32Array.of(4))], [10, 11, 13, 15]);
});

test('numbers, lengths and times as text', () => {
  assert.deepEqual([number(1234567), number(-0.04, 1), number(-2.5, 1)], ['1,234,567', '0.0', '−2.5']);
  assert.deepEqual([1500, 2, 0.05, 0.002, 0.0005].map(length), ['1.5 km', '2 m', '5 cm', '2.0 mm', '0.50 mm']);
  assert.deepEqual([times(0.5), times(Infinity)], ['0.5×', 'max']);
  assert.deepEqual([0.1, 0.04, 1, 1e-9].map(decimalsOf), [1, 2, 1, 9]);
  for (let digits = 1; digits < 10; digits++) {
    const step = 10 ** -digits;
    assert.notEqual((3 * step).toFixed(decimalsOf(step)), (2 * step).toFixed(decimalsOf(step)), `steps of ${step} s are told apart`);
    assert.equal(Number.parseFloat(duration(20 * step).replace('−', '-')), Number((20 * step).toPrecision(4)), duration(20 * step));
  }
  assert.deepEqual([100000, 500.5, 0.1 + 0.2, 0].map(duration), ['100,000 s', '500.5 s', '0.3 s', '0 s']);
});

test('events as sentences', () => {
  const who = (id) => `drone ${id}`;
  const say = (kind, id = 1, other = 0, text = '') => eventText({ t: 0, kind, id, other, text }, who);
  assert.equal(say('capture', 1, 2), 'drone 1 captured drone 2');
  assert.equal(say('collision', 1, 2), 'drone 1 and drone 2 collided');
  assert.equal(say('collision'), 'drone 1 hit the ground');
  assert.equal(say('death', 1, 3, 'fuel'), 'drone 1 died: fuel (drone 3)');
  assert.equal(say('end', 0, 0, 'one_team'), 'the game ended: one team is left');
  assert.equal(say('landing', 1, 0, 'soft'), 'landing drone 1 soft');
});

/** Origins, places, and what geodesy.py makes of them. */
const PLACES = [
  [[52.2, 13.3, 40.0], [1000.0, 2000.0, 50.0], [52.217972922193184, 13.314631666182315, 90.39193027466536]],
  [[-33.9, 18.4, 120.0], [-20000.0, 15000.0, 3000.0], [-33.764644611874175, 18.184214319197242, 3169.0024496670812]],
  [[89.9, 10.0, 0.0], [500.0, 12000.0, 0.0], [89.99132028538078, 158.9528142736838, 11.270237105898559]],
  [[0.0, -60.0, 10.0], [0.0, 0.0, -30.0], [0.0, -59.99999999999999, -20.000000000931323]],
];

test('latitude and longitude of a place are those of geodesy.py, to a millimetre', () => {
  for (const [origin, place, expected] of PLACES) {
    const found = geodeticOf(origin, place);
    isNear(found.slice(0, 2), expected.slice(0, 2), 1e-8);
    isNear(found.slice(2), expected.slice(2), 1e-3);
  }
  isNear(geodeticOf([0, 179.999, 0], [1000, 0, 0]).slice(0, 2), [0, -179.9920168], 1e-6);
  assert.equal(geodeticOf([0, 0, 0], [2e6, 0, 0]), null);
  assert.deepEqual(sidesOf([-33.9, 18.4]), ['33.900000° S', '18.400000° E']);
  assert.deepEqual(sidesOf([0, -0.0000012]), ['0.000000° N', '0.000001° W']);
});

test('a plain map has north up and one scale, whatever the height, and a pixel leads back to its place', () => {
  const camera = new Camera(100);
  camera.look([30, -50, 20], [1, 2, 3]);
  camera.isPlain = true;
  const view = camera.view(400, 300, 1, [10, 20, 0]);
  isNear(pixelOf(view, [1, 2, 3]).slice(0, 2), [200, 150], 1e-6);
  const perMetre = 1 / (view.perPixel * view.distance);
  for (const height of [-500, 3, 1e4]) isNear(pixelOf(view, [6, 12, height]).slice(0, 2), [200 + 5 * perMetre, 150 - 10 * perMetre], 1e-6);
  const [a, b, c, d, e, f] = affine(view);
  isNear([a * -4 + c * -8 + e, b * -4 + d * -8 + f], pixelOf(view, [6, 12, 7]), 1e-6);
  isNear(placeBehind(view, camera, ...pixelOf(view, [6, 12, 3]).slice(0, 2)), [6, 12, 3], 1e-6);
});

test('behind an entity, a plain map has its heading up; panels leave room as in 3D', () => {
  const camera = new Camera(100);
  camera.isPlain = true;
  camera.enter('behind', [0, 0, 0], 0.3);
  isNear(rested(camera).axes().up, [Math.cos(0.3), Math.sin(0.3), 0], 1e-6);
  camera.enter('overview');
  const places = [[0, 0, 0], [80, 5, 3000], [-30, 60, 10], [10, -90, -40]];
  camera.fit((see) => places.forEach(([x, y, z]) => see(x, y, z)), 4 / 3, { left: 0.1, right: 0.2, top: 0.1, bottom: 0.3 });
  const pixels = places.map((place) => pixelOf(rested(camera).view(400, 300, 1, [0, 0, 0]), place));
  for (const [x, y] of pixels) assert.ok(x > 39 && x < 321 && y > 29 && y < 211, `${x}, ${y}`);
  const heights = pixels.map(([, y]) => y);
  assert.ok(Math.max(...heights) - Math.min(...heights) > 179, 'it is as near as it can be');
});

test('from above, faces that look up are seen, and headings are those of level bodies', () => {
  const box = { vertices: [0, 1, 2, 3, 4, 5, 6, 7].flatMap((i) => [(i & 1) - 0.5, ((i >> 1) & 1) - 0.5, (i >> 2) - 0.5]),
    faces: [0, 3, 1, 0, 2, 3, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 1, 3, 7, 1, 7, 5, 3, 2, 6, 3, 6, 7, 2, 0, 4, 2, 4, 6] };
  const area = (/** @type {number[][][]} */ faces) => faces.reduce((sum, [p, q, r]) => sum + 0.5 * ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])), 0);
  isNear([area(facesFromAbove(box, [1, 0, 0, 0], [4, 2, 1]))], [8]);
  isNear([area(facesFromAbove(box, [Math.SQRT1_2, Math.SQRT1_2, 0, 0], [4, 2, 1]))], [4], 1e-6);
  isNear(headingOf([Math.cos(0.4), 0, 0, Math.sin(0.4)]), [Math.cos(0.8), Math.sin(0.8)]);
  isNear(headingOf([Math.SQRT1_2, 0, Math.SQRT1_2, 0]), [1, 0], 1e-3);
});
