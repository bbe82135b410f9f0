// The clock: what time it is, how fast it goes, and the slider that shows it. Of a recording it is this page's own, of a live game the
// game's, which all who watch share.

import { decimalsOf, say, times } from './formatting.js';
import { between } from './geometry.js';

const SPEEDS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 1000];
/** Decimals of a live game's times, whose step is not known. */
const LIVE_DECIMALS = 2;

class Clock {
  constructor(layer) {
    this.layer = layer;
    this.slider = document.getElementById('time');
    this.parts = document.querySelectorAll('#clock b, #clock span');
    this.span();
  }

  /** Let the slider reach as far as the game. */
  span() {
    this.slider.min = String(this.layer.start);
    this.slider.max = String(this.layer.end);
  }

  show() {
    const { layer, t } = this;
    const { start, end } = layer;
    this.span();
    say(this.parts[0], t.toFixed(this.decimals));
    say(this.parts[1], `/ ${end.toFixed(this.decimals)} s`);
    if (document.activeElement !== this.slider || this.isPlaying) this.slider.value = String(t);
    const share = end > start ? (t - start) / (end - start) : 0;
    this.slider.style.setProperty('--done', `${100 * share}%`);
    this.slider.setAttribute('aria-valuetext', `${t.toFixed(this.decimals)} seconds`);
    const play = document.getElementById('play');
    play.classList.toggle('is-playing', this.isPlaying);
    play.setAttribute('aria-label', this.isPlaying ? 'Pause' : 'Play');
    say(document.getElementById('speed'), times(this.speed));
  }
}

export class RecordedClock extends Clock {
  constructor(layer, { begins, warp, isPlaying }) {
    super(layer);
    this.t = begins ?? layer.start;
    this.isPlaying = Boolean(isPlaying) && this.t < layer.end;
    this.speed = warp === undefined ? 1 : warp ?? SPEEDS[SPEEDS.length - 1];
    this.isLooping = false;
    this.decimals = layer.times.length > 1 ? decimalsOf((layer.end - layer.start) / (layer.times.length - 1)) : 1;
  }

  get frame() {
    return this.layer.frameAt(this.t);
  }

  /** Move on by seconds of the watcher's time. */
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

  seek(t) {
    this.t = between(t, this.layer.start, this.layer.end);
  }

  /** To the beginning of a frame some frames away; between two frames, one back is the beginning of the present one. */
  step(n) {
    const { times } = this.layer;
    const { frame } = this;
    const isBetween = n < 0 && this.t > times[frame] + this.layer.slack;
    this.isPlaying = false;
    this.t = times[between(frame + n + (isBetween ? 1 : 0), 0, times.length - 1)];
  }

  /** The next speed in the list. */
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
  constructor(layer, source) {
    super(layer);
    this.source = source;
    this.decimals = LIVE_DECIMALS;
  }

  get t() {
    return this.layer.shown.t;
  }

  get frame() {
    return this.layer.shown.frame;
  }

  get isPlaying() {
    const { isPaused, isOver } = this.layer.status;
    return !isPaused && !isOver;
  }

  get speed() {
    return this.layer.status.warp ?? Infinity;
  }

  advance() {}

  play() {
    this.source.send('resume');
  }

  pause() {
    this.source.send('pause');
  }

  seek(t) {
    this.source.send('seek', { t: between(t, this.layer.start, this.layer.end) });
  }

  step(n) {
    this.source.send('step', { n });
  }

  change(n) {
    this.source.send(n > 0 ? 'faster' : 'slower');
  }

  hurry() {
    this.source.send('warp', { value: this.speed === Infinity ? 1 : null });
  }
}
