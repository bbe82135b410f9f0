// The clock: what time it is, how fast it goes, and the slider that shows it. Of a recording it is this page's own, of a live game the
// game's, which all who watch share.
/** @import { PageData, Source } from './types' */

import { byId, decimalsOf, field, say, times } from './formatting.js';
import { between } from './geometry.js';
import { Layer } from './layer.js';
import { Live } from './live.js';
import { Recorded } from './recorded.js';

const SPEEDS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 1000];

/** What both clocks have in common; `t`, `isPlaying` and `speed` are their own. */
export class Clock {
  /** @param {Layer} layer */
  constructor(layer) {
    this.layer = layer;
    this.slider = field('time');
    this.decimals = 2;
    this.isLooping = false;
    this.fitSlider();
  }

  /** Let the slider reach as far as the game. */
  fitSlider() {
    this.slider.min = String(this.layer.start);
    this.slider.max = String(this.layer.horizon);
  }

  /** @param {number} t @param {boolean} isPlaying @param {number} speed */
  show(t, isPlaying, speed) {
    const { slider, decimals } = this;
    const { start, end, horizon } = this.layer;
    const share = (/** @type {number} */ time) => `${horizon > start ? (100 * (time - start)) / (horizon - start) : 0}%`;
    this.fitSlider();
    if (document.activeElement !== slider || isPlaying) slider.value = String(t);
    slider.style.setProperty('--done', share(t));
    slider.style.setProperty('--known', share(end));
    slider.setAttribute('aria-valuetext', `${t.toFixed(decimals)} seconds`);
    say(document.querySelector('#clock b'), t.toFixed(decimals));
    say(document.querySelector('#clock span'), `/ ${horizon.toFixed(decimals)} s`);
    byId('play').classList.toggle('is-playing', isPlaying);
    byId('play').setAttribute('aria-label', isPlaying ? 'Pause' : 'Play');
    say(byId('speed'), times(speed));
  }
}

export class RecordedClock extends Clock {
  /** @param {Recorded} layer @param {Partial<PageData>} page */
  constructor(layer, { begins, warp, isPlaying }) {
    super(layer);
    this.layer = layer;
    this.t = begins ?? layer.start;
    this.isPlaying = Boolean(isPlaying) && this.t < layer.end;
    this.speed = warp === undefined ? 1 : warp ?? SPEEDS[SPEEDS.length - 1];
    if (layer.times.length > 1) this.decimals = decimalsOf((layer.end - layer.start) / (layer.times.length - 1));
  }

  /** Move on by seconds of the watcher's time. @param {number} seconds */
  advance(seconds) {
    const { layer } = this;
    if (!this.isPlaying) return;
    this.t += seconds * this.speed;
    if (this.t < layer.end) return;
    this.t = this.isLooping ? layer.start : layer.end;
    this.isPlaying = this.isLooping;
  }

  play() {
    if (this.t >= this.layer.end) this.t = this.layer.start;
    this.isPlaying = this.layer.end > this.layer.start;
  }

  pause() {
    this.isPlaying = false;
  }

  /** @param {number} t */
  seek(t) {
    this.t = between(t, this.layer.start, this.layer.end);
  }

  /** To the beginning of a frame some frames away; between two frames, one back is the beginning of the present one. @param {number} n */
  step(n) {
    const { times } = this.layer;
    const frame = this.layer.frameAt(this.t);
    const isBetween = n < 0 && this.t > times[frame] + this.layer.slack;
    this.isPlaying = false;
    this.t = times[between(frame + n + (isBetween ? 1 : 0), 0, times.length - 1)];
  }

  /** The next speed in the list, or the one before. @param {number} n */
  change(n) {
    const found = n > 0 ? SPEEDS.find((each) => each > this.speed) : SPEEDS.findLast((each) => each < this.speed);
    this.speed = found ?? this.speed;
  }

  /** As fast as can be seen, and back. */
  hurry() {
    const most = SPEEDS[SPEEDS.length - 1];
    this.speed = this.speed === most ? 1 : most;
  }
}

export class LiveClock extends Clock {
  /** @param {Live} layer @param {Source} source */
  constructor(layer, source) {
    super(layer);
    this.layer = layer;
    this.source = source;
    this.decimals = decimalsOf(layer.page.dt);
  }

  get t() {
    return this.layer.shown.t;
  }

  get isPlaying() {
    const { isPaused, isOver } = this.layer.status;
    return !isPaused && !isOver;
  }

  get speed() {
    return this.layer.status.warp ?? Infinity;
  }

  /** @param {number} seconds */
  advance(seconds) {
    this.layer.advance(seconds);
  }

  play() {
    this.source.send('resume');
  }

  pause() {
    this.source.send('pause');
  }

  /** @param {number} t */
  seek(t) {
    // To the end is to what has been played; a place of the slider may be played first.
    this.source.send('seek', { t: between(t, this.layer.start, t === Infinity ? this.layer.end : this.layer.horizon) });
  }

  /** @param {number} n */
  step(n) {
    this.source.send('step', { n });
  }

  /** @param {number} n */
  change(n) {
    this.source.send(n > 0 ? 'faster' : 'slower');
  }

  hurry() {
    this.source.send('warp', { value: this.speed === Infinity ? 1 : null });
  }
}
