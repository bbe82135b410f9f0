// A recording: who was there from when to when, and where. Its pieces are unpacked when they are first needed.

/** States that are kept unpacked, at 29 bytes each; the pieces that were used last stay. */
const MOST_STATES = 4e6;

/** Frames that were packed together: states track after track, frame after frame. */
class Piece {
  constructor(layer, first, last, bytes) {
    this.first = first;
    this.last = last;
    const tracks = [];
    for (let k = 0; k < layer.nTracks; k++) {
      if (layer.first[k] <= last && layer.last[k] >= first) tracks.push(k);
    }
    this.tracks = Int32Array.from(tracks);
    this.begin = this.tracks.map((k) => Math.max(layer.first[k], first));
    this.end = this.tracks.map((k) => Math.min(layer.last[k], last));
    const counts = this.begin.map((begin, i) => this.end[i] - begin + 1);
    this.row = new Int32Array(counts.length);
    for (let i = 1; i < counts.length; i++) this.row[i] = this.row[i - 1] + counts[i - 1];
    this.slotOf = new Map(tracks.map((k, i) => [k, i]));
    const reader = new Reader(bytes);
    [this.x, this.y, this.z] = [0, 1, 2].map(() => reader.column(counts));
    const [largest, ...others] = [0, 1, 2, 3].map(() => reader.column(counts));
    this.quat = attitudes(largest, others, layer.data.attitudeUnit);
    this.health = Uint8Array.from(reader.column(counts));
    this.nStates = this.x.length;
  }
}

/** Quaternions from which component is largest and steps of the three others, each up to sqrt(1/2). */
function attitudes(largest, others, unitSteps) {
  const out = new Float32Array(4 * largest.length);
  const step = Math.SQRT1_2 / unitSteps;
  for (let row = 0; row < largest.length; row++) {
    let rest = 1;
    for (let k = 0; k < 3; k++) {
      const value = others[k][row] * step;
      out[4 * row + ((largest[row] + k + 1) & 3)] = value;
      rest -= value * value;
    }
    out[4 * row + largest[row]] = Math.sqrt(Math.max(0, rest));
  }
  return out;
}

class Layer {
  /** `data` is the page's; `changed` is called when a piece has been unpacked, `failed` with an error when it cannot be. */
  constructor(data, changed, failed) {
    this.data = data;
    this.changed = changed;
    this.failed = failed;
    this.nTracks = data.nTracks;
    this.pieces = new Map();
    this.reading = new Set();
  }

  async read() {
    const reader = new Reader(await unpacked('index'));
    this.times = reader.reals(this.data.nFrames);
    for (const name of ['id', 'team', 'block', 'first', 'last']) this[name] = reader.ints(this.nTracks);
    this.start = this.times[0];
    this.end = this.times[this.times.length - 1];
    // A slider gives back times whose last digits differ from those it was given.
    this.slack = 1e-6 * ((this.end - this.start) / Math.max(1, this.times.length - 1));
    this.tracksOf = new Map();
    for (let k = 0; k < this.nTracks; k++) {
      if (!this.tracksOf.has(this.id[k])) this.tracksOf.set(this.id[k], []);
      this.tracksOf.get(this.id[k]).push(k);
    }
    this.teamIndex = new Map(this.data.teams.map((team, i) => [team.id, i]));
    this.count();
    this.happenings = this.sorted(JSON.parse(new TextDecoder().decode(await unpacked('happenings'))));
    this.reserve();
  }

  /** How many of each team there are in each frame. */
  count() {
    const { nFrames } = this.data;
    this.counts = this.data.teams.map(() => new Int32Array(nFrames + 1));
    for (let k = 0; k < this.nTracks; k++) {
      const counts = this.counts[this.teamIndex.get(this.team[k])];
      counts[this.first[k]]++;
      counts[this.last[k] + 1]--;
    }
    for (const counts of this.counts) for (let i = 1; i <= nFrames; i++) counts[i] += counts[i - 1];
    this.mostAtOnce = 0;
    for (let i = 0; i < nFrames; i++) {
      let sum = 0;
      for (const counts of this.counts) sum += counts[i];
      this.mostAtOnce = Math.max(this.mostAtOnce, sum);
    }
  }

  /** What happened, without the deaths that a capture or a collision tells of. */
  sorted(columns) {
    const all = columns.t.map((t, i) => ({ t, kind: columns.kind[i], id: columns.id[i], other: columns.other[i], text: columns.text[i] }));
    const isTold = new Set();
    for (const { t, kind, id, other } of all) {
      if (kind === 'capture') isTold.add(`${t} ${other}`);
      if (kind === 'collision') isTold.add(`${t} ${id}`).add(`${t} ${other}`);
    }
    return all.filter(({ t, kind, id }) => kind !== 'death' || !isTold.has(`${t} ${id}`));
  }

  /** Room for those who are shown at once. */
  reserve() {
    const n = this.mostAtOnce;
    this.shown = {
      n: 0, t: NaN, frame: -1, track: new Int32Array(n), x: new Float64Array(n), y: new Float64Array(n), z: new Float64Array(n),
      quat: new Float32Array(4 * n), health: new Uint8Array(n), slotOf: new Map(),
    };
  }

  who(id) {
    const tracks = this.tracksOf.get(id);
    return tracks ? `${this.data.blocks[this.block[tracks[0]]].name} ${id}` : `${id}`;
  }

  colour(track) {
    const block = this.data.blocks[this.block[track]];
    const isOfItsTeam = block.team === this.team[track];
    return isOfItsTeam ? block.colour : this.data.teams[this.teamIndex.get(this.team[track])].colour;
  }

  /** Number of the last frame that is not after a time, within a millionth of a frame. */
  frameAt(t) {
    let low = 0;
    let high = this.times.length;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.times[middle] <= t + this.slack) low = middle;
      else high = middle;
    }
    return low;
  }

  /** Number of the piece that goes on from a frame. */
  pieceOf(frame) {
    const { pieces } = this.data;
    let low = 0;
    let high = pieces.length;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (pieces[middle][0] <= frame) low = middle;
      else high = middle;
    }
    return low;
  }

  /** A piece; null where it has to be unpacked first, which begins now. */
  piece(number) {
    const piece = this.pieces.get(number);
    if (piece) {
      this.pieces.delete(number);
      this.pieces.set(number, piece);
      return piece;
    }
    if (number >= 0 && number < this.data.pieces.length) this.unpack(number).catch(this.failed);
    return null;
  }

  async unpack(number) {
    if (this.reading.has(number)) return;
    this.reading.add(number);
    const [first, last] = this.data.pieces[number];
    const bytes = await unpacked(`piece-${number}`);
    this.pieces.set(number, new Piece(this, first, last, bytes));
    this.reading.delete(number);
    let nStates = 0;
    for (const piece of this.pieces.values()) nStates += piece.nStates;
    for (const [oldest, piece] of this.pieces) {
      if (nStates <= MOST_STATES || this.pieces.size <= 2) break;
      nStates -= piece.nStates;
      this.pieces.delete(oldest);
    }
    this.changed();
  }

  /** The oldest frame that can be kept unpacked together with a frame. */
  oldestBeside(frame) {
    const { pieces, nStates } = this.data;
    const most = Math.max(1, Math.floor((0.6 * MOST_STATES * pieces.length) / nStates));
    return pieces[Math.max(0, this.pieceOf(frame) - most + 1)][0];
  }

  /** Set `shown` to a time, between frames on the straight way; false while it has to be unpacked. */
  show(t) {
    const frame = this.frameAt(t);
    const piece = this.piece(this.pieceOf(frame));
    if (!piece) return false;
    if (this.shown.t === t) return true;
    this.shown.t = t;
    const next = frame + 1 < this.times.length ? this.times[frame + 1] : t;
    const share = next > this.times[frame] ? between((t - this.times[frame]) / (next - this.times[frame]), 0, 1) : 0;
    this.fill(piece, frame, share);
    return true;
  }

  fill(piece, frame, share) {
    const { shown, data } = this;
    const { low, step } = data;
    shown.frame = frame;
    shown.slotOf.clear();
    let n = 0;
    for (let i = 0; i < piece.tracks.length; i++) {
      if (piece.begin[i] > frame || piece.end[i] < frame) continue;
      const row = piece.row[i] + frame - piece.begin[i];
      const after = frame < piece.end[i] ? row + 1 : row;
      shown.track[n] = piece.tracks[i];
      shown.slotOf.set(piece.tracks[i], n);
      shown.x[n] = low[0] + step * (piece.x[row] + share * (piece.x[after] - piece.x[row]));
      shown.y[n] = low[1] + step * (piece.y[row] + share * (piece.y[after] - piece.y[row]));
      shown.z[n] = low[2] + step * (piece.z[row] + share * (piece.z[after] - piece.z[row]));
      shown.health[n] = piece.health[row];
      turned(shown.quat, 4 * n, piece.quat, 4 * row, 4 * after, share);
      n++;
    }
    shown.n = n;
  }

  /** The track of an id in a frame; -1 where it is not there. */
  trackIn(id, frame) {
    const tracks = this.tracksOf.get(id) || [];
    const found = tracks.find((k) => this.first[k] <= frame && this.last[k] >= frame);
    return found === undefined ? -1 : found;
  }

  /** Row of an id in `shown`; -1 where it is not there. */
  slotOf(id) {
    const slot = this.shown.slotOf.get(this.trackIn(id, this.shown.frame));
    return slot === undefined ? -1 : slot;
  }

  placeIn(slot) {
    return [this.shown.x[slot], this.shown.y[slot], this.shown.z[slot]];
  }

  /** Where an entity is in a frame; null where it is not there, or that frame is not unpacked. */
  placeAt(id, frame) {
    const track = this.trackIn(id, frame);
    const piece = this.pieces.get(this.pieceOf(frame));
    if (track < 0 || !piece) return null;
    const i = piece.slotOf.get(track);
    const row = piece.row[i] + frame - piece.begin[i];
    return [0, 1, 2].map((axis) => this.data.low[axis] + this.data.step * [piece.x, piece.y, piece.z][axis][row]);
  }

  /** Velocity [m/s] of who is shown in a row, over the frames around it within half a second. */
  velocity(slot) {
    const { shown, times } = this;
    const track = shown.track[slot];
    const piece = this.pieces.get(this.pieceOf(shown.frame));
    if (!piece) return [0, 0, 0];
    const i = piece.slotOf.get(track);
    let a = shown.frame;
    let b = Math.min(shown.frame + 1, piece.end[i]);
    while (a > piece.begin[i] && times[shown.frame] - times[a - 1] <= 0.25) a--;
    while (b < piece.end[i] && times[b + 1] - times[shown.frame] <= 0.25) b++;
    if (a === b) a = Math.max(piece.begin[i], a - 1);
    if (a === b) return [0, 0, 0];
    const [from, to] = [a, b].map((frame) => piece.row[i] + frame - piece.begin[i]);
    return [piece.x, piece.y, piece.z].map((axis) => ((axis[to] - axis[from]) * this.data.step) / (times[b] - times[a]));
  }
}

/** An attitude between two, of one of which the opposite sign may be meant. */
function turned(out, at, quat, a, b, share) {
  const same = quat[a] * quat[b] + quat[a + 1] * quat[b + 1] + quat[a + 2] * quat[b + 2] + quat[a + 3] * quat[b + 3];
  const far = same < 0 ? -share : share;
  const near = 1 - share;
  let sum = 0;
  for (let k = 0; k < 4; k++) {
    out[at + k] = near * quat[a + k] + far * quat[b + k];
    sum += out[at + k] * out[at + k];
  }
  const size = 1 / Math.sqrt(sum || 1);
  for (let k = 0; k < 4; k++) out[at + k] *= size;
}
